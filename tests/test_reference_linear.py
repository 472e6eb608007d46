"""Rank-revealing least squares against NumPy's singular value decomposition, on matrices that lack rank."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.reference.kernels import keep_if_better
from workbench.reference.linear import (
    Elimination,
    eliminate,
    factor,
    least_squares,
    room_to_eliminate,
    room_to_factor,
    solve_beside,
    solve_eliminated,
    solve_transposed,
)
from workbench.reference.many import Many, factor_many, room_for_many, solve_many, solve_transposed_many

TOLERANCE = 1e-11  # rounding of a factor with condition number up to about 100

shapes = st.tuples(st.integers(1, 14), st.integers(1, 12), st.integers(0, 12), st.integers(0, 2**32 - 1))


def matrix_of_rank(rows: int, columns: int, rank: int, rng: np.random.Generator) -> np.ndarray:
    """Singular values between 1 and 10, of any scale between a thousandth and a thousand."""
    left = np.linalg.qr(rng.normal(size=(rows, rows)))[0][:, :rank]
    right = np.linalg.qr(rng.normal(size=(columns, columns)))[0][:, :rank]
    return 10.0 ** rng.uniform(-3, 3) * (left * rng.uniform(1.0, 10.0, rank)) @ right.T


def least_norm(matrix: np.ndarray, rhs: np.ndarray) -> tuple[np.ndarray, int]:
    """y with A^T y = rhs by the compiled routines, and the rank."""
    a, beta, perm, lengths = room_to_factor(*matrix.shape)
    a[: len(matrix), : matrix.shape[1]] = matrix
    rank = factor(a, beta, perm, lengths)
    y = np.full(len(matrix), np.nan)
    solve_transposed(a, beta, perm, rank, rhs, y)
    return y, rank


@given(shapes)
def test_solution_rank_and_residual(shape: tuple[int, int, int, int]) -> None:
    rows, columns, rank, seed = shape
    rank = min(rank, rows, columns)
    rng = np.random.default_rng(seed)
    a, b = matrix_of_rank(rows, columns, rank, rng), rng.normal(size=rows)
    x, found, residual = least_squares(a, b)
    best = np.linalg.pinv(a, rcond=1e-8) @ b
    scale = max(1.0, float(np.abs(best).max()))
    assert found == rank
    # a basic solution: the same residual as the least-norm one, at most `rank` entries that are not zero
    assert np.abs(a @ x - a @ best).max() <= TOLERANCE
    assert residual == pytest.approx(np.linalg.norm(a @ best - b), abs=TOLERANCE)
    assert np.count_nonzero(x) <= rank
    if rank == columns:
        assert np.abs(x - best).max() <= TOLERANCE * scale


@given(shapes)
def test_transposed_solution_is_the_least_norm_one(shape: tuple[int, int, int, int]) -> None:
    rows, columns, rank, seed = shape
    rank = min(rank, rows, columns)
    rng = np.random.default_rng(seed)
    a = matrix_of_rank(rows, columns, rank, rng)
    rhs = a.T @ rng.normal(size=rows)  # consistent, as forces along the constraints are
    y, found = least_norm(a, rhs)
    best = np.linalg.pinv(a.T, rcond=1e-8) @ rhs
    assert found == rank
    assert np.abs(y - best).max() <= TOLERANCE * max(1.0, float(np.abs(best).max()))


@given(shapes, st.integers(1, 6))
def test_right_hand_sides_factored_along_are_solved_as_one_by_one(shape: tuple[int, int, int, int], count: int) -> None:
    rows, columns, rank, seed = shape
    rank = min(rank, rows, columns)
    rng = np.random.default_rng(seed)
    matrix, sides = matrix_of_rank(rows, columns, rank, rng), rng.normal(size=(rows, count))
    a, beta, perm, lengths = room_to_factor(rows, columns, count)
    a[:rows, :columns], a[:rows, columns : columns + count] = matrix, sides
    found = factor(a, beta, perm, lengths)
    solve_beside(a, columns, found)
    x = np.zeros((columns, count))
    x[perm] = a[:columns, columns : columns + count]
    alone = np.transpose([least_squares(matrix, side)[0] for side in sides.T])
    scale = max(1.0, float(np.abs(alone).max()))
    assert found == rank
    assert np.abs(x - alone).max() <= TOLERANCE * scale
    assert np.abs(matrix.T @ (matrix @ x - sides)).max() <= TOLERANCE * max(1.0, np.abs(matrix).max()) * 100
    assert not a[:, columns + count :].any()  # what fills up the fours stays zero


@given(st.integers(0, 2**32 - 1))
def test_residual_is_orthogonal_to_every_column(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = matrix_of_rank(12, 7, 4, rng), rng.normal(size=12)
    x, _, _ = least_squares(a, b)
    assert np.abs(a.T @ (a @ x - b)).max() <= TOLERANCE * np.abs(a).max() * 100


@given(st.integers(0, 2**32 - 1))
def test_a_solution_moved_by_a_millionth_is_noticed(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = matrix_of_rank(9, 5, 5, rng), rng.normal(size=9)
    x, _, residual = least_squares(a, b)
    moved = x.copy()
    moved[int(np.argmax(np.abs(x)))] *= 1.0 + 1e-6
    assert np.abs(a @ moved - a @ (np.linalg.pinv(a) @ b)).max() > 10 * TOLERANCE
    assert np.linalg.norm(a @ moved - b) > residual * (1 - 1e-15)


@given(st.integers(0, 2**32 - 1))
def test_rank_is_judged_against_the_largest_column(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a = matrix_of_rank(8, 4, 4, rng)
    for disturbance, rank in ((1e-14, 4), (1e-7, 5)):
        extra = a @ rng.uniform(0.5, 1.0, 4) + disturbance * np.abs(a).max() * rng.normal(size=8)
        assert least_squares(np.column_stack([a, extra]), np.ones(8))[1] == rank


def test_repeated_rows_and_columns_change_no_residual() -> None:
    rng = np.random.default_rng(5)
    a, b = matrix_of_rank(6, 4, 4, rng), rng.normal(size=6)
    x, _, _ = least_squares(a, b)
    doubled, rank, _ = least_squares(np.vstack([a, a]), np.concatenate([b, b]))
    assert rank == 4
    assert np.abs(doubled - x).max() <= TOLERANCE * max(1.0, np.abs(x).max())
    twice, rank, _ = least_squares(np.hstack([a, a]), b)
    assert rank == 4
    assert np.abs(twice[:4] + twice[4:] - x).max() <= TOLERANCE * max(1.0, np.abs(x).max())


def test_a_zero_matrix_has_rank_zero_and_a_zero_solution() -> None:
    x, rank, residual = least_squares(np.zeros((3, 2)), np.array([3.0, 0.0, 4.0]))
    assert rank == 0
    assert np.array_equal(x, np.zeros(2))
    assert residual == pytest.approx(5.0)


def test_arguments_are_left_as_they_were() -> None:
    a, b = np.arange(6.0).reshape(3, 2), np.ones(3)
    before = a.copy(), b.copy()
    least_squares(a, b)
    assert np.array_equal(a, before[0])
    assert np.array_equal(b, before[1])


def test_not_a_number_is_no_rank() -> None:
    assert least_squares(np.array([[np.nan]]), np.ones(1))[1] == 0
    mixed = np.array([[1.0, np.nan], [0.0, 1.0]])
    x, rank, _ = least_squares(mixed, np.ones(2))
    assert rank < 2 or np.isnan(x).any()


@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_residual_that_is_no_number_closes_nothing(place: int) -> None:
    """NaN compares as false with everything; a closure step must neither keep such a pose nor go on from it."""
    limits = (1e-13, 1e-15, 1e3, False)
    residual, kept, best = np.full(3, 1e-14), np.full(2, 7.0), np.array([np.inf])
    residual[place] = np.nan
    again, closed = keep_if_better(residual, limits, np.array([1.0, 2.0]), kept, best, 0)
    assert (again, closed, best[0], kept.tolist()) == (False, False, np.inf, [7.0, 7.0])
    # the twin: the same without it is kept, closed, and gets one more step
    residual[place] = 1e-14
    again, closed = keep_if_better(residual, limits, np.array([1.0, 2.0]), kept, best, 0)
    assert (again, closed, best[0], kept.tolist()) == (True, True, 1e-14, [1.0, 2.0])


def eliminated(matrix: np.ndarray, rhs: np.ndarray, sizes: tuple[int, ...]) -> tuple[Elimination, float]:
    """All blocks eliminated with a right-hand side along; and the product of their determinants."""
    p = len(matrix)
    room, product = room_to_eliminate(p, 1), 1.0
    room.a[:, :p], room.a[:, p] = matrix, rhs
    for end, size in zip(np.cumsum(sizes), sizes, strict=True):
        negative, volume = eliminate(room, end - size, end, p, p + 1, 1.0)
        product *= -volume if negative else volume
    return room, product


@given(st.lists(st.integers(1, 5), min_size=1, max_size=3).map(tuple), st.integers(0, 2**32 - 1))
def test_elimination_solves_block_by_block_in_any_order(sizes: tuple[int, ...], seed: int) -> None:
    """Blocks see those before them; pivots stay in their block, wherever it stands."""
    rng = np.random.default_rng(seed)
    p, ends = sum(sizes), np.cumsum(sizes)
    matrix = rng.normal(size=(p, p))
    for end, size in zip(ends, sizes, strict=True):
        block = slice(end - size, end)
        matrix[block, end:] = 0.0
        matrix[block, block] += 5.0 * np.eye(size)
    moved = rng.permutation(len(sizes))
    order = np.concatenate([np.arange(ends[k] - sizes[k], ends[k]) for k in moved])
    matrix = matrix[np.ix_(order, order)]
    first, second = rng.normal(size=(2, p))
    room, product = eliminated(matrix, first, tuple(sizes[k] for k in moved))
    assert product == pytest.approx(np.linalg.det(matrix), rel=1e-9)
    again = second.copy()
    solve_eliminated(room, again)
    np.testing.assert_allclose(matrix @ again, second, atol=1e-9)
    solve_beside(room.a, p, p)
    np.testing.assert_allclose(matrix @ room.a[:, p], first, atol=1e-9)
    flat = matrix.copy()
    flat[:, 0] = 0.0
    assert eliminate(Elimination(flat, room.swaps), 0, sizes[moved[0]], p, p, 1.0) == (False, -1.0)


def side_by_side(matrices: np.ndarray, rhs: np.ndarray) -> Many:
    lanes, rows, columns = matrices.shape
    room = room_for_many(rows, columns, lanes)
    room.a[:] = np.concatenate([matrices, rhs[:, :, None]], axis=2).reshape(lanes, -1).T
    return room


@pytest.mark.parametrize("lanes", [1, 7, 32])
def test_many_systems_are_solved_as_each_by_itself(lanes: int) -> None:
    rng = np.random.default_rng(lanes)
    rows, columns = 9, 6
    matrices = matrix_of_rank(rows, columns, columns, rng) + 1e-7 * rng.normal(size=(lanes, rows, columns))
    rhs, wanted = rng.normal(size=(lanes, rows)), rng.normal(size=(lanes, columns))
    room = side_by_side(matrices, rhs)
    assert factor_many(rows, room)
    ends = abs(room.a[0] / room.a[columns * columns + columns - 2])
    solve_many(room)
    solutions = room.x[:columns].copy()
    room.x[:columns] = wanted[:, room.order].T
    solve_transposed_many(rows, room)
    for n in range(lanes):
        a, beta, perm, lengths = room_to_factor(rows, columns)
        a[:, :columns] = matrices[n]
        assert factor(a, beta, perm, lengths) == columns
        assert perm.tolist() == room.order.tolist()
        assert ends[n] == pytest.approx(abs(a[0, 0] / a[columns - 1, columns - 1]), rel=1e-9)
        np.testing.assert_allclose(solutions[:, n], np.linalg.lstsq(matrices[n], rhs[n])[0][room.order], rtol=1e-8)
        np.testing.assert_allclose(room.x[:, n], np.linalg.pinv(matrices[n].T) @ wanted[n], rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("odd", ["another order", "less rank", "no number"])
def test_systems_that_do_not_go_together_are_not_solved_together(odd: str) -> None:
    rng = np.random.default_rng(4)
    matrices = np.repeat(rng.normal(size=(1, 8, 5)), 6, axis=0)
    rhs = rng.normal(size=(6, 8))
    assert factor_many(8, side_by_side(matrices, rhs))
    longest = int(np.argmax(np.linalg.norm(matrices[0], axis=0)))
    if odd == "another order":
        matrices[3, :, (longest + 1) % 5] *= 100.0
    elif odd == "less rank":
        matrices[3, :, (longest + 1) % 5] = 0.0
    else:
        matrices[3, 2, longest] = np.nan
    assert not factor_many(8, side_by_side(matrices, rhs))
