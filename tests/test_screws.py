"""Screws: the group's axioms, each with a twin that breaks it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from workbench.robots import screws

RNG = np.random.default_rng(20161109)
TOLERANCE = 1e-13
TWIN = 1e-3


def random_screws(n: int) -> np.ndarray:
    return RNG.normal(size=(n, 6))


def random_displacement() -> tuple[np.ndarray, np.ndarray]:
    rotation, _ = np.linalg.qr(RNG.normal(size=(3, 3)))
    return rotation * np.sign(np.linalg.det(rotation)), RNG.normal(size=3)


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def test_klein_form_is_symmetric_and_invariant():
    first, second = random_screws(20), random_screws(20)
    rotation, displacement = random_displacement()
    moved = screws.adjoint(rotation, displacement)
    form = screws.klein(first, second)
    np.testing.assert_allclose(screws.klein(second, first), form, atol=TOLERANCE)
    np.testing.assert_allclose(screws.klein(first @ moved.T, second @ moved.T), form, atol=1e-12)
    # the plain scalar product is no invariant
    plain = np.sum((first @ moved.T) * (second @ moved.T), axis=1) - np.sum(first * second, axis=1)
    assert np.abs(plain).max() > TWIN


def test_klein_form_is_invariant_under_a_change_of_pole():
    first, second, shift = random_screws(20), random_screws(20), RNG.normal(size=(20, 3))
    moved = screws.klein(screws.change_pole(first, shift), screws.change_pole(second, shift))
    np.testing.assert_allclose(moved, screws.klein(first, second), atol=1e-12)
    opposite = screws.klein(screws.change_pole(first, shift), screws.change_pole(second, -shift))
    assert np.abs(opposite - screws.klein(first, second)).max() > TWIN


def test_lie_product_is_antisymmetric_and_satisfies_the_jacobi_identity():
    a, b, c = random_screws(20), random_screws(20), random_screws(20)
    bracket = screws.lie_bracket
    np.testing.assert_allclose(bracket(a, b), -bracket(b, a), atol=TOLERANCE)
    jacobi = bracket(a, bracket(b, c)) + bracket(b, bracket(c, a)) + bracket(c, bracket(a, b))
    np.testing.assert_allclose(jacobi, 0.0, atol=1e-12)
    assert np.abs(jacobi - 2 * bracket(c, bracket(a, b))).max() > TWIN


def test_lie_product_is_the_rate_of_a_screw_carried_along():
    generator, carried = random_screws(1)[0], random_screws(1)[0]
    step = 1e-5

    def displaced(time: float) -> np.ndarray:
        matrix = np.zeros((4, 4))
        matrix[:3, :3], matrix[:3, 3] = skew(generator[:3]), generator[3:]
        moved = expm(time * matrix)
        return screws.adjoint(moved[:3, :3], moved[:3, 3]) @ carried

    rate = (displaced(step) - displaced(-step)) / (2 * step)
    np.testing.assert_allclose(rate, screws.lie_bracket(generator, carried), atol=1e-8)
    assert np.abs(rate - screws.lie_bracket(carried, generator)).max() > TWIN


def test_a_line_moves_with_its_body_only_if_its_moment_is_point_cross_axis():
    axis, point = RNG.normal(size=3), RNG.normal(size=3)
    rotation, displacement = random_displacement()
    moved = screws.adjoint(rotation, displacement)
    expected = screws.line(rotation @ axis, rotation @ point + displacement)
    np.testing.assert_allclose(moved @ screws.line(axis, point), expected, atol=TOLERANCE)
    printed = np.concatenate([axis, np.cross(axis, point)])  # u x A
    printed_moved = np.concatenate([rotation @ axis, np.cross(rotation @ axis, rotation @ point + displacement)])
    assert np.abs(moved @ printed - printed_moved).max() > TWIN


def test_a_line_gives_the_velocity_of_a_turning_body():
    axis, point, other = RNG.normal(size=3), RNG.normal(size=3), RNG.normal(size=3)
    about_other = screws.change_pole(screws.line(axis, point), other)
    np.testing.assert_allclose(about_other[3:], np.cross(axis, other - point), atol=TOLERANCE)
    assert np.abs(about_other[3:] - np.cross(axis, point - other)).max() > TWIN


def test_change_of_pole_equals_moving_the_frame():
    screw, shift = random_screws(1)[0], RNG.normal(size=3)
    np.testing.assert_allclose(
        screws.change_pole(screw, shift), screws.adjoint(np.eye(3), -shift) @ screw, atol=TOLERANCE
    )


@pytest.mark.parametrize(("first", "second", "common"), [(3, 4, 1), (4, 4, 2), (2, 3, 0), (6, 2, 2)])
def test_dimension_of_intersections(first: int, second: int, common: int):
    one, two = screws.span(random_screws(first)), screws.span(random_screws(second))
    found = screws.intersection(one, two)
    assert found.shape == (6, common)
    np.testing.assert_allclose(one @ (one.T @ found), found, atol=1e-9)
    np.testing.assert_allclose(two @ (two.T @ found), found, atol=1e-9)


def test_span_counts_independent_screws():
    basis = random_screws(3)
    assert screws.span(np.vstack([basis, basis @ np.eye(6), basis.sum(axis=0)])).shape == (6, 3)


def test_many_displacements_at_once_are_each_by_itself():
    each = [random_displacement() for _ in range(6)]
    rotations, displacements = (np.array(part).reshape(2, 3, *part[0].shape) for part in zip(*each, strict=True))
    together = screws.adjoint(rotations, displacements).reshape(6, 6, 6)
    np.testing.assert_array_equal(together, [screws.adjoint(*one) for one in each])
