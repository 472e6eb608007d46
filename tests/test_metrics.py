"""Relative errors, against a second writing in plain Python that looks at one sample after the other."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from workbench.metrics import POINTWISE_FLOOR, JointError, relative_error, relative_errors

SAME = 1e-14


def by_hand(candidate: np.ndarray, reference: np.ndarray, spoil: str = "") -> JointError:
    """The definitions of docs/run-directory.md, without arrays; *spoil* plants a fault, for twins of the test."""
    peak, worst, worst_at, squares, weights, pointwise, skipped = 0.0, 0.0, 0, 0.0, 0.0, 0.0, 0
    for value in reference:
        peak = max(peak, abs(float(value)))
    for index, (one, other) in enumerate(zip(candidate.tolist(), reference.tolist(), strict=True)):
        apart = abs(one - other)
        small = abs(other) < POINTWISE_FLOOR * peak
        if small:
            skipped += 1
        else:
            pointwise = max(pointwise, apart / abs(other))
        if spoil == "floor" and small:
            continue
        if apart > worst:
            worst, worst_at = apart, index
        squares += apart**2
        weights += other**2
    rms = math.sqrt(squares / weights)
    return JointError(worst / peak, rms, pointwise, skipped, peak, worst_at)


def series(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A torque that passes through zero, and a candidate whose largest error lies there."""
    random = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, 200)
    reference = random.uniform(1.0, 50.0) * np.sin(2 * np.pi * t + random.uniform(0, 6))
    candidate = reference + 0.01 * random.normal(size=len(t))
    candidate[int(np.argmin(np.abs(reference)))] += random.uniform(0.5, 1.0)
    return candidate, reference


@pytest.mark.parametrize("seed", range(6))
def test_every_figure_is_that_of_its_definition(seed: int) -> None:
    candidate, reference = series(seed)
    found, expected = relative_error(candidate, reference), by_hand(candidate, reference)
    for name in ("peak_error", "rms_error", "pointwise_error", "peak_reference"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name), rel=SAME), name
    assert found.pointwise_skipped == expected.pointwise_skipped > 0
    assert found.worst_index == expected.worst_index
    # an error near a zero crossing counts in full against the peak, and only there is it left out of the quotient
    spoiled = by_hand(candidate, reference, "floor")
    assert spoiled.peak_error < 0.5 * found.peak_error
    assert spoiled.rms_error < found.rms_error
    assert found.worst_index != spoiled.worst_index


def test_the_floor_itself_is_looked_at() -> None:
    reference = np.array([100.0, 1.0, 0.999])
    off = np.array([0.0, 0.5, 0.5])
    found = relative_error(reference + off, reference)
    assert found.pointwise_error == 0.5
    assert found.pointwise_skipped == 1


@pytest.mark.parametrize("place", [0, 3])
def test_not_a_number_is_no_small_error(place: int) -> None:
    reference = np.array([1.0, -2.0, 3.0, 0.001])
    candidate = reference.copy()
    candidate[place] = np.nan
    found = relative_error(candidate, reference)
    for error in (found.peak_error, found.rms_error):
        assert math.isnan(error)
        assert not error <= 1e6
    assert found.worst_index == place
    assert math.isnan(relative_error(reference, candidate).peak_error)


def test_a_reference_of_zero() -> None:
    zero, off = np.zeros(3), np.array([0.0, 1e-30, 0.0])
    same, other = relative_error(zero, zero), relative_error(off, zero)
    for read in ERRORS:
        assert read(same) == 0.0
        assert read(other) == math.inf
    assert other.worst_index == 1


ERRORS: tuple[Callable[[JointError], float], ...] = (
    lambda e: e.peak_error,
    lambda e: e.rms_error,
    lambda e: e.pointwise_error,
)


@pytest.mark.parametrize("factor", [-1e-6, 1e-6, 1e6])
def test_errors_are_fractions_of_the_joints_own_force(factor: float) -> None:
    candidate, reference = series(7)
    one, other = relative_error(candidate, reference), relative_error(factor * candidate, factor * reference)
    for read in ERRORS:
        assert read(other) == pytest.approx(read(one), rel=1e-12)


def test_columns_are_judged_as_each_by_itself_bit_for_bit() -> None:
    columns = [series(seed) for seed in range(4)]
    zero, gap = np.zeros(200), columns[0][0].copy()
    gap[7] = np.nan
    columns += [(zero, zero), (columns[1][0], zero), (gap, columns[0][1])]
    candidates, references = (np.column_stack(arrays) for arrays in zip(*columns, strict=True))
    found = relative_errors(candidates, references)
    alone = [relative_error(*column) for column in columns]
    assert list(map(repr, found)) == list(map(repr, alone))
    assert [error.peak_error for error in found[4:6]] == [0.0, math.inf]
    assert math.isnan(found[6].peak_error)
    # a column that took its neighbour's peak would be another
    assert len({error.peak_reference for error in found[:4]}) == 4
