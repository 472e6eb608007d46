"""The figures that a campaign declares, most of them a paper's own, redrawn."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import FigureBase
from matplotlib.ticker import FuncFormatter

from workbench.report.curves import (
    DASHES,
    MARKERS,
    Curve,
    ErrorCurve,
    error_panel,
    platform_lines,
    torque_lines,
)
from workbench.report.layout import SMALLEST_DRAWN, WIDE, figure_legend, legend, legend_rows, log_axis, stack
from workbench.report.load import Run, Series
from workbench.report.manifest import FigureRecord
from workbench.report.plot import Plot
from workbench.report.style import PALETTE
from workbench.report.text import exact, pretty_unit

LINEAR_FROM = 1e-4
"""Errors over cases that are all at least this large are drawn in percent from zero; smaller ones on a log axis."""

PLATFORM = {
    "platform": ("x", "position [m]"),
    "platform_velocity": ("xd", "velocity [m/s]"),
    "platform_acceleration": ("xdd", "acceleration [m/s²]"),
}
"""Kind of figure -> the series' columns and the label."""


def campaign_plot(run: Run, record: FigureRecord, key: str, series: Series, anchor: str) -> Plot | str:
    """Draw a figure of one case that the campaign declares, or say in a sentence why it cannot be drawn."""
    if record.kind == "torque":
        return _campaign_torque(run, record, key, series, anchor)
    if record.kind not in PLATFORM:
        return f"Not drawn: this version knows no figure of kind {record.kind!r}."
    prefix, label = PLATFORM[record.kind]

    def draw(figure: FigureBase) -> None:
        (axes,) = stack(figure, [1.0])
        platform_lines(axes, run, series, prefix)
        axes.set_ylabel(f"platform {label}")
        legend(axes)

    axes_names = ", ".join(run.manifest.platform_axes)
    alt = f"{record.title}: platform {label} along {axes_names} over time, case {record.case}."
    return Plot(key, WIDE, draw, alt, record.title, anchor)


def error_over_plot(run: Run, record: FigureRecord, key: str) -> Plot | str:
    """Draw the peak errors of several cases over the number that tells them apart, a line per candidate and joint."""
    names = [curve.name for text in record.curves if (curve := Curve.parse(text)) and not curve.is_reference]
    joints = [record.joint] if record.joint else list(run.manifest.joints)
    lines = [(name, joint) for name in names for joint in joints]
    columns = 3 if len(joints) == 3 else 4
    by_line = {line: _errors_over(run, record, *line) for line in lines}
    drawn = [error for points in by_line.values() for _, error in points if math.isfinite(error)]
    if not drawn:
        return f"Not drawn: no stored error of {', '.join(names) or 'no curve'} against reference {record.reference}."

    def draw(figure: FigureBase) -> None:
        (axes,) = stack(figure, [1.0], header=legend_rows(len(lines), columns), over=record.label)
        for (name, joint), points in by_line.items():
            turn = joints.index(joint)
            axes.plot(
                [x for x, _ in points],
                [max(error, SMALLEST_DRAWN) for _, error in points],
                color=PALETTE[names.index(name) % 6],
                linestyle=DASHES[turn % 4],
                marker=MARKERS[turn % 4],
                markersize=4.5,
                label=f"{name}, {joint}",
            )
        if min(drawn) >= LINEAR_FROM:
            axes.set_ylim(0.0, 1.08 * max(drawn))
            axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:.3g} %"))
        else:
            log_axis(axes, max(min(drawn), SMALLEST_DRAWN), max(drawn))
        axes.set_ylabel("peak error")
        figure_legend(figure, axes, columns)

    alt = (
        f"{record.title}: peak error against the {record.reference} reference over {record.label}, "
        f"for {', '.join(f'{name} on {joint}' for name, joint in lines)}; "
        f"from {exact(min(drawn), 3)} to {exact(max(drawn), 3)} of the reference's peak."
    )
    return Plot(key, WIDE, draw, alt, record.title)


def _errors_over(run: Run, record: FigureRecord, name: str, joint: str) -> list[tuple[float, float]]:
    by_case = {
        row.case: row.peak_error
        for row in run.rows
        if (row.candidate, row.reference, row.joint) == (name, record.reference, joint)
    }
    return [(x, by_case[c]) for c, x in zip(record.cases, record.abscissa, strict=False) if c in by_case]


def _campaign_torque(run: Run, record: FigureRecord, key: str, series: Series, anchor: str) -> Plot | str:
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
    candidates = [curve.name for curve in curves if not curve.is_reference]
    errors, said = [], []
    for curve, base in error_pairs(run, curves):
        reference = series[base.column(joint)]
        peak = float(np.max(np.abs(reference)))
        if peak > 0:
            error = np.abs(series[curve.column(joint)] - reference) / peak
            color = PALETTE[candidates.index(curve.name) % 6]
            same = base.is_reference and run.manifest.candidates[curve.name].mass_model == base.name
            label = f"{curve.label} − {base.label}"
            errors.append(ErrorCurve(series["t"], error, color, is_modelling=not same, label=label))
            said.append(f"{curve.label} against {base.label}")

    def draw(figure: FigureBase) -> None:
        above, below = stack(figure, [2.6, 1.0], header=legend_rows(len(curves), columns=4))
        torque_lines(above, run, series, joint, curves)
        above.set_ylabel(f"{joint} [{unit}]")
        figure_legend(figure, above, columns=4)
        error_panel(below, errors, [])

    comparison = f"; below, the error of {' and of '.join(said)} over the latter's peak" if said else ""
    alt = f"{record.title}: {joint} in {unit} over time of {', '.join(c.label for c in curves)}{comparison}."
    return Plot(key, WIDE, draw, alt, record.title, anchor)


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
