"""Maps of the modelling error over two of the numbers that a sweep varied."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import FigureBase
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from workbench.arrays import FloatArray
from workbench.report.layout import size_of
from workbench.report.light_axis import LightAxes
from workbench.report.plot import Plot
from workbench.report.section import Section
from workbench.report.style import GRID
from workbench.report.sweep.load import SweepRun
from workbench.report.sweep.varied import label_of, range_of, scale_of
from workbench.report.sweep.verdict import number
from workbench.report.tables import Cell, Table, columns
from workbench.report.text import exact, percent, slug

MOST_BINS, FEWEST_BINS = 8, 3
CASES_PER_CELL = 12
"""Bins are as many as leave so many designs in a cell on average."""
OWN_VALUES = 10
"""A number that takes at most so many values has a column for each."""
STRONGEST = 3
"""Maps are drawn over each two of so many of the strongest drivers."""
COLOURS = "cividis"
"""Reads the same with any colour vision, and in print without colour."""
BRIGHT = 0.18
"""Luminance from which on black is easier to read than white."""
ON_BRIGHT, ON_DARK = "#010101", "#fefefe"
"""Not the page's own colours: a cell looks the same in dark and light."""


@dataclass(frozen=True)
class Bins:
    """How the values of one key are grouped."""

    label: str
    edges: FloatArray
    """``(k + 1,)``; or, where ``own`` is set, the ``(k,)`` values themselves"""
    own: bool
    place: NDArray[np.int64] = field(repr=False)
    """``(n,)`` bin of each case"""

    @property
    def count(self) -> int:
        """Number of bins."""
        return len(self.edges) - (0 if self.own else 1)

    def text(self, bin_: int) -> str:
        """Range of a bin."""
        if self.own:
            return exact(float(self.edges[bin_]), 3)
        return f"{exact(float(self.edges[bin_]), 3)} to {exact(float(self.edges[bin_ + 1]), 3)}"


@dataclass(frozen=True)
class Map:
    """Errors over two keys: cells ``(rows, columns)``, NaN where no case is."""

    across: Bins
    down: Bins
    median: FloatArray
    worst: FloatArray
    cases: NDArray[np.int64]


def heat_section(run: SweepRun) -> Section | None:
    """Draw maps over the strongest drivers of every modelling error; None with fewer than two of them."""
    pairs = list(dict.fromkeys((d.candidate, d.reference) for d in run.summary.drivers))
    plots, tables = [], []
    for place, pair in enumerate(pairs):
        keys = [d.key for d in run.summary.drivers_of(*pair) if run.key(d.key) is not None][:STRONGEST]
        for turn, (first, second) in enumerate(itertools.combinations(keys, 2)):
            found = map_over(run, pair, first, second)
            if found is None:
                continue
            against = f"{pair[0]} against the {pair[1]} reference"
            key = f"figure-map-{slug(pair[0])}-{slug(pair[1])}-{place + 1}-{turn + 1}"
            plots.append(_plot(key, found, against))
            if turn == 0:
                tables.append(_table(place, found, against))
    if not plots:
        return None
    context = {"paragraphs": [], "tables": tables, "figures": plots, "note": NOTE}
    return Section("maps", "Error over two numbers", "sweep", context, tuple(plots))


NOTE = (
    "Each cell holds the designs in a range of two of the numbers that drive the error most; all the others vary "
    "within it. The upper figure in a cell is the error of the worst joint in percent, the lower one counts its "
    "designs. Dark is small, bright is large, on one logarithmic scale for both maps."
)


def _bins(run: SweepRun, key: str, kept: NDArray[np.bool_]) -> Bins:
    record = run.key(key)
    column = [k.key for k in run.summary.keys].index(key)
    values = run.values[kept, column]
    label = label_of(record) if record else key
    distinct = np.unique(values)
    if len(distinct) <= OWN_VALUES:
        return Bins(label, distinct, True, np.searchsorted(distinct, values))
    count = int(np.clip(round((len(values) / CASES_PER_CELL) ** 0.5), FEWEST_BINS, MOST_BINS))
    low, high = range_of(run, key, float(distinct[0]), float(distinct[-1]))
    spread = np.geomspace if scale_of(run, key) == "log" and low > 0 else np.linspace
    edges = np.asarray(spread(low, high, count + 1), dtype=np.float64)
    return Bins(label, edges, False, np.clip(np.searchsorted(edges, values, side="right") - 1, 0, count - 1))


def map_over(run: SweepRun, pair: tuple[str, str], first: str, second: str) -> Map | None:
    """Return the errors of a comparison over two keys, *first* in columns; None where one of them does not vary."""
    errors = run.worst[pair]
    kept = np.isfinite(errors)
    across, down = _bins(run, first, kept), _bins(run, second, kept)
    if across.count < 2 or down.count < 2:
        return None
    shape = (down.count, across.count)
    median, worst, cases = np.full(shape, np.nan), np.full(shape, np.nan), np.zeros(shape, dtype=np.int64)
    cell = down.place * across.count + across.place
    order = np.argsort(cell, kind="stable")
    sorted_cells, sorted_errors = cell[order], errors[kept][order]
    found, starts = np.unique(sorted_cells, return_index=True)
    for number_, members in zip(found, np.split(sorted_errors, starts[1:]), strict=True):
        where = divmod(int(number_), across.count)
        median[where], worst[where], cases[where] = np.median(members), members.max(), len(members)
    return Map(across, down, median, worst, cases)


def _plot(key: str, found: Map, against: str) -> Plot:
    size = (9.0, 0.93 + 0.42 * found.down.count)

    def draw(figure: FigureBase) -> None:
        width, height = size_of(figure)
        left, right, top, bottom, gap = 0.72, 0.1, 0.3, 0.5, 0.3
        room = (width - left - right - gap) / 2
        smallest = max(float(np.nanmin(found.median)), 1e-300)
        norm = LogNorm(smallest, max(float(np.nanmax(found.worst)), smallest * 1.01))
        for turn, (title, cells) in enumerate((("median", found.median), ("largest", found.worst))):
            box = ((left + turn * (room + gap)) / width, bottom / height, room / width, 1 - (top + bottom) / height)
            axes = figure.add_axes(box, axes_class=LightAxes)
            axes.set_title(f"{title} of the designs in the cell", fontsize=8.5)
            _cells(axes, found, cells, norm)
            axes.set_xlabel(found.across.label)
            _ticks(axes, found, with_rows=turn == 0)

    worst = np.unravel_index(int(np.nanargmax(found.median)), found.median.shape)
    best = np.unravel_index(int(np.nanargmin(found.median)), found.median.shape)

    def place(cell: tuple[np.intp, ...]) -> str:
        row, column = (int(i) for i in cell)
        return (
            f"{percent(float(found.median[row, column]))} with {found.across.label} {found.across.text(column)} and "
            f"{found.down.label} {found.down.text(row)}"
        )

    alt = (
        f"Two maps of the error of {against} over {found.across.label} and {found.down.label}, median and largest of "
        f"the designs in each of {found.median.size} cells. The median is smallest, {place(best)}; and largest, "
        f"{place(worst)}."
    )
    return Plot(
        key, size, draw, alt, f"Error of {against}, over {found.across.label} and {found.down.label}, in percent"
    )


def _cells(axes: Axes, found: Map, cells: FloatArray, norm: LogNorm) -> None:
    colours = mpl.colormaps[COLOURS]
    for row in range(found.down.count):
        for column in range(found.across.count):
            value = float(cells[row, column])
            if not np.isfinite(value):
                axes.add_patch(Rectangle((column, row), 1, 1, facecolor="none", edgecolor=GRID, hatch="///"))
                continue
            share = float(norm(max(value, norm.vmin or value)))
            shade = colours(share)
            colour = mpl.colors.to_hex(shade)
            axes.add_patch(Rectangle((column + 0.02, row + 0.02), 0.96, 0.96, facecolor=colour, edgecolor="none"))
            ink = ON_BRIGHT if _luminance(shade[:3]) > BRIGHT else ON_DARK
            told = f"{100 * value:.3g}"
            axes.text(column + 0.5, row + 0.62, told, color=ink, fontsize=8, ha="center", va="center")
            axes.text(column + 0.5, row + 0.25, number(int(found.cases[row, column])), color=ink, fontsize=6.5,
                      ha="center", va="center")  # fmt: skip
    axes.set_xlim(0, found.across.count)
    axes.set_ylim(0, found.down.count)
    axes.grid(visible=False)


def _luminance(colour: tuple[float, float, float]) -> float:
    """Return the relative luminance of an sRGB colour, as WCAG 2 defines it."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colour]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def _ticks(axes: Axes, found: Map, with_rows: bool) -> None:
    for bins, axis in ((found.across, axes.xaxis), (found.down, axes.yaxis)):
        at = np.arange(bins.count) + 0.5 if bins.own else np.arange(bins.count + 1)
        axis.set_ticks(at, [f"{edge:.3g}" for edge in bins.edges])
    axes.tick_params(labelleft=with_rows)
    if with_rows:
        axes.set_ylabel(found.down.label)


def _table(place: int, found: Map, against: str) -> Table:
    names = [f"{found.down.label} \\ {found.across.label}", *(found.across.text(k) for k in range(found.across.count))]
    rows = []
    for row in reversed(range(found.down.count)):
        cells = [Cell(found.down.text(row), float(found.down.edges[row]))]
        for column in range(found.across.count):
            median, worst = float(found.median[row, column]), float(found.worst[row, column])
            if not np.isfinite(median):
                cells.append(Cell("–"))
                continue
            count = number(int(found.cases[row, column]))
            cells.append(Cell(f"{percent(median)}, {percent(worst)} ({count})", median))
        rows.append(tuple(cells))
    return Table(
        f"map-{place + 1}",
        f"The first map as numbers: error of {against} over {found.down.label} (rows) and {found.across.label} "
        "(columns).",
        columns(names, numeric=names[1:]),
        tuple(rows),
        "In each cell the median, the largest, and in brackets the number of designs. Columns sort by the median.",
    )
