"""What a diagnosis needs of a robot and a formula: torques of both sides, also where parameters are changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from workbench.arrays import FloatArray
from workbench.reference import MujocoReference

MASS, INERTIA, GRAVITY, FRICTION, LENGTH, NUMBER = "mass", "inertia", "gravity", "friction", "length", "number"
AFFINE = (MASS, INERTIA, GRAVITY, FRICTION)
"""Kinds of parameters in which torques are affine: what each is worth can be told from one change of it."""

Changes = Mapping[str, float]


@dataclass(frozen=True)
class Parameter:
    """A parameter that both sides know."""

    name: str
    unit: str
    kind: str
    """one of mass, inertia, gravity, friction, length, number"""
    value: float
    read: bool
    """whether the formula reads it; one that it never reads may be what is missing"""

    @property
    def varied(self) -> float:
        """Another value that it may have, far enough to see its share and near enough to close the loops."""
        if self.kind in AFFINE:
            return 2.0 * self.value if self.value else {MASS: 0.5, INERTIA: 1e-3, GRAVITY: 9.81}.get(self.kind, 0.3)
        return self.value * (1.03 if self.kind == LENGTH else 0.9)


@dataclass(frozen=True)
class Source:
    """Where a formula's own text stands."""

    file: Path
    candidate: str
    """the name that it is registered by in the file"""


class Subject(Protocol):
    """A robot, a formula for it, and the motions that it is meant for. Arrays batch first, SI, actuator order."""

    @property
    def title(self) -> str:
        """Robot, case and candidate, for the reader."""

    @property
    def candidate(self) -> str:
        """The formula's name."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints."""

    @property
    def force_units(self) -> tuple[str, ...]:
        """Unit of each torque, N or N m."""

    @property
    def mass_model(self) -> str:
        """The reference's mass model that the formula is held against."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """What may be changed on both sides alike; empty where nothing can be."""

    @property
    def no_parameters(self) -> str:
        """Why `parameters` is empty; else empty."""

    @property
    def motion(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The motions' samples q, qd, qdd, ``(n, na)``: the range that is looked at."""

    @property
    def takes_force(self) -> bool:
        """Whether the formula is told the external force."""

    @property
    def source(self) -> Source | None:
        """The formula's text, where it is at hand."""

    def formula(
        self, q: FloatArray, qd: FloatArray, qdd: FloatArray, force: FloatArray, changes: Changes
    ) -> FloatArray:
        """Torques ``(n, na)`` by the formula.

        Raises
        ------
        WorkbenchError
            It failed, on any of the samples.
        """

    def reference(self, changes: Changes) -> MujocoReference:
        """The reference with parameters changed."""

    def torques_of_reference(
        self, q: FloatArray, qd: FloatArray, qdd: FloatArray, force: FloatArray, changes: Changes
    ) -> FloatArray:
        """Torques ``(n, na)`` by the reference, under the formula's mass model."""

    def values(self, changes: Changes) -> Any:
        """The parameters' values as the formula is handed them, to be pickled."""
