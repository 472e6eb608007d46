"""Task coordinates of a rotation: against SciPy's rotations and finite differences, small and large angles alike."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robots import slope
from workbench.errors import ParameterError
from workbench.reference.task import continuous, quaternions, task_motion, task_of

COORDINATES = ["rx", "ry", "rz", "rx ry", "ry rz", "rz rx", "rx ry rz", "rz ry rx"]
H = 1e-2


def coordinates_of(
    names: str, rotation: Rotation, omega: np.ndarray, alpha: np.ndarray, near: np.ndarray | None = None
):  # type: ignore[no-untyped-def]
    """First-hand: values, rates and second derivatives of rotation coordinates of n orientations."""
    nothing = np.zeros((len(omega), 3))
    return task_motion(task_of(names), (nothing, nothing, nothing), rotation.as_matrix(), omega, alpha, near)


def moving(size: float, rng: np.random.Generator, n: int = 40):  # type: ignore[no-untyped-def]
    """Orientations up to *size* rad from none, turning: R(t) = exp(omega t + alpha t^2/2) R(0) to second order."""
    axis = rng.normal(size=(n, 3))
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    start = Rotation.from_rotvec(axis * size * rng.uniform(0.2, 1.0, (n, 1)))
    omega, alpha = rng.normal(size=(2, n, 3))

    def at(t: float) -> Rotation:
        return Rotation.from_rotvec(omega * t + alpha * t * t / 2) * start

    return at, omega, alpha


@pytest.mark.parametrize("size", [1e-6, 0.3, 1.0, 3.0])
@pytest.mark.parametrize("names", COORDINATES)
def test_rates_and_accelerations_are_derivatives(names: str, size: float) -> None:
    at, omega, alpha = moving(size, np.random.default_rng(len(names)))
    values, rates, rises = coordinates_of(names, at(0.0), omega, alpha)
    # angular velocity of exp(w t + a t^2/2): w + a t + O(t^2), so its rate at 0 is alpha; the values need no more
    first = slope(lambda t: coordinates_of(names, at(t), omega, alpha, values)[0], H)
    assert np.abs(first - rates).max() < 1e-7 * np.abs(rates).max()

    def rate(t: float) -> np.ndarray:
        return slope(lambda s: coordinates_of(names, at(t + s), omega, alpha, values)[0], H)

    assert np.abs(slope(rate, H) - rises).max() < 1e-5 * np.abs(rises).max()
    if size > 1e-3:  # a twin that forgets how the rates' matrix changes
        forgot = coordinates_of(names, at(0.0), alpha, 0 * alpha)[1]
        assert np.abs(forgot - rises).max() > 1e-3 * np.abs(rises).max()


def test_three_rotations_are_the_rotation_vector() -> None:
    at, omega, alpha = moving(3.1, np.random.default_rng(3))
    values = coordinates_of("rx ry rz", at(0.0), omega, alpha)[0]
    assert np.abs(values - at(0.0).as_rotvec()).max() < 1e-13
    # past half a turn SciPy goes on from the other side; near a vector of that length the same one is found again
    beyond = values * (4.5 / np.linalg.norm(values, axis=1))[:, None]
    found = coordinates_of("rx ry rz", Rotation.from_rotvec(beyond), omega, alpha, beyond + 0.1)[0]
    assert np.abs(found - beyond).max() < 1e-13
    assert np.abs(Rotation.from_rotvec(beyond).as_rotvec() - beyond).max() > 1.0


@pytest.mark.parametrize("axis", range(3))
def test_one_rotation_is_the_angle_about_the_axis_and_goes_on_past_a_turn(axis: int) -> None:
    angle = np.linspace(-9.0, 9.0, 200)
    rotation = Rotation.from_rotvec(angle[:, None] * np.eye(3)[axis])
    task, still = task_of(["rx", "ry", "rz"][axis]), np.zeros((200, 3))
    values = task_motion(task, (still, still, still), rotation.as_matrix(), still, still)[0]
    assert np.abs(values).max() <= np.pi
    joined = continuous(task, values)[:, 0]
    assert np.abs(joined - joined[100] - (angle - angle[100])).max() < 1e-13


def test_what_leans_keeps_the_angle_that_is_left_without_the_lean() -> None:
    rng = np.random.default_rng(5)
    angle, lean = rng.uniform(-3, 3, 50), rng.uniform(-1.2, 1.2, (50, 2))
    turn = Rotation.from_rotvec(angle[:, None] * np.eye(3)[2])
    swing = Rotation.from_rotvec(np.column_stack([lean, np.zeros(50)]))
    still = np.zeros((50, 3))
    for rotation in (swing * turn, turn * swing):
        assert np.abs(coordinates_of("rz", rotation, still, still)[0][:, 0] - angle).max() < 1e-13


def test_quaternions_of_matrices() -> None:
    rotation = Rotation.random(500, random_state=1)
    found = quaternions(rotation.as_matrix())
    assert np.abs(Rotation.from_quat(found[:, [1, 2, 3, 0]]).as_matrix() - rotation.as_matrix()).max() < 1e-14


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["x", "y", "phi"], '"phi" is no coordinate of a platform'),
        (["x", "z", "x"], '"x" is given twice in x z x'),
        ([], "none given"),
    ],
)
def test_names_that_are_none(names: list[str], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        task_of(names)
