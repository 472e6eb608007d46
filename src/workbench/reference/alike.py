"""Which torques are the same but for rounding, so that one simulation is that of them all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.arrays import FloatArray

SAME = 1e-12
"""Of each joint's peak. A replay's window ends where torques a thousandth too large would be off by a tenth of a
stroke, so that torques which differ by this are off by some 1e-10 strokes: no digit of a verdict's figures."""


def first_alike(torques: Sequence[FloatArray]) -> list[int]:
    """For each candidate the first one with the same torques, itself where there is none before it.

    Parameters
    ----------
    torques
        ``(candidates, samples, na)`` each, N and N m: all of them have to agree. What is not finite is like nothing.
    """
    first: list[int] = []
    for one in range(len(torques[0])):
        before = (other for other in dict.fromkeys(first) if all(_same(tau[other], tau[one]) for tau in torques))
        first.append(next(before, one))
    return first


def _same(one: FloatArray, other: FloatArray) -> bool:
    apart = np.abs(one - other).max(axis=0)
    return bool(np.all(apart <= SAME * np.abs(one).max(axis=0)))  # false for what is no number
