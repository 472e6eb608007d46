"""How far a way leads before it is blocked, and that said of poses that cannot be reached."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import as_batch
from workbench.errors import ModelError, MotionError

if TYPE_CHECKING:
    from workbench.capabilities.robot import Robot

STEPS = 200
"""Poses on the straight way from home that are looked at first, so that no gap in it is stepped over ..."""
HALVINGS = 40
"""... before the last part is halved."""


def last_reached(
    reached: Callable[[float], bool], steps: int, halvings: int, stopped: Callable[[], bool] = lambda: False
) -> float:
    """Return the largest share of a way, 0 to 1, that is in reach before the first that is not.

    Parameters
    ----------
    reached
        Whether a share of the way is in reach; 0 is taken to be.
    steps
        Shares that are tried on the way outwards; a gap between two of them is not seen.
    halvings
        Of the step in which the way ends.
    stopped
        Asked before each try; true ends the search with what is known to be in reach.
    """
    inside, outside = 0.0, None
    for step in range(1, steps + 1):
        if stopped():
            return inside
        if not reached(step / steps):
            outside = step / steps
            break
        inside = step / steps
    if outside is None:
        return inside
    for _ in range(halvings):
        if stopped():
            return inside
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if reached(middle) else (inside, middle)
    return inside


def with_nearest(error: MotionError, robot: Robot, at: ArrayLike) -> MotionError:
    """Return *error* with the last pose in reach on the straight way from the home pose to the one that it refuses.

    *at* are the poses ``(n, m)`` in task coordinates. An error that names no sample, one that says so already, and one
    of a pose that can be reached (a singular one), stay as they are.
    """
    sample, x = error.facts.get("sample"), as_batch("x", at)
    if sample is None or "nearest" in error.facts or not np.isfinite(x[sample]).all():
        return error
    try:
        home = robot.forward_kinematics(robot.home[None, :])[0]
    except (ModelError, MotionError):  # a robot that cannot be assembled at home
        return error

    def reached(share: float) -> bool:
        return bool(robot.reach((home + share * (x[sample] - home))[None, :]).reachable[0])

    share = last_reached(reached, STEPS, HALVINGS) if reached(0.0) else 1.0
    if share == 1.0:
        return error
    pose = home + share * (x[sample] - home)
    shown = ", ".join(f"{value:.6g}" for value in pose)
    told = f"{error}; the straight way from the home pose ends at x = ({shown})"
    return MotionError(told, **error.facts | {"nearest": pose.tolist()})
