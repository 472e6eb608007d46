"""Position, velocity and acceleration of sampled coordinates, and how uncertain rounding and noise leave them.

A smoothing spline whose order and bandwidth are those under which the samples are most likely (restricted maximum
likelihood); its posterior covariance is the uncertainty [Wahba1983]. Samples that carry no noise leave nothing to
smooth: the spline then runs through them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import MotionError
from workbench.recorded.kernels import backward, covariances, forward

ORDERS = (4, 5, 6)
"""Orders m that are tried: the spline has degree 2 m - 1."""

FEWEST = 2 * max(ORDERS)
"""Samples; fewer say nothing of their own noise."""

LONGEST = 4_000
"""Samples of which order and bandwidth are found; of a longer record the middle is looked at."""

EXPONENTS = np.arange(-44.0, 30.0, 4.0)
"""Powers of ten of the bandwidth parameter that are looked at first."""

EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class Smoothed:
    """One coordinate with its derivatives, in its own units."""

    q: FloatArray
    qd: FloatArray
    qdd: FloatArray
    covariance: FloatArray = field(repr=False)
    """``(n, 3, 3)`` of (q, qd, qdd) at each sample"""
    sigma: float
    """standard deviation of a sample's noise, rounding included"""
    bandwidth: float
    """Hz: slower parts of the motion are kept, faster ones are smoothed away; infinite where nothing is smoothed"""
    order: int
    _factors: FloatArray = field(repr=False)
    _step: float = field(repr=False)
    _rho: float = 0.0
    _dt: FloatArray | None = field(default=None, repr=False)

    def quieter(self, times: float) -> float:
        """Uncertainty of the acceleration with noise so many times smaller, over what it is now (median)."""
        if self._dt is None:
            return 1.0
        n, m, _ = self._factors.shape
        factors, found = np.empty_like(self._factors), np.empty((n, 3, 3))
        forward(np.zeros(n), self._dt, *_unit_step(m), self._rho * times**2, factors, True)
        covariances(factors, found)
        now = np.median(self.covariance[:, 2, 2]) * self._step**4 / self.sigma**2
        return float(np.sqrt(np.median(found[:, 2, 2]) / now) / times)

    def draws(self, count: int, seed: int) -> FloatArray:
        """Errors of (q, qd, qdd) as they may be, ``(count, n, 3)``: draws from the posterior, less its mean."""
        n, m, _ = self._factors.shape
        generator = np.random.default_rng(seed)
        silent = self._factors.copy()
        silent[:, :, 2 * m] = 0.0
        found, states = np.empty((count, n, 3)), np.empty((n, m))
        scale = self.sigma * self._step ** -np.arange(3.0)
        for one in found:
            backward(silent, generator.standard_normal((n, m)), states)
            one[:] = states[:, :3] * scale
        return found


def smooth(t: FloatArray, y: FloatArray, floor: float = 0.0) -> Smoothed:
    """Differentiate samples twice.

    Parameters
    ----------
    t
        Times ``(n,)``, s, strictly increasing.
    y
        Samples ``(n,)``.
    floor
        Standard deviation that each sample's rounding leaves at the least; the noise that the samples show counts where
        it is larger.

    Raises
    ------
    MotionError
        Fewer than `FEWEST` samples.
    """
    n = len(y)
    if n < FEWEST:
        raise MotionError(f"{n} samples; allowed: at least {FEWEST} to tell a motion from its noise", value=n)
    step = float(t[-1] - t[0]) / (n - 1)
    dt = np.diff(t) / step
    shift = float(np.mean(y))
    scale = float(np.abs(y - shift).max())
    if scale == 0.0:  # at rest
        zero = np.zeros(n)
        rest = np.zeros((n, 3, 3))
        rest[:, 0, 0] = floor**2
        return Smoothed(y.copy(), zero, zero.copy(), rest, floor, 0.0, ORDERS[0], _at_rest(n), step)
    least = max(floor, EPS * float(np.abs(y).max())) / scale
    value = (y - shift) / scale
    part = slice(max((n - LONGEST) // 2, 0), max((n - LONGEST) // 2, 0) + LONGEST)
    best = min((_fit(value[part], dt[part][: len(value[part]) - 1], m, least) for m in ORDERS), key=lambda f: f.cost)
    white, transition = _unit_step(best.order)
    factors, states = np.empty((n, best.order, 2 * best.order + 1)), np.empty((n, best.order))
    forward(value, dt, white, transition, best.rho, factors, True)
    backward(factors, np.zeros((n, best.order)), states)
    covariance = np.empty((n, 3, 3))
    covariances(factors, covariance)
    per = step ** -np.arange(3.0)
    sigma = best.sigma * scale
    cutoff = best.rho ** (0.5 / best.order) / step / (2.0 * math.pi)
    return Smoothed(
        shift + scale * states[:, 0],
        scale * states[:, 1] * per[1],
        scale * states[:, 2] * per[2],
        covariance * sigma**2 * per[:, None] * per[None, :],
        sigma,
        cutoff if cutoff < 0.5 / step else math.inf,
        best.order,
        factors,
        step,
        best.rho,
        dt,
    )


@dataclass(frozen=True)
class _Fit:
    cost: float
    order: int
    rho: float
    sigma: float


def _fit(y: FloatArray, dt: FloatArray, m: int, least: float) -> _Fit:
    """Most likely bandwidth and noise of one order; the noise is not below *least*."""
    from scipy.optimize import minimize_scalar

    white, transition = _unit_step(m)
    nothing = np.empty((0, m, 2 * m + 1))
    freedom = len(y) - m

    def cost(exponent: float) -> tuple[float, float]:
        rss, logdet = forward(y, dt, white, transition, 10.0**exponent, nothing, False)
        variance = max(rss / freedom, least**2)
        return float(rss / variance + freedom * math.log(variance) + 2.0 * logdet), math.sqrt(variance)

    grid = [cost(exponent)[0] for exponent in EXPONENTS]
    grid = [value if math.isfinite(value) else math.inf for value in grid]
    middle = int(np.argmin(grid))
    around = EXPONENTS[max(middle - 1, 0)], EXPONENTS[min(middle + 1, len(grid) - 1)]
    found = minimize_scalar(lambda e: cost(e)[0], bounds=around, method="bounded", options={"xatol": 1e-2})
    value, sigma = cost(float(found.x))
    return _Fit(value, m, 10.0 ** float(found.x), sigma)


def _unit_step(m: int) -> tuple[FloatArray, FloatArray]:
    """Inverse Cholesky factor of a unit step's noise ``(m, m)``, lower triangular flipped to whiten, and transition."""
    order = np.arange(m)
    factorial = np.array([math.factorial(int(k)) for k in order], dtype=np.float64)
    up = m - 1 - order
    noise = 1.0 / ((up[:, None] + up[None, :] + 1) * factorial[up][:, None] * factorial[up][None, :])
    gap = order[None, :] - order[:, None]
    transition = np.where(gap >= 0, 1.0 / factorial[np.maximum(gap, 0)], 0.0)
    white: FloatArray = np.linalg.inv(np.linalg.cholesky(noise))
    return np.ascontiguousarray(white), np.ascontiguousarray(transition)


def _at_rest(n: int) -> FloatArray:
    m = ORDERS[0]
    factors = np.zeros((n, m, 2 * m + 1))
    factors[:, np.arange(m), np.arange(m)] = np.inf
    return factors
