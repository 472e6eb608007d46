"""From the uncertainty of a motion to that of the torques that a reference computes on it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from workbench.arrays import FloatArray
from workbench.recorded.smoothing import Smoothed

Torque = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
"""q, qd, qdd ``(n, na)`` -> tau ``(n, na)``"""

LEVEL = 0.95
"""Share of cases in which nothing but the stated uncertainty exceeds it."""

DRAWS = 200
ENTRIES = 20_000_000
"""Numbers of all draws together; long records get fewer draws."""

POSITION_STEP = 1e-5
"""m or rad, of the difference quotient for the positions' part."""

SPEED_STEP = 1e-3
"""Of the peak speed."""

SEED = 20260101


@dataclass(frozen=True)
class Uncertainty:
    """What motion and recorder leave in the difference of torques, per joint."""

    sigma: FloatArray = field(repr=False)
    """``(n, na)`` standard deviation at each sample"""
    widening: FloatArray
    """``(na,)``: so many standard deviations hold the whole curve in `LEVEL` of cases"""
    peak: FloatArray
    """``(na,)``: the largest difference that they leave over the case stays below this in `LEVEL` of cases"""
    noise_peak: FloatArray
    """``(na,)``: the same of the recorded torques' own noise and times alone, without the motion's part"""
    draws: FloatArray = field(repr=False)
    """``(count, n, na)`` differences as they may be"""

    @property
    def band(self) -> FloatArray:
        """Half of the band ``(n, na)`` that holds the whole curve in `LEVEL` of cases."""
        return self.sigma * self.widening


def uncertainty(
    torque: Torque,
    motion: tuple[FloatArray, FloatArray, FloatArray],
    smoothed: Sequence[Smoothed] | None,
    noise: FloatArray,
    drift: FloatArray,
) -> Uncertainty:
    """Carry a motion's uncertainty through a reference.

    Parameters
    ----------
    torque
        The reference.
    motion
        q, qd, qdd, each ``(n, na)``.
    smoothed
        Each coordinate as it was estimated; None: the motion is exact.
    noise
        Standard deviation of the recorded torques' own noise, ``(na,)``.
    drift
        What an uncertain time offset does: standard deviation times rate of the torque, ``(n, na)``.
    """
    n, na = motion[0].shape
    count = int(np.clip(ENTRIES // (3 * n * na), 40, DRAWS))
    generator = np.random.default_rng(SEED)
    draws = generator.standard_normal((count, n, na)) * noise
    draws += generator.standard_normal((count, 1, na)) * drift
    alone = np.quantile(np.abs(draws).max(axis=1), LEVEL, axis=0)
    variance = np.tile(noise**2, (n, 1)) + drift**2
    if smoothed:
        slopes = sensitivities(torque, motion)
        for j, one in enumerate(smoothed):
            by = np.stack([slope[:, :, j] for slope in slopes], axis=2)  # (n, na, 3)
            variance += np.einsum("nak,nkl,nal->na", by, one.covariance, by)
            draws += np.einsum("nak,dnk->dna", by, one.draws(count, SEED + 1 + j))
    # the covariance takes rounding for independent; the draws do not, and are few
    sigma = np.sqrt(np.maximum(variance, np.mean(draws**2, axis=0)))
    over = np.abs(np.divide(draws, sigma, out=np.zeros_like(draws), where=sigma > 0.0))
    return Uncertainty(
        sigma,
        np.quantile(over.max(axis=1), LEVEL, axis=0),
        np.quantile(np.abs(draws).max(axis=1), LEVEL, axis=0),
        alone,
        draws,
    )


def sensitivities(
    torque: Torque, motion: tuple[FloatArray, FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Derivatives of tau by q, qd and qdd, each ``(n, na, na)``: torque, then coordinate. The last is the mass matrix.

    By acceleration exact, since torques are affine in it; by speed and position as central differences.
    """
    q, qd, qdd = motion
    na = q.shape[1]
    by_q, by_qd, by_qdd = (np.empty((*q.shape, na)) for _ in range(3))
    zero = np.zeros_like(q)
    rest = torque(q, zero, zero)
    for j in range(na):
        unit = np.zeros(na)
        unit[j] = 1.0
        by_qdd[:, :, j] = torque(q, zero, zero + unit) - rest
        step = SPEED_STEP * max(float(np.abs(qd[:, j]).max()), 1e-6)
        by_qd[:, :, j] = (torque(q, qd + step * unit, qdd) - torque(q, qd - step * unit, qdd)) / (2.0 * step)
        step = POSITION_STEP
        by_q[:, :, j] = (torque(q + step * unit, qd, qdd) - torque(q - step * unit, qd, qdd)) / (2.0 * step)
    return by_q, by_qd, by_qdd
