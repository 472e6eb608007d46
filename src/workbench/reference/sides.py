"""On which side of its singular poses a configuration is: signs of determinants of what Newton's method solves for.

A branch of the loop closure is never left without passing a pose in which the Jacobian of the freedoms that are solved
for loses rank, and beyond one its determinant has the other sign. So two configurations on one branch, near each other,
have equal signs, however near another branch comes. Loops that do not act on each other pass such poses each for
itself, and two changes of sign would cancel: the determinant is taken apart into the blocks of its triangular form.

Where rows repeat others there is no determinant. As many rows as freedoms are chosen at home; where these turn over or
are no good measure, the two Jacobians themselves are compared.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import compiled
from workbench.reference.kinds import CONNECT, JOINT, SPIN, TENDON, WELD
from workbench.reference.linear import factor, solved
from workbench.reference.structure import IntArray, Structure

UNKNOWN = -1
"""No side: the Jacobian has not full rank, or the chosen rows are no good measure of it."""

POOR = 0.1
"""Part of the volume that the chosen rows hold, against home, below which they are no good measure of all rows."""

MOST_BITS = 62


class SideTable(NamedTuple):
    """Which determinants are looked at; kernels read it by name."""

    rows: IntArray
    """``(p,)`` chosen rows, block after block"""
    columns: IntArray
    """``(p,)`` velocity addresses, likewise"""
    starts: IntArray
    """``(blocks + 1,)``"""
    least: float
    """part of the volume that chosen rows must hold; zero where all rows are chosen"""


NO_SIDES = SideTable(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(1, dtype=np.int64), 0.0)
"""Nothing is looked at: every configuration is on side 0."""


@compiled
def eliminated(a):  # type: ignore[no-untyped-def]
    """Bring ``a (n, n)`` to triangular form in place; returns whether its determinant is negative, or `UNKNOWN`."""
    negative = 0
    for k in range(a.shape[0]):
        pivot = k
        for i in range(k + 1, a.shape[0]):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        if pivot != k:
            negative = 1 - negative
            for j in range(k, a.shape[0]):
                a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
        if not abs(a[k, k]) > 0.0:
            return UNKNOWN
        if a[k, k] < 0.0:
            negative = 1 - negative
        for i in range(k + 1, a.shape[0]):
            scale = a[i, k] / a[k, k]
            if scale != 0.0:
                for j in range(k + 1, a.shape[0]):
                    a[i, j] -= scale * a[k, j]
    return negative


@compiled
def side_of(jac, factored, rank, table, work):  # type: ignore[no-untyped-def]
    """Side of one sample: a bit for each block, set where its determinant is negative, or `UNKNOWN`.

    ``jac (m, nv)`` are the rows; ``factored (m, p)`` and ``rank`` are what `linear.factor` made of the columns that are
    solved for; ``work (p, p)`` is overwritten.
    """
    rows, columns, starts = table.rows, table.columns, table.starts
    if rank < rows.shape[0]:
        return UNKNOWN
    side, volume = 0, 1.0
    for block in range(starts.shape[0] - 1):
        first, end = starts[block], starts[block + 1]
        a = work[first:end, first:end]
        for i in range(first, end):
            for j in range(first, end):
                work[i, j] = jac[rows[i], columns[j]]
        negative = eliminated(a)
        if negative == UNKNOWN:
            return UNKNOWN
        for k in range(first, end):
            volume *= abs(work[k, k] / factored[k, k])
        side ^= negative << (block % MOST_BITS)
    return side if volume >= table.least else UNKNOWN


@compiled
def turned_over(both, table):  # type: ignore[no-untyped-def]
    """Whether a block turns over between two neighbours; ``both (m, 2 p)``, overwritten, holds their Jacobians.

    Columns are in the order of the table. With ``before T = after`` in least squares T is near one for near neighbours;
    beyond a singular pose, the determinant of a block of it is negative.
    """
    starts, p = table.starts, table.columns.shape[0]
    order, change = np.empty(p, dtype=np.int64), np.empty((p, p))
    rank = factor(both, np.empty(p), order)
    if rank < p:
        return True
    for j in range(p):
        solved(both, order, rank, p + j, change[j])  # the transpose has the same determinants
    for block in range(starts.shape[0] - 1):
        first, end = starts[block], starts[block + 1]
        if eliminated(change[first:end, first:end]) != 0:
            return True
    return False


def side_table(jacobian: FloatArray, pattern: np.ndarray, columns: IntArray) -> SideTable:
    """Choose rows and blocks at home.

    Parameters
    ----------
    jacobian
        ``(m, p)`` of what is solved for, in the home pose.
    pattern
        ``(m, p)`` where it may differ from zero in any pose.
    columns
        ``(p,)`` velocity addresses.
    """
    from scipy.linalg import qr
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching

    m, p = jacobian.shape
    if m < p or not p:
        return NO_SIDES
    chosen = np.arange(m) if m == p else np.sort(qr(jacobian.T, mode="r", pivoting=True)[1][:p])
    square = pattern[chosen]
    # the column that stands for each row on the diagonal of the triangular form
    matched = np.asarray(maximum_bipartite_matching(csr_array(square), perm_type="column"), dtype=np.int64)
    if (matched < 0).any():
        return NO_SIDES
    by_column = np.zeros((p, p), dtype=np.bool_)
    by_column[matched] = square
    count, labels = connected_components(csr_array(by_column), connection="strong")
    order = np.argsort(labels, kind="stable")
    row_of = np.empty(p, dtype=np.int64)
    row_of[matched] = chosen
    table = SideTable(
        row_of[order].astype(np.int64),
        np.asarray(columns, dtype=np.int64)[order],
        np.concatenate([[0], np.cumsum(np.bincount(labels, minlength=count))]).astype(np.int64),
        0.0,
    )
    if m == p:
        return table
    whole, part = 0.5 * np.linalg.slogdet(jacobian.T @ jacobian)[1], np.linalg.slogdet(jacobian[chosen])[1]
    return table._replace(least=POOR * math.exp(part - whole)) if np.isfinite([whole, part]).all() else NO_SIDES


def side_at(jacobian: FloatArray, columns: IntArray, table: SideTable) -> int:
    """Side of one configuration with rows ``(m, nv)``, of which *columns* are solved for."""
    factored = np.ascontiguousarray(jacobian[:, columns])
    p = len(columns)
    rank = factor(factored, np.empty(p), np.empty(p, dtype=np.int64))
    return int(side_of(jacobian, factored, rank, table, np.empty((p, p))))


def pattern_of(structure: Structure, dof_of: IntArray) -> np.ndarray:
    """Where rows of the loop closures ``(m, nv)`` may differ from zero in a closed pose; *dof_of* each joint."""
    pattern = np.zeros((structure.rows, structure.moves.shape[1]), dtype=np.bool_)
    for block, first, end in zip(structure.blocks, structure.block_rows[:-1], structure.block_rows[1:], strict=True):
        kind, one, two, left, right = (int(entry) for entry in block)
        if kind in (CONNECT, WELD):
            # what moves both ends alike does not change their distance
            pattern[first:end] = structure.moves[one] ^ structure.moves[two]
        elif kind == SPIN:
            pattern[first:end] = structure.moves[one]
        else:
            for element in (left, right):
                if element >= 0 and kind == JOINT:
                    pattern[first:end, dof_of[element]] = True
                elif element >= 0 and kind == TENDON:
                    pattern[first:end, dof_of[structure.tendons[element] != 0.0]] = True
    return pattern
