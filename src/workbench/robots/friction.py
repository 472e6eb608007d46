"""Friction and rotor inertia of actuated joints: the same for every mechanism, since they act on q itself.

Each actuated joint has three coefficients: ``damping_NAME`` (viscous), ``coulomb_NAME`` (dry) and ``armature_NAME``
(the motor's rotor, reflected through its gear). What passive joints add is the mechanism's own affair.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from workbench.arrays import FloatArray
from workbench.dry_friction import REST_SPEED, at_rest, direction
from workbench.robots.parameters import ParameterInfo, Target

SLIDE_DAMPING, HINGE_DAMPING = "N s/m", "N m s/rad"
NO_FRICTION = "none in the paper"

KINDS = (("damping", "damping"), ("coulomb", "frictionloss"), ("armature", "armature"))
"""First part of the parameter's name, and the attribute of the MJCF's joint."""


def damping_parameter(name: str, unit: str, meaning: str, sided: bool = False) -> ParameterInfo:
    """One coefficient of viscous friction, zero unless it is set."""
    return ParameterInfo(name, unit, f"viscous friction {meaning}", NO_FRICTION, sided, minimum=0.0)


def drive_parameters(joints: Sequence[str], units: Sequence[str]) -> tuple[ParameterInfo, ...]:
    """Describe the three coefficients of each actuated joint; *units* are those of q, ``m`` or ``rad``."""
    rows = []
    for kind, meaning, (slide, hinge) in (
        ("damping", "viscous friction at", (SLIDE_DAMPING, HINGE_DAMPING)),
        ("coulomb", "Coulomb friction at", ("N", "N m")),
        ("armature", "rotor inertia reflected to", ("kg", "kg m^2")),
    ):
        for joint, unit in zip(joints, units, strict=True):
            name, of = f"{kind}_{joint}", slide if unit == "m" else hinge
            rows.append(ParameterInfo(name, of, f"{meaning} the actuated joint {joint}", NO_FRICTION, minimum=0.0))
    return tuple(rows)


def drive_targets(joints: Sequence[str]) -> tuple[Target, ...]:
    """Where the MJCF keeps them: attributes of the actuated joints."""
    return tuple(
        Target("joint", joint, attribute, 0, 1.0, (f"{kind}_{joint}",), reads=f"{kind}_{joint}")
        for kind, attribute in KINDS
        for joint in joints
    )


@dataclass(frozen=True)
class DriveFriction:
    """Coefficients of the actuated joints, each ``(na,)``, SI."""

    joints: tuple[str, ...]
    damping: FloatArray
    coulomb: FloatArray
    armature: FloatArray

    @classmethod
    def of(cls, parameters: Any, joints: Sequence[str]) -> Self:
        """Collect the coefficients from a mechanism's parameters."""
        values = [np.array([getattr(parameters, f"{kind}_{joint}") for joint in joints]) for kind, _ in KINDS]
        return cls(tuple(joints), *values)

    def __bool__(self) -> bool:
        """Tell whether any coefficient is not zero."""
        return bool(self.damping.any() or self.coulomb.any() or self.armature.any())

    def torques(self, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        """What the actuators must supply for these effects, ``(n, na)``, SI."""
        result: FloatArray = self.damping * qd + self.coulomb * direction(qd) + self.armature * qdd
        return result

    def warnings(self, qd: FloatArray) -> list[str]:
        """Say of each joint with Coulomb friction how many samples find it at rest, where its sign is a convention."""
        found = []
        for joint, force, resting in zip(self.joints, self.coulomb, at_rest(qd).sum(axis=0), strict=True):
            if force > 0 and resting:
                found.append(
                    f"{joint} rests (slower than {REST_SPEED:g} per second) in {resting} of {len(qd)} samples, where"
                    f" its Coulomb friction may be anything from {-force:g} to {force:g}: taken as 0 on both sides"
                )
        return found
