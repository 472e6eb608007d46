"""Piecewise polynomials through samples: an interpolating spline, and the quintic that also takes given derivatives.

SciPy is imported where it is used: it takes longer to load than most commands take to run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import MotionError

if TYPE_CHECKING:
    from scipy.interpolate import BPoly, BSpline

SPLINE_TOLERANCE = 1e-9
"""Largest miss at a sample, over the largest value: steps that differ a hundredfold leave 1e-13, a millionfold 1e-5."""


def interpolating_spline(t: FloatArray, values: FloatArray, degree: int) -> BSpline:
    """Return the spline of *degree* with not-a-knot ends through *values* ``(n, m)`` at times *t* ``(n,)``, n > degree.

    Raises
    ------
    MotionError
        The times lie so unevenly that the spline is not determined in floating point.
    """
    from scipy.interpolate import make_interp_spline

    try:
        spline: BSpline = make_interp_spline(t, values, k=degree)
        missed = np.abs(spline(t) - values).max(axis=0) > SPLINE_TOLERANCE * np.abs(values).max(axis=0)
    except (np.linalg.LinAlgError, ValueError):  # the equations are singular to working precision
        missed = np.array([True])
    if missed.any():
        shortest, longest = np.diff(t).min(), np.diff(t).max()
        raise MotionError(
            f"spline: time steps from {shortest:g} s to {longest:g} s are too uneven; allowed: steps of similar size"
        )
    return spline


def hermite_quintic(t: FloatArray, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> BPoly:
    """Return the piecewise quintic that takes position, velocity and acceleration ``(n, m)`` at times *t* ``(n,)``.

    It is twice continuously differentiable, and local: a sample acts on its two neighbouring intervals only.
    """
    from scipy.interpolate import BPoly

    # Bernstein coefficients of one interval of length h: the first three fix the derivatives at its start, the last
    # three those at its end.
    h = np.diff(t)[:, None]
    start = [q[:-1], q[:-1] + h / 5.0 * qd[:-1], q[:-1] + 2.0 * h / 5.0 * qd[:-1] + h**2 / 20.0 * qdd[:-1]]
    end = [q[1:] - 2.0 * h / 5.0 * qd[1:] + h**2 / 20.0 * qdd[1:], q[1:] - h / 5.0 * qd[1:], q[1:]]
    return BPoly(np.stack(start + end), t)
