"""The factor of `workbench.reference.linear` for many systems at once, which lie side by side: vector code.

Entry (i, j) of all systems is one row of an array, so that one instruction serves several of them. The systems share
the order of their columns, as neighbouring samples of a motion nearly always do; it is the order of each system by
itself, and where one would take another, all are left to the factor of one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import borrowing
from workbench.reference.linear import DIGITS_LEFT, RANK_TOLERANCE

LANES = 32
"""Systems at once. With half of them what surrounds the loops over systems takes half as long as these, twice as many
leave the first-level cache."""

ALIKE = 1.0 + 1e-9
"""A column may be longer than the one that is taken by so little: rounding chooses between equal ones."""


class Many(NamedTuple):
    """Room for so many systems of m rows and p columns with one right-hand side: the last axis is theirs."""

    a: FloatArray
    """``(high (p + 1), lanes)`` entry (i, j) in row ``i (p + 1) + j``"""
    beta: FloatArray
    """``(p, lanes)``"""
    order: np.ndarray
    """``(p,)``"""
    left: FloatArray
    known: FloatArray
    rows: np.ndarray
    """``(high,)``"""
    sums: FloatArray
    """``(lanes,)``, as `scale` and `least`"""
    scale: FloatArray
    least: FloatArray
    x: FloatArray
    """``(high, lanes)`` solutions, of the one problem or of the transposed one"""


def room_for_many(rows: int, columns: int, lanes: int) -> Many:
    """Room, not cleared."""
    high, p = max(rows, columns), columns
    return Many(
        np.empty((high * (p + 1), lanes)), np.empty((p, lanes)), np.empty(p, dtype=np.int64), np.empty((p, lanes)),
        np.empty((p, lanes)), np.empty(high, dtype=np.int64), np.empty(lanes), np.empty(lanes), np.empty(lanes),
        np.empty((high, lanes)),
    )  # fmt: skip


@borrowing
def factor_many(high, room):  # type: ignore[no-untyped-def]
    """Factor systems of *high* rows as `workbench.reference.linear.factor` does; whether they agree and have full rank.

    Where they do not, nothing is said.
    """
    a, left, known, rows, order = room.a, room.left, room.known, room.rows, room.order
    sums, scale, least = room.sums, room.scale, room.least
    p, lanes = order.shape[0], sums.shape[0]
    width = p + 1
    for j in range(p):
        order[j] = j
        y = left[j]
        for n in range(lanes):
            y[n] = 0.0
        for i in range(high):
            x = a[i * width + j]
            for n in range(lanes):
                y[n] += x[n] * x[n]
        z = known[j]
        for n in range(lanes):
            z[n] = y[n]
    for k in range(p):
        pivot = k
        for j in range(k + 1, p):
            if left[j, 0] > left[pivot, 0]:
                pivot = j
        if pivot != k:
            for i in range(high):
                _exchange(a[i * width + k], a[i * width + pivot])
            order[k], order[pivot] = order[pivot], order[k]
            _exchange(left[k], left[pivot])
            _exchange(known[k], known[pivot])
        x, other = left[k], 0
        for j in range(k + 1, p):
            y = left[j]
            for n in range(lanes):
                other += y[n] > ALIKE * x[n]
        if other:
            return False
        head, turn, count = a[k * width + k], room.beta[k], 0
        for n in range(lanes):
            sums[n] = head[n] * head[n]
        for i in range(k + 1, high):
            x, some = a[i * width + k], 0
            for n in range(lanes):
                sums[n] += x[n] * x[n]
                some += x[n] != 0.0
            rows[count] = i
            count += some > 0
        short = 0
        for n in range(lanes):
            norm = math.sqrt(sums[n])
            if k == 0:
                least[n] = RANK_TOLERANCE * norm
            short += not norm > least[n]
            alpha = -norm if head[n] > 0.0 else norm
            scale[n] = 1.0 / (head[n] - alpha)
            turn[n] = (alpha - head[n]) / alpha
            head[n] = alpha
        if short:
            return False
        for r in range(count):
            x = a[rows[r] * width + k]
            for n in range(lanes):
                x[n] *= scale[n]
        for j in range(k + 1, width):
            x = a[k * width + j]
            for n in range(lanes):
                sums[n] = x[n]
            for r in range(count):
                v, y = a[rows[r] * width + k], a[rows[r] * width + j]
                for n in range(lanes):
                    sums[n] += v[n] * y[n]
            for n in range(lanes):
                sums[n] *= turn[n]
                x[n] -= sums[n]
            for r in range(count):
                v, y = a[rows[r] * width + k], a[rows[r] * width + j]
                for n in range(lanes):
                    y[n] -= sums[n] * v[n]
        for j in range(k + 1, p):
            x, y, z, again = a[k * width + j], left[j], known[j], 0
            for n in range(lanes):
                y[n] -= x[n] * x[n]
                again += not y[n] > DIGITS_LEFT * z[n]
            if again:
                for n in range(lanes):
                    y[n] = 0.0
                for i in range(k + 1, high):
                    x = a[i * width + j]
                    for n in range(lanes):
                        y[n] += x[n] * x[n]
                for n in range(lanes):
                    z[n] = y[n]
    return True


@borrowing
def solve_many(room):  # type: ignore[no-untyped-def]
    """Least squares for the right-hand sides that were factored along: row k of `Many.x` is entry ``order[k]``."""
    a, sums, out = room.a, room.sums, room.x
    p, lanes = room.order.shape[0], sums.shape[0]
    for k in range(p - 1, -1, -1):
        x = a[k * (p + 1) + p]
        for n in range(lanes):
            sums[n] = x[n]
        for j in range(k + 1, p):
            v, y = a[k * (p + 1) + j], out[j]
            for n in range(lanes):
                sums[n] -= v[n] * y[n]
        v, y = a[k * (p + 1) + k], out[k]
        for n in range(lanes):
            y[n] = sums[n] / v[n]


@borrowing
def solve_transposed_many(high, room):  # type: ignore[no-untyped-def]
    """Least-norm solutions of the transposed systems, in place: row k of `Many.x` is what ``order[k]`` has to be."""
    a, beta, sums, out = room.a, room.beta, room.sums, room.x
    p, lanes = room.order.shape[0], sums.shape[0]
    width = p + 1
    for i in range(p, high):
        y = out[i]
        for n in range(lanes):
            y[n] = 0.0
    for i in range(p):
        y, v = out[i], a[i * width + i]
        for n in range(lanes):
            y[n] /= v[n]
        for k in range(i + 1, p):
            x, v = out[k], a[i * width + k]
            for n in range(lanes):
                x[n] -= v[n] * y[n]
    for k in range(p - 1, -1, -1):
        y, turn = out[k], beta[k]
        for n in range(lanes):
            sums[n] = y[n]
        for i in range(k + 1, high):
            x, v = out[i], a[i * width + k]
            for n in range(lanes):
                sums[n] += v[n] * x[n]
        for n in range(lanes):
            sums[n] *= turn[n]
            y[n] -= sums[n]
        for i in range(k + 1, high):
            x, v = out[i], a[i * width + k]
            for n in range(lanes):
                x[n] -= sums[n] * v[n]


@borrowing
def _exchange(one, other):  # type: ignore[no-untyped-def]
    for n in range(one.shape[0]):
        one[n], other[n] = other[n], one[n]
