"""Figures of a study: tracking error over rate and over speed, one line for each controller with its model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from matplotlib.figure import FigureBase
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from workbench.report.control.load import StudyRun
from workbench.report.curves import DASHES
from workbench.report.layout import WIDE, figure_legend, legend_rows, log_axis, stack
from workbench.report.plot import Plot
from workbench.report.style import ALARM, PALETTE
from workbench.report.text import slug

RATE, SPEED = "rate", "speed"
LABELS = {RATE: "control rate [Hz]", SPEED: "speed of the motion, of the case's own"}


def number_of_rate(row: dict[str, Any]) -> bool:
    """Whether a run's rate is one that the campaign gives as a number."""
    return bool(row["rate_asked"] != "printed cost")


def lines_over(
    run: StudyRun, over: str, case: str, fixed: float, bandwidth: float
) -> dict[str, list[tuple[float, float, float]]]:
    """Controller and model -> (abscissa, rms error of the platform in mm, how well it is known), in order.

    *fixed* is the speed of curves over the rate, and the rate of curves over the speed.
    """
    other = SPEED if over == RATE else RATE
    found: dict[str, list[tuple[float, float, float]]] = {}
    for row in run.runs:
        error = run.platform(row)
        if row["case"] != case or row["bandwidth"] != bandwidth or error is None or not number_of_rate(row):
            continue
        if not math.isclose(row[other], fixed):
            continue
        known = [abs(error[r] - error["rms"]) for r in ("rms_halved", "rms_second") if is_number(error[r])]
        found.setdefault(run.place(row).name, []).append(
            (row[over], 1e3 * error["rms"], 1e3 * max(known, default=math.nan))
        )
    return {name: sorted(points) for name, points in found.items()}


def is_number(value: Any) -> bool:
    """Whether a stored figure is there."""
    return value is not None and math.isfinite(value)


def curve(run: StudyRun, over: str, case: str, fixed: float, bandwidth: float) -> Plot | None:
    """Draw one figure; None where fewer than two abscissae are known."""
    lines = {name: points for name, points in lines_over(run, over, case, fixed, bandwidth).items() if len(points) > 1}
    if not lines:
        return None
    wanted = 1e3 * run.study.wanted_m
    values = [value for points in lines.values() for _, value, _ in points]

    def draw(figure: FigureBase) -> None:
        axes = stack(figure, [1.0], header=legend_rows(len(lines), 2), over=LABELS[over])[0]
        for turn, (name, points) in enumerate(lines.items()):
            axes.errorbar(
                [p[0] for p in points], [p[1] for p in points],
                yerr=[0.0 if math.isnan(p[2]) else min(p[2], 0.99 * p[1]) for p in points],
                label=name, color=PALETTE[turn % 6], linestyle=DASHES[turn % 4], marker="o", markersize=3,
                linewidth=1.2,
            )  # fmt: skip
        log_axis(axes, min([*values, wanted]), max([*values, wanted]))
        axes.axhline(wanted, color=ALARM, linewidth=0.9, linestyle=(0, (6, 2)))
        axes.set_xscale("log")
        ticks = sorted({p[0] for points in lines.values() for p in points})
        axes.xaxis.set_major_locator(FixedLocator(sparse(ticks)))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.set_ylabel("platform, rms [mm]")
        figure_legend(figure, axes, columns=2)

    held = f"speed {fixed:g}" if over == RATE else f"{fixed:g} Hz"
    said = "; ".join(f"{name}: {_ends(points)}" for name, points in lines.items())
    key = f"figure-control-{over}-{slug(case)}-{bandwidth:g}".replace(".", "-")
    alt = f"Tracking error of the platform over {LABELS[over]} in {case}, {held}, bandwidth {bandwidth:g} Hz: {said}."
    caption = f"{case}, {held}, bandwidth {bandwidth:g} Hz; dashed: the wanted {wanted:g} mm"
    return Plot(key, WIDE, draw, alt, caption)


def sparse(ticks: Sequence[float]) -> list[float]:
    """At most seven of the places on an axis, evenly taken."""
    return list(ticks) if len(ticks) <= 7 else list(ticks[:: math.ceil(len(ticks) / 7)])


def _ends(points: Sequence[tuple[float, float, float]]) -> str:
    return f"{points[0][1]:.3g} mm at {points[0][0]:g}, {points[-1][1]:.3g} mm at {points[-1][0]:g}"
