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
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import borrowing
from workbench.reference.kinds import CONNECT, JOINT, SPIN, TENDON, WELD
from workbench.reference.linear import eliminate, factor, room_to_eliminate, room_to_factor
from workbench.reference.structure import IntArray, Structure

UNKNOWN = -1
"""No side: the Jacobian has not full rank, or the chosen rows are no good measure of it."""

POOR = 0.01
"""Of a block's determinant at home, below which the chosen rows are no good measure of all rows (or the pose is almost
singular)."""

MOST_BITS = 62


class SideTable(NamedTuple):
    """Which determinants are looked at; kernels read it by name."""

    rows: IntArray
    """``(p,)`` chosen rows, block after block"""
    columns: IntArray
    """``(p,)`` velocity addresses, likewise"""
    starts: IntArray
    """``(blocks + 1,)``"""
    sizes: FloatArray
    """``(blocks,)`` the mean size of pivots at home"""
    least: FloatArray
    """``(blocks,)`` part of the determinant at home that must be left; zero where all rows are chosen"""
    group_starts: IntArray
    """``(blocks + 1,)``"""
    group_rows: IntArray
    """``(m,)`` all rows of the closures of each block, chosen or not, block after block"""


_NONE = np.zeros(0, dtype=np.int64)
NO_SIDES = SideTable(
    _NONE, _NONE, np.zeros(1, dtype=np.int64), np.zeros(0), np.zeros(0), np.zeros(1, dtype=np.int64), _NONE
)
"""Nothing is looked at: every configuration is on side 0."""


@borrowing
def side_of(jac, rank, table, room):  # type: ignore[no-untyped-def]
    """Side of one sample: a bit for each block, set where its determinant is negative, or `UNKNOWN`.

    ``jac (m, nv)`` are the rows, ``rank`` that of the columns that are solved for; ``room`` is that of
    `workbench.reference.linear.room_to_eliminate`.
    """
    rows, columns = table.rows, table.columns
    if rank < rows.shape[0]:
        return UNKNOWN
    for i in range(rows.shape[0]):
        for j in range(columns.shape[0]):
            room.a[i, j] = jac[rows[i], columns[j]]
    return eliminate_chosen(table, room, columns.shape[0])[0]


@borrowing
def eliminate_chosen(table, room, width):  # type: ignore[no-untyped-def]
    """Eliminate the chosen rows, which stand in *room* with all up to column *width*: side, and how good they are.

    The latter is the least determinant of a block as a part of that at home. Entries outside of the blocks do not
    change a block's pivots, however blocks follow each other: what leads from a block to others never leads back.
    """
    starts, side, poorest = table.starts, 0, math.inf
    for block in range(starts.shape[0] - 1):
        negative, volume = eliminate(
            room, starts[block], starts[block + 1], table.rows.shape[0], width, table.sizes[block]
        )
        poorest = min(poorest, volume)
        if volume < table.least[block]:
            side = UNKNOWN
        if volume < 0.0:
            return UNKNOWN, volume
        if negative and side != UNKNOWN:
            side ^= 1 << (block % MOST_BITS)
    return side, poorest


@borrowing
def same_side(before, after, table, room, same):  # type: ignore[no-untyped-def]
    """Fill ``same (k,)``: which of these rows ``(k, m, nv)`` of neighbours are turned over in no block.

    With ``A T = B`` in least squares, A a block before and B after, T is near one for near neighbours; its determinant
    has the sign of that of ``A^T B``, and is negative beyond a singular pose.
    """
    rows, columns = table.group_rows, table.columns
    for s in range(before.shape[0]):
        same[s] = True
        for block in range(table.starts.shape[0] - 1):
            first, size = table.starts[block], table.starts[block + 1] - table.starts[block]
            mean = 1e-300
            for i in range(size):
                for j in range(size):
                    value = 0.0
                    for r in range(table.group_starts[block], table.group_starts[block + 1]):
                        value += before[s, rows[r], columns[first + i]] * after[s, rows[r], columns[first + j]]
                    room.a[i, j] = value
                    mean = max(mean, abs(value))
            negative, volume = eliminate(room, 0, size, size, size, mean)
            same[s] &= volume >= 0.0 and not negative


def side_table(jacobian: FloatArray, pattern: np.ndarray, group: IntArray, columns: IntArray) -> SideTable:
    """Choose rows and blocks at home.

    Parameters
    ----------
    jacobian
        ``(m, p)`` of what is solved for, in the home pose.
    pattern
        ``(m, p)`` where it may differ from zero in any pose.
    group
        ``(m,)`` the closure that each row belongs to; rows of one closure stay in one block.
    columns
        ``(p,)`` velocity addresses.
    """
    from scipy.linalg.lapack import dgeqp3

    m, p = jacobian.shape
    if m < p or not p or np.linalg.matrix_rank(jacobian) < p:
        return NO_SIDES
    chosen = np.arange(m) if m == p else np.sort(dgeqp3(jacobian.T)[1][:p] - 1)
    blocks = _blocks(pattern.tobytes(), pattern.shape[1], tuple(group.tolist()), tuple(chosen.tolist()))
    if not blocks:
        return NO_SIDES
    rows, places, group_rows = ([block[k] for block in blocks] for k in range(3))
    sizes = [float(np.exp(np.linalg.slogdet(jacobian[np.ix_(own, mine)])[1] / len(mine))) for own, mine, _ in blocks]
    return SideTable(
        np.concatenate(rows).astype(np.int64),  # pivots of LAPACK are shorter, and another type for the kernels
        np.asarray(columns, dtype=np.int64)[np.concatenate(places)],
        _starts(rows),
        np.array(sizes),
        np.array([POOR if len(whole) > len(own) else 0.0 for own, _, whole in blocks]),
        _starts(group_rows),
        np.concatenate(group_rows),
    )


@lru_cache(maxsize=64)
def _blocks(
    pattern: bytes, columns: int, group: tuple[int, ...], chosen: tuple[int, ...]
) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], ...]:
    """Blocks of the triangular form of the *chosen* rows: rows, columns, and all rows of the closures in it.

    They follow from where entries may differ from zero alone, and many variants of a mechanism have the same. Empty
    where the form has a zero on its diagonal.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components, maximum_bipartite_matching

    entries = np.frombuffer(pattern, dtype=np.bool_).reshape(-1, columns)
    groups, rows = np.array(group, dtype=np.int64), np.array(chosen, dtype=np.int64)
    square = entries[rows]
    # the column that stands for each row on the diagonal of the triangular form
    matched = np.asarray(maximum_bipartite_matching(csr_array(square), perm_type="column"), dtype=np.int64)
    if (matched < 0).any():
        return ()
    depends = np.zeros((columns, columns), dtype=np.bool_)
    depends[matched] = square
    for one in np.unique(groups[rows]):
        together = matched[groups[rows] == one]
        depends[np.ix_(together, together)] = True
    count, labels = connected_components(csr_array(depends), connection="strong")
    found = []
    for block in range(count):
        mine = np.flatnonzero(labels == block)
        own = rows[np.isin(matched, mine)]
        found.append((own, mine, np.flatnonzero(np.isin(groups, groups[own]))))
    return tuple(found)


def _starts(parts: list[np.ndarray]) -> IntArray:
    return np.concatenate([[0], np.cumsum([len(part) for part in parts])]).astype(np.int64)


def side_at(jacobian: FloatArray, columns: IntArray, table: SideTable) -> int:
    """Side of one configuration with rows ``(m, nv)``, of which *columns* are solved for."""
    p = len(columns)
    a, *room = room_to_factor(len(jacobian), p)
    a[: len(jacobian), :p] = jacobian[:, columns]
    rank = factor(a, *room)
    return int(side_of(jacobian, rank, table, room_to_eliminate(p)))


def pattern_of(structure: Structure, dof_of: IntArray) -> tuple[np.ndarray, IntArray]:
    """Where rows of the loop closures ``(m, nv)`` may differ from zero in a closed pose, and closures ``(m,)`` of rows.

    ``dof_of (njnt,)`` is the velocity address of each joint.
    """
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
    return pattern, np.repeat(np.arange(len(structure.blocks)), np.diff(structure.block_rows)).astype(np.int64)
