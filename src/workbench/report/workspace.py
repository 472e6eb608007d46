"""Figures of a stored workspace: three sections through its middle and a view in space, with the cases' paths in it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from workbench.arrays import FloatArray
from workbench.errors import OutputError
from workbench.report.style import INK, PALETTE, figure_style
from workbench.report.svg import new_figure

CELLS = "workspace.parquet"
FACTS = "workspace.json"
NEAR_SINGULAR = 0.1
"""Cells whose smallest scaled determinant is below this are drawn darker."""


def draw_workspace(directory: Path, paths: Mapping[str, FloatArray] | None = None) -> list[Path]:
    """Draw ``sections`` and ``space``, or a planar robot's ``map``, as SVG and PNG into ``figures/``.

    Parameters
    ----------
    directory
        What ``workbench workspace`` wrote.
    paths
        Platform paths ``(n, 3)`` in metres by case name, to be marked in the figures.

    Raises
    ------
    OutputError
        The directory holds no workspace, or a torn one.
    """
    try:
        facts = json.loads((directory / FACTS).read_text(encoding="utf-8"))
        cells = pd.read_parquet(directory / CELLS, page_checksum_verification=True)
    except (OSError, ValueError) as error:
        raise OutputError(f"{directory}: holds no readable workspace: {error}", path=str(directory)) from error
    marked = dict(paths or {})
    folder = directory / "figures"
    folder.mkdir(exist_ok=True)
    written = []
    with figure_style():
        drawn = {"sections": _sections, "space": _space} if len(facts["shape"]) == 3 else {"map": _map}
        for name, figure in ((name, draw(facts, cells, marked)) for name, draw in drawn.items()):
            for suffix in ("svg", "png"):
                path = folder / f"workspace_{name}.{suffix}"
                figure.savefig(path, dpi=150, metadata={"Date": None} if suffix == "svg" else None)
                written.append(path)
    return written


def _looks(count: int) -> list[dict[str, Any]]:
    """Colour and dash of each of *count* lines; dashes tell apart what shares a colour."""
    dashes = ("-", "--", ":", "-.")
    return [{"color": PALETTE[i % len(PALETTE)], "linestyle": dashes[i // len(PALETTE) % 4]} for i in range(count)]


def _grid(facts: Mapping[str, Any], cells: pd.DataFrame) -> NDArray[np.int64]:
    """0 out of reach, 1 in reach, 2 in reach and near a singular pose."""
    grid = np.zeros(facts["shape"], dtype=np.int64)
    index = cells[[f"i{k + 1}" for k in range(len(facts["shape"]))]].to_numpy()
    measured = [np.abs(cells[f"measure_{name}"].to_numpy()) for name in facts["measures"]]
    smallest = np.min(measured, axis=0) if measured else np.ones(len(cells))
    grid[tuple(index.T)] = np.where(smallest < NEAR_SINGULAR, 2, 1)
    return grid


def _sections(facts: Mapping[str, Any], cells: pd.DataFrame, paths: Mapping[str, FloatArray]) -> Figure:
    grid, axes_names = _grid(facts, cells), facts["axes"]
    low, step = np.array(facts["low_m"]), float(facts["spacing_m"])
    high = low + step * np.array(grid.shape)
    middle = np.round(cells[["i1", "i2", "i3"]].mean().to_numpy()).astype(int)
    figure = new_figure(10.5, 4.2)
    figure.set_layout_engine("constrained")
    colours = ListedColormap(["#ffffff", "#bcd9ea", "#7ba7c4"])
    upright = axes_names.index(facts["down"] or facts["up"])
    first, second = (i for i in range(3) if i != upright)
    # what points up is drawn upright; the third section is the view from above
    for number, (across, up, normal) in enumerate(
        ((first, upright, second), (second, upright, first), (first, second, upright)), start=1
    ):
        axes = figure.add_subplot(1, 3, number)
        plane = np.take(grid, middle[normal], axis=normal)
        if across > up:
            plane = plane.T
        extent = (low[across], high[across], low[up], high[up])
        axes.imshow(plane.T, origin="lower", extent=extent, cmap=colours, vmin=0, vmax=2, interpolation="nearest")
        for look, (name, x) in zip(_looks(len(paths)), paths.items(), strict=True):
            axes.plot(x[:, across], x[:, up], linewidth=1.0, label=name, **look)
        for axis, limit in ((across, axes.set_xlim), (up, axes.set_ylim)):
            held = cells[f"x{axis + 1}"]
            limit(held.min() - 2 * step, held.max() + 2 * step)
        position = low[normal] + (middle[normal] + 0.5) * step
        axes.set_title(f"section {axes_names[normal]} = {position:.3f} m")
        axes.set_xlabel(f"{axes_names[across]} [m]")
        axes.set_ylabel(f"{axes_names[up]} [m]")
        if facts["down"] == axes_names[up]:
            axes.invert_yaxis()
        axes.grid(visible=False)
    if paths:
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=min(len(paths), 5))
    return figure


def _map(facts: Mapping[str, Any], cells: pd.DataFrame, paths: Mapping[str, FloatArray]) -> Figure:
    """The area of a planar robot, or the range of one that moves along a line."""
    grid, names = _grid(facts, cells), facts["axes"]
    low, step = facts["low_m"], float(facts["spacing_m"])
    if grid.ndim == 1:
        grid, names, low = grid[:, None], [*names, ""], [*low, 0.0]
    upright = names.index(facts["down"] or facts["up"]) if (facts["down"] or facts["up"]) in names else 1
    across = 1 - upright
    figure = new_figure(6.5, 5.5)
    figure.set_layout_engine("constrained")
    axes = figure.add_subplot()
    plane = grid.T if across == 0 else grid
    ends = [(float(low[i]), float(low[i]) + step * grid.shape[i]) for i in (across, upright)]
    extent = (*ends[0], *ends[1])
    colours = ListedColormap(["#ffffff", "#bcd9ea", "#7ba7c4"])
    axes.imshow(plane, origin="lower", extent=extent, cmap=colours, vmin=0, vmax=2, interpolation="nearest")
    for look, (name, x) in zip(_looks(len(paths)), paths.items(), strict=True):
        axes.plot(x[:, across], x[:, upright], linewidth=1.0, label=name, **look)
    axes.set_xlabel(f"{names[across]} [m]")
    axes.set_ylabel(f"{names[upright]} [m]" if names[upright] else "")
    held = ", ".join(f"{name} = {value:.4g}" for name, value in facts["held"].items())
    axes.set_title(held and f"at {held}", color=INK)
    if facts["down"] == names[upright]:
        axes.invert_yaxis()
    axes.grid(visible=False)
    if paths:
        axes.legend(loc="best")
    return figure


def _space(facts: Mapping[str, Any], cells: pd.DataFrame, paths: Mapping[str, FloatArray]) -> Figure:
    """Cells at the border as points, shaded by height; a full rendering of faces takes minutes."""
    grid = _grid(facts, cells) > 0
    padded = np.pad(grid, 1)
    inner = np.ones_like(grid)
    for axis in range(3):
        for shift in (-1, 1):
            inner &= np.roll(padded, shift, axis=axis)[1:-1, 1:-1, 1:-1]
    shell = np.argwhere(grid & ~inner)
    points = np.array(facts["low_m"]) + (shell + 0.5) * facts["spacing_m"]
    figure = new_figure(6.5, 5.5)
    axes = figure.add_subplot(projection="3d")
    names = facts["axes"]
    # the axis that points up or down is drawn upright
    upright = names.index(facts["down"] or facts["up"])
    flat = [i for i in range(3) if i != upright]
    height = points[:, upright] * (-1 if facts["down"] else 1)
    axes.scatter(
        points[:, flat[0]], points[:, flat[1]], points[:, upright], c=height, cmap="cividis", s=9.0, linewidths=0,
        alpha=0.3, rasterized=True,
    )  # fmt: skip
    for look, (name, x) in zip(_looks(len(paths)), paths.items(), strict=True):
        axes.plot(x[:, flat[0]], x[:, flat[1]], x[:, upright], linewidth=1.4, label=name, **look)
    if facts["down"]:
        axes.invert_zaxis()
    axes.set_xlabel(f"{names[flat[0]]} [m]")
    axes.set_ylabel(f"{names[flat[1]]} [m]")
    axes.set_zlabel(f"{names[upright]} [m]")
    axes.tick_params(labelsize=7)
    axes.locator_params(nbins=5)
    axes.set_box_aspect([float(np.ptp(points[:, i])) for i in (*flat, upright)])
    volume, error = facts["volume_m3"], facts["volume_error_m3"]
    axes.set_title(f"volume {volume:.4f} m³ ± {error:.4f} m³ at {1000 * facts['spacing_m']:g} mm", color=INK)
    if paths:
        axes.legend(loc="upper left", bbox_to_anchor=(-0.1, 1.0))
    return figure
