"""The platform of a case: where it is and how it moves, by closed form and by the reference, and as it is stored."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.cases import Case
from workbench.reference import ReferenceResult
from workbench.reference.task import POSITIONS, rotation_vector, task_motion, task_of

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Platform:
    """One case's platform motion."""

    case: Case
    result: ReferenceResult
    task: tuple[FloatArray, FloatArray, FloatArray]
    """task coordinates, rates and accelerations by the reference, each ``(n, m)``"""

    def columns(self) -> dict[str, FloatArray]:
        """Columns of the time series: position, rotation and their rates, base frame; task coordinates by name.

        The position is the closed form's where there is one, as the robot's own formulas see it.
        """
        case, result = self.case, self.result
        own = case.robot.closed_kinematics and case.robot.coordinates == POSITIONS
        places = (case.x, case.xd, case.xdd) if own else (result.x, result.xd, result.xdd)
        columns = {
            f"{prefix}{i + 1}": values[:, i] for prefix, values in zip(("x", "xd", "xdd"), places, strict=True)
            for i in range(3)
        }  # fmt: skip
        turns = (rotation_vector(result.rotation), result.omega, result.alpha)
        for prefix, values in zip(("turn", "omega", "alpha"), turns, strict=True):
            columns |= {f"{prefix}_{axis}": values[:, i] for i, axis in enumerate(AXES)}
        if case.robot.coordinates != POSITIONS:
            for prefix, values in zip(("task", "taskd", "taskdd"), self.task, strict=True):
                columns |= {f"{prefix}_{name}": values[:, i] for i, name in enumerate(case.robot.coordinates)}
        return columns

    def apart(self, derivative: int) -> float:
        """Largest distance of closed form and reference, over the largest magnitude; metres and radians apart."""
        own = (self.case.x, self.case.xd, self.case.xdd)[derivative]
        turning = np.array([unit == "rad" for unit in self.case.robot.task_units])
        parts = [(own[:, kind], self.task[derivative][:, kind]) for kind in (~turning, turning) if kind.any()]
        return max(_apart(*part) for part in parts)


def platform_of(case: Case, result: ReferenceResult) -> Platform:
    """Put a case's platform motion into its robot's task coordinates, each angle near the one that the case has."""
    position = result.x, result.xd, result.xdd
    task = task_of(case.robot.coordinates)
    return Platform(case, result, task_motion(task, position, result.rotation, result.omega, result.alpha, case.x))


def _apart(candidate: FloatArray, reference: FloatArray) -> float:
    """Largest distance over the largest magnitude; 0 where both vanish."""
    distance = float(np.linalg.norm(candidate - reference, axis=1).max())
    magnitude = float(np.linalg.norm(reference, axis=1).max())
    if magnitude == 0.0:
        return 0.0 if distance == 0.0 else float("inf")
    return distance / magnitude
