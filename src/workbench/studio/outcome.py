"""One state computed: the same numbers that a campaign gives, and what a page shows beside them."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.cases import Case, case_on, plan_motion
from workbench.campaign.compare import Row, compute_case
from workbench.campaign.evidence import Effort
from workbench.campaign.motion_spec import TableMotion
from workbench.reference import ReferenceResult
from workbench.rendering.solids import Movement, Solid, movement, solids
from workbench.studio.motions import own_samples, scaled, scaled_spec, thinned_spec
from workbench.studio.state import State
from workbench.studio.subject import Subject

ERRORS_ONLY = Effort.of_many()
"""What a sweep gathers: no power balance, no replay."""


@dataclass(frozen=True)
class Peak:
    """The largest magnitude of something over a motion."""

    value: float
    time: float
    """s"""


@dataclass(frozen=True)
class Outcome:
    """What a state gives; arrays over n samples, SI, in actuator order."""

    state: State
    case: Case = field(repr=False)
    rows: tuple[Row, ...] = field(repr=False)
    references: Mapping[str, FloatArray] = field(repr=False)
    """mass model -> the reference's torques ``(n, na)``"""
    formulas: Mapping[str, FloatArray] = field(repr=False)
    """formula -> torques ``(n, na)``; one that failed is not there"""
    result: ReferenceResult = field(repr=False)
    facts: Mapping[str, Any] = field(repr=False)
    solids: tuple[Solid, ...] = field(repr=False)
    movement: Movement = field(repr=False)
    whole: int | None
    """samples that the case itself has, where it is known"""
    seconds: float

    @property
    def t(self) -> FloatArray:
        """Times ``(n,)``, s."""
        return self.case.motion.t

    @property
    def tau(self) -> FloatArray:
        """The first reference's torques ``(n, na)``."""
        return next(iter(self.references.values()))

    @property
    def power(self) -> FloatArray:
        """Mechanical power of each actuator ``(n, na)``, W."""
        return self.tau * self.case.motion.qd

    def peak(self, values: FloatArray) -> Peak:
        """The largest magnitude of ``(n,)`` and when it is."""
        worst = int(np.abs(values).argmax())
        return Peak(float(np.abs(values[worst])), float(self.t[worst]))

    def peak_torques(self) -> tuple[Peak, ...]:
        """By joint, N or N m."""
        return tuple(self.peak(column) for column in self.tau.T)

    def peak_powers(self) -> tuple[Peak, ...]:
        """By joint, W."""
        return tuple(self.peak(column) for column in self.power.T)

    def peak_reactions(self) -> dict[str, Peak]:
        """By joint or loop closure, N."""
        return {name: self.peak(np.linalg.norm(force, axis=1)) for name, force in self.result.reactions.items()}

    def worst_moment(self) -> int:
        """The sample at which some torque is nearest to, or at, its own peak over the motion and the others largest.

        Torques and forces count in fractions of each joint's peak, so that newtons are not added to newton-metres.
        """
        peaks = np.abs(self.tau).max(axis=0)
        shares = np.abs(self.tau) / np.where(peaks > 0.0, peaks, 1.0)
        return int((shares.max(axis=1) + 1e-6 * shares.sum(axis=1)).argmax())

    def worst_row(self) -> Row | None:
        """The row with the largest error over its bound; without bounds the largest error."""
        judged = [row for row in self.rows if row.bound is not None]
        if judged:
            return max(judged, key=lambda row: row.peak_error / (row.bound or 1.0))
        return max(self.rows, key=lambda row: row.peak_error, default=None)


def case_of(subject: Subject, state: State) -> Case:
    """Put the robot of a state on its motion.

    Raises
    ------
    WorkbenchError
        A value that may not be, or a pose out of reach.
    """
    spec, overrides = subject.spec(state.case), overrides_of(subject, state)
    robot = subject.base.with_parameters(**overrides) if overrides else subject.base
    shown = thinned_spec(scaled_spec(spec, state.amplitude, state.speed))
    planned = plan_motion(shown, subject.file, robot)
    if isinstance(spec.motion, TableMotion):
        planned = scaled(planned, state.amplitude, state.speed)
    return case_on(shown, subject.model, overrides, robot, planned)


def overrides_of(subject: Subject, state: State) -> dict[str, float]:
    """All parameters of a state that differ from the file's, layer by layer."""
    return subject.base.description.table.layered(subject.start(state.case), state.changes)


def compute(subject: Subject, state: State) -> Outcome:
    """Compute a state.

    Raises
    ------
    WorkbenchError
        One line: what is out of reach, where, and what is allowed.
    """
    clock = time.perf_counter()
    case = case_of(subject, state)
    rows = [subject.campaign.candidate[index] for index in state.rows]
    campaign = subject.campaign.model_copy(update={"candidate": rows, "recorded": []})
    found = compute_case(campaign, case, ERRORS_ONLY)
    joints, motion, reference = case.robot.joints, case.motion, case.robot.reference
    names = tuple(dict.fromkeys(row.reference for row in rows)) or ("distributed",)
    # the poses are kept from the call before, so that this one costs little
    result = reference.inverse_dynamics(motion.q, motion.qd, motion.qdd, names[0], case.force, along=motion.t)
    model, spec = reference.compiled(), subject.spec(state.case)
    table = isinstance(spec.motion, TableMotion)
    return Outcome(
        state=state,
        case=case,
        rows=tuple(found.rows),
        references={name: _torques(found.series, f"ref_{name}", joints) for name in names},
        formulas={
            row.name: _torques(found.series, f"cand_{row.name}", joints)
            for row in rows
            if f"cand_{row.name}_{joints[0]}" in found.series
        },
        result=result,
        facts=found.facts,
        solids=solids(model),
        movement=movement(model, result.qpos, reference.structure.platform_site),
        whole=None if table else own_samples(spec),
        seconds=time.perf_counter() - clock,
    )


def _torques(series: Mapping[str, FloatArray], prefix: str, joints: tuple[str, ...]) -> FloatArray:
    return np.stack([series[f"{prefix}_{joint}"] for joint in joints], axis=1)
