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

KINDS = ("damping", "coulomb", "armature")
"""First part of the parameters' names."""


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
        values = [np.array([getattr(parameters, f"{kind}_{joint}") for joint in joints]) for kind in KINDS]
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
