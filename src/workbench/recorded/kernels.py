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
def _triangular(a: FloatArray, rows: int, columns: int, work: FloatArray) -> None:
    """Householder: the first *columns* columns of ``a[:rows]`` become upper triangular, in place; *work* is a row."""
    width = a.shape[1]
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
            work[k] = lead * a[j, k]
        for i in range(j + 1, rows):
            if a[i, j] != 0.0:
                for k in range(j + 1, width):
                    work[k] += a[i, j] * a[i, k]
        scale = 2.0 / below
        for k in range(j + 1, width):
            work[k] *= scale
            a[j, k] -= work[k] * lead
        for i in range(j + 1, rows):
            if a[i, j] != 0.0:
                for k in range(j + 1, width):
                    a[i, k] -= work[k] * a[i, j]
                a[i, j] = 0.0
        a[j, j] = alpha


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
    drive: FloatArray,
    rho: float,
    factors: FloatArray,
    rhs: FloatArray,
    keep: bool,
) -> FloatArray:
    """Triangularise all rows; returns (residual sum of squares, log determinant) of the unit-variance problem.

    Each column of *y* ``(n, c)`` is a record of its own; the sum of squares is the first's. *drive* ``(n - 1, m)`` is
    what each step adds to the state beside its noise. Where *keep* is true, *factors* ``(n, m, 2 m)`` takes
    ``[R_kk, R_k,k+1]`` of each sample, and *rhs* ``(n, m, c)`` the right-hand sides.
    """
    n, many = y.shape
    m = len(white)
    a = np.zeros((2 * m, 2 * m + many))
    info = np.zeros((m + 1, m + many))
    w, wf = np.zeros((m, m)), np.zeros((m, m))
    work = np.empty(2 * m + many)
    rss, logdet, last = 0.0, 0.0, -1.0
    for k in range(n):
        for j in range(m):
            info[m, j] = 0.0
        info[m, 0] = 1.0
        for c in range(many):
            info[m, m + c] = y[k, c]
        _triangular(info, m + 1, m, work)
        rss += info[m, m] * info[m, m]
        if k == n - 1:
            break
        if dt[k] != last:
            last = dt[k]
            _step_rows(white, transition, last, rho, w, wf)
        for i in range(m):
            driven = 0.0
            for j in range(m):
                a[i, j] = -wf[i, j]
                a[i, m + j] = w[i, j]
                a[m + i, j] = info[i, j]
                a[m + i, m + j] = 0.0
                driven += w[i, j] * drive[k, j]
            for c in range(many):
                a[i, 2 * m + c] = driven
                a[m + i, 2 * m + c] = info[i, m + c]
            logdet -= np.log(abs(w[i, i]))
        _triangular(a, 2 * m, 2 * m, work)
        for i in range(m):
            logdet += np.log(abs(a[i, i]))
            for j in range(m):
                info[i, j] = a[m + i, m + j]
            for c in range(many):
                info[i, m + c] = a[m + i, 2 * m + c]
            if keep:
                for j in range(2 * m):
                    factors[k, i, j] = a[i, j]
                for c in range(many):
                    rhs[k, i, c] = a[i, 2 * m + c]
    for i in range(m):
        logdet += np.log(abs(info[i, i]))
        if keep:
            for j in range(m):
                factors[n - 1, i, j] = info[i, j]
            for c in range(many):
                rhs[n - 1, i, c] = info[i, m + c]
    return np.array([rss, logdet])


@compiled
def backward(factors: FloatArray, rhs: FloatArray) -> None:
    """Solve for the states, in place of *rhs* ``(n, m, c)``. Right-hand sides of unit variance give the posterior's."""
    n, m, many = rhs.shape
    for k in range(n - 1, -1, -1):
        for i in range(m - 1, -1, -1):
            if k < n - 1:
                for j in range(m):
                    for c in range(many):
                        rhs[k, i, c] -= factors[k, i, m + j] * rhs[k + 1, j, c]
            for j in range(i + 1, m):
                for c in range(many):
                    rhs[k, i, c] -= factors[k, i, j] * rhs[k, j, c]
            for c in range(many):
                rhs[k, i, c] /= factors[k, i, i]


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
