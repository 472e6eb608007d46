"""Edits that mend together what none of them mends alone: their effects add up where they do not meet in a product.

What each edit changes has been seen once, when it was tried alone. So sums of two and of three are looked through
without running anything: a sum that equals what is wrong is a candidate.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from workbench.arrays import FloatArray

SAME = 1e-7
"""Relative: effects that are as near are the same."""

MOST_TRIPLES = 1200
MOST = 24
"""Sums of one kind that are looked at."""

SEED = 15


def sums(effects: FloatArray, wanted: FloatArray, triples: bool) -> list[tuple[int, ...]]:
    """Pairs and triples of effects ``(n, k)`` that add up to *wanted* ``(k,)``, those of few edits first."""
    size = float(np.abs(wanted).max(initial=0.0))
    if size == 0.0 or len(effects) < 2:
        return []
    weights = np.random.default_rng(SEED).uniform(0.5, 1.5, effects.shape[1]) * _signs(effects.shape[1])
    shadow, aim = effects @ weights, float(wanted @ weights)
    order = np.argsort(shadow, kind="stable")
    ranked, slack = shadow[order], SAME * float(np.abs(weights).sum()) * size / np.sqrt(len(weights))
    found: list[tuple[int, ...]] = []
    for one, other in _pairs(ranked, aim, slack, 0):
        pair = int(order[one]), int(order[other])
        if _equal(effects[list(pair)], wanted, size):
            found.append(tuple(sorted(pair)))
            if len(found) >= MOST:
                return found
    if found or not triples or len(effects) > MOST_TRIPLES:
        return found
    for third in range(len(ranked)):
        for one, other in _pairs(ranked, aim - float(ranked[third]), slack / 30, third + 1):
            triple = tuple(sorted(int(order[i]) for i in (third, one, other)))
            if _equal(effects[list(triple)], wanted, size):
                found.append(triple)
                if len(found) >= MOST:
                    return found
    return found


def _signs(count: int) -> FloatArray:
    return np.asarray(np.random.default_rng(SEED + 1).choice([-1.0, 1.0], count))


def _pairs(ranked: FloatArray, aim: float, slack: float, first: int) -> Iterator[tuple[int, int]]:
    """Places in a sorted row, from *first* on, of two numbers that add up."""
    row = ranked[first:]
    low = np.searchsorted(ranked, aim - row - slack)
    high = np.searchsorted(ranked, aim - row + slack, side="right")
    for index in np.flatnonzero(high > low):
        one = first + int(index)
        for other in range(max(int(low[index]), one + 1), int(high[index])):
            yield one, other


def _equal(effects: FloatArray, wanted: FloatArray, size: float) -> bool:
    scale = max(size, float(np.abs(effects).max()))
    return bool(np.abs(effects.sum(axis=0) - wanted).max() <= SAME * scale)


def groups_alike(effects: FloatArray) -> list[list[int]]:
    """Numbers of effects that are the same, in groups; those that do nothing are left out."""
    weights = np.random.default_rng(SEED).uniform(0.5, 1.5, effects.shape[1])
    size = np.abs(effects).max(axis=1, initial=0.0)
    groups: list[list[int]] = []
    shadow = effects @ weights
    for index in np.argsort(shadow, kind="stable"):
        if size[index] == 0.0:
            continue
        near = groups[-1][0] if groups else None
        if near is not None and np.abs(effects[index] - effects[near]).max() <= SAME * size[index]:
            groups[-1].append(int(index))
        else:
            groups.append([int(index)])
    return groups


def masks(shape: Sequence[int]) -> Iterator[tuple[np.ndarray, bool]]:
    """Which numbers ``(parts, poses, na)`` are to add up, and whether triples are looked at: all, then each joint."""
    whole = np.ones(shape, dtype=np.bool_)
    yield whole.ravel(), True
    for joint in range(shape[2] if shape[2] > 1 else 0):
        mask = np.zeros(shape, dtype=np.bool_)
        mask[:, :, joint] = True
        yield mask.ravel(), False
