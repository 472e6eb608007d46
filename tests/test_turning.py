"""Rotations for formulas, against SciPy's and finite differences; limbs against Lagrange's equations by differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from workbench.robots.limbs import telescope, universal_spin
from workbench.robots.turning import exponential, logarithm, rotation_vector_rates, skew, unskew

RNG = np.random.default_rng(4)
VECTORS = np.concatenate([RNG.normal(size=(20, 3)), 1e-5 * RNG.normal(size=(5, 3)), 1e-3 * RNG.normal(size=(5, 3))])


def test_rotation_vectors_there_and_back() -> None:
    rotation = exponential(VECTORS)
    assert np.abs(rotation - Rotation.from_rotvec(VECTORS).as_matrix()).max() < 1e-14
    assert np.abs(logarithm(rotation) - Rotation.from_matrix(rotation).as_rotvec()).max() < 1e-13
    assert np.abs(unskew(skew(VECTORS)) - VECTORS).max() == 0


def test_rates_of_a_rotation_vector() -> None:
    omega, step = RNG.normal(size=(len(VECTORS), 3)), 1e-6
    ahead, behind = (logarithm(exponential(sign * step * omega) @ exponential(VECTORS)) for sign in (1, -1))
    rates = (rotation_vector_rates(VECTORS) @ omega[..., None])[..., 0]
    inside = np.linalg.norm(VECTORS, axis=1) < 3
    assert np.abs(rates - (ahead - behind) / (2 * step))[inside].max() < 1e-8
    assert np.abs(omega - (ahead - behind) / (2 * step))[inside].max() > 1e-2


AXIS = np.array([0.6, 0.8, 0.0])
CYLINDER, PISTON, AXIAL, FORK, GRAVITY = (2.0, 0.3, 0.05), (1.1, 0.25, 0.03), 0.02, 0.007, 9.81


def lagrangian(s: np.ndarray, rate: np.ndarray) -> float:
    """Kinetic less potential energy of a leg on a universal joint, by its two angles and rotation matrices."""
    (m1, c1, i1), (m2, c2, i2) = CYLINDER, PISTON
    length = np.sqrt(s @ s)
    n, speed = s / length, s @ rate / length
    turn = (rate - speed * n) / length
    lean = np.arcsin(n @ AXIS)
    flat = (n - np.sin(lean) * AXIS) / np.cos(lean)
    swing = turn @ np.cross(AXIS, flat) / np.cos(lean)
    omega = swing * AXIS + turn @ (np.cos(lean) * AXIS - np.sin(lean) * flat) * np.cross(flat, AXIS)
    kinetic = sum(m * v @ v for m, v in ((m1, c1 * turn), (m2, (length - c2) * turn + speed * n))) / 2
    inertia = (i1 + i2) * (np.eye(3) - np.outer(n, n)) + AXIAL * np.outer(n, n)
    kinetic += omega @ inertia @ omega / 2 + FORK * swing**2 / 2
    return float(kinetic - GRAVITY * (m1 * c1 + m2 * (length - c2)) * n[2])


def by_differences(s: np.ndarray, rate: np.ndarray, add: np.ndarray) -> np.ndarray:
    """Lagrange's equations for the end of the leg."""
    step, unit = 1e-4, np.eye(3)

    def momentum(t: float) -> np.ndarray:
        place, speed = s + t * rate + t * t / 2 * add, rate + t * add
        ahead, behind = ([lagrangian(place, speed + k * step * e) for e in unit] for k in (1, -1))
        return (np.array(ahead) - np.array(behind)) / (2 * step)

    slope = [(lagrangian(s + step * e, rate) - lagrangian(s - step * e, rate)) / (2 * step) for e in unit]
    return (momentum(step) - momentum(-step)) / (2 * step) - np.array(slope)


@pytest.mark.parametrize("seed", range(4))
def test_a_leg_on_a_universal_joint_follows_lagrange(seed: int) -> None:
    rng = np.random.default_rng(seed)
    s, rate, add = np.array([0.3, -0.2, 0.8]) + 0.2 * rng.normal(size=3), rng.normal(size=3), rng.normal(size=3)
    motion = [v[None, None] for v in (s, rate, add)]
    force = telescope(*motion, CYLINDER, PISTON, GRAVITY)[0, 0]
    spin = universal_spin(*motion, AXIS[None], AXIAL, FORK)[0, 0]
    assert np.abs(force + spin - by_differences(s, rate, add)).max() < 1e-5
    assert np.abs(force - by_differences(s, rate, add)).max() > 1e-4
