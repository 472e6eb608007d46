"""Rank-revealing least squares for many small systems: Householder QR with column pivoting, compiled.

The loop-closure Jacobian of a parallel mechanism is rank-deficient by nature (redundant rows), so normal equations and
Cholesky factors of J J^T are out of the question. Its passive columns, however, are independent away from singular
poses; with A P = Q R the same factor serves positions, velocities, accelerations and the least-norm multipliers.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import borrowing

RANK_TOLERANCE = 1e-10
"""A column counts as dependent when its pivot is below this fraction of the largest one."""


DIGITS_LEFT = 1e-3
"""A squared column length that fell below this fraction of what was last summed up is summed up again."""

SPARE = 3
"""Columns of zeros that a matrix to be factored has behind all others: columns are taken by fours, and the last four
may be short of as many."""


class Lengths(NamedTuple):
    """Room for `factor`."""

    left: FloatArray
    """``(p,)`` squared length of each column below the rows that are done"""
    known: FloatArray
    """``(p,)`` the same when it was summed up last"""
    rows: np.ndarray
    """``(m,)`` in which a column is not zero"""


def room_to_factor(rows: int, columns: int, beside: int = 0) -> tuple[FloatArray, FloatArray, np.ndarray, Lengths]:
    """A matrix of zeros with *beside* right-hand sides, and ``beta, perm, lengths``, as `factor` takes them.

    It has at least as many rows as columns, for the solutions; what is not written stays zero.
    """
    high = max(rows, columns)
    return (
        np.zeros((high, columns + beside + SPARE)), np.zeros(columns), np.zeros(columns, dtype=np.uint64),
        Lengths(np.zeros(columns), np.zeros(columns), np.zeros(high, dtype=np.uint64)),
    )  # fmt: skip


ONE, TWO, THREE, FOUR = (np.uint64(n) for n in range(1, 5))
"""Counts of what is never negative: of another index a kernel looks first whether it is meant from the end."""


@borrowing
def factor(a, beta, perm, lengths):  # type: ignore[no-untyped-def]
    """Factor the first p columns of ``a`` in place; returns the rank. Reflectors below the diagonal, R on and above it.

    ``a`` and all else is of `room_to_factor`: ``beta (p,)`` receives the reflector scales, ``perm (p,)`` the column
    order. Between these columns and `SPARE` of zeros may stand right-hand sides b, which become Q^T b, for
    `solve_beside`. Rows in which a column is zero cost nothing: loops that do not act on each other leave many.
    """
    m, p, width = np.uint64(a.shape[0]), np.uint64(perm.shape[0]), np.uint64(a.shape[1] - SPARE)
    left, known, rows = lengths.left, lengths.known, lengths.rows
    for j in range(p):
        perm[j] = j
        left[j] = 0.0
    # row by row, all columns at a time: the compiler can vectorise it
    for i in range(m):
        for j in range(p):
            left[j] += a[i, j] * a[i, j]
    for j in range(p):
        known[j] = left[j]
    rank = 0
    first = 0.0
    for k in range(p):
        best, pivot = -1.0, k
        for j in range(k, p):
            if left[j] > best:
                best, pivot = left[j], j
        if pivot != k:
            for i in range(m):
                a[i, k], a[i, pivot] = a[i, pivot], a[i, k]
            perm[k], perm[pivot] = perm[pivot], perm[k]
            left[pivot], known[pivot] = left[k], known[k]
        head = a[k, k]
        best, count = head * head, np.uint64(0)
        for i in range(k + ONE, m):
            v = a[i, k]
            rows[count] = i
            best += v * v
            count += np.uint64(v != 0.0)
        norm = math.sqrt(best)
        if rank == 0:
            first = norm
        if not norm > RANK_TOLERANCE * first:
            for j in range(k, p):
                beta[j] = 0.0
            return rank
        rank += 1
        alpha = -norm if head > 0.0 else norm
        # reflector v = (1, a[k+1:]/(head - alpha)), H = 1 - beta v v^T
        scale = 1.0 / (head - alpha)
        turn = (alpha - head) / alpha
        beta[k] = turn
        a[k, k] = alpha
        for n in range(count):
            a[rows[n], k] *= scale
        for j in range(k + ONE, width, FOUR):
            s0, s1, s2, s3 = a[k, j], a[k, j + ONE], a[k, j + TWO], a[k, j + THREE]
            for n in range(count):
                i = rows[n]
                v = a[i, k]
                s0 += v * a[i, j]
                s1 += v * a[i, j + ONE]
                s2 += v * a[i, j + TWO]
                s3 += v * a[i, j + THREE]
            s0, s1, s2, s3 = turn * s0, turn * s1, turn * s2, turn * s3
            a[k, j], a[k, j + ONE], a[k, j + TWO], a[k, j + THREE] = (
                a[k, j] - s0, a[k, j + ONE] - s1, a[k, j + TWO] - s2, a[k, j + THREE] - s3
            )  # fmt: skip
            for n in range(count):
                i = rows[n]
                v = a[i, k]
                # all four are read before the first is written, so that none has to wait for another
                a[i, j], a[i, j + ONE], a[i, j + TWO], a[i, j + THREE] = (
                    a[i, j] - s0 * v, a[i, j + ONE] - s1 * v, a[i, j + TWO] - s2 * v, a[i, j + THREE] - s3 * v
                )  # fmt: skip
        # what is left of a column's length: taken off, and looked at again where that would lose digits
        for j in range(k + ONE, p):
            left[j] -= a[k, j] * a[k, j]
            if not left[j] > DIGITS_LEFT * known[j]:
                left[j] = 0.0
                for i in range(k + ONE, m):
                    left[j] += a[i, j] * a[i, j]
                known[j] = left[j]
    return rank


@borrowing
def solve_beside(a, p, rank):  # type: ignore[no-untyped-def]
    """Least squares for all right-hand sides that were factored along, each in its column of ``a``.

    Row k becomes the solution's entry ``perm[k]``, for k < p; entries beyond the rank are zero.
    """
    for row in range(rank, p):
        for j in range(p, a.shape[1]):
            a[row, j] = 0.0
    high = np.uint64(rank)
    for j in range(np.uint64(p), np.uint64(a.shape[1] - SPARE), FOUR):
        for n in range(high):
            k = high - ONE - n
            s0, s1, s2, s3 = a[k, j], a[k, j + ONE], a[k, j + TWO], a[k, j + THREE]
            for i in range(k + ONE, high):
                v = a[k, i]
                s0 -= v * a[i, j]
                s1 -= v * a[i, j + ONE]
                s2 -= v * a[i, j + TWO]
                s3 -= v * a[i, j + THREE]
            v = a[k, k]
            a[k, j], a[k, j + ONE], a[k, j + TWO], a[k, j + THREE] = s0 / v, s1 / v, s2 / v, s3 / v


class Elimination(NamedTuple):
    """Room for `eliminate`."""

    a: FloatArray
    """``(p, columns)``"""
    swaps: np.ndarray
    """``(p,)`` with which row each was exchanged"""


def room_to_eliminate(rows: int, beside: int = 0) -> Elimination:
    """A square matrix with *beside* right-hand sides, for `solve_beside`."""
    return Elimination(np.zeros((rows, rows + beside + SPARE)), np.zeros(rows, dtype=np.int64))


@borrowing
def eliminate(room, first, end, high, width, mean):  # type: ignore[no-untyped-def]
    """Eliminate columns *first* to *end* - 1, pivots from the same rows, up to row *high* and column *width*.

    Multipliers take the place of what is eliminated. Returns the determinant of these rows and columns: its sign
    (whether it is negative), and its size over ``mean^(end - first)``, which is -1 for zero; then nothing else holds.
    """
    a, swaps = room.a, room.swaps
    negative, volume = False, 1.0
    last, low, wide = np.uint64(end), np.uint64(high), np.uint64(width)
    for k in range(np.uint64(first), last):
        pivot = k
        for i in range(k + ONE, last):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        swaps[k] = pivot
        if pivot != k:
            negative = not negative
            for j in range(wide):
                a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
        head = a[k, k]
        if not abs(head) > 0.0:
            return False, -1.0
        negative ^= head < 0.0
        volume *= abs(head) / mean
        for i in range(k + ONE, low):
            scale = a[i, k] / head
            if scale != 0.0:
                a[i, k] = scale
                for j in range(k + ONE, wide):
                    a[i, j] -= scale * a[k, j]
    return negative, volume


@borrowing
def solve_eliminated(room, x):  # type: ignore[no-untyped-def]
    """Solve for one more right-hand side ``(p,)``, which the solution takes the place of."""
    a, swaps = room.a, room.swaps
    p = x.shape[0]
    for k in range(p):
        x[k], x[swaps[k]] = x[swaps[k]], x[k]
    for i in range(p):
        for k in range(i):
            x[i] -= a[i, k] * x[k]
    for i in range(p - 1, -1, -1):
        s = x[i]
        for k in range(i + 1, p):
            s -= a[i, k] * x[k]
        x[i] = s / a[i, i]


@borrowing
def solve(a, beta, perm, rank, rhs, x):  # type: ignore[no-untyped-def]
    """Least squares ``min |A x - rhs|``; returns the residual norm. ``rhs (m,)`` is overwritten by Q^T rhs.

    The factor stands in the first columns of *a*; further ones, factored along, are not looked at.
    """
    m, p = rhs.shape[0], perm.shape[0]
    for k in range(rank):
        s = rhs[k]
        for i in range(k + 1, m):
            s += a[i, k] * rhs[i]
        s *= beta[k]
        rhs[k] -= s
        for i in range(k + 1, m):
            rhs[i] -= s * a[i, k]
    for j in range(p):
        x[j] = 0.0
    for k in range(rank - 1, -1, -1):
        s = rhs[k]
        for j in range(k + 1, rank):
            s -= a[k, j] * x[perm[j]]
        x[perm[k]] = s / a[k, k]
    residual = 0.0
    for i in range(rank, m):
        residual += rhs[i] * rhs[i]
    return math.sqrt(residual)


@borrowing
def solve_transposed(a, beta, perm, rank, rhs, y):  # type: ignore[no-untyped-def]
    """Least-norm ``y (m,)`` with A^T y = rhs ``(p,)``."""
    m, r = np.uint64(y.shape[0]), np.uint64(rank)
    for i in range(r):
        y[i] = rhs[perm[i]]
    for i in range(r, m):
        y[i] = 0.0
    for i in range(r):
        y[i] /= a[i, i]
        for j in range(i + ONE, r):
            y[j] -= a[i, j] * y[i]
    for n in range(r):
        k = r - ONE - n
        s = y[k]
        for i in range(k + ONE, m):
            s += a[i, k] * y[i]
        s *= beta[k]
        y[k] -= s
        for i in range(k + ONE, m):
            y[i] -= s * a[i, k]


def least_squares(matrix: np.ndarray, rhs: np.ndarray) -> tuple[np.ndarray, int, float]:
    """Solve one system with the compiled routines: solution, rank and residual norm (for tests and set-up)."""
    a, beta, perm, lengths = room_to_factor(*matrix.shape)
    a[: len(matrix), :-SPARE] = matrix
    rank, x = factor(a, beta, perm, lengths), np.zeros(len(perm))
    residual = solve(a, beta, perm, rank, np.array(rhs, dtype=np.float64), x)
    return x, int(rank), float(residual)
