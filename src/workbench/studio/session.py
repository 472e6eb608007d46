"""A studio without its page: what is open, what is wanted, what was computed, and the way back."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.rerun import stamps
from workbench.capabilities.robot import Robot
from workbench.errors import MotionError, ParameterError, WorkbenchError, did_you_mean
from workbench.studio.knobs import Knob, knobs_of
from workbench.studio.outcome import Outcome, case_of, compute, overrides_of
from workbench.studio.reachable import reach_of
from workbench.studio.state import History, State
from workbench.studio.subject import Subject, open_subject

FILE, STEP, NOTHING = "the file's robot", "the step before", "nothing"
AGAINST = (FILE, STEP, NOTHING)
"""What the robot of the page is compared with."""


class Session:
    """One open studio. Not for two threads at once; the page has a thread that computes.

    Parameters
    ----------
    subject
        From `open_subject`.
    case
        The case to begin with; None is the campaign's first.

    Raises
    ------
    WorkbenchError
        No such case, or the case cannot be computed.
    """

    def __init__(self, subject: Subject, case: str | None = None) -> None:
        self.subject = subject
        self.against = FILE
        self.history = History(self._first(case))
        self.knobs = knobs_of(subject.base)
        self.good = compute(subject, self.wanted)
        """what was computed last without an error"""
        self.problem: str | None = None
        """why `wanted` cannot be computed, one line"""
        self._other: Outcome | None = None
        self._seen = stamps(subject.files)

    @property
    def wanted(self) -> State:
        """The state that is asked for."""
        return self.history.now

    @property
    def stale(self) -> bool:
        """Whether what is shown is not what is asked for."""
        return self.good.state != self.wanted

    def _first(self, case: str | None) -> State:
        campaign = self.subject.campaign
        names = [one.name for one in campaign.case]
        if case is not None and case not in names:
            raise ParameterError(
                f'{self.subject.shown_campaign}: no case "{case}"{did_you_mean(case, names)}', case=case
            )
        # what is wrong on purpose is offered, and not shown before it is asked for
        rows = tuple(i for i, candidate in enumerate(campaign.candidate) if not candidate.expect_fail)
        return State(case or names[0], rows=rows)

    # changes

    def set(self, name: str, value: float, gesture: Hashable = None) -> State:
        """Set a parameter, or a group of them, SI; setting what the case has takes the change back.

        Raises
        ------
        ParameterError
            Unknown name, or a value that is not a number or not allowed.
        """
        return self.set_many({name: value}, gesture)

    def set_many(self, values: Mapping[str, float], gesture: Hashable = None, **factors: float) -> State:
        """Set several parameters, and factors on the motion (`move`), as one step; errors as of `set`."""
        given = self.subject.base.description.table.expand(values)
        changes = {**self.wanted.changes, **given}
        self._values(changes)  # raises what is not allowed before it is asked for
        for member, number in given.items():
            # bars follow their mass and length: only another number than what follows is a change
            others = {name: value for name, value in changes.items() if name != member}
            if number == self._values(others)[member]:
                changes = others
        return self.history.change(gesture, changes=changes, **factors)

    def _values(self, changes: Mapping[str, float]) -> Mapping[str, float]:
        table = self.subject.base.description.table
        return table.changed(self.subject.base.values, table.layered(self.subject.start(self.wanted.case), changes))

    def reset(self, name: str) -> State:
        """Take back what was done to a parameter or to a group."""
        members = self.subject.base.description.table.members(name)
        kept = {other: value for other, value in self.wanted.changes.items() if other not in members}
        return self.history.change(changes=kept)

    def put_on(self, case: str) -> State:
        """Take another case of the campaign; what was changed by hand stays."""
        self._first(case)  # refuses a case that there is not
        return self.history.change(case=case)

    def move(self, gesture: Hashable = None, **factors: float) -> State:
        """Make the motion larger (``amplitude``) or faster (``speed``).

        Raises
        ------
        ParameterError
            A factor out of range.
        """
        return self.history.change(gesture, **factors)

    def hold(self, rows: tuple[int, ...]) -> State:
        """Choose the formulas that are held against MuJoCo."""
        return self.history.change(rows=rows)

    def back_to_file(self) -> State:
        """Go back to the robot and the motion of the files; a step of its own, which can be undone."""
        return self.history.change(changes={}, amplitude=1.0, speed=1.0)

    # results

    def compute(self, wanted: State | None = None) -> Outcome | None:
        """Compute what is wanted; None where it cannot be, with `problem` set and the last good state kept."""
        state = wanted or self.wanted
        try:
            self.good = compute(self.subject, state)
        except WorkbenchError as error:
            self.problem = str(error)
            return None
        self.problem = None
        return self.good

    def baseline(self) -> Outcome | None:
        """What the page compares with: the file's robot on the same motion, or the state one step back."""
        good = self.good.state
        other: State | None = None
        if self.against == FILE:
            other = replace(good, changes={})
        elif self.against == STEP:
            other = self.history.before
        if other is None or other == good:
            return None
        if self._other is None or self._other.state != other:
            try:
                self._other = compute(self.subject, other)
            except WorkbenchError:
                return None
        return self._other

    def values(self) -> Mapping[str, float]:
        """The parameters that are wanted, with what follows from them."""
        return self._values(self.wanted.changes)

    def knob(self, name: str) -> Knob:
        """The slider of a parameter or group."""
        return next(knob for knob in self.knobs if knob.name == name)

    def reach(self, name: str, stopped: Callable[[], bool] = lambda: False) -> tuple[float, float]:
        """The part of a slider, around where it stands, in which the case's motion is in reach at its samples."""
        knob, state = self.knob(name), self.good.state
        table = self.subject.base.description.table
        standing = knob.value(self.good.case.robot.values)
        low, high = min(knob.low, standing), max(knob.high, standing)
        if knob.unit not in ("m", "rad"):
            return low, high  # masses and their like move nothing

        def feasible(value: float) -> bool:
            changes = {**state.changes, **table.expand({name: value})}
            try:
                case_of(self.subject, replace(state, changes=changes))
            except WorkbenchError:
                return False
            return True

        least, most = reach_of(standing, low, high, feasible, stopped)
        # whole steps, inwards: ends that can be read, and that the slider can take
        return (
            low if least == low else min(math.ceil(least / knob.step) * knob.step, standing),
            high if most == high else max(math.floor(most / knob.step) * knob.step, standing),
        )

    def robot(self) -> Robot:
        """The robot that is shown."""
        return self.good.case.robot

    def target(self, x: FloatArray) -> FloatArray:
        """MuJoCo's coordinates ``(nq,)`` with the platform at task coordinates ``(m,)``, on the home branch.

        Raises
        ------
        MotionError
            Out of reach.
        """
        robot = self.robot()
        q = robot.inverse_kinematics(np.asarray(x, dtype=np.float64)[None, :])
        if not np.isfinite(q).all():
            raise MotionError("the target is out of reach")
        still = np.zeros_like(q)
        pose: FloatArray = robot.reference.inverse_dynamics(q, still, still).qpos[0]
        return pose

    # files

    def edited(self) -> bool:
        """Whether a file was saved since it was read."""
        return stamps(self.subject.files) != self._seen

    def read_again(self) -> str | None:
        """Read the files again; what was changed by hand stays. Gives the one line that is wrong with them, or None."""
        self._seen = stamps(self.subject.files)
        old = self.subject
        try:
            subject = open_subject(
                old.opened, model=old.other_model, settings=old.settings, candidates=old.candidates
            )  # fmt: skip
            known = subject.base.description.table.infos
            names = [case.name for case in subject.campaign.case]
            state = State(
                self.wanted.case if self.wanted.case in names else names[0],
                {name: value for name, value in self.wanted.changes.items() if name in known},
                self.wanted.amplitude,
                self.wanted.speed,
                self._same_rows(old, subject),
            )
            good = compute(subject, state)
        except WorkbenchError as error:
            self.problem = str(error)
            return self.problem
        self.subject, self.good, self.problem, self._other = subject, good, None, None
        self.knobs, self.history = knobs_of(subject.base), History(state)
        self._seen = stamps(subject.files)
        return None

    def _same_rows(self, old: Subject, new: Subject) -> tuple[int, ...]:
        """The formulas that were held before, and new ones, by their places in the new campaign."""
        before = [(c.name, c.reference) for c in old.campaign.candidate]
        held = {before[index] for index in self.wanted.rows}
        return tuple(
            index
            for index, c in enumerate(new.campaign.candidate)
            if (c.name, c.reference) in held or ((c.name, c.reference) not in before and not c.expect_fail)
        )

    def overrides(self) -> dict[str, float]:
        """All parameters of the shown state that differ from the model's file."""
        return overrides_of(self.subject, self.good.state)

    @property
    def folder(self) -> Path:
        """Where the session was started, and copies are written."""
        return Path.cwd()
