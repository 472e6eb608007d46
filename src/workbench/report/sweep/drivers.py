"""Which numbers drive the modelling error of a sweep: rank correlations, and the error over each strong driver."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import FigureBase
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter, NullLocator

from workbench.report.layout import size_of
from workbench.report.light_axis import LightAxes
from workbench.report.plot import Plot
from workbench.report.section import Section
from workbench.report.style import INK, PALETTE
from workbench.report.sweep.errors import percent_tick
from workbench.report.sweep.load import SweepRun
from workbench.report.sweep.summary import BinRecord, DriverRecord
from workbench.report.sweep.varied import label_of, scale_of
from workbench.report.tables import Cell, Table, columns
from workbench.report.text import exact, percent, slug

BARS = 20
"""Keys in the figure, the strongest; the table holds them all."""
PANELS = 6
RISES, FALLS = PALETTE[1], PALETTE[0]
LABEL_ROOM = 1.5
"""inches for the names of keys beside the bars"""


def drivers_section(run: SweepRun) -> Section | None:
    """Show what every modelling error depends on; None where nothing was found."""
    pairs = list(dict.fromkeys((d.candidate, d.reference) for d in run.summary.drivers))
    if not pairs:
        return None
    plots, tables = [], []
    for place, (candidate, reference) in enumerate(pairs):
        drivers = run.summary.drivers_of(candidate, reference)
        against = f"{candidate} against the {reference} reference"
        stem = f"{slug(candidate)}-{slug(reference)}-{place + 1}"
        plots.append(_bars(f"figure-drivers-{stem}", drivers, against))
        bins = {
            driver.key: [
                b for b in run.summary.bins if (b.candidate, b.reference, b.key) == (candidate, reference, driver.key)
            ]
            for driver in drivers
        }
        shown = [driver for driver in drivers if bins[driver.key]][:PANELS]
        if shown:
            plots.append(_courses(run, f"figure-courses-{stem}", shown, bins, against))
        tables.append(_table(run, place, drivers, bins, against))
    context = {"paragraphs": [], "tables": tables, "figures": plots, "note": NOTE}
    return Section("drivers", "What drives the error", "sweep", context, tuple(plots))


NOTE = (
    "Spearman's rank correlation of each varied number with the error of the worst joint: +1 says that the error "
    "always rises with the number, −1 that it always falls, 0 that the order of one says nothing about the order of "
    "the other. Then the error over the strongest numbers, in bins with as many designs each: half of the designs of "
    "a bin are below the solid line, 95 % below the dashed one."
)


def _name(key: str) -> str:
    return key.removeprefix("parameters.")


def _bars(key: str, drivers: Sequence[DriverRecord], against: str) -> Plot:
    shown = drivers[:BARS]

    def draw(figure: FigureBase) -> None:
        width, height = size_of(figure)
        box = (LABEL_ROOM / width, 0.42 / height, 1 - (LABEL_ROOM + 0.15) / width, 1 - 0.55 / height)
        axes = figure.add_axes(box, axes_class=LightAxes)
        for place, driver in enumerate(reversed(shown)):
            value = driver.rank_correlation
            axes.add_patch(
                Rectangle((min(0.0, value), place - 0.36), abs(value), 0.72, color=RISES if value > 0 else FALLS)
            )
            outwards = 1 if value > 0 else -1
            axes.annotate(f"{value:+.2f}", (value, place), (3 * outwards, 0), textcoords="offset points", va="center",
                          ha="left" if value > 0 else "right", fontsize=8)  # fmt: skip
        axes.set_yticks(range(len(shown)), [_cut(_name(d.key)) for d in reversed(shown)])
        axes.set_ylim(-0.6, len(shown) - 0.4)
        axes.set_xlim(-1.12, 1.12)
        axes.set_xticks([-1.0, -0.5, 0.0, 0.5, 1.0])
        axes.axvline(0.0, color=INK, linewidth=0.8)
        axes.grid(axis="y", visible=False)
        axes.set_xlabel("rank correlation with the error")

    listed = ", ".join(f"{_name(d.key)} {d.rank_correlation:+.2f}" for d in shown)
    return Plot(
        key,
        (5.8, 0.65 + 0.27 * max(len(shown), 3)),
        draw,
        f"Rank correlation of the error of {against} with each varied number, strongest first: {listed}.",
        f"What the error of {against} rises with (orange, right) and falls with (blue, left)",
    )


def _cut(name: str) -> str:
    return name if len(name) <= 24 else f"{name[:23]}…"


def _courses(
    run: SweepRun, key: str, drivers: Sequence[DriverRecord], bins: dict[str, list[BinRecord]], against: str
) -> Plot:
    across = min(3, len(drivers))
    down = -(-len(drivers) // across)
    top = max(b.p95 for d in drivers for b in bins[d.key])

    def draw(figure: FigureBase) -> None:
        width, height = size_of(figure)
        room, tall = (width - 0.72 - 0.1) / across, (height - 0.12) / down
        for place, driver in enumerate(drivers):
            column, row = place % across, place // across
            corner = (0.72 + column * room) / width, 1 - (0.12 + (row + 1) * tall - 0.46) / height
            axes = figure.add_axes((*corner, (room - 0.16) / width, (tall - 0.56) / height), axes_class=LightAxes)
            record = run.key(driver.key)
            logarithmic = scale_of(run, driver.key) == "log" and bins[driver.key][0].low > 0
            centres = [
                (b.low * b.high) ** 0.5 if logarithmic else (b.low + b.high) / 2 for b in bins[driver.key]
            ]  # fmt: skip
            axes.plot(centres, [b.median for b in bins[driver.key]], color=PALETTE[0], marker="o", markersize=3)
            axes.plot(
                centres, [b.p95 for b in bins[driver.key]], color=PALETTE[1], marker="s", markersize=3, linestyle="--"
            )
            if logarithmic:
                axes.set_xscale("log")
                axes.xaxis.set_minor_locator(NullLocator())
                low, high = bins[driver.key][0].low, bins[driver.key][-1].high
                axes.set_xticks([low * (high / low) ** (k / 3) for k in range(4)])
                axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.2g}"))
            else:
                axes.locator_params(axis="x", nbins=5)
            axes.set_ylim(0.0, 1.06 * top)
            axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: percent_tick(value)))
            axes.tick_params(labelleft=column == 0)
            if column == 0:
                axes.set_ylabel("peak error")
            axes.set_xlabel(_cut(label_of(record) if record else _name(driver.key)))

    said = "; ".join(
        f"{_name(d.key)} from {exact(bins[d.key][0].low, 3)} to {exact(bins[d.key][-1].high, 3)}: median from "
        f"{percent(bins[d.key][0].median)} to {percent(bins[d.key][-1].median)}"
        for d in drivers
    )
    return Plot(
        key,
        (9.0, 0.12 + 2.0 * down),
        draw,
        f"Error of {against} over its strongest drivers, median and 95th percentile of bins with as many designs "
        f"each. {said}.",
        f"Error of {against} over the numbers that drive it most: solid blue the median, dashed orange what 95 % of "
        "the designs stay below",
    )


def _table(
    run: SweepRun, place: int, drivers: Sequence[DriverRecord], bins: dict[str, list[BinRecord]], against: str
) -> Table:
    rows = []
    for driver in drivers:
        record = run.key(driver.key)
        found = bins[driver.key]
        cells = [
            Cell(_name(driver.key)),
            Cell(record.meaning if record else ""),
            Cell(f"{driver.rank_correlation:+.3f}", driver.rank_correlation, emphasis=True),
            Cell(exact(driver.p_value, 2) if driver.p_value != 0 else "< 1e-300", driver.p_value),
        ]
        for end in (found[0], found[-1]) if found else ():
            cells.append(Cell(f"{exact(end.low, 3)} to {exact(end.high, 3)}", end.low))
            cells.append(Cell(percent(end.median), end.median))
            cells.append(Cell(percent(end.p95), end.p95))
        cells += [Cell("–")] * (10 - len(cells))
        rows.append(tuple(cells))
    names = ["Number", "Meaning", "Rank correlation", "p", "Lowest bin", "Median there", "95 % there"]
    names += ["Highest bin", "Median there", "95 % there"]
    return Table(
        f"drivers-{place + 1}",
        f"How the error of {against} depends on each varied number, the strongest first.",
        columns(names, numeric=names[2:]),
        tuple(rows),
        "The lowest and the highest bin hold the designs with the smallest and the largest values of the number, a "
        "tenth of all each. p is the probability of so large a correlation by chance; with thousands of designs even a "
        "correlation that matters little has a small one, so read the correlation first.",
    )
