"""The reachable workspace by discretisation, as the papers' Fig. 4 and Fig. 2 show it, with its volume and their error.

A cubic grid of platform positions is put through the closed form's inverse kinematics: a position counts when the limbs
reach it on the home branch within the limits of the active joints. The volume is the number of such cells times a
cell's; what the grid leaves open is at most half of the cells at the border.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from workbench.arrays import FloatArray
from workbench.errors import ParameterError, did_you_mean
from workbench.robots.base import Mechanism

CELLS_ACROSS = 60
"""Cells along the longest side of the box, where the user gives no spacing."""

MAX_CELLS = 20_000_000
"""A finer grid would need more memory than a workstation has."""

CHUNK = 200_000


@dataclass(frozen=True)
class Workspace:
    """Reachable cells of a mechanism; arrays over cells in reach, SI, paper frame."""

    spacing: float
    """edge of a cell, m"""
    limits: tuple[tuple[float, float], ...]
    """ranges of the active joints, in actuator order, m or rad"""
    low: FloatArray
    """``(3,)`` smallest corner of the grid, m"""
    shape: tuple[int, int, int]
    """number of cells along each axis"""
    index: NDArray[np.int64] = field(repr=False)
    """``(k, 3)`` cells in reach"""
    q: FloatArray = field(repr=False)
    measures: dict[str, FloatArray] = field(repr=False)
    condition: FloatArray = field(repr=False)
    border_cells: int
    """cells in reach with a neighbour out of reach, and cells out of reach with one in reach"""

    @property
    def x(self) -> FloatArray:
        """Centres of the cells in reach, ``(k, 3)``, m."""
        return self.low + (self.index + 0.5) * self.spacing

    @property
    def volume(self) -> float:
        """Volume in m^3."""
        return len(self.index) * self.spacing**3

    @property
    def volume_error(self) -> float:
        """Bound on the discretisation error of the volume, m^3: half of the cells at the border."""
        return 0.5 * self.border_cells * self.spacing**3

    def mask(self) -> NDArray[np.bool_]:
        """Reachability over the whole grid, boolean array of `shape`."""
        grid = np.zeros(self.shape, dtype=np.bool_)
        grid[tuple(self.index.T)] = True
        return grid


def joint_limits(mechanism: Mechanism, given: Mapping[str, tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Limits of the active joints: the mechanism's own, with those that are given put over them.

    Raises
    ------
    ParameterError
        Unknown joint, or a lower limit that is not below the upper one.
    """
    for name, (low, high) in given.items():
        if name not in mechanism.joints:
            raise ParameterError(f'limits: no joint "{name}"{did_you_mean(name, mechanism.joints)}', joint=name)
        if not low < high or not np.isfinite([low, high]).all():
            raise ParameterError(
                f"limits of {name}: {low:g} to {high:g}; the first must be below the second", joint=name
            )
    own = zip(mechanism.joints, mechanism.joint_limits, strict=True)
    return tuple(given.get(name, default) for name, default in own)


def compute_workspace(
    mechanism: Mechanism,
    spacing: float | None = None,
    limits: Mapping[str, tuple[float, float]] | None = None,
) -> Workspace:
    """Compute the reachable workspace.

    Parameters
    ----------
    mechanism
        The robot.
    spacing
        Edge of a cell in metres; None divides the longest side of the box into `CELLS_ACROSS`.
    limits
        Ranges of active joints by name, m or rad; the others have the mechanism's `joint_limits`.

    Raises
    ------
    ParameterError
        A spacing that is not positive or gives more than `MAX_CELLS` cells; unknown joint; nothing in reach.
    """
    ranges = joint_limits(mechanism, limits or {})
    low, high = mechanism.reach_box()
    step = float((high - low).max()) / CELLS_ACROSS if spacing is None else spacing
    if not (np.isfinite(step) and step > 0):
        raise ParameterError(f"grid spacing {step:g} m; allowed: > 0")
    cells = np.maximum(np.ceil((high - low) / step), 1.0)
    if cells.prod() > MAX_CELLS:
        raise ParameterError(f"grid spacing {step:g} m gives {cells.prod():.3g} cells; allowed: at most {MAX_CELLS}")
    shape = (int(cells[0]), int(cells[1]), int(cells[2]))
    parts = [
        _cells_in_reach(mechanism, low, step, shape, ranges, start) for start in range(0, int(cells.prod()), CHUNK)
    ]
    index = np.concatenate([part[0] for part in parts])
    if not len(index):
        raise ParameterError(f"no position in reach on a grid of {step:g} m within the joint limits")
    grid = np.zeros(shape, dtype=np.bool_)
    grid[tuple(index.T)] = True
    return Workspace(
        spacing=step,
        limits=ranges,
        low=low,
        shape=shape,
        index=index,
        q=np.concatenate([part[1] for part in parts]),
        measures={name: np.concatenate([part[2][name] for part in parts]) for name in parts[0][2]},
        condition=np.concatenate([part[3] for part in parts]),
        border_cells=_border(grid),
    )


def _cells_in_reach(
    mechanism: Mechanism,
    low: FloatArray,
    step: float,
    shape: tuple[int, int, int],
    ranges: tuple[tuple[float, float], ...],
    start: int,
) -> tuple[NDArray[np.int64], FloatArray, dict[str, FloatArray], FloatArray]:
    stop = min(start + CHUNK, int(np.prod(shape)))
    index = np.stack(np.unravel_index(np.arange(start, stop), shape), axis=1).astype(np.int64)
    reach = mechanism.reach(low + (index + 0.5) * step)
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
    for axis in range(3):
        here = [slice(None)] * 3
        there = [slice(None)] * 3
        here[axis], there[axis] = slice(None, -1), slice(1, None)
        change = padded[tuple(here)] != padded[tuple(there)]
        border[tuple(here)] |= change
        border[tuple(there)] |= change
    return int(np.count_nonzero(border))
