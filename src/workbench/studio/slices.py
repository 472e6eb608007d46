"""A slice of the workspace through the platform: which positions are in reach, and how far they are from singular."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from workbench.arrays import FloatArray
from workbench.capabilities.robot import Robot
from workbench.errors import ParameterError

CELLS = 44
"""Cells across the longer side."""

COLOURS = np.array([[0.84, 0.15, 0.16], [0.99, 0.68, 0.38], [0.88, 0.95, 0.73], [0.35, 0.74, 0.60], [0.13, 0.40, 0.67]])
"""From singular to far from it."""


@dataclass(frozen=True)
class Slice:
    """Cells in reach."""

    x: FloatArray = field(repr=False)
    """``(k, 3)`` centres, m, base frame"""
    nearness: FloatArray = field(repr=False)
    """``(k,)`` smallest measure of singularity, 0 at a singular pose; all 1 where the robot has none"""
    spacing: float
    axes: tuple[str, str]

    @property
    def colours(self) -> FloatArray:
        """``(k, 3)`` red, green, blue, 0 to 1, from red at a singular pose to blue at 1 and beyond."""
        at = np.clip(self.nearness, 0.0, 1.0) * (len(COLOURS) - 1)
        return np.stack([np.interp(at, np.arange(len(COLOURS)), channel) for channel in COLOURS.T], axis=1)


def planes_of(robot: Robot) -> tuple[str, ...]:
    """Planes of positions that can be sliced: ``x y`` ...; none where positions do not say where the platform is."""
    axes = [name for name in robot.coordinates if name in ("x", "y", "z")]
    if not robot.has_task or len(axes) < 2:
        return ()
    return tuple(f"{one} {other}" for i, one in enumerate(axes) for other in axes[i + 1 :])


def slice_of(robot: Robot, pose: FloatArray, position: FloatArray, plane: str) -> Slice:
    """Slice the workspace through a pose ``(m,)`` in task coordinates, of which all others are held.

    *position* ``(3,)`` is where the platform is, m: what the task coordinates do not say.

    Raises
    ------
    ParameterError
        No such plane.
    """
    planes = planes_of(robot)
    if plane not in planes:
        raise ParameterError(f'plane "{plane}"; allowed: {", ".join(planes) or "none of this robot"}')
    names = plane.split()
    columns = [robot.coordinates.index(name) for name in names]
    low, high = (corner[columns] for corner in robot.reach_box())
    spacing = float((high - low).max()) / CELLS
    sides = [start + spacing * (np.arange(max(1, int((end - start) / spacing))) + 0.5) for start, end in
             zip(low, high, strict=True)]  # fmt: skip
    grid = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2)
    x = np.tile(pose, (len(grid), 1))
    x[:, columns] = grid
    seen = robot.reach(x)
    inside = seen.reachable.copy()
    for column, (lower, upper) in enumerate(robot.joint_limits):
        with np.errstate(invalid="ignore"):
            inside &= (seen.q[:, column] >= lower) & (seen.q[:, column] <= upper)
    measures = [np.abs(values[inside]) for values in seen.measures.values()]
    nearness = np.min(measures, axis=0) if measures else np.ones(int(inside.sum()))
    places = np.tile(position, (int(inside.sum()), 1))
    for index, name in enumerate("xyz"):
        if name in robot.coordinates:
            places[:, index] = x[inside, robot.coordinates.index(name)]
    return Slice(places, nearness, spacing, (names[0], names[1]))
