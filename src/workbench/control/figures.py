"""What a run is worth: tracking errors of joints and platform, torques, and how well each figure is known."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.control.names import ROUTES

DECIDED = 0.1
"""A figure is undecided where it is not known to a tenth of itself."""


@dataclass(frozen=True)
class Error:
    """Root mean square and largest error; joints in m and rad, the platform in m."""

    rms: FloatArray
    """``(na,)``"""
    peak: FloatArray
    platform_rms: float
    platform_peak: float


def error_of(q: FloatArray, desired: FloatArray, x: FloatArray, x_desired: FloatArray) -> Error:
    """Errors over the ticks of a run: coordinates ``(n, na)``, platform sites ``(n, 3)``."""
    off, away = q - desired, np.linalg.norm(x - x_desired, axis=1)
    return Error(
        rms=np.sqrt(np.mean(off**2, axis=0)),
        peak=np.abs(off).max(axis=0),
        platform_rms=float(np.sqrt(np.mean(away**2))),
        platform_peak=float(away.max()),
    )


def extrapolated(coarse: FloatArray, fine: FloatArray) -> FloatArray:
    """Coordinates at a step of zero, from those of a method of first order at a step and at its half."""
    found: FloatArray = 2.0 * fine - coarse
    return found


def platform_row(rows: Sequence[Mapping[str, Any]]) -> Mapping[str, Any] | None:
    """Of a run's rows that of the platform; None where the run does not track."""
    return next((row for row in rows if row["joint"] == "platform"), None)


def errors_in(row: Mapping[str, Any]) -> dict[str, float]:
    """The platform's rms error by each route that was taken, m."""
    return {route: row[route] for route in ROUTES if row.get(route) is not None}


def uncertainty_of(errors: Mapping[str, float]) -> float:
    """How well an error is known, m: the largest difference between routes and steps; NaN where there is one alone."""
    first, *others = ROUTES
    return max((abs(errors[name] - errors[first]) for name in others if name in errors), default=math.nan)


def is_decided(value: float, uncertainty: float) -> bool:
    """Whether a figure is known to a tenth of itself."""
    return bool(math.isfinite(value) and math.isfinite(uncertainty) and uncertainty <= DECIDED * abs(value))
