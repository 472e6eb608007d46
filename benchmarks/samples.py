"""What is measured on: for each robot a smooth motion and samples scattered around the same place."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

import workbench as wb

MODELS = Path(__file__).resolve().parents[1] / "models"

PLACES = {"asym_2rss_ppap": (0.02, 0.03, 0.40), "planar_4rprp": (0.26, 0.25, 0.30)}
"""Platform position, m, in the middle of the samples."""

REACH = 0.03
"""m, how far they go to each side."""

HARMONICS = (1.0, 2.0, 3.0)
FREQUENCY = 2 * np.pi  # rad/s


@dataclass(frozen=True)
class Samples:
    """Actuated motion, ``(n, 3)`` each, SI."""

    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray


def model(robot: str) -> Path:
    """The bundled MJCF of a robot."""
    return MODELS / f"{robot}.xml"


def smooth(robot: str, samples: int) -> Samples:
    """A closed curve of the platform in one second."""
    mechanism = wb.load_mechanism(model(robot))
    w = FREQUENCY * np.array(HARMONICS)
    angle = np.outer(np.linspace(0.0, 1.0, samples), w) + np.array([0.0, 1.0, 2.0])
    x = np.array(PLACES[robot]) + REACH * np.sin(angle)
    return Samples(*mechanism.joint_motion(x, REACH * w * np.cos(angle), -REACH * w**2 * np.sin(angle)))


def scattered(robot: str, samples: int) -> Samples:
    """Positions without order, rates as on the curve."""
    mechanism = wb.load_mechanism(model(robot))
    random = np.random.default_rng(0)
    w = FREQUENCY * np.array(HARMONICS)
    x = np.array(PLACES[robot]) + random.uniform(-REACH, REACH, (samples, 3))
    xd, xdd = (REACH * w**k * random.uniform(-1.0, 1.0, (samples, 3)) for k in (1, 2))
    return Samples(*mechanism.joint_motion(x, xd, xdd))
