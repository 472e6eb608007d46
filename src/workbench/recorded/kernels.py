"""Square-root information smoother of one coordinate: the smoothing spline as least squares, with its uncertainty.

The coordinate is an m-fold integrated Wiener process seen through noise ([Wahba1983], see docs/recorded.md): between
samples its m-th derivative is white noise of density ``rho``, in units of the measurement's variance. Each sample adds
a row, each step m rows, and orthogonal transformations keep the factor triangular, so that nothing is squared and no
prior is needed. Time is counted in units of the mean step; state k is (q, q', ..., q^(m-1)).
"""

from __future__ import annotations

import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import compiled


@compiled
def _triangular(a: FloatArray, rows: int, columns: int, width: int) -> None:
    """Householder: the first *columns* columns of ``a[:rows, :width]`` become upper triangular, in place."""
    for j in range(columns):
        norm = 0.0
        for i in range(j, rows):
            norm += a[i, j] * a[i, j]
        norm = np.sqrt(norm)
        if norm == 0.0:
            continue
        alpha = -norm if a[j, j] > 0.0 else norm
        lead = a[j, j] - alpha
        below = lead * lead
        for i in range(j + 1, rows):
            below += a[i, j] * a[i, j]
        if below == 0.0:
            continue
        for k in range(j + 1, width):
            total = lead * a[j, k]
            for i in range(j + 1, rows):
                total += a[i, j] * a[i, k]
            total *= 2.0 / below
            a[j, k] -= total * lead
            for i in range(j + 1, rows):
                a[i, k] -= total * a[i, j]
        a[j, j] = alpha
        for i in range(j + 1, rows):
            a[i, j] = 0.0


@compiled
def _step_rows(white: FloatArray, transition: FloatArray, dt: float, rho: float, w: FloatArray, wf: FloatArray) -> None:
    """Rows ``W`` and ``W F`` of a step of length *dt*, from those of a unit step, by scaling."""
    m = len(white)
    root = np.sqrt(rho)
    for i in range(m):
        for j in range(m):
            w[i, j] = white[i, j] * dt ** (-(m - j - 0.5)) / root
    for i in range(m):
        for j in range(m):
            total = 0.0
            for k in range(j + 1):
                total += w[i, k] * transition[k, j] * dt ** (j - k)
            wf[i, j] = total


@compiled
def forward(
    y: FloatArray,
    dt: FloatArray,
    white: FloatArray,
    transition: FloatArray,
    rho: float,
    factors: FloatArray,
    keep: bool,
) -> FloatArray:
    """Triangularise all rows; returns (residual sum of squares, log determinant) of the unit-variance problem.

    *factors* ``(n, m, 2 m + 1)`` takes ``[R_kk, R_k,k+1 | z_k]`` of each sample where *keep* is true.
    """
    n, m = len(y), len(white)
    a = np.zeros((2 * m + 1, 2 * m + 1))
    info = np.zeros((m + 1, m + 1))
    w, wf = np.zeros((m, m)), np.zeros((m, m))
    rss, logdet, last = 0.0, 0.0, -1.0
    for k in range(n):
        for j in range(m + 1):
            info[m, j] = 0.0
        info[m, 0] = 1.0
        info[m, m] = y[k]
        _triangular(info, m + 1, m, m + 1)
        rss += info[m, m] * info[m, m]
        if k == n - 1:
            break
        if dt[k] != last:
            last = dt[k]
            _step_rows(white, transition, last, rho, w, wf)
        for i in range(m):
            for j in range(m):
                a[i, j] = info[i, j]
                a[i, m + j] = 0.0
                a[m + i, j] = -wf[i, j]
                a[m + i, m + j] = w[i, j]
            a[i, 2 * m] = info[i, m]
            a[m + i, 2 * m] = 0.0
            logdet -= np.log(abs(w[i, i]))
        _triangular(a, 2 * m, 2 * m, 2 * m + 1)
        for i in range(m):
            logdet += np.log(abs(a[i, i]))
            for j in range(m):
                info[i, j] = a[m + i, m + j]
            info[i, m] = a[m + i, 2 * m]
            if keep:
                for j in range(2 * m + 1):
                    factors[k, i, j] = a[i, j]
    for i in range(m):
        logdet += np.log(abs(info[i, i]))
        if keep:
            for j in range(m):
                factors[n - 1, i, j] = info[i, j]
            factors[n - 1, i, 2 * m] = info[i, m]
    return np.array([rss, logdet])


@compiled
def backward(factors: FloatArray, noise: FloatArray, states: FloatArray) -> None:
    """Solve for the states ``(n, m)``; *noise* ``(n, m)``, of unit variance, makes them a draw from the posterior."""
    n, m = states.shape
    for k in range(n - 1, -1, -1):
        for i in range(m - 1, -1, -1):
            total = factors[k, i, 2 * m] + noise[k, i]
            if k < n - 1:
                for j in range(m):
                    total -= factors[k, i, m + j] * states[k + 1, j]
            for j in range(i + 1, m):
                total -= factors[k, i, j] * states[k, j]
            states[k, i] = total / factors[k, i, i]


@compiled
def covariances(factors: FloatArray, out: FloatArray) -> None:
    """Covariance of the first three entries of each state, ``(n, 3, 3)``, for measurements of unit variance."""
    n, m, _ = factors.shape
    after, mixed, inverse = np.zeros((m, m)), np.zeros((m, m)), np.zeros((m, m))
    for k in range(n - 1, -1, -1):
        for c in range(m):
            for i in range(m - 1, -1, -1):
                total = 1.0 if i == c else 0.0
                for j in range(i + 1, m):
                    total -= factors[k, i, j] * inverse[j, c]
                inverse[i, c] = total / factors[k, i, i]
        for i in range(m):
            for j in range(m):
                total = 1.0 if i == j else 0.0
                if k < n - 1:
                    for a in range(m):
                        for b in range(m):
                            total += factors[k, i, m + a] * after[a, b] * factors[k, j, m + b]
                mixed[i, j] = total
        for i in range(m):
            for j in range(m):
                total = 0.0
                for a in range(m):
                    for b in range(m):
                        total += inverse[i, a] * mixed[a, b] * inverse[j, b]
                after[i, j] = total
        for i in range(3):
            for j in range(3):
                out[k, i, j] = after[i, j]
