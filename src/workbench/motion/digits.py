"""How many digits a column of numbers was written with, and what rounding to them is worth."""

from __future__ import annotations

import numpy as np

from workbench.arrays import FloatArray

FULL = 13
"""Digits from which on a column counts as written with all of them."""

UNIFORM = 3.0**-0.5
"""Standard deviation of an error that is spread evenly over +-1, as rounding is over half of the last place."""

_NEAR = 1e-14
"""Relative: a number this near to a shorter one was written as the shorter one."""


def rounding_of(column: FloatArray) -> tuple[float, int]:
    """Return half of the last place that a column ``(n,)`` was written with, in its own unit, and its number of digits.

    Digits are counted at the column's largest number, both for a fixed number of decimals and for a fixed number of
    significant digits; whichever explains the column with fewer holds. A column with `FULL` digits or more is not
    rounded: (0, FULL). So is one of zeros.
    """
    largest = float(np.abs(column).max(initial=0.0))
    if largest == 0.0:
        return 0.0, FULL
    top = int(np.floor(np.log10(largest))) + 1
    moving = column[column != 0.0]
    exponent = np.floor(np.log10(np.abs(moving))).astype(np.int64) + 1
    for digits in range(1, FULL):
        if _holds(moving, np.full(len(moving), digits - top)) or _holds(moving, digits - exponent):
            return 0.5 * 10.0 ** (top - digits), digits
    return 0.0, FULL


def _holds(numbers: FloatArray, decimals: np.ndarray) -> bool:
    """Whether each number has no more than so many decimals."""
    with np.errstate(over="ignore", invalid="ignore"):
        scaled = numbers * np.power(10.0, decimals.astype(np.float64))
        return bool((np.abs(scaled - np.rint(scaled)) <= _NEAR * np.abs(scaled)).all())
