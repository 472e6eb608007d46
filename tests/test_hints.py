"""Hints: every familiar shape is recognised on random torques; right formulas and ordinary errors have none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from workbench.hints import hint_of

T = np.linspace(0.0, 2.0, 401)
JOINTS = ("q1", "q2", "q3")


def torques(seed: int, columns: int = 3) -> Callable[[np.ndarray], np.ndarray]:
    """Random smooth torques of unlike sizes, with a mean, as a function of time."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-1, 2, columns)
    waves = rng.normal(size=(4, columns)), rng.uniform(1, 12, (4, columns)), rng.uniform(0, 6, (4, columns))
    mean = rng.normal(size=columns)

    def at(t: np.ndarray) -> np.ndarray:
        a, w, p = waves
        return np.asarray(size * (mean + np.sum(a * np.sin(w * t[:, None, None] + p), axis=1)))

    return at


SHAPES: dict[str, tuple[Callable[[Callable], np.ndarray], str]] = {
    "N mm": (lambda f: 1e3 * f(T), "q1, q2, q3: it looks like a factor of 1000, as if in N mm"),
    "degrees": (lambda f: 180 / np.pi * f(T), "a factor of 57.3, as if degrees"),
    "sign": (lambda f: -f(T), "a factor of -1, the sign is turned round"),
    "one sign": (lambda f: f(T) * [1, -1, 1], "q2: it looks like a factor of -1"),
    "swapped": (lambda f: f(T)[:, [1, 0, 2]], "order of the joints: its columns are the reference's q2, q1, q3"),
    "cycled": (lambda f: f(T)[:, [2, 0, 1]], "its columns are the reference's q3, q1, q2"),
    "reversed": (lambda f: f(T)[::-1], "another order of the samples: the last comes first"),
    "shuffled": (lambda f: f(T)[np.random.default_rng(0).permutation(len(T))], "the same torques stand at other times"),
    "offset": (lambda f: f(T) + np.array([0, 0, 0.7]), "q3: it looks like a constant offset of 0.7"),
    "delay": (lambda f: f(T - 0.02), "it looks like a delay of 0.02 s (4 samples)"),
    "lead": (lambda f: f(T + 0.0125), "it looks like a lead of 0.0125 s (2.5 samples)"),
}  # fmt: skip


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("seed", range(6))
def test_each_shape_is_recognised(name: str, seed: int) -> None:
    change, words = SHAPES[name]
    f = torques(seed)
    found = hint_of(change(f), f(T), T, JOINTS)
    assert found is not None
    assert words in found


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_with_something_else_on_top_is_none(name: str) -> None:
    """The twin: half of the error comes from elsewhere."""
    f, other = torques(1), torques(77)
    candidate = SHAPES[name][0](f)
    error = np.linalg.norm(candidate - f(T), axis=0)
    error = np.where(error > 0, error, error.max())
    extra = other(T)
    assert hint_of(candidate + 0.3 * error * extra / np.linalg.norm(extra, axis=0), f(T), T, JOINTS) is None


@pytest.mark.parametrize("seed", range(40))
def test_right_formulas_and_ordinary_errors_have_none(seed: int) -> None:
    f, rng = torques(seed), np.random.default_rng(seed)
    right = f(T)
    noise = rng.normal(size=right.shape) * np.abs(right).max(axis=0)
    assert hint_of(right, right, T, JOINTS) is None
    assert hint_of(right + 1e-12 * noise, right, T, JOINTS) is None
    for wrong in (
        right + 1e-3 * noise,
        right * rng.uniform(1.01, 1.4, 3),  # another mass
        right + torques(seed + 100)(T),  # a term too many
        torques(seed + 200)(T),
        right + 0.05 * np.abs(right).max(axis=0) * np.sin(9 * T)[:, None],
        np.where(right > 0, right, 0.9 * right),
        np.zeros_like(right),
    ):
        assert hint_of(wrong, right, T, JOINTS) is None
    for empty in (np.full_like(right, np.nan), right[:5]):
        assert hint_of(empty, right[: len(empty)], T[: len(empty)], JOINTS) is None


def test_one_joint_and_torques_at_rest() -> None:
    f = torques(3, 1)
    assert "factor of -1" in str(hint_of(-f(T), f(T), T, ("crank",)))
    rest = np.ones((len(T), 1))
    assert hint_of(rest + 0.3, rest, T, ("crank",)) is None
    assert hint_of(np.ones((len(T), 1)), np.zeros((len(T), 1)), T, ("crank",)) is None
