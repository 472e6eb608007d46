"""The figures that a campaign declares, most of them a paper's own, redrawn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
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
from workbench.report.text import exact, pretty_unit, torque_label, torque_name

LINEAR_FROM = 1e-4
"""Errors over cases that are all at least this large are drawn in percent from zero; smaller ones on a log axis."""

ONE_SIZE = 30.0
"""So are those of which the largest is no more than so many times the smallest."""

ROUNDING = 1e-9
"""A line of errors over cases that never rises above this is rounding."""

PANEL_HEIGHT = 1.55
"""inches"""

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
    return Plot(key, WIDE, draw, alt, record.title, anchor, declared=_declared(record))


def _declared(record: FigureRecord) -> str:
    # whether its source shows this robot is said beside a figure, not in it
    return record.model_dump_json(exclude={"not_about"})


def error_over_plot(run: Run, record: FigureRecord, key: str) -> Plot | str:
    """Draw the peak errors of several cases over the number that tells them apart, a line per candidate and joint."""
    names = [curve.name for text in record.curves if (curve := Curve.parse(text)) and not curve.is_reference]
    joints = [record.joint] if record.joint else list(run.manifest.joints)
    lines = [(name, joint) for name in names for joint in joints]
    by_line = {line: _errors_over(run, record, *line) for line in lines}
    drawn = [error for points in by_line.values() for _, error in points if math.isfinite(error)]
    if not drawn:
        return f"Not drawn: no stored error of {', '.join(names) or 'no curve'} against reference {record.reference}."

    rounding = {line for line, points in by_line.items() if all(not error > ROUNDING for _, error in points)}
    shown = [joint for joint in joints if any((name, joint) not in rounding for name in names)]
    # a panel a joint; what is nothing but rounding would squeeze the others together and has one of its own
    panels = [[line for line in lines if line[1] == joint and line not in rounding] for joint in shown]
    labels = [f"{torque_label(joint, run.manifest.unit_of(joint)).partition(' [')[0]}, peak error" for joint in shown]
    if rounding:
        panels.append([line for line in lines if line in rounding])
        labels.append("rounding")
    columns = min(len(names), 4)

    def draw(figure: FigureBase) -> None:
        header = legend_rows(len(names), columns)
        stacked = stack(figure, [1.0] * len(shown) + [0.6] * bool(rounding), header=header, over=record.label)
        for axes, drawn_here, label in zip(stacked, panels, labels, strict=True):
            for name, joint in drawn_here:
                points, turn = by_line[name, joint], names.index(name)
                axes.plot(
                    [x for x, _ in points],
                    [max(error, SMALLEST_DRAWN) for _, error in points],
                    color=PALETTE[turn % 6],
                    linestyle=DASHES[turn % 4],
                    marker=MARKERS[turn % 4],
                    markersize=4.5,
                )
            _error_axis(axes, [error for line in drawn_here for _, error in by_line[line] if math.isfinite(error)])
            axes.set_ylabel(label)
        for turn, name in enumerate(names):
            style: dict[str, Any] = {
                "color": PALETTE[turn % 6],
                "linestyle": DASHES[turn % 4],
                "marker": MARKERS[turn % 4],
            }
            stacked[0].plot([], [], markersize=4.5, label=name, **style)
        figure_legend(figure, stacked[0], columns)

    alt = (
        f"{record.title}: peak error against the {record.reference} reference over {record.label}, "
        f"for {', '.join(f'{name} on {joint}' for name, joint in lines)}; "
        f"from {exact(min(drawn), 3)} to {exact(max(drawn), 3)} of the reference's peak."
    )
    size = WIDE[0], 0.9 + PANEL_HEIGHT * (len(shown) + 0.6 * bool(rounding))
    return Plot(key, size, draw, alt, record.title)


def _error_axis(axes: Axes, errors: list[float]) -> None:
    """Percent from zero where the errors are of one size, a log axis elsewhere."""
    if not errors:
        return
    if min(errors) >= LINEAR_FROM and max(errors) <= ONE_SIZE * min(errors):
        axes.set_ylim(0.0, 1.08 * max(errors))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:.3g} %"))
    else:
        log_axis(axes, max(min(errors), SMALLEST_DRAWN), max(errors))


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
        above.set_ylabel(torque_label(joint, run.manifest.unit_of(joint)))
        figure_legend(figure, above, columns=4)
        error_panel(below, errors, [])

    comparison = f"; below, the error of {' and of '.join(said)} over the latter's peak" if said else ""
    shown = f"{torque_name(joint)} in {unit} over time of {', '.join(c.label for c in curves)}"
    alt = f"{record.title}: {shown}{comparison}."
    return Plot(key, WIDE, draw, alt, record.title, anchor, declared=_declared(record))


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
