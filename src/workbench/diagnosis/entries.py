"""Each joint of each part, held against the reference: right to how many digits, or wrong by how much."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from workbench.arrays import FloatArray
from workbench.diagnosis.parts import DRY, ODD, REST, VISCOUS, Part, Parts

RIGHT = 1e-8
"""Of an entry's own size: a smaller error is rounding, of the formula or of the reference's loop closure."""

NOTHING = 1e-11
"""Of the largest part of the joint's torque: a smaller entry is zero."""

SAME_RATIO = 1e-6
"""How constant a ratio must be over all poses to be called one, where nothing is noisy."""

SIMPLE = 16
"""Largest denominator, and largest numerator, of a fraction that is called simple."""

RIGHT_MARK, WRONG_MARK, UNKNOWN_MARK, NONE_MARK = "right", "wrong", "unknown", "none"


@dataclass(frozen=True)
class Entry:
    """One joint's share of one part."""

    part: Part
    joint: int
    status: str
    """right, wrong, unknown (the formula did not answer), none (zero on both sides)"""
    error: float
    """max |formula - reference| over max of both"""
    weight: float
    """max |formula - reference| over the largest part of the joint's torque: how much it matters"""
    ratio: Fraction | float | None
    """formula / reference where it is the same at all poses; 0 where the formula has nothing"""

    @property
    def digits(self) -> int:
        """Digits that agree."""
        return 15 if self.error < 1e-15 else max(0, int(-np.log10(self.error)))


def compare_parts(
    formula: Parts,
    reference: Parts,
    floors: FloatArray,
    right: float = RIGHT,
    nothing: float = NOTHING,
    noise: FloatArray | None = None,
) -> list[Entry]:
    """Hold all parts against the reference's.

    *floors* ``(na,)`` are the joints' largest parts, N and N m; *noise* ``(s,)`` is what the formula's own numbers are
    off by at each pose, as a fraction of them.
    """
    own = np.zeros(len(next(iter(reference.values())))) if noise is None else noise
    return [
        _entry(part, joint, formula[part][:, joint], wanted[:, joint], floors[joint], right, nothing, own)
        for part, wanted in reference.items()
        if part in formula
        for joint in range(wanted.shape[1])
    ]


def _entry(
    part: Part,
    joint: int,
    found: FloatArray,
    wanted: FloatArray,
    floor: float,
    right: float,
    nothing: float,
    noise: FloatArray,
) -> Entry:
    known = np.isfinite(found) & np.isfinite(wanted)
    if not known.any():
        return Entry(part, joint, UNKNOWN_MARK, np.nan, np.nan, None)
    found, wanted = found[known], wanted[known]
    # where several answers are added up, so are their noises
    slack = noise[known] * floor * (4.0 if part.kind in (ODD, REST, VISCOUS, DRY) else 1.0)
    over = float((np.abs(found - wanted) - slack).max())
    gap = float(np.abs(found - wanted).max())
    size = max(float(np.abs(wanted).max()), float(np.abs(found).max()))
    # a difference of two torques that are as large as the joint's largest part carries their rounding
    small = nothing * floor * (100.0 if part.kind in (ODD, REST, VISCOUS, DRY) else 1.0)
    error, weight = (gap / size if size > 0.0 else 0.0), (gap / floor if floor > 0.0 else 0.0)
    if size <= small + slack.max():
        return Entry(part, joint, NONE_MARK, 0.0, weight, None)
    if over <= max(small, right * size):
        return Entry(part, joint, RIGHT_MARK, error, weight, Fraction(1))
    return Entry(part, joint, WRONG_MARK, error, weight, ratio_of(found, wanted, max(small, right * size, slack.max())))


def ratio_of(found: FloatArray, wanted: FloatArray, slack: float = 0.0) -> Fraction | float | None:
    """Return found / wanted where it is the same throughout: a simple fraction where it is near one, else a number."""
    power = float(np.vdot(wanted, wanted))
    if not (np.isfinite(found).all() and np.isfinite(power)):
        return None
    if np.abs(wanted).max() <= slack or power == 0.0:
        return None
    ratio = float(np.vdot(found, wanted)) / power
    rest = float(np.abs(found - ratio * wanted).max())
    if rest > max(SAME_RATIO * float(np.abs(wanted).max()), slack):
        return None
    return simple(ratio)


def simple(ratio: float) -> Fraction | float:
    """Return the simple fraction that a ratio is, or the ratio itself."""
    if not np.isfinite(ratio):
        return ratio
    near = Fraction(ratio).limit_denominator(SIMPLE)
    if abs(float(near) - ratio) < 1e-5 * max(1.0, abs(ratio)) and abs(near.numerator) <= 4 * SIMPLE:
        return near
    return ratio


def show_ratio(ratio: Fraction | float | None) -> str:
    """Write a ratio as ``x -1``, ``x 1/2``, ``missing``; empty where there is none."""
    if ratio is None:
        return ""
    if ratio == 0:
        return "missing"
    return f"x {ratio}" if isinstance(ratio, Fraction) else f"x {ratio:.6g}"


def floors_of(reference: Parts) -> FloatArray:
    """Return the largest part of each joint's torque, ``(na,)``."""
    sizes = [np.abs(values).max(axis=0) for part, values in reference.items() if part.kind not in (ODD, REST)]
    return np.asarray(np.maximum(np.max(sizes, axis=0), 1e-300))
