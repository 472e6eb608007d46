"""Random robots and motions that several tests share."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import workbench as wb
from workbench.errors import MotionError
from workbench.mechanisms.base import Mechanism

MODEL = Path(__file__).resolve().parents[1] / "models" / "asym_2rss_ppap.xml"
NOMINAL = {"L": 0.2, "l": 0.1, "a1": 0.2, "a2": 0.3, "a5": 0.25, "m1": 0.2, "m2": 0.3, "m3": 0.45, "m4": 0.1,
           "m5": 0.5, "m6": 0.1}  # fmt: skip
SIDED = ("L", "l", "a1", "a2", "m1", "m2")
POSE = np.array([0.0, np.pi / 4, np.pi / 4])
AMPLITUDE = np.array([0.1, 0.3, 0.3])

Motion = tuple[np.ndarray, np.ndarray, np.ndarray]


def random_changes(rng: np.random.Generator) -> dict[str, float]:
    """Lengths +-30 %, masses x 0.3 to 3, payload to 2 kg, limbs that differ, mass centres and inertias of their own."""
    values: dict[str, float] = {}
    for name, nominal in NOMINAL.items():
        for key in (f"{name}_left", f"{name}_right") if name in SIDED else (name,):
            factor = np.exp(rng.uniform(np.log(0.3), np.log(3.0))) if name.startswith("m") else rng.uniform(0.7, 1.3)
            values[key] = nominal * float(factor)
    values["payload"] = float(rng.uniform(0.0, 2.0))
    for bar in ("1_left", "1_right", "2_left", "2_right", "5"):
        values[f"k{bar}"] = float(rng.uniform(0.2, 0.8))
        values[f"I{bar}"] = values[f"m{bar}"] * values[f"a{bar}"] ** 2 / 12 * float(rng.uniform(0.5, 2.0))
    return values


def sine_sum(rng: np.random.Generator, t: np.ndarray, scale: float = 1.0) -> Motion:
    """Two sines per joint about a pose near the paper's: q, qd, qdd ``(n, 3)``."""
    offset = POSE + scale * rng.uniform(-0.5, 0.5, 3) * AMPLITUDE
    q, qd, qdd = np.tile(offset, (len(t), 1)), np.zeros((len(t), 3)), np.zeros((len(t), 3))
    for joint in range(3):
        for part in (0.6, 0.4):
            size = scale * AMPLITUDE[joint] * part * rng.uniform(0.3, 1.0)
            rate, phase = rng.uniform(2.0, 25.0), rng.uniform(0.0, 2 * np.pi)
            q[:, joint] += size * np.sin(rate * t + phase)
            qd[:, joint] += size * rate * np.cos(rate * t + phase)
            qdd[:, joint] -= size * rate**2 * np.sin(rate * t + phase)
    return q, qd, qdd


def motion_inside(
    mech: Mechanism, rng: np.random.Generator, t: np.ndarray, tries: int = 20, away: float = 0.0
) -> tuple[Motion | None, int]:
    """A random motion that the closed-form kinematics accept, and how many were refused before it.

    *away* is the least value that every singularity measure keeps.
    """
    for refused in range(tries):
        motion = sine_sum(rng, t)
        try:
            measures = mech.singularity_measures(motion[0])
        except MotionError:
            continue
        if min(np.abs(value).min() for value in measures.values()) < away:
            continue
        return motion, refused
    return None, tries


def table_1() -> Mechanism:
    """The robot of the bundled model."""
    return wb.load_mechanism(MODEL)


def peak_error(candidate: np.ndarray, reference: np.ndarray) -> float:
    """Largest difference, per column over that column's peak."""
    return float((np.abs(candidate - reference).max(axis=0) / np.abs(reference).max(axis=0)).max())
