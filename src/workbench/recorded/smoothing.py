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
from workbench.motion.digits import UNIFORM
from workbench.recorded.kernels import backward, covariances, forward
from workbench.recorded.trend import trend_of

ORDERS = (4, 5, 6)
"""Orders m that are tried: the spline has degree 2 m - 1."""

FEWEST = 2 * max(ORDERS)
"""Samples; fewer say nothing of their own noise."""

LONGEST = 4_000
"""Samples of which order and bandwidth are found; of a longer record the middle is looked at."""

SLOWEST, FASTEST = 0.3, 2.0
"""Bandwidths that are looked at: from so many radians in the whole record to so many powers of ten of one a sample,"""

APART = 0.5
"""powers of ten from one to the next at first."""

AT_ONCE = 2_000_000
"""Numbers of all draws that are computed at a time."""

ZETA_3 = 1.2020569
"""Sum of 1 / k^3."""

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
    weight: float
    """standard deviation that a sample is smoothed with: `sigma`, or more where neighbours are rounded alike"""
    bandwidth: float
    """Hz: slower parts of the motion are kept, faster ones are smoothed away; infinite where nothing is smoothed"""
    order: int
    rounding: float = 0.0
    """half of the last place that samples were written with"""
    _factors: FloatArray = field(default_factory=lambda: np.zeros((0, 0, 0)), repr=False)
    _step: float = field(default=1.0, repr=False)
    _rho: float = 0.0
    _dt: FloatArray | None = field(default=None, repr=False)

    def quieter(self, times: float) -> float:
        """Uncertainty of the acceleration with noise so many times smaller, over what it is now (median)."""
        if self._dt is None:
            return 1.0
        n, m, _ = self._factors.shape
        factors, found = _factored(self._dt, m, self._rho * times**2)[0], np.empty((n, 3, 3))
        covariances(factors, found)
        now = np.median(self.covariance[:, 2, 2]) * self._step**4 / self.weight**2
        return float(np.sqrt(np.median(found[:, 2, 2]) / now) / times)

    def draws(self, count: int, seed: int) -> FloatArray:
        """Errors of (q, qd, qdd) as they may be, ``(count, n, 3)``.

        Motions that are drawn from the posterior are written and estimated again, as the record was: rounded to its
        last place, at a random place of the grid, with the rest of the noise as Gaussian. Where a motion stands still
        between two samples their roundings are alike, which no independent noise shows.
        """
        if self._dt is None:
            return np.zeros((count, len(self.q), 3))
        n, m, _ = self._factors.shape
        generator = np.random.default_rng(seed)
        found = np.empty((count, n, 3))
        at_once = max(AT_ONCE // (n * m), 1)
        for start in range(0, count, at_once):
            many = min(at_once, count - start)
            states = generator.standard_normal((n, m, many))
            backward(self._factors, states)
            written = states[:, 0] + self._written_again(states[:, 0], generator)
            again = _factored(self._dt, m, self._rho, written)[1]
            backward(self._factors, again)
            found[start : start + many] = np.moveaxis(again[:, :3] - states[:, :3], 2, 0)
        found *= self.weight * self._step ** -np.arange(3.0)
        return found

    def _written_again(self, errors: FloatArray, generator: np.random.Generator) -> FloatArray:
        """Noise of motions that are *errors* ``(n, c)`` beside the estimate; all in units of `weight`."""
        half = self.rounding / self.weight
        rest = math.sqrt(max((self.sigma / self.weight) ** 2 - (half * UNIFORM) ** 2, 0.0))
        noise = rest * generator.standard_normal(errors.shape)
        if half == 0.0:
            return noise
        shown = (self.q / self.weight)[:, None] + errors + noise
        place = shown / (2.0 * half) + generator.uniform(size=errors.shape[1])
        return noise + 2.0 * half * (np.rint(place) - place)


def smooth(t: FloatArray, y: FloatArray, rounding: float = 0.0) -> Smoothed:
    """Differentiate samples twice.

    Parameters
    ----------
    t
        Times ``(n,)``, s, strictly increasing.
    y
        Samples ``(n,)``.
    rounding
        Half of the last place that samples were written with. The noise is not below what it leaves, over the root of
        three; what the samples show counts where it is larger.

    Raises
    ------
    MotionError
        Fewer than `FEWEST` samples.
    """
    n = len(y)
    if n < FEWEST:
        raise MotionError(f"{n} samples; allowed: at least {FEWEST} to tell a motion from its noise", value=n)
    step = float(t[-1] - t[0]) / (n - 1)
    shift = float(np.mean(y))
    scale = float(np.abs(y - shift).max())
    floor = rounding * UNIFORM
    if scale == 0.0:  # at rest
        zero = np.zeros(n)
        rest = np.zeros((n, 3, 3))
        rest[:, 0, 0] = floor**2
        return Smoothed(y.copy(), zero, zero.copy(), rest, floor, floor, 0.0, ORDERS[0])
    least = max(floor, EPS * float(np.abs(y).max())) / scale
    trend = trend_of((t - t[0]) / step, (y - shift) / scale)
    least *= _alike(trend.derivatives[0], 2.0 * rounding / scale)
    value = (y - shift) / scale - trend.derivatives[0]
    first = max((n - LONGEST) // 2, 0)
    part, steps = slice(first, first + LONGEST), slice(first, min(first + LONGEST, n) - 1)
    best = min((_fit(value[part], trend.dt[steps], trend.drive(m)[steps], least) for m in ORDERS), key=lambda f: f.cost)
    factors, states = _factored(trend.dt, best.order, best.rho, value[:, None], trend.drive(best.order))
    backward(factors, states)
    covariance = np.empty((n, 3, 3))
    covariances(factors, covariance)
    q, qd, qdd = scale * (states[:, :3, 0].T + trend.derivatives[:3])
    per = step ** -np.arange(3.0)
    weight = best.weight * scale
    cutoff = best.rho ** (0.5 / best.order) / step / (2.0 * math.pi)
    return Smoothed(
        shift + q,
        qd * per[1],
        qdd * per[2],
        covariance * weight**2 * per[:, None] * per[None, :],
        max(best.shown * scale, floor),
        weight,
        cutoff if cutoff < 0.5 / step else math.inf,
        best.order,
        rounding,
        factors,
        step,
        best.rho,
        trend.dt,
    )


@dataclass(frozen=True)
class _Fit:
    cost: float
    order: int
    rho: float
    weight: float
    shown: float
    """standard deviation of what the curve leaves"""


def _factored(
    dt: FloatArray, m: int, rho: float, y: FloatArray | None = None, drive: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Factors ``(n, m, 2 m)``, and right-hand sides ``(n, m, c)`` of the records *y* ``(n, c)``."""
    n = len(dt) + 1
    y = np.zeros((n, 1)) if y is None else y
    drive = np.zeros((n - 1, m)) if drive is None else drive
    factors, rhs = np.empty((n, m, 2 * m)), np.empty((n, m, y.shape[1]))
    forward(np.ascontiguousarray(y), dt, *_unit_step(m), drive, rho, factors, rhs, True)
    return factors, rhs


def _fit(y: FloatArray, dt: FloatArray, drive: FloatArray, least: float) -> _Fit:
    """Most likely bandwidth and noise of one order; samples are not taken for better than *least*."""
    from scipy.optimize import minimize_scalar

    m = drive.shape[1]
    white, transition = _unit_step(m)
    factors, rhs = np.empty((0, m, 2 * m)), np.empty((0, m, 1))
    freedom = len(y) - m

    def cost(power: float) -> tuple[float, float, float]:
        rho = 10.0 ** (2 * m * power)
        rss, logdet = forward(y[:, None], dt, white, transition, drive, rho, factors, rhs, False)
        variance = max(rss / freedom, least**2)
        value = float(rss / variance + freedom * math.log(variance) + 2.0 * logdet)
        return value, math.sqrt(variance), math.sqrt(rss / freedom)

    powers = np.arange(math.log10(SLOWEST / len(y)), FASTEST + APART, APART)
    grid = [cost(power)[0] for power in powers]
    grid = [value if math.isfinite(value) else math.inf for value in grid]
    middle = int(np.argmin(grid))
    around = powers[max(middle - 1, 0)], powers[min(middle + 1, len(grid) - 1)]
    found = minimize_scalar(lambda e: cost(e)[0], bounds=around, method="bounded", options={"xatol": 3e-3})
    value, weight, shown = cost(float(found.x))
    return _Fit(value, m, 10.0 ** (2 * m * float(found.x)), weight, shown)


def _alike(motion: FloatArray, place: float) -> float:
    """By how much slow rounding noise exceeds that of independent roundings: root of the quotient of their spectra.

    Rounding to *place* is a sawtooth of the position: harmonics k of power place^2 / (2 pi^2 k^2) at frequencies of
    k times speed over place. Speeds that are distributed like a Gaussian of the motion's own root mean square make of
    that a density place^3 zeta(3) / (2 pi^2 sqrt(2 pi) speed) at frequency zero; independent roundings have
    place^2 / 12 times the step. Where a motion takes many samples to a place, they count as few.
    """
    speed = float(np.sqrt(np.mean(np.diff(motion) ** 2)))
    if place == 0.0 or speed == 0.0:
        return 1.0
    return math.sqrt(max(12.0 * ZETA_3 / (2.0 * math.pi**2 * math.sqrt(2.0 * math.pi)) * place / speed, 1.0))


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
