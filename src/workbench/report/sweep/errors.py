"""How large the errors of a sweep are: their distribution, and the share of designs that stay below a limit."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from workbench.arrays import FloatArray
from workbench.campaign.verdict import WITHOUT_BOUND
from workbench.report.curves import DASHES
from workbench.report.layout import SMALLEST_DRAWN, WIDE, figure_legend, legend_rows, size_of, stack
from workbench.report.plot import Plot
from workbench.report.section import Section
from workbench.report.style import ALARM, INK, PALETTE
from workbench.report.sweep.load import SweepRun
from workbench.report.sweep.summary import ANY_JOINT, ErrorRecord
from workbench.report.sweep.verdict import number
from workbench.report.tables import Cell, Table, columns
from workbench.report.text import exact, percent, scientific, slug, torque_label

LIMITS = (0.01, 0.02, 0.05, 0.1)
"""Modelling errors that designs are counted below, beside those that the campaign names."""
CURVE_POINTS = 240
"""Points of a curve of the distribution: more than pixels tell apart."""
BARS = 36
NARROW = 4.5
"""inches: figures that are drawn narrower have fewer numbers on their axes"""
LARGEST = "worst joint"
SHOWN_DRIVERS = 4
MATTERS = 0.06
"""Rank correlations below this are not named among what an error depends on."""


WHAT = {"modelling": "Modelling error", "unbounded": "Error, nothing judged,"}
"""What a comparison without a bound shows."""


def limits_of(run: SweepRun, candidate: str, reference: str) -> tuple[float, ...]:
    """Return the limits that designs are counted below."""
    row = run.summary.row(candidate, reference, ANY_JOINT)
    own = [float(text) for text in row.below] if row else []
    return tuple(sorted({*LIMITS, *own}))


def errors_section(run: SweepRun) -> Section | None:
    """Show, for each comparison, the distribution of the error over all designs; modelling errors first."""
    pairs = sorted(run.summary.pairs, key=lambda pair: pair[2] not in WITHOUT_BOUND)
    known = [pair for pair in pairs if np.isfinite(run.worst[pair[:2]]).any()]
    if not known:
        return None
    plots, tables, answers = [], [], []
    for place, (candidate, reference, kind) in enumerate(known):
        if kind in WITHOUT_BOUND:
            answers.append(_answer(run, candidate, reference))
        key = f"figure-errors-{slug(candidate)}-{slug(reference)}-{place + 1}"
        plots.append(_distribution_plot(run, key, candidate, reference, kind))
        tables.append(_table(run, place, candidate, reference, kind))
    return Section(
        "errors",
        "How large the errors are",
        "sweep",
        {"paragraphs": answers, "tables": tables, "figures": plots, "note": NOTE},
        tuple(plots),
    )


NOTE = (
    "Above, the share of designs whose peak error is below the abscissa: for each joint, and for the worst joint "
    "of each design. Below, how many designs fall into each of equal steps of the worst joint's error on the same "
    "logarithmic axis."
)


def _answer(run: SweepRun, candidate: str, reference: str) -> str:
    """Answer in words when a model is good enough."""
    row = run.summary.row(candidate, reference, ANY_JOINT)
    worst = run.worst[candidate, reference]
    known = worst[np.isfinite(worst)]
    where = f", in {row.worst_case}" if row and row.worst_case else ""
    shares = [
        f"{percent(float(np.mean(known < limit)))} below {percent_tick(limit)}"
        for limit in limits_of(run, candidate, reference)
    ]
    text = (
        f"{candidate} against the {reference} reference, on the worst joint of each of {number(len(known))} designs: "
        f"half of the designs stay below {percent(float(np.median(known)))}, 95 % below "
        f"{percent(float(np.quantile(known, 0.95)))}, and the worst reaches {percent(float(known.max()))}{where}. "
        f"{', '.join(shares)} of the reference's peak."
    )
    return text[:1].upper() + text[1:] + _dependence(run, candidate, reference)


def _dependence(run: SweepRun, candidate: str, reference: str) -> str:
    drivers = [
        d for d in run.summary.drivers_of(candidate, reference)[:SHOWN_DRIVERS] if abs(d.rank_correlation) >= MATTERS
    ]
    if not drivers:
        return ""
    said = []
    for verb, sign in (("rises with", 1), ("falls with", -1)):
        names = [
            f"{d.key.removeprefix('parameters.')} ({d.rank_correlation:+.2f})"
            for d in drivers
            if d.rank_correlation * sign > 0
        ]
        if names:
            said.append(f"{verb} {', '.join(names)}")
    bins = [b for b in run.summary.bins if (b.candidate, b.reference, b.key) == (candidate, reference, drivers[0].key)]
    tail = ""
    if len(bins) > 1:
        first, last = min(bins, key=lambda b: b.p95), max(bins, key=lambda b: b.p95)
        name = drivers[0].key.removeprefix("parameters.")
        tail = (
            f" With {name} from {exact(first.low, 3)} to {exact(first.high, 3)}, 95 % of the designs stay below "
            f"{percent(first.p95)}; from {exact(last.low, 3)} to {exact(last.high, 3)} half of them exceed "
            f"{percent(last.median)}."
        )
    return f" The error {' and '.join(said)} (rank correlation).{tail}"


def _table(run: SweepRun, place: int, candidate: str, reference: str, kind: str) -> Table:
    modelling = kind in WITHOUT_BOUND
    write = percent if modelling else scientific
    limits = limits_of(run, candidate, reference) if modelling else ()
    bound = run.bounds.get((candidate, reference))
    names = ["Joint", *(f"Below {percent_tick(limit)}" for limit in limits)]
    names += ["Median", "95 % below", "99 % below", "Largest"]
    names += ["in case", *([] if modelling else ["Bound"])]
    rows = []
    for joint in (ANY_JOINT, *run.manifest.joints):
        row = run.summary.row(candidate, reference, joint)
        if row is None or not row.cases:
            continue
        values = _values(run, candidate, reference, joint)
        cells = [Cell(LARGEST if joint == ANY_JOINT else torque_label(joint, run.manifest.unit_of(joint)))]
        for limit in limits:
            share = float(np.mean(values < limit))
            cells.append(Cell(percent(share), share))
        cells += [_quantile(row, name, write) for name in ("0.5", "0.95", "0.99")]
        cells.append(Cell("–" if row.max is None else write(row.max), row.max, emphasis=True))
        cells.append(Cell(row.worst_case or "–"))
        if not modelling:
            cells.append(Cell(exact(bound), bound))
        rows.append(tuple(cells))
    what = (
        f"{WHAT[kind]} of {candidate} against the {reference} reference, over all designs that were computed."
        if modelling
        else f"Verification of {candidate} against the {reference} reference: what remains in any design is rounding."
    )
    reading = (
        "Errors are peak errors, max|Δτ| / max|τ_ref| of a joint over a design's motion. “Worst joint” takes the "
        "largest of the joints in each design."
    )
    if modelling:
        reading += " “Below” is the share of designs whose error is smaller; nothing judges these errors."
    numeric = [name for name in names if name not in ("Joint", "in case")]
    return Table(f"errors-{place + 1}", what, columns(names, numeric=numeric), tuple(rows), reading)


def _quantile(row: ErrorRecord, name: str, write: object) -> Cell:
    value = row.quantiles.get(name)
    return Cell("–" if value is None else write(value), value)  # type: ignore[operator]


def _values(run: SweepRun, candidate: str, reference: str, joint: str) -> FloatArray:
    pair = (candidate, reference)
    values = run.worst[pair] if joint == ANY_JOINT else run.errors[pair][:, run.manifest.joints.index(joint)]
    return values[np.isfinite(values)]


def _distribution_plot(run: SweepRun, key: str, candidate: str, reference: str, kind: str) -> Plot:
    modelling = kind in WITHOUT_BOUND
    bound = run.bounds.get((candidate, reference))
    joints = run.manifest.joints
    worst = np.maximum(_values(run, candidate, reference, ANY_JOINT), SMALLEST_DRAWN)

    def draw(figure: FigureBase) -> None:
        above, below = stack(figure, [1.7, 1.0], header=legend_rows(len(joints) + 1, 4), over="peak error")
        lowest, highest = float(worst.min()), float(worst.max())
        for turn, joint in enumerate(joints):
            values = np.maximum(_values(run, candidate, reference, joint), SMALLEST_DRAWN)
            lowest = min(lowest, float(np.quantile(values, 0.01)))
            style = {"color": PALETTE[turn % 6], "linestyle": DASHES[turn % 4], "linewidth": 1.0}
            _share_curve(above, values, joint, **style)
        _share_curve(above, worst, LARGEST, color=INK, linewidth=1.8)
        edges = np.geomspace(float(worst.min()), max(highest, float(worst.min()) * 1.001), BARS + 1)
        counts, _ = np.histogram(worst, edges)
        below.stairs(counts, edges, fill=True, color=PALETTE[5])
        if bound is not None:
            highest = max(highest, bound)
            for axes in (above, below):
                axes.axvline(bound, color=ALARM, linewidth=1.0, linestyle=(0, (6, 2)))
            above.annotate(f"bound {bound:g}", (bound, 0.05), (-3, 0), xycoords=("data", "axes fraction"),
                           textcoords="offset points", color=ALARM, fontsize=7.5, ha="right", va="bottom")  # fmt: skip
        for axes in (above, below):
            _error_axis(axes, lowest / 1.15, highest * 1.15, modelling, size_of(figure)[0] < NARROW)
        above.set_ylim(0.0, 1.02)
        above.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:.0f} %"))
        above.set_ylabel("designs below")
        below.set_ylabel("designs")
        figure_legend(figure, above, columns=4)

    write = percent if modelling else scientific
    said = (
        f"median {write(float(np.median(worst)))}, 95 % below {write(float(np.quantile(worst, 0.95)))}, largest "
        f"{write(float(worst.max()))}"
    )
    against = f"{candidate} against the {reference} reference"
    alt = (
        f"Distribution of the peak error of {against} over {len(worst)} designs, for joints {', '.join(joints)} and "
        f"for the worst joint of each design: {said}" + (f"; bound {bound:g}." if bound is not None else ".")
    )
    return Plot(key, WIDE, draw, alt, f"{against}: {said}")


def _share_curve(axes: Axes, values: FloatArray, label: str, **style: object) -> None:
    """Draw the share of values below each value; as many points as can be told apart, the largest value among them."""
    shares = np.linspace(0.0, 1.0, min(CURVE_POINTS, len(values)))
    axes.plot(np.quantile(values, shares), shares, label=label, **style)  # type: ignore[arg-type]


def _error_axis(axes: Axes, low: float, high: float, modelling: bool, narrow: bool) -> None:
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    first, last = int(np.floor(np.log10(low))), int(np.ceil(np.log10(high)))
    if modelling and last - first <= 4:
        ticks = [base * 10.0**power for power in range(first, last + 1) for base in ((1,) if narrow else (1, 2, 5))]
    else:
        ticks = [10.0**power for power in range(first, last + 1, max(1, (last - first) // 5))]
    axes.xaxis.set_major_locator(FixedLocator([tick for tick in ticks if low <= tick <= high]))
    axes.xaxis.set_minor_locator(NullLocator())
    write = percent_tick if modelling else power_tick
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: write(value)))


def percent_tick(value: float) -> str:
    """Write ``0.5 %``, for the ticks of an axis."""
    return f"{100 * value:.3g} %"


def power_tick(value: float) -> str:
    """Write ``1e-12``, for the ticks of an axis."""
    return f"1e{round(np.log10(value))}"
