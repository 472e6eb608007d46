"""What an error looks like, where it has a familiar shape: a factor, a swapped order, an offset, a delay.

Each shape is a change that would make the reference's torques the candidate's. One counts where it leaves next to
nothing of the error; so ordinary errors (a term left out, another mass) have none.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from workbench.arrays import FloatArray

WORTH = 1e-6
"""Of the peak: smaller errors need no hint."""

EXPLAINED = 0.02
"""Of the error: what a shape may leave of it to count as its cause."""

NEAR = 0.02
"""Relative: how near a fitted factor has to be to a familiar one."""

FACTORS = (
    (1e3, "as if in N mm in place of N m (or mN in place of N)"),
    (1e-3, "as if in kN or kN m in place of N or N m"),
    (180.0 / np.pi, "as if degrees stood where radians belong"),
    (np.pi / 180.0, "as if radians stood where degrees belong"),
    (-1.0, "the sign is turned round"),
    (2.0, "twice the reference"),
    (0.5, "half the reference"),
)

MOST_ORDERS = 6
"""Joints up to which every order is tried; of more only swaps of two."""

LONGEST_DELAY = 0.2
"""Of the samples."""


def hint_of(candidate: FloatArray, reference: FloatArray, t: FloatArray, joints: Sequence[str]) -> str | None:
    """Say in one sentence what the error of a candidate looks like, or nothing.

    Parameters
    ----------
    candidate, reference
        Torques ``(n, na)``, N and N m.
    t
        Times ``(n,)``, s.
    joints
        Their names.

    Returns
    -------
    str or None
        None where the error is small, not finite, or of no familiar shape.
    """
    if len(t) < 8 or candidate.shape != reference.shape or not np.isfinite(candidate).all():
        return None
    peak = np.abs(reference).max(axis=0)
    wrong = np.abs(candidate - reference).max(axis=0) > WORTH * np.maximum(peak, np.finfo(np.float64).tiny)
    if not wrong.any() or not peak.any():
        return None
    return next(itertools.chain(_orders(candidate, reference, joints, wrong), _samples(candidate, reference),
                                _each(candidate, reference, t, joints, wrong)), None)  # fmt: skip


def _explains(shaped: FloatArray, candidate: FloatArray, reference: FloatArray) -> bool:
    """Whether a changed reference leaves next to nothing of the error, in every column."""
    error = np.linalg.norm(candidate - reference, axis=0)
    left = np.linalg.norm(candidate - shaped, axis=0)
    return bool((left <= EXPLAINED * error + 1e-9 * np.linalg.norm(reference, axis=0)).all())


def _orders(candidate: FloatArray, reference: FloatArray, joints: Sequence[str], wrong: np.ndarray) -> Iterator[str]:
    count = len(joints)
    if count < 2 or np.count_nonzero(wrong) < 2:
        return
    if count <= MOST_ORDERS:
        orders: Iterator[tuple[int, ...]] = itertools.permutations(range(count))
    else:
        orders = (_swapped(count, i, j) for i, j in itertools.combinations(range(count), 2))
    for order in orders:
        if order != tuple(range(count)) and _explains(reference[:, order], candidate, reference):
            shown = ", ".join(joints[k] for k in order)
            yield f"it looks like another order of the joints: its columns are the reference's {shown}"
            return


def _swapped(count: int, i: int, j: int) -> tuple[int, ...]:
    order = list(range(count))
    order[i], order[j] = j, i
    return tuple(order)


def _samples(candidate: FloatArray, reference: FloatArray) -> Iterator[str]:
    if _explains(reference[::-1], candidate, reference):
        yield "it looks like another order of the samples: the last comes first"
        return
    # the same torques in another order: every column sorted is the same, and so is every pair of columns at a sample
    mine, theirs = (array[np.lexsort(array.T)] for array in (candidate, reference))
    if np.abs(mine - theirs).max() <= 1e-9 * np.abs(reference).max():
        yield "it looks like another order of the samples: the same torques stand at other times"


def _each(
    candidate: FloatArray, reference: FloatArray, t: FloatArray, joints: Sequence[str], wrong: np.ndarray
) -> Iterator[str]:
    """Shapes of single joints; the first joint that has one is named, with the others that share it."""
    found = {int(k): _shape(candidate[:, k], reference[:, k], t) for k in np.flatnonzero(wrong)}
    for words in found.values():
        if words is not None:
            alike = [joints[k] for k, other in found.items() if other is not None and other[0] == words[0]]
            yield f"{', '.join(alike)}: it looks like {words[1]}"
            return


def _shape(candidate: FloatArray, reference: FloatArray, t: FloatArray) -> tuple[str, str] | None:
    """The kind of shape, by which joints are grouped, and the words for it."""
    one, other = candidate[:, None], reference[:, None]
    worth = float(reference @ reference)
    if worth == 0.0:
        return None
    factor = float(candidate @ reference) / worth
    for known, words in FACTORS:
        if abs(factor / known - 1.0) < NEAR and _explains(known * other, one, other):
            return words, f"a factor of {known:.4g}, {words}"
    offset = float(np.mean(candidate - reference))
    if np.ptp(reference) > 1e-6 * np.abs(reference).max() and _explains(other + offset, one, other):
        return "offset", f"a constant offset of {offset:.4g}"
    return _delay(candidate, reference, t)


def _delay(candidate: FloatArray, reference: FloatArray, t: FloatArray) -> tuple[str, str] | None:
    """A delay, also of a part of a step: the reference between its samples, where the steps are alike."""
    steps = np.diff(t)
    step, n = float(np.median(steps)), len(t)
    if np.ptp(steps) > 1e-3 * step:
        return None
    best: tuple[float, float] | None = None
    for shift in range(-int(LONGEST_DELAY * n), int(LONGEST_DELAY * n) + 1):
        inside = slice(max(shift, 0) + 1, n + min(shift, 0) - 1)
        left = float(np.linalg.norm(candidate[inside] - np.roll(reference, shift)[inside])) / np.sqrt(
            max(inside.stop - inside.start, 1)
        )
        if best is None or left < best[0]:
            best = left, float(shift)
    assert best is not None
    whole = best[1]
    fine = _refined(candidate, reference, whole)
    margin = int(abs(whole)) + 2
    inside = slice(margin, n - margin)
    shifted = _at(reference, np.arange(n, dtype=np.float64) - fine)
    error = float(np.linalg.norm((candidate - reference)[inside]))
    left = float(np.linalg.norm((candidate - shifted)[inside]))
    if abs(fine) < 1e-3 or left > EXPLAINED * error or inside.stop - inside.start < 8:
        return None
    word = "a delay" if fine > 0 else "a lead"
    return f"{word} {round(fine, 2)}", f"{word} of {abs(fine) * step:.4g} s ({abs(fine):.3g} samples)"


def _refined(candidate: FloatArray, reference: FloatArray, whole: float) -> float:
    """A few Gauss-Newton steps for the part of a step."""
    n, shift = len(candidate), whole
    places = np.arange(n, dtype=np.float64)
    for _ in range(8):
        margin = int(abs(shift)) + 3
        inside = slice(margin, n - margin)
        if inside.stop - inside.start < 8:
            return whole
        value = _at(reference, places - shift)
        slope = (_at(reference, places - shift + 1e-3) - _at(reference, places - shift - 1e-3)) / 2e-3
        worth = float(slope[inside] @ slope[inside])
        if worth == 0.0:
            return whole
        change = -float(slope[inside] @ (candidate - value)[inside]) / worth
        shift += float(np.clip(change, -1.0, 1.0))
        if abs(shift - whole) > 2.0:
            return whole
    return shift


def _at(values: FloatArray, places: FloatArray) -> FloatArray:
    """Values between samples by cubics through four neighbours."""
    n = len(values)
    first = np.clip(np.floor(places).astype(np.int64), 1, n - 3)
    s = places - first
    a, b, c, d = (values[first + k] for k in (-1, 0, 1, 2))
    result: FloatArray = (
        -s * (s - 1) * (s - 2) / 6 * a
        + (s + 1) * (s - 1) * (s - 2) / 2 * b
        - (s + 1) * s * (s - 2) / 2 * c
        + (s + 1) * s * (s - 1) / 6 * d
    )
    return result
