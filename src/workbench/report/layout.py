"""Where panels and legends of a figure stand, and how its axes are labelled."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import cast

from matplotlib.axes import Axes
from matplotlib.figure import FigureBase, SubFigure
from matplotlib.ticker import FixedLocator, FuncFormatter
from matplotlib.transforms import Transform, blended_transform_factory

from workbench.report.light_axis import LightAxes
from workbench.report.style import INK
from workbench.report.svg import OVER_TIME, OWN

MOMENT = f"{OWN}moment"
"""Mark of texts that belong to one moment: out of place while the time axis is zoomed."""
SMALLEST_DRAWN = 1e-17
"""Errors below this, zero among them, are drawn here: a logarithmic axis has no zero."""
SMALL = (4.4, 3.4)
TALL = (4.4, 4.1)
WIDE = (5.8, 3.9)


def log_axis(axes: Axes, low: float, high: float) -> None:
    """Make the y axis logarithmic: whole decades, at most five labelled, written as plain text."""
    bottom = math.floor(math.log10(max(low, SMALLEST_DRAWN)))
    top = max(math.ceil(math.log10(high * 1.5)) if high < math.inf else 3, bottom + 2)
    axes.set_yscale("log")
    axes.set_ylim(10.0**bottom, 10.0**top)
    step = math.ceil((top - bottom) / 4)
    axes.yaxis.set_major_locator(FixedLocator([10.0**power for power in range(bottom, top + 1, step)]))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"1e{round(math.log10(value))}"))
    axes.minorticks_off()


def stack(figure: FigureBase, heights: Sequence[float], header: int = 0, over: str = "time [s]") -> list[Axes]:
    """Put panels one above the other on one axis *over*; *header* is the lines of room for a legend above them."""
    width, height = size_of(figure)
    left, right, bottom, gap = 0.62 / width, 1 - 0.12 / width, 0.42 / height, 0.14 / height
    top = 1 - (0.1 + 0.165 * header) / height
    room = top - bottom - gap * (len(heights) - 1)
    panels: list[Axes] = []
    for share in heights:
        panel = room * share / sum(heights)
        above = panels[0] if panels else None
        axes = figure.add_axes((left, top - panel, right - left, panel), sharex=above, axes_class=LightAxes)
        axes.locator_params(nbins=5)
        axes.margins(x=0.01)
        if over == "time [s]":
            axes.set_gid(OVER_TIME)
        top -= panel + gap
        panels.append(axes)
    for axes in panels[:-1]:
        axes.tick_params(labelbottom=False)
    panels[-1].set_xlabel(over)
    # Fixed places: to find them from the tick labels takes a third of the drawing time.
    for axes in panels:
        axes.yaxis.set_label_coords(0.19 / width, 0.5, transform=_beside(figure, axes))
    place_below(figure, panels[-1])
    return panels


def _whole(figure: FigureBase) -> Transform:
    return cast(Transform, figure.transSubfigure)  # type: ignore[attr-defined]


def _beside(figure: FigureBase, axes: Axes) -> Transform:
    return blended_transform_factory(_whole(figure), axes.transAxes)


def place_below(figure: FigureBase, axes: Axes) -> None:
    """Give the label of the x axis a fixed place near the figure's lower edge."""
    beside = blended_transform_factory(axes.transAxes, _whole(figure))
    axes.xaxis.set_label_coords(0.5, 0.19 / size_of(figure)[1], transform=beside)


def size_of(figure: FigureBase) -> tuple[float, float]:
    """Return width and height in inches, of a figure or of a part of one."""
    box, dpi = figure.bbox, figure.figure.dpi if isinstance(figure, SubFigure) else figure.dpi  # type: ignore[attr-defined]
    return box.width / dpi, box.height / dpi


def legend_rows(count: int, columns: int = 2) -> int:
    """Return how many lines a legend of *count* entries takes."""
    return math.ceil(count / columns)


def figure_legend(figure: FigureBase, axes: Axes, columns: int = 2) -> None:
    """Put the legend of *axes* above all panels."""
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        figure.legend(
            handles,
            labels,
            loc="upper left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=columns,
            borderaxespad=0.2,
            labelspacing=0.25,
        )


def legend(axes: Axes) -> None:
    """Put the legend inside the panel, above the curves."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.18 * (high - low))  # room for the legend above the curves
    axes.legend(loc="upper right", ncols=4, borderaxespad=0.1)


def mark(axes: Axes, time: float, value: float, text: str) -> None:
    """Mark one moment of a curve with a triangle and a number."""
    axes.plot([time], [value], "v", color=INK, markersize=4.5)
    axes.annotate(
        text, (time, value), (0, 4), textcoords="offset points", ha="center", va="bottom", fontsize=8, gid=MOMENT
    )
