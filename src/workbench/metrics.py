"""Relative errors of a candidate against a reference, per joint, with the normaliser named.

Every figure is a fraction (0.01 is one percent) and is computed per joint: newtons and newton-metres are never mixed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.arrays import FloatArray

POINTWISE_FLOOR = 0.01
"""`pointwise_error` looks only at samples with |reference| of at least this fraction of the reference's own peak:
near a zero crossing the quotient says nothing."""


@dataclass(frozen=True)
class JointError:
    """The errors of one candidate on one joint over one case."""

    peak_error: float
    """max|d| / max|ref|"""
    rms_error: float
    """rms(d) / rms(ref)"""
    pointwise_error: float
    """max |d|/|ref| over samples with |ref| >= POINTWISE_FLOOR * max|ref|"""
    pointwise_skipped: int
    """number of samples left out of `pointwise_error`"""
    peak_reference: float
    """max|ref|, the normaliser of `peak_error`, in the joint's unit"""
    worst_index: int
    """sample with the largest |d|"""


def relative_error(candidate: FloatArray, reference: FloatArray) -> JointError:
    """Compare two time series of one joint.

    Parameters
    ----------
    candidate, reference
        Shape ``(n,)``, same unit.

    Returns
    -------
    JointError
        A reference that is zero throughout gives 0 where the candidate is zero too, and inf otherwise. NaN anywhere
        gives NaN errors, which satisfy no bound.
    """
    difference = np.abs(candidate - reference)
    magnitude = np.abs(reference)
    peak = float(magnitude.max())
    worst = int(np.argmax(np.where(np.isnan(difference), np.inf, difference)))
    kept = magnitude >= POINTWISE_FLOOR * peak
    pointwise = float(np.max(difference[kept] / magnitude[kept])) if peak > 0 else _ratio(difference.max(), 0.0)
    return JointError(
        peak_error=_ratio(float(difference.max()), peak),
        rms_error=_ratio(float(np.sqrt(np.mean(difference**2))), float(np.sqrt(np.mean(reference**2)))),
        pointwise_error=pointwise,
        pointwise_skipped=int(np.count_nonzero(~kept)),
        peak_reference=peak,
        worst_index=worst,
    )


def _ratio(numerator: float, denominator: float) -> float:
    if denominator == 0.0:
        return 0.0 if numerator == 0.0 else float("inf")
    return float(numerator / denominator)
