"""Cases that cannot be driven, out of reach or singular: what is kept of them where the others go on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.spec import CaseSpec
from workbench.capabilities.nearest import last_reached
from workbench.capabilities.robot import Robot
from workbench.errors import ModelError, MotionError

NOT_DRIVEN = "not-driven"
"""Status of such a case."""

STEPS = 20
"""Poses on the straight way from home that are looked at first ..."""
HALVINGS = 25
"""... before the last part is halved: 1e-9 of the way is left."""


@dataclass(frozen=True)
class NotDriven:
    """A case that was left out, with the line that a run without ``--keep-going`` ends with."""

    spec: CaseSpec
    error: MotionError
    parameters: Mapping[str, float]
    robot: Robot | None = None
    """None where it could not be made"""

    def facts(self) -> dict[str, Any]:
        """What the manifest says of it."""
        found = self.error.facts
        return {
            "status": NOT_DRIVEN,
            "title": self.spec.title,
            "description": self.spec.description,
            "message": str(self.error),
            "time_s": found.get("time"),
            "nearest": found.get("nearest"),
            "nearest_q": found.get("nearest_q"),
            "parameters": dict(self.parameters),
            "external_force": list(self.spec.external_force),
            "warnings": [],
        }


def refuse_none(cases: Sequence[object], missing: Sequence[NotDriven]) -> None:
    """Refuse a run of which not one case can be driven: it would hold nothing."""
    if not cases and missing:
        count = f"none of {len(missing)} cases can be driven; the first: " if len(missing) > 1 else ""
        raise MotionError(f"{count}{missing[0].error}", **missing[0].error.facts)


def with_nearest_joints(error: MotionError, robot: Robot, q: FloatArray) -> MotionError:
    """Return *error* with the last actuated coordinates, on the straight way from home to its sample, that can be.

    Parameters
    ----------
    error
        Of a motion in joint space; one that names no sample, or a pose of the platform already, stays as it is.
    robot
        Its robot.
    q
        The motion ``(n, na)``.
    """
    sample = error.facts.get("sample")
    if sample is None or "nearest" in error.facts or not np.isfinite(q[sample]).all():
        return error
    try:
        home = robot.home
    except ModelError:  # a robot that cannot be assembled at all has none
        return error

    def driven(share: float) -> bool:
        pose = (home + share * (q[sample] - home))[None, :]
        still = np.zeros_like(pose)
        try:
            robot.platform_motion(pose, still, still)
            robot.inverse_dynamics(pose, still, still)
            robot.reference.inverse_dynamics(pose, still, still)
        except MotionError:
            return False
        return True

    share = last_reached(driven, STEPS, HALVINGS) if driven(0.0) else 1.0
    if share == 1.0:  # home itself cannot be driven, or the pose can: it is the rates that are wrong
        return error
    pose = home + share * (q[sample] - home)
    shown = ", ".join(f"{name} = {value:.6g}" for name, value in zip(robot.joints, pose, strict=True))
    told = f"{error}; the straight way from the home pose ends at {shown}"
    return MotionError(told, **error.facts | {"nearest_q": pose.tolist()})
