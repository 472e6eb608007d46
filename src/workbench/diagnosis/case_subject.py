"""A campaign's case and candidate as a subject of diagnosis."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.cases import Case
from workbench.campaign.user_candidates import UserCandidate
from workbench.diagnosis.subject import (
    FRICTION,
    GRAVITY,
    INERTIA,
    LENGTH,
    MASS,
    NUMBER,
    Changes,
    Parameter,
    Source,
)
from workbench.errors import CandidateError, WorkbenchError
from workbench.reference import MujocoReference
from workbench.reference.varied_model import Targets, places_of, settable, varied_reference

KIND_OF_UNIT = {"kg": MASS, "kg m^2": INERTIA, "m/s^2": GRAVITY, "m": LENGTH, "1": NUMBER, "kg or kg m^2": INERTIA}


class Recorded:
    """Parameters that remember which of them were read."""

    def __init__(self, parameters: Any, reads: set[str]) -> None:
        object.__setattr__(self, "_parameters", parameters)
        object.__setattr__(self, "_reads", reads)

    def __getattr__(self, name: str) -> Any:
        value = getattr(object.__getattribute__(self, "_parameters"), name)
        if not name.startswith("__"):
            object.__getattribute__(self, "_reads").add(name)
        return value


@dataclasses.dataclass(frozen=True)
class _Handed:
    """What a user's candidate sees of a mechanism."""

    parameters: Any
    joints: tuple[str, ...]
    values: Mapping[str, float]
    """the same by name, for formulas in other languages"""


class CaseSubject:
    """A formula on the robot of a case; *others* are the campaign's other cases on it, whose motions count too."""

    def __init__(self, case: Case, candidate: str, mass_model: str, others: Sequence[Case] = ()) -> None:
        self.case, self.candidate, self.mass_model = case, candidate, mass_model
        self._others = tuple(others)
        self._robot = case.robot
        self._function = case.robot.candidates[candidate].function
        self._references: dict[tuple[tuple[str, float], ...], MujocoReference] = {}
        self._mechanisms: dict[tuple[tuple[str, float], ...], Any] = {}

    @property
    def title(self) -> str:
        """Candidate, robot and case."""
        return f'"{self.candidate}" on {self._robot.title or self._robot.name}, case {self.case.name}'

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints."""
        return tuple(self._robot.joints)

    @property
    def force_units(self) -> tuple[str, ...]:
        """Unit of each torque."""
        return tuple(self._robot.force_units)

    @cached_property
    def takes_force(self) -> bool:
        """Whether the formula looks at the external force; closed forms of the package's own always do.

        A formula in another language is handed it in any case; it is asked at some samples whether it matters.
        """
        if not isinstance(self._function, UserCandidate):
            return True
        if self._function.function is not None:
            return self._function.takes_force
        q, qd, qdd = (array[: min(len(array), 3)] for array in self.motion)
        try:
            without, loaded = (self._function(self._robot, q, qd, qdd, np.full((len(q), 3), f)) for f in (0.0, 1.0))
        except CandidateError:
            return True
        return not np.array_equal(without, loaded)

    @property
    def source(self) -> Source | None:
        """The user's file; those of the package and in other languages are not edited."""
        if isinstance(self._function, UserCandidate) and self._function.file.suffix == ".py":
            return Source(self._function.file.resolve(), self.candidate)
        return None

    @cached_property
    def motion(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Samples of all cases, alike in number."""
        motions = [case.motion for case in (self.case, *self._others)]
        picked = [np.linspace(0, len(m.t) - 1, min(len(m.t), 200)).astype(int) for m in motions]
        return tuple(  # type: ignore[return-value]
            np.concatenate([getattr(m, name)[rows] for m, rows in zip(motions, picked, strict=True)])
            for name in ("q", "qd", "qdd")
        )

    @cached_property
    def reads(self) -> frozenset[str] | None:
        """Parameters that a user's formula reads; None where that cannot be seen."""
        if not isinstance(self._function, UserCandidate) or self._function.function is None:
            return None  # in another language all are handed over
        reads: set[str] = set()
        q, qd, qdd = (array[: min(len(array), 3)] for array in self.motion)
        force = np.ones((len(q), 3))
        handed: Any = _Handed(Recorded(self._robot.parameters, reads), self.joints, self._robot.values)
        try:
            self._function(handed, q, qd, qdd, force)
        except CandidateError:
            return frozenset(reads) or None
        return frozenset(reads)

    @cached_property
    def no_parameters(self) -> str:
        """Why nothing can be varied."""
        if self.parameters:
            return ""
        if self.reads is not None and not self.reads:
            return "the formula reads no parameters (p.NAME): its numbers are its own, and cannot be varied"
        return "no parameter of this model can be set"

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those that the formula reads, and those that it might have to."""
        if self.reads is not None and not self.reads:
            return ()
        found = []
        table = self._robot.description.table
        read = [name for name in (*table.infos, *table.groups) if self.reads is None or name in self.reads]
        if self.reads is None:
            read = list(table.infos)
        for name in read:
            unit = table.infos[table.members(name)[0]].unit
            kind = KIND_OF_UNIT.get(unit, FRICTION)
            found.append(Parameter(name, unit, kind, float(getattr(self._robot.parameters, name)), True))
        covered = {member for name in read for member in table.members(name)}
        for name, info in table.infos.items():
            kind = KIND_OF_UNIT.get(info.unit, FRICTION)
            if name not in covered and kind in (MASS, GRAVITY, INERTIA, FRICTION):
                value = float(getattr(self._robot.parameters, name))
                if value != 0.0:
                    found.append(Parameter(name, info.unit, kind, value, False))
        if self._generic:
            able = settable(self._targets)
            found = [parameter for parameter in found if parameter.name in able]
        return tuple(found)

    @property
    def _generic(self) -> bool:
        """Whether the robot's numbers are varied in the compiled model, since nothing else keeps both sides alike."""
        return self._robot.closed_form is None

    @cached_property
    def _targets(self) -> Targets:
        """Where the robot file says that each parameter stands."""
        return places_of(self._robot.description.targets)

    def _pinned(self, changes: Changes) -> dict[str, float]:
        """Changes together with all that the formula reads, so that no rule moves another parameter along."""
        if self._generic or not changes:
            return dict(changes)
        read = [parameter for parameter in self.parameters if parameter.read]
        pins = {p.name: p.value for p in read if p.kind in (INERTIA, NUMBER, MASS, LENGTH)}
        return pins | dict(changes)

    def values(self, changes: Changes) -> Any:
        """The parameters with changes, as the formula is handed them."""
        return self._changed(changes).parameters

    def _changed(self, changes: Changes) -> Any:
        key = tuple(sorted(changes.items()))
        if key not in self._mechanisms:
            if not changes:
                found: Any = self._robot
            elif self._generic:
                expanded = self._robot.description.table.expand(changes)
                parameters = dataclasses.replace(self._robot.parameters, **expanded)
                found = _Handed(parameters, self.joints, dict(self._robot.values) | dict(expanded))
            else:
                found = self._robot.with_parameters(**self._pinned(changes))
            self._mechanisms[key] = found
        return self._mechanisms[key]

    def formula(
        self, q: FloatArray, qd: FloatArray, qdd: FloatArray, force: FloatArray, changes: Changes
    ) -> FloatArray:
        """Torques by the formula.

        Raises
        ------
        WorkbenchError
            It failed.
        """
        with np.errstate(all="ignore"):
            tau = self._function(self._changed(changes), q, qd, qdd, force)
        if not np.isfinite(tau).all():
            raise CandidateError(f'candidate "{self.candidate}" returns values that are not finite')
        return tau

    def reference(self, changes: Changes) -> MujocoReference:
        """The reference with parameters changed."""
        key = tuple(sorted(changes.items()))
        if key not in self._references:
            self._references[key] = self._make_reference(changes)
        return self._references[key]

    def _make_reference(self, changes: Changes) -> MujocoReference:
        if not changes:
            return self._robot.reference
        if not self._generic:
            return self._robot.with_parameters(**self._pinned(changes)).reference
        expanded = self._robot.description.table.expand(changes)
        return varied_reference(
            self._robot.reference, self._targets, self._robot.values, expanded, self.mass_model, True
        )

    def torques_of_reference(
        self, q: FloatArray, qd: FloatArray, qdd: FloatArray, force: FloatArray, changes: Changes
    ) -> FloatArray:
        """Torques by the reference, under the formula's mass model."""
        lumped_already = self._generic and bool(changes)
        model = "distributed" if lumped_already else self.mass_model
        return self.reference(changes).inverse_dynamics(q, qd, qdd, model, force).tau


def subjects_of(
    cases: Iterable[Case], candidates: Sequence[tuple[str, str]], only: str | None = None
) -> list[CaseSubject]:
    """Make a subject of each candidate ``(name, mass model)``, on the first case and with all motions of that robot.

    Raises
    ------
    WorkbenchError
        There is no such candidate.
    """
    every = list(cases)
    first = every[0]
    alike = [case for case in every[1:] if case.overrides == first.overrides]
    if only is not None and only not in {name for name, _ in candidates}:
        from workbench.errors import SpecError, did_you_mean

        raise SpecError(f'no candidate "{only}"{did_you_mean(only, {name for name, _ in candidates})}')
    return [CaseSubject(first, name, model, alike) for name, model in candidates if only in (None, name)]


__all__ = ["CaseSubject", "WorkbenchError", "subjects_of"]
