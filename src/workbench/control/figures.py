"""What a run is worth: tracking errors of joints and platform, torques, and how well each figure is known."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from workbench.arrays import FloatArray

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


def is_decided(value: float, uncertainty: float) -> bool:
    """Whether a figure is known to a tenth of itself."""
    return bool(math.isfinite(value) and math.isfinite(uncertainty) and uncertainty <= DECIDED * abs(value))
