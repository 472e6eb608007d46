"""The figures of a report, drawn from stored series; one function per kind of figure.

Numbers that a figure marks (worst moment, normaliser, bound, peak speed) come from summary.csv and manifest.json.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter

from workbench.arrays import FloatArray
from workbench.report.load import ErrorRow, Run, Series
from workbench.report.manifest import FigureRecord
from workbench.report.style import ALARM, INK, PALETTE, new_figure, svg_of
from workbench.report.text import exact, pretty_unit, scientific

DASHES = ("-", (0, (5, 1.6)), (0, (1, 1.2)), (0, (5, 1.4, 1, 1.4)))
MARKERS = ("o", "s", "D", "^")
DASH_UNIT = 3.5
"""Length of one dash, in line widths, where several candidates share one line in turn."""
MARKED_SAMPLES = 24
ERROR_POINTS = 400
"""An error curve with more samples is drawn as the largest value of as many bins: no peak is lost."""
SMALLEST_DRAWN = 1e-17

SMALL = (4.4, 3.5)
WIDE = (7.2, 4.4)


@dataclass(frozen=True)
class Plot:
    """A drawn figure: the file-safe key, the SVG, the text for those who cannot see it and a caption."""

    key: str
    svg: str
    alt: str
    caption: str


@dataclass(frozen=True)
class Curve:
    """One line of a torque figure: ``cand:NAME`` or ``ref:MASS_MODEL``."""

    name: str
    is_reference: bool

    @classmethod
    def parse(cls, text: str) -> Curve | None:
        """Read ``cand:NAME`` or ``ref:MASS_MODEL``; None for anything else."""
        kind, _, name = text.partition(":")
        return cls(name, kind == "ref") if kind in ("cand", "ref") and name else None

    def column(self, joint: str) -> str:
        """Name of the series' column."""
        return f"{'ref' if self.is_reference else 'cand'}_{self.name}_{joint}"

    @property
    def label(self) -> str:
        """Name in legends and alt texts."""
        return f"reference: {self.name}" if self.is_reference else self.name


@dataclass(frozen=True)
class ErrorCurve:
    """One line of an error panel, with its worst moment where the summary knows it."""

    time: FloatArray
    error: FloatArray
    color: str
    is_verification: bool
    worst: tuple[float, float] | None = None


def motion_plots(run: Run, case: str, key: str, series: Series) -> list[Plot]:
    """Draw the actuated coordinates, the platform's position, and its speed and acceleration."""
    manifest = run.manifest
    record = manifest.cases[case]
    time = series["t"]
    units = list(dict.fromkeys(manifest.coordinate_units))
    figure = new_figure(*SMALL)
    for axes, unit in zip(_stack(figure, [1.0] * len(units)), units, strict=True):
        for index, joint in enumerate(manifest.joints):
            if manifest.coordinate_units[index] == unit:
                axes.plot(time, series[joint], color=PALETTE[index % 6], linestyle=DASHES[index % 4], label=joint)
        axes.set_ylabel(f"[{pretty_unit(unit)}]")
        _legend(axes)
    joints = Plot(
        f"{key}-joints",
        svg_of(figure, f"{key}-joints"),
        f"Actuated coordinates {', '.join(manifest.joints)} over time in case {case}.",
        "Actuated coordinates",
    )
    figure = new_figure(*SMALL)
    (axes,) = _stack(figure, [1.0])
    _platform_lines(axes, run, series, "x")
    axes.set_ylabel("[m]")
    _legend(axes)
    platform = Plot(
        f"{key}-platform",
        svg_of(figure, f"{key}-platform"),
        f"Platform position {', '.join(manifest.platform_axes)} over time in case {case}.",
        "Platform position (reference)",
    )
    figure = new_figure(*SMALL)
    peaks = (
        ("xd", "speed [m/s]", record.peak_speed, record.speed_at_s),
        ("xdd", "acceleration [m/s²]", record.peak_acceleration, record.acceleration_at_s),
    )
    for index, (axes, (prefix, label, peak, at)) in enumerate(zip(_stack(figure, [1.0, 1.0]), peaks, strict=True)):
        size = np.sqrt(sum(series[f"{prefix}{k + 1}"] ** 2 for k in range(len(manifest.platform_axes))))
        axes.plot(time, size, color=PALETTE[index])
        axes.set_ylabel(label)
        axes.set_ylim(0, 1.18 * float(np.nanmax(size)) or 1.0)
        if peak is not None and at is not None:
            _mark(axes, at, peak, f"{peak:.4g}")
    speed = Plot(
        f"{key}-speed",
        svg_of(figure, f"{key}-speed"),
        f"Size of the platform's velocity and acceleration over time in case {case}; "
        f"peaks {exact(record.peak_speed)} m/s and {exact(record.peak_acceleration)} m/s².",
        "Platform speed and acceleration (reference)",
    )
    return [joints, platform, speed]


def torque_plots(run: Run, case: str, key: str, series: Series) -> list[Plot]:
    """Draw, per joint, candidates and references in one panel and every error of summary.csv below it."""
    plots = []
    for index, joint in enumerate(run.manifest.joints):
        rows = [row for row in run.rows_of_case[case] if row.joint == joint]
        if not rows:
            continue
        unit = pretty_unit(run.manifest.force_units[index])
        names = list(dict.fromkeys(row.candidate for row in rows))
        curves = [Curve(name, False) for name in names]
        curves += [Curve(name, True) for name in dict.fromkeys(row.reference for row in rows)]
        figure = new_figure(*SMALL)
        above, below = _stack(figure, [1.25, 1.0], header=_legend_rows(len(curves)))
        _torque_lines(above, run, series, joint, curves)
        above.set_ylabel(f"{joint} [{unit}]")
        _figure_legend(figure, above)
        errors = [_error_of_row(row, series, PALETTE[names.index(row.candidate) % 6]) for row in rows]
        _error_panel(below, [e for e in errors if e is not None], [row.bound for row in rows if row.bound])
        figure_key = f"{key}-torque-{index + 1}"
        worst = max(rows, key=lambda row: row.badness)
        plots.append(
            Plot(
                figure_key,
                svg_of(figure, figure_key),
                f"Case {case}, joint {joint}: force or torque in {unit} over time of {', '.join(c.label for c in curves)}; "
                f"below, the error relative to the reference's peak on a logarithmic axis. Worst against its bound: "
                f"{worst.candidate} against the {worst.reference} reference, {scientific(worst.peak_error)}.",
                f"Joint {joint}: force or torque above, error over the reference's peak below",
            )
        )
    return plots


def campaign_plot(run: Run, record: FigureRecord, key: str, series: Series) -> Plot | str:
    """Draw a figure that the campaign declares, or say in a sentence why it cannot be drawn."""
    if record.kind == "torque":
        return _campaign_torque(run, record, key, series)
    prefix = {"platform": "x", "platform_velocity": "xd", "platform_acceleration": "xdd"}[record.kind]
    label = {"x": "position [m]", "xd": "velocity [m/s]", "xdd": "acceleration [m/s²]"}[prefix]
    figure = new_figure(WIDE[0], 3.4)
    (axes,) = _stack(figure, [1.0], header=0)
    _platform_lines(axes, run, series, prefix)
    axes.set_ylabel(f"platform {label}")
    _legend(axes)
    alt = f"{record.title}: platform {label} along {', '.join(run.manifest.platform_axes)} over time, case {record.case}."
    return Plot(key, svg_of(figure, key), alt, record.title)


def _campaign_torque(run: Run, record: FigureRecord, key: str, series: Series) -> Plot | str:
    joint = record.joint
    if joint not in run.manifest.joints:
        return f"Not drawn: joint {joint!r} is not one of {', '.join(run.manifest.joints)}."
    curves = []
    for text in record.curves:
        curve = Curve.parse(text)
        if curve is None or curve.column(joint) not in series:
            return f"Not drawn: the stored results of case {record.case} have no curve {text!r}."
        curves.append(curve)
    if not curves:
        return "Not drawn: the figure names no curves."
    unit = pretty_unit(run.manifest.unit_of(joint))
    figure = new_figure(*WIDE)
    above, below = _stack(figure, [2.6, 1.0], header=_legend_rows(len(curves), columns=4))
    _torque_lines(above, run, series, joint, curves)
    above.set_ylabel(f"{joint} [{unit}]")
    _figure_legend(figure, above, columns=4)
    candidates = [curve.name for curve in curves if not curve.is_reference]
    errors, said = [], []
    for curve, base in error_pairs(run, curves):
        reference = series[base.column(joint)]
        peak = float(np.max(np.abs(reference)))
        if peak > 0:
            error = np.abs(series[curve.column(joint)] - reference) / peak
            color = PALETTE[candidates.index(curve.name) % 6]
            same = base.is_reference and run.manifest.candidates[curve.name].mass_model == base.name
            errors.append(ErrorCurve(series["t"], error, color, same))
            said.append(f"{curve.label} against {base.label}")
    _error_panel(below, errors, [])
    comparison = f"; below, the error of {' and of '.join(said)} over the latter's peak" if said else ""
    alt = f"{record.title}: {joint} in {unit} over time of {', '.join(c.label for c in curves)}{comparison}."
    return Plot(key, svg_of(figure, key), alt, record.title)


def error_pairs(run: Run, curves: Sequence[Curve]) -> list[tuple[Curve, Curve]]:
    """Pair each candidate of a figure with what its error panel holds it against.

    That is the reference of its own mass model, else the figure's first reference, else the figure's last candidate.
    """
    candidates = [curve for curve in curves if not curve.is_reference and curve.name in run.manifest.candidates]
    references = [curve for curve in curves if curve.is_reference]
    if not references:
        return [(curve, candidates[-1]) for curve in candidates[:-1]]
    pairs = []
    for curve in candidates:
        own = Curve(run.manifest.candidates[curve.name].mass_model, True)
        pairs.append((curve, own if own in references else references[0]))
    return pairs


def _platform_lines(axes: Axes, run: Run, series: Series, prefix: str) -> None:
    for index, name in enumerate(run.manifest.platform_axes):
        axes.plot(
            series["t"],
            series[f"{prefix}{index + 1}"],
            color=PALETTE[index % 6],
            linestyle=DASHES[index % 4],
            label=name,
        )


def _torque_lines(axes: Axes, run: Run, series: Series, joint: str, curves: Sequence[Curve]) -> None:
    """Candidates as lines, references as open markers; candidates of one mass model take turns along one line."""
    time = series["t"]
    candidates = [curve for curve in curves if not curve.is_reference]
    references = [curve for curve in curves if curve.is_reference]
    families: dict[str, list[Curve]] = {}
    for curve in candidates:
        record = run.manifest.candidates.get(curve.name)
        families.setdefault(record.mass_model if record else curve.name, []).append(curve)
    for index, curve in enumerate(candidates):
        family = next(members for members in families.values() if curve in members)
        turn, count = family.index(curve), len(family)
        dashes = "-" if count == 1 else (turn * DASH_UNIT, (DASH_UNIT, (count - 1) * DASH_UNIT))
        values = series.get(curve.column(joint))
        if values is not None:
            axes.plot(time, values, color=PALETTE[index % 6], linestyle=dashes, label=curve.label)
    step = max(1, len(time) // MARKED_SAMPLES)
    for index, curve in enumerate(references):
        values = series.get(curve.column(joint))
        if values is not None:
            axes.plot(
                time,
                values,
                linestyle="none",
                color=INK,
                marker=MARKERS[index % 4],
                markersize=3.6,
                markerfacecolor="none",
                markeredgewidth=0.8,
                markevery=(index * step // max(1, len(references)), step),
                label=curve.label,
            )


def _error_of_row(row: ErrorRow, series: Series, color: str) -> ErrorCurve | None:
    candidate = series.get(Curve(row.candidate, False).column(row.joint))
    reference = series.get(Curve(row.reference, True).column(row.joint))
    if candidate is None or reference is None or not row.peak_reference > 0:
        return None
    error = np.abs(candidate - reference) / row.peak_reference
    return ErrorCurve(series["t"], error, color, row.is_verification, (row.worst_time_s, row.peak_error))


def _error_panel(axes: Axes, curves: Sequence[ErrorCurve], bounds: Iterable[float]) -> None:
    low, high = math.inf, -math.inf
    for curve in curves:
        time, error = _envelope(curve.time, np.maximum(curve.error, SMALLEST_DRAWN))
        style = "-" if curve.is_verification else (0, (3, 1))
        axes.plot(time, error, color=curve.color, linewidth=0.8, linestyle=style)
        low = min(low, float(np.nanquantile(error, 0.03)))
        high = max(high, float(np.nanmax(error)))
    for curve in curves:
        if curve.worst is not None and all(math.isfinite(v) for v in curve.worst):
            at, value = curve.worst
            axes.plot([at], [max(value, SMALLEST_DRAWN)], "v", color=curve.color, markersize=4.5, clip_on=False)
            high = max(high, value)
    for bound in sorted(set(bounds)):
        axes.axhline(bound, color=ALARM, linewidth=1.0, linestyle=(0, (6, 2)))
        axes.annotate(
            f"bound {bound:g}",
            (0.99, bound),
            (0, 2),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            ha="right",
            va="bottom",
            color=ALARM,
            fontsize=7.5,
        )
        low, high = min(low, bound), max(high, bound)
    if not low < math.inf:
        low, high = SMALLEST_DRAWN, 1.0
    _log_axis(axes, low, high)
    axes.set_ylabel("relative error")


def _log_axis(axes: Axes, low: float, high: float) -> None:
    """Whole decades, at most five labelled, written as plain text."""
    bottom = math.floor(math.log10(max(low, SMALLEST_DRAWN)))
    top = max(math.ceil(math.log10(high * 1.5)) if high < math.inf else 3, bottom + 2)
    axes.set_yscale("log")
    axes.set_ylim(10.0**bottom, 10.0**top)
    step = math.ceil((top - bottom) / 4)
    axes.yaxis.set_major_locator(FixedLocator([10.0**power for power in range(bottom, top + 1, step)]))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"1e{round(math.log10(value))}"))
    axes.minorticks_off()


def _envelope(time: FloatArray, error: FloatArray) -> tuple[FloatArray, FloatArray]:
    if len(time) <= ERROR_POINTS:
        return time, error
    starts = np.linspace(0, len(time), ERROR_POINTS, endpoint=False).astype(int)
    return time[starts], np.maximum.reduceat(error, starts)


def _stack(figure: Figure, heights: Sequence[float], header: int = 0) -> list[Axes]:
    """Panels one above the other on one time axis; *header* lines of room for a legend above them."""
    width, height = figure.get_size_inches()
    left, right, bottom, gap = 0.62 / width, 1 - 0.12 / width, 0.42 / height, 0.14 / height
    top = 1 - (0.1 + 0.165 * header) / height
    room = top - bottom - gap * (len(heights) - 1)
    panels: list[Axes] = []
    for share in heights:
        panel = room * share / sum(heights)
        axes = figure.add_axes((left, top - panel, right - left, panel), sharex=panels[0] if panels else None)
        axes.locator_params(nbins=5)
        axes.margins(x=0.01)
        top -= panel + gap
        panels.append(axes)
    for axes in panels[:-1]:
        axes.tick_params(labelbottom=False)
    panels[-1].set_xlabel("time [s]")
    figure.align_ylabels(panels)
    return panels


def _legend_rows(count: int, columns: int = 2) -> int:
    return math.ceil(count / columns)


def _figure_legend(figure: Figure, axes: Axes, columns: int = 2) -> None:
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
            columnspacing=1.2,
            handlelength=2.6,
        )


def _legend(axes: Axes) -> None:
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.18 * (high - low))  # room for the legend above the curves
    axes.legend(loc="upper right", ncols=4, borderaxespad=0.1, columnspacing=1.2, handlelength=2.4)


def _mark(axes: Axes, time: float, value: float, text: str) -> None:
    axes.plot([time], [value], "v", color=INK, markersize=4.5)
    axes.annotate(text, (time, value), (0, 4), textcoords="offset points", ha="center", va="bottom", fontsize=8)
