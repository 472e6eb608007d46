"""The lines of torque figures and of their error panels."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from workbench.arrays import FloatArray
from workbench.campaign.verdict import WITHOUT_BOUND
from workbench.report.layout import SMALLEST_DRAWN, log_axis
from workbench.report.load import ErrorRow, Run, Series
from workbench.report.style import ALARM, INK, PALETTE

DASHES = ("-", (0, (5, 1.6)), (0, (1, 1.2)), (0, (5, 1.4, 1, 1.4)))
MARKERS = ("o", "s", "D", "^")
DASH_UNIT = 3.5
"""Length of one dash, in line widths, where several candidates share one line in turn."""
MARKED_SAMPLES = 28
"""Markers in one panel, shared by its references."""
LONGEST_NAME = 32
"""Longer names are cut in legends; the tables hold them whole."""
ERROR_POINTS = (60, 120)
"""An error curve with more samples is drawn as the largest value of as many bins: no peak is lost; fewer bins where
many curves share a panel."""
CURVE_BINS = 900
"""Bins of all error curves of a panel together, within those limits."""


@dataclass(frozen=True)
class Curve:
    """One line of a torque figure: ``cand:NAME`` or ``ref:MASS_MODEL``."""

    name: str
    is_reference: bool
    recorded: bool = False
    """torques from elsewhere, drawn with the band of their uncertainty"""

    @classmethod
    def parse(cls, text: str) -> Curve | None:
        """Read ``cand:NAME`` or ``ref:MASS_MODEL``; None for anything else."""
        kind, _, name = text.partition(":")
        return cls(name, kind == "ref") if kind in ("cand", "ref") and name else None

    def column(self, joint: str) -> str:
        """Name of the series' column."""
        return f"{'ref' if self.is_reference else 'rec' if self.recorded else 'cand'}_{self.name}_{joint}"

    @property
    def label(self) -> str:
        """Name in legends and alt texts."""
        name = self.name if len(self.name) <= LONGEST_NAME else f"{self.name[: LONGEST_NAME - 1]}…"
        return f"reference: {name}" if self.is_reference else name


@dataclass(frozen=True)
class ErrorCurve:
    """One line of an error panel, with its worst moment where the summary knows it."""

    time: FloatArray
    error: FloatArray
    color: str
    is_modelling: bool
    label: str
    worst: tuple[float, float] | None = None


def platform_lines(axes: Axes, run: Run, series: Series, prefix: str) -> None:
    """Draw the platform's ``x``, ``xd`` or ``xdd`` (*prefix*) along each axis."""
    for index, name in enumerate(run.manifest.platform_axes):
        axes.plot(
            series["t"],
            series[f"{prefix}{index + 1}"],
            color=PALETTE[index % 6],
            linestyle=DASHES[index % 4],
            label=name,
        )


def torque_lines(axes: Axes, run: Run, series: Series, joint: str, curves: Sequence[Curve]) -> None:
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
        band = series.get(f"band_{curve.name}_{joint}") if curve.recorded else None
        reference = series.get(references[0].column(joint)) if references else None
        if band is not None and reference is not None:
            low, high = reference - band, reference + band
            axes.fill_between(time, low, high, color=PALETTE[index % 6], alpha=0.2, linewidth=0.0)
    step = max(1, len(references) * len(time) // MARKED_SAMPLES)
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


def error_of_row(row: ErrorRow, series: Series, color: str) -> ErrorCurve | None:
    """Return the error behind a row of the summary over time; None where the series does not hold it."""
    candidate = series.get(Curve(row.candidate, False, row.kind == "recorded").column(row.joint))
    reference = series.get(Curve(row.reference, True).column(row.joint))
    if candidate is None or reference is None or not row.normaliser > 0:
        return None
    error = np.abs(candidate - reference) / row.normaliser
    label = f"{row.candidate} − {row.reference}"
    measured = row.kind in WITHOUT_BOUND
    return ErrorCurve(series["t"], error, color, measured, label, (row.worst_time_s, row.peak_error))


def error_panel(axes: Axes, curves: Sequence[ErrorCurve], bounds: Iterable[float]) -> None:
    """Draw errors on a logarithmic axis with the worst moment of each and the bounds as lines."""
    low, high = math.inf, -math.inf
    bins = int(np.clip(CURVE_BINS // max(1, len(curves)), *ERROR_POINTS))
    for curve in curves:
        time, error = _envelope(curve.time, np.maximum(curve.error, SMALLEST_DRAWN), bins)
        style = (0, (3, 1)) if curve.is_modelling else "-"
        axes.plot(time, error, color=curve.color, linewidth=0.8, linestyle=style, label=curve.label)
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
    log_axis(axes, low, high)
    axes.set_ylabel("relative error")


def _envelope(time: FloatArray, error: FloatArray, bins: int) -> tuple[FloatArray, FloatArray]:
    if len(time) <= bins:
        return time, error
    starts = np.linspace(0, len(time), bins, endpoint=False).astype(int)
    return time[starts], np.maximum.reduceat(error, starts)
