"""Motions, parameters and finite differences that the tests of the 4-RPRP robot share."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from workbench.capabilities.load import load_robot as load_mechanism

MODEL = str(Path(__file__).resolve().parents[1] / "models" / "planar_4rprp.xml")
HOME = np.array([0.3893182978, 0.3768866111, 0.3893182978])
AMPLITUDE = np.array([0.025, -0.030, 0.020])

ROUND_OFF = 1e-10
"""Peak-normalised, per joint: two forms of the same equations."""

STEP = 1e-3
DIFFERENCES = 1e-9
"""Finite differences of sixth order over 1 ms: the remainder and the round-off of positions over the step squared."""

Motion = tuple[np.ndarray, np.ndarray, np.ndarray]


def example(samples: int = 401, speed: float = 1.0) -> Motion:
    """The numerical example of section 7, `speed` rad/s instead of 1."""
    time = np.linspace(0.0, 2 * np.pi / speed, samples)[:, None]
    sine, cosine = np.sin(speed * time), np.cos(speed * time)
    return HOME + AMPLITUDE * sine, speed * AMPLITUDE * cosine, -(speed**2) * AMPLITUDE * sine


def scattered(mechanism: Any, samples: int, seed: int) -> Motion:
    """Poses all over the workspace with velocities and accelerations that have nothing to do with each other."""
    rng = np.random.default_rng(seed)
    p = mechanism.parameters
    x = np.stack([p.a * rng.uniform(0.2, 0.8, samples), rng.uniform(0.1, 0.4, samples),
                  p.b * rng.uniform(0.2, 0.8, samples)], axis=1)  # fmt: skip
    q = mechanism.inverse_kinematics(x)
    return q, rng.normal(size=q.shape), 30 * rng.normal(size=q.shape)


def slow(mechanism: Any, samples: int, seed: int) -> Motion:
    """As `scattered`, slow enough for finite differences over a few milliseconds."""
    q, qd, qdd = scattered(mechanism, samples, seed)
    return q, 0.2 * qd, 0.1 * qdd


def random_parameters(seed: int) -> dict[str, float]:
    """Masses and inertias x 0.5 to 2, another frame; b so that limbs 1 and 3 still meet at the model's home pose."""
    rng = np.random.default_rng(seed)
    defaults = dataclasses.asdict(load_mechanism(MODEL).parameters)
    changed = {name: defaults[name] * rng.uniform(0.5, 2.0) for name in defaults if name not in ("a", "b", "h", "g")}
    return changed | {"a": rng.uniform(0.45, 0.8), "b": rng.uniform(0.45, 0.72), "h": rng.uniform(-0.03, 0.06),
                      "g": rng.uniform(1.0, 15.0)}  # fmt: skip


def peak_error(value: np.ndarray, truth: np.ndarray) -> np.ndarray:
    return np.abs(value - truth).max(axis=0) / np.abs(truth).max(axis=0)


def along(function: Callable[[np.ndarray], np.ndarray], q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """`function` at seven times around each sample, ``(7, n, ...)``."""
    times = STEP * np.arange(-3, 4)
    return np.stack([function(q + t * qd + 0.5 * t**2 * qdd) for t in times])


def first_rate(values: np.ndarray) -> np.ndarray:
    return np.tensordot([-1, 9, -45, 0, 45, -9, 1], values, axes=1) / (60 * STEP)


def second_rate(values: np.ndarray) -> np.ndarray:
    return np.tensordot([2, -27, 270, -490, 270, -27, 2], values, axes=1) / (180 * STEP**2)
