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
    return relative_errors(candidate[:, None], reference[:, None])[0]


def relative_errors(candidate: FloatArray, reference: FloatArray) -> list[JointError]:
    """`relative_error` of each column of ``(n, k)``, one joint each, with the same bits."""
    # a row a joint, in one piece: then NumPy adds up each as it does a series by itself
    difference = np.ascontiguousarray(np.abs(candidate - reference).T)
    magnitude = np.ascontiguousarray(np.abs(reference).T)
    peaks, largest = magnitude.max(axis=1), difference.max(axis=1)
    kept = magnitude >= POINTWISE_FLOOR * peaks[:, None]
    judged = kept & (peaks > 0.0)[:, None]
    quotients = np.divide(difference, magnitude, out=np.zeros_like(difference), where=judged).max(axis=1)
    worst = np.argmax(np.where(np.isnan(difference), np.inf, difference), axis=1)
    rms, rms_reference = (np.sqrt(np.mean(values**2, axis=1)).tolist() for values in (difference, magnitude))
    skipped = (kept.shape[1] - np.count_nonzero(kept, axis=1)).tolist()
    return [
        JointError(
            peak_error=_ratio(off, peak),
            rms_error=_ratio(rms[joint], rms_reference[joint]),
            pointwise_error=float(quotients[joint]) if peak > 0 else _ratio(off, 0.0),
            pointwise_skipped=skipped[joint],
            peak_reference=peak,
            worst_index=int(worst[joint]),
        )
        for joint, (off, peak) in enumerate(zip(largest.tolist(), peaks.tolist(), strict=True))
    ]


def _ratio(numerator: float, denominator: float) -> float:
    if denominator == 0.0:
        return 0.0 if numerator == 0.0 else float("inf")
    return float(numerator / denominator)
