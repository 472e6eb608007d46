"""A smooth curve near the samples of a coordinate, which the smoother works relative to.

Over a step of a slow motion the smoother's model moves the state by less than the state's last digit: at 1 ms and order
6 by some 1e-16 of it. Relative to a curve near the samples the state is of the size of the noise, and all its digits
count. Any curve will do, provided that what it adds over a step is known without taking differences.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from workbench.arrays import FloatArray

DEGREE = 11

CLOSEST = 12
"""Samples from knot to knot, at the least."""


@dataclass(frozen=True)
class Trend:
    """A curve at the samples."""

    derivatives: FloatArray = field(repr=False)
    """``(degree + 1, n)``: value and derivatives, by time in units of the step; from the right at knots"""
    dt: FloatArray = field(repr=False)
    """``(n - 1,)``"""

    def drive(self, m: int) -> FloatArray:
        """What a state of order *m*, relative to the curve, is driven by over each step, ``(n - 1, m)``.

        Less the curve's Taylor remainder from its m-th derivative on: exact, since between samples it is a polynomial.
        """
        out = np.zeros((len(self.dt), m))
        for j in range(m, len(self.derivatives)):
            for i in range(m):
                out[:, i] -= self.derivatives[j, :-1] * self.dt ** (j - i) / math.factorial(j - i)
        return out


def trend_of(u: FloatArray, y: FloatArray) -> Trend:
    """Fit samples *y* ``(n,)`` at times *u* by a least-squares spline.

    Its knots are as far apart as generalised cross-validation finds best: one that follows the noise has derivatives
    larger than the motion's.
    """
    from scipy.interpolate import make_lsq_spline

    n = len(u)
    degree = min(DEGREE, n // 4)
    ends = np.ones(degree + 1)
    curves, costs = [], []
    spacing = n
    while spacing >= min(CLOSEST, n):
        inner = u[spacing : n - spacing // 2 : spacing]
        curve = make_lsq_spline(u, y, np.r_[u[0] * ends, inner, u[-1] * ends], degree)
        free = n - len(inner) - degree - 1
        curves.append(curve)
        costs.append(float(np.sum((y - curve(u)) ** 2)) / free**2)
        spacing //= 2
    best = curves[int(np.argmin(costs))]
    return Trend(np.array([best.derivative(j)(u) for j in range(degree + 1)]), np.diff(u))
