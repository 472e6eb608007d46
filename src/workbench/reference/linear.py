"""Rank-revealing least squares for many small systems: Householder QR with column pivoting, compiled.

The loop-closure Jacobian of a parallel mechanism is rank-deficient by nature (redundant rows), so normal equations and
Cholesky factors of J J^T are out of the question. Its passive columns, however, are independent away from singular
poses; with A P = Q R the same factor serves positions, velocities, accelerations and the least-norm multipliers.
"""

from __future__ import annotations

import math

import numpy as np

from workbench.compiled import borrowing

RANK_TOLERANCE = 1e-10
"""A column counts as dependent when its pivot is below this fraction of the largest one."""


DIGITS_LEFT = 1e-3
"""A squared column length that fell below this fraction of what was last summed up is summed up again."""


@borrowing
def factor(a, beta, perm, room):  # type: ignore[no-untyped-def]
    """Factor ``a (m, p)`` in place; returns the rank. Reflectors below the diagonal, R on and above it.

    ``beta (p,)`` receives the reflector scales, ``perm (p,)`` the column order. Where ``a`` has more columns than
    ``perm`` entries, those are right-hand sides b and become Q^T b, for `solved`. ``room (3, columns of a)`` is
    overwritten.
    """
    m, p, width = a.shape[0], perm.shape[0], a.shape[1]
    steps = min(m, p)
    sums, left, known = room[0], room[1], room[2]
    for j in range(p):
        perm[j] = j
        left[j] = 0.0
    # row by row, all columns at a time: the compiler can vectorise it, and rows where a column is zero cost nothing
    for i in range(m):
        for j in range(p):
            left[j] += a[i, j] * a[i, j]
    for j in range(p):
        known[j] = left[j]
    rank = 0
    first = 0.0
    for k in range(steps):
        best, pivot = -1.0, k
        for j in range(k, p):
            if left[j] > best:
                best, pivot = left[j], j
        if pivot != k:
            for i in range(m):
                a[i, k], a[i, pivot] = a[i, pivot], a[i, k]
            perm[k], perm[pivot] = perm[pivot], perm[k]
            left[pivot], known[pivot] = left[k], known[k]
        best = 0.0
        for i in range(k, m):
            best += a[i, k] * a[i, k]
        norm = math.sqrt(best)
        if k == 0:
            first = norm
        if not norm > RANK_TOLERANCE * first:
            for j in range(k, p):
                beta[j] = 0.0
            return rank
        rank += 1
        head = a[k, k]
        alpha = -norm if head > 0.0 else norm
        # reflector v = (1, a[k+1:]/(head - alpha)), H = 1 - beta v v^T
        scale = 1.0 / (head - alpha)
        beta[k] = (alpha - head) / alpha
        a[k, k] = alpha
        for j in range(k + 1, width):
            sums[j] = a[k, j]
        for i in range(k + 1, m):
            a[i, k] *= scale
            v = a[i, k]
            if v != 0.0:
                for j in range(k + 1, width):
                    sums[j] += v * a[i, j]
        for j in range(k + 1, width):
            sums[j] *= beta[k]
            a[k, j] -= sums[j]
        for i in range(k + 1, m):
            v = a[i, k]
            if v != 0.0:
                for j in range(k + 1, width):
                    a[i, j] -= sums[j] * v
        # what is left of a column's length: taken off, and looked at again where that would lose digits
        for j in range(k + 1, p):
            left[j] -= a[k, j] * a[k, j]
            if not left[j] > DIGITS_LEFT * known[j]:
                left[j] = 0.0
                for i in range(k + 1, m):
                    left[j] += a[i, j] * a[i, j]
                known[j] = left[j]
    for j in range(steps, p):
        beta[j] = 0.0
    return rank


@borrowing
def solved(a, perm, rank, column, x):  # type: ignore[no-untyped-def]
    """Least squares for a right-hand side that was factored along, in a column of ``a``; x ``(p,)``."""
    for j in range(perm.shape[0]):
        x[j] = 0.0
    for k in range(rank - 1, -1, -1):
        s = a[k, column]
        for j in range(k + 1, rank):
            s -= a[k, j] * x[perm[j]]
        x[perm[k]] = s / a[k, k]


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
    m = a.shape[0]
    for i in range(m):
        y[i] = 0.0
    for k in range(rank):
        s = rhs[perm[k]]
        for i in range(k):
            s -= a[i, k] * y[i]
        y[k] = s / a[k, k]
    for k in range(rank - 1, -1, -1):
        s = y[k]
        for i in range(k + 1, m):
            s += a[i, k] * y[i]
        s *= beta[k]
        y[k] -= s
        for i in range(k + 1, m):
            y[i] -= s * a[i, k]


def least_squares(matrix: np.ndarray, rhs: np.ndarray) -> tuple[np.ndarray, int, float]:
    """Solve one system with the compiled routines: solution, rank and residual norm (for tests and set-up)."""
    a = np.array(matrix, dtype=np.float64, order="C")
    beta, perm, x = np.zeros(a.shape[1]), np.zeros(a.shape[1], dtype=np.int64), np.zeros(a.shape[1])
    rank = factor(a, beta, perm, np.empty((3, a.shape[1])))
    residual = solve(a, beta, perm, rank, np.array(rhs, dtype=np.float64), x)
    return x, int(rank), float(residual)
