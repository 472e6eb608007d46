"""Joints that carry nothing: a force that should be zero is judged by the forces whose cancellation leaves it.

Where a slider stands still in the plane of symmetry its force is zero in the closed form and 1e-15 N of rounding in the
reference. The quotient of the two says nothing; the reactions in the joints say how large such rounding may be.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

import numpy as np

from workbench.arrays import FloatArray
from workbench.metrics import JointError, relative_errors

UNLOADED = 3e-5
"""A joint whose force (N) or torque (N m) stays below this fraction of the largest joint reaction (N; times 1 m) over
the whole case is unloaded. Rounding is 1e-11 of this limit; the least loaded joint of the papers' examples (tau2 of the
4-RPRP robot under 1000 N) lies four times above it."""


def largest_reaction(reactions: Iterable[FloatArray]) -> float:
    """Return the largest magnitude among reaction forces, each ``(n, 3)`` in newtons; 0 where there are none."""
    every = [force for force in reactions if len(force)]
    return float(np.linalg.norm(np.concatenate(every), axis=1).max()) if every else 0.0


def normaliser_of(error: JointError, reaction: float) -> float:
    """Return what `joint_error` divides by, in the joint's unit."""
    return error.peak_reference if not error.peak_reference < UNLOADED * reaction else UNLOADED * reaction


def joint_error(candidate: FloatArray, reference: FloatArray, reaction: float) -> JointError:
    """Compare two time series ``(n,)`` of one joint; where it is unloaded, in fractions of ``UNLOADED * reaction``.

    `peak_reference` stays the largest |reference|. All samples of an unloaded joint count in `pointwise_error`, which
    equals `peak_error`.
    """
    return joint_errors(candidate[:, None], reference[:, None], reaction)[0]


def joint_errors(candidate: FloatArray, reference: FloatArray, reaction: float) -> list[JointError]:
    """`joint_error` of each column of ``(n, na)``."""
    errors = relative_errors(candidate, reference)
    return [_judged(error, candidate[:, i], reference[:, i], reaction) for i, error in enumerate(errors)]


def _judged(error: JointError, candidate: FloatArray, reference: FloatArray, reaction: float) -> JointError:
    limit = UNLOADED * reaction
    if not error.peak_reference < limit:
        return error
    difference = np.abs(candidate - reference)
    peak = float(difference.max()) / limit
    return dataclasses.replace(
        error,
        peak_error=peak,
        rms_error=float(np.sqrt(np.mean(difference**2))) / limit,
        pointwise_error=peak,
        pointwise_skipped=0,
    )
