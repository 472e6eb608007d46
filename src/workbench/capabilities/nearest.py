"""Where the way to a pose that a closed form cannot reach ends."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from workbench.arrays import FloatArray
from workbench.errors import MotionError
from workbench.robots.closed_form import Reach

STEPS = 200
"""Poses on the straight way from home that are looked at first, so that no gap in it is stepped over ..."""
HALVINGS = 40
"""... before the last part is halved."""


def with_nearest(
    error: MotionError, x: FloatArray, home: FloatArray, reach: Callable[[FloatArray], Reach]
) -> MotionError:
    """Return *error* with the last pose that is in reach on the straight way from the home pose to the sample's.

    *x* is ``(n, m)``, *home* ``(m,)``, both in task coordinates. An error that names no sample, and one of
    a pose that can be reached (a singular one), stay as they are.
    """
    sample = error.facts.get("sample")
    if sample is None or not np.isfinite(x[sample]).all():
        return error

    def reached(shares: FloatArray) -> NDArray[np.bool_]:
        return reach(home + shares[:, None] * (x[sample] - home)).reachable

    shares = np.linspace(0.0, 1.0, STEPS + 1)
    seen = reached(shares)
    if seen.all() or not seen[0]:
        return error
    low, high = shares[seen.argmin() - 1], shares[seen.argmin()]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if reached(np.array([middle]))[0] else (low, middle)
    pose = home + low * (x[sample] - home)
    shown = ", ".join(f"{value:.6g}" for value in pose)
    told = f"{error}; the straight way from the home pose ends at x = ({shown})"
    return MotionError(told, **error.facts | {"nearest": pose.tolist()})
