"""The reachable workspace by discretisation, as the papers' Fig. 4 and Fig. 2 show it, with its volume and their error.

A cubic grid of platform positions, at a fixed orientation, is put through inverse kinematics: a position counts when
the limbs reach it on the home branch within the limits of the active joints. The volume (of a planar robot: the area)
is the number of such cells times a cell's; what the grid leaves open is at most half of the cells at the border.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from workbench.arrays import FloatArray
from workbench.capabilities.robot import Robot
from workbench.errors import ParameterError, did_you_mean

CELLS_ACROSS = 60
"""Cells along the longest side of the box, where the user gives no spacing."""

MAX_CELLS = 20_000_000
"""A finer grid would need more memory than a workstation has."""

CHUNK = 200_000


@dataclass(frozen=True)
class Workspace:
    """Reachable cells of a robot; arrays over cells in reach, SI, paper frame."""

    spacing: float
    """edge of a cell, m"""
    limits: tuple[tuple[float, float], ...]
    """ranges of the active joints, in actuator order, m or rad"""
    axes: tuple[int, ...]
    """columns of the task coordinates that the grid runs over: positions, or rotations where there are none"""
    fixed: dict[str, float]
    """the other task coordinates, held"""
    low: FloatArray
    """``(d,)`` smallest corner of the grid, m"""
    shape: tuple[int, ...]
    """number of cells along each axis"""
    index: NDArray[np.int64] = field(repr=False)
    """``(k, d)`` cells in reach"""
    q: FloatArray = field(repr=False)
    measures: dict[str, FloatArray] = field(repr=False)
    condition: FloatArray = field(repr=False)
    border_cells: int
    """cells in reach with a neighbour out of reach, and cells out of reach with one in reach"""

    @property
    def x(self) -> FloatArray:
        """Centres of the cells in reach, ``(k, d)``, m."""
        return self.low + (self.index + 0.5) * self.spacing

    @property
    def volume(self) -> float:
        """Volume in m^3; of a planar robot the area in m^2."""
        return len(self.index) * self.spacing ** len(self.shape)

    @property
    def volume_error(self) -> float:
        """Bound on the discretisation error of the volume: half of the cells at the border."""
        return 0.5 * self.border_cells * self.spacing ** len(self.shape)

    def mask(self) -> NDArray[np.bool_]:
        """Reachability over the whole grid, boolean array of `shape`."""
        grid = np.zeros(self.shape, dtype=np.bool_)
        grid[tuple(self.index.T)] = True
        return grid


def joint_limits(robot: Robot, given: Mapping[str, tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Limits of the active joints: the robot's own, with those that are given put over them.

    Raises
    ------
    ParameterError
        Unknown joint, or a lower limit that is not below the upper one.
    """
    for name, (low, high) in given.items():
        if name not in robot.joints:
            raise ParameterError(f'limits: no joint "{name}"{did_you_mean(name, robot.joints)}', joint=name)
        if not low < high or not np.isfinite([low, high]).all():
            raise ParameterError(
                f"limits of {name}: {low:g} to {high:g}; the first must be below the second", joint=name
            )
    own = zip(robot.joints, robot.joint_limits, strict=True)
    return tuple(given.get(name, default) for name, default in own)


def _held(robot: Robot, given: Mapping[str, float]) -> tuple[tuple[int, ...], FloatArray]:
    """Columns that the grid runs over, and a pose ``(m,)`` that holds the others: as given, else as at home."""
    turning = np.array([unit == "rad" for unit in robot.task_units])
    axes = tuple(int(i) for i in np.flatnonzero(~turning if not turning.all() else turning))
    names = (*robot.coordinates, *robot.platform_axes)
    pose = np.zeros(len(robot.coordinates))
    if len(axes) < len(pose):
        pose = robot.forward_kinematics(robot.home[None, :])[0]
    for name, value in given.items():
        if name not in names:
            raise ParameterError(f'--at {name}: no task coordinate "{name}"{did_you_mean(name, robot.coordinates)}')
        column = names.index(name) % len(pose)
        if column in axes:
            raise ParameterError(f"--at {name}: the workspace runs over it; the rotations may be held")
        pose[column] = value
    return axes, pose


def compute_workspace(
    robot: Robot,
    spacing: float | None = None,
    limits: Mapping[str, tuple[float, float]] | None = None,
    at: Mapping[str, float] | None = None,
) -> Workspace:
    """Compute the reachable workspace at one orientation.

    Parameters
    ----------
    robot
        The robot.
    spacing
        Edge of a cell in metres; None divides the longest side of the box into `CELLS_ACROSS`.
    limits
        Ranges of active joints by name, m or rad; the others have the robot's `joint_limits`.
    at
        Rotations that are held, rad, by task coordinate; the others are held as they are in the home pose.

    Raises
    ------
    ParameterError
        A spacing that is not positive or gives more than `MAX_CELLS` cells; unknown joint; nothing in reach.
    """
    ranges = joint_limits(robot, limits or {})
    if not robot.has_task:
        raise ParameterError(
            f"{robot.name}: {' '.join(robot.coordinates)} do not say where the platform is; state platform.coordinates"
            " in the robot file, as many as it has freedoms"
        )
    axes, pose = _held(robot, at or {})
    low, high = (corner[list(axes)] for corner in robot.reach_box())
    step = float((high - low).max()) / CELLS_ACROSS if spacing is None else spacing
    if not (np.isfinite(step) and step > 0):
        raise ParameterError(f"grid spacing {step:g} m; allowed: > 0")
    cells = np.maximum(np.ceil((high - low) / step), 1.0)
    if cells.prod() > MAX_CELLS:
        raise ParameterError(f"grid spacing {step:g} m gives {cells.prod():.3g} cells; allowed: at most {MAX_CELLS}")
    shape = tuple(int(number) for number in cells)
    parts = [
        _cells_in_reach(robot, axes, pose, low, step, shape, ranges, start)
        for start in range(0, int(cells.prod()), CHUNK)
    ]
    index = np.concatenate([part[0] for part in parts])
    if not len(index):
        raise ParameterError(f"no position in reach on a grid of {step:g} m within the joint limits")
    grid = np.zeros(shape, dtype=np.bool_)
    grid[tuple(index.T)] = True
    return Workspace(
        spacing=step,
        limits=ranges,
        axes=axes,
        fixed={name: float(pose[i]) for i, name in enumerate(robot.coordinates) if i not in axes},
        low=low,
        shape=shape,
        index=index,
        q=np.concatenate([part[1] for part in parts]),
        measures={name: np.concatenate([part[2][name] for part in parts]) for name in parts[0][2]},
        condition=np.concatenate([part[3] for part in parts]),
        border_cells=_border(grid),
    )


def _cells_in_reach(
    robot: Robot,
    axes: tuple[int, ...],
    pose: FloatArray,
    low: FloatArray,
    step: float,
    shape: tuple[int, ...],
    ranges: tuple[tuple[float, float], ...],
    start: int,
) -> tuple[NDArray[np.int64], FloatArray, dict[str, FloatArray], FloatArray]:
    stop = min(start + CHUNK, int(np.prod(shape)))
    index = np.stack(np.unravel_index(np.arange(start, stop), shape), axis=1).astype(np.int64)
    x = np.tile(pose, (len(index), 1))
    x[:, list(axes)] = low + (index + 0.5) * step
    reach = robot.reach(x)
    inside = reach.reachable.copy()
    for column, (lower, upper) in enumerate(ranges):
        with np.errstate(invalid="ignore"):
            inside &= (reach.q[:, column] >= lower) & (reach.q[:, column] <= upper)
    measures = {name: values[inside] for name, values in reach.measures.items()}
    return index[inside], reach.q[inside], measures, reach.condition[inside]


def _border(grid: NDArray[np.bool_]) -> int:
    """Count cells on either side of the border; beyond the grid everything is out of reach."""
    padded = np.pad(grid, 1)
    border = np.zeros_like(padded)
    for axis in range(grid.ndim):
        here = [slice(None)] * grid.ndim
        there = [slice(None)] * grid.ndim
        here[axis], there[axis] = slice(None, -1), slice(1, None)
        change = padded[tuple(here)] != padded[tuple(there)]
        border[tuple(here)] |= change
        border[tuple(there)] |= change
    return int(np.count_nonzero(border))
