"""Task coordinates: which numbers say where the platform is and how it is turned, and the one convention behind them.

Named are some of ``x y z rx ry rz``, of the platform site in the base body's frame, in the order that the user gives.

- Positions are metres along the base's axes.
- **One** rotation coordinate is the angle about that base axis, rad, not limited to a turn: the twist of the rotation R
  about the axis (`2 atan2(v_i, w)` of its quaternion). For a planar robot that is the angle that one draws; for a
  platform that also leans it is the angle that is left when the lean (a rotation about an axis across) is taken off.
  Singular only where the platform leans by half a turn.
- **Two or three** are components of the rotation vector r, R = exp [r]x: the axis times the angle, rad. Small rotations
  read as rotations about the three axes; any rotation by less than a full turn has one that is differentiable, and
  rates follow from ``rd = (1 - [r]x/2 + c [r]x^2) omega`` with ``c = (1 - a/2 cot a/2)/a^2``, a = |r|. Singular at a
  full turn. With two, the third component is the mechanism's own affair.

What is not among the coordinates is not held: the platform goes there, and turns about there, as the loops have it.
R is the site's rotation itself: zero is the pose in which the site's axes are parallel to the base's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ParameterError, did_you_mean
from workbench.reference.task_rows import turn_motion

POSITIONS = ("x", "y", "z")
ROTATIONS = ("rx", "ry", "rz")
COORDINATES = (*POSITIONS, *ROTATIONS)


@dataclass(frozen=True)
class Task:
    """Task coordinates, resolved: which columns are positions and rotations, about which axes."""

    names: tuple[str, ...]
    slide_columns: np.ndarray
    """columns of positions"""
    slides: np.ndarray
    """and their base axes, 0 to 2"""
    turn_columns: np.ndarray
    """columns of rotations"""
    turns: np.ndarray

    def table(self, body: int, site: int) -> tuple[Any, ...]:
        """The task as the kernels take it."""
        return body, site, self.slide_columns, self.slides, self.turn_columns, self.turns

    def shown(self, values: FloatArray) -> str:
        """Coordinates in words: ``x = 0.1, ry = 0.5``."""
        return ", ".join(f"{name} = {value:.6g}" for name, value in zip(self.names, values, strict=True))


def task_of(coordinates: Sequence[str]) -> Task:
    """Resolve names of task coordinates.

    Raises
    ------
    ParameterError
        An unknown name, a name given twice, or none at all.
    """
    names = tuple(coordinates.split()) if isinstance(coordinates, str) else tuple(coordinates)
    for name in names:
        if name not in COORDINATES:
            raise ParameterError(
                f'coordinates: "{name}" is no coordinate of a platform{did_you_mean(name, COORDINATES)}; a subset of'
                f" {' '.join(COORDINATES)} is",
                value=name,
            )
        if names.count(name) > 1:
            raise ParameterError(f'coordinates: "{name}" is given twice in {" ".join(names)}', value=name)
    if not names:
        raise ParameterError(f"coordinates: none given; some of {' '.join(COORDINATES)} are needed")
    places = np.array([COORDINATES.index(name) for name in names], dtype=np.int64)
    slide, turn = np.flatnonzero(places < 3), np.flatnonzero(places >= 3)
    return Task(names, slide, places[slide], turn, places[turn] - 3)


def task_motion(
    task: Task,
    position: tuple[FloatArray, FloatArray, FloatArray],
    rotation: FloatArray,
    omega: FloatArray,
    alpha: FloatArray,
    near: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Task coordinates of a platform's motion with their first and second derivatives, each ``(n, m)``, SI.

    Parameters
    ----------
    task
        The coordinates.
    position
        ``x, xd, xdd``, each ``(n, 3)``, base frame, as `ReferenceResult` holds them.
    rotation, omega, alpha
        ``(n, 3, 3)``, ``(n, 3)``, ``(n, 3)``, base frame, likewise.
    near
        ``(n, m)`` coordinates that say which of several equal rotations is meant; left out: each sample's own least.
    """
    n, m = len(rotation), len(task.names)
    found = np.zeros((3, n, m))
    for derivative in range(3):
        found[derivative][:, task.slide_columns] = position[derivative][:, task.slides]
    if len(task.turns):
        aims = np.zeros((n, len(task.turns))) if near is None else np.ascontiguousarray(near[:, task.turn_columns])
        turned = np.zeros((3, n, len(task.turns)))
        writable = [np.array(array, dtype=np.float64, order="C") for array in (omega, alpha)]
        turn_motion(task.turns, quaternions(rotation), aims, *writable, turned[0], turned[1], turned[2])
        found[:, :, task.turn_columns] = turned
    return found[0], found[1], found[2]


def continuous(task: Task, x: FloatArray) -> FloatArray:
    """Task coordinates ``(n, m)`` in which the angle of a single rotation runs on from sample to sample, past a turn.

    For samples in the order of a motion. Two or three rotation coordinates are left as they are.
    """
    unwrapped = x.copy()
    if len(task.turns) == 1:
        column = int(task.turn_columns[0])
        unwrapped[:, column] = np.unwrap(x[:, column])
    return unwrapped


def rotation_vector(rotation: FloatArray) -> FloatArray:
    """Axis times angle ``(n, 3)``, rad, of rotation matrices ``(n, 3, 3)``; the angle is at most half a turn."""
    q = quaternions(rotation)
    q = np.where(q[:, :1] < 0, -q, q)
    sine = np.linalg.norm(q[:, 1:], axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, q[:, :1])
    scale = np.divide(angle, sine, out=np.full_like(sine, 2.0), where=sine > 0.0)
    return np.asarray(scale * q[:, 1:])


def quaternions(rotation: FloatArray) -> FloatArray:
    """Unit quaternions ``(n, 4)`` (w, x, y, z) of rotation matrices ``(n, 3, 3)``, each by its largest component."""
    r = rotation
    trace = np.trace(r, axis1=1, axis2=2)
    # 4 q_a^2, and beside each the products 4 q_a q_b
    squares = 1.0 + np.stack([trace, *(2.0 * r[:, i, i] - trace for i in range(3))], axis=1)
    w = np.stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], axis=1)
    table = np.empty((len(r), 4, 4))
    for i in range(4):
        table[:, i, i] = squares[:, i]
    for i in range(3):
        table[:, 0, 1 + i] = table[:, 1 + i, 0] = w[:, i]
        for j in range(i):
            table[:, 1 + i, 1 + j] = table[:, 1 + j, 1 + i] = r[:, i, j] + r[:, j, i]
    rows = table[np.arange(len(r)), np.argmax(squares, axis=1)]
    found: FloatArray = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    return found
