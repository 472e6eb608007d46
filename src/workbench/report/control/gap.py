"""What a model adds to the error that remains anyway: over speed and rate as figures, at every place as a table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.figure import FigureBase
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from workbench.report.control.curves import LABELS, RATE, SPEED, is_number, sparse
from workbench.report.control.load import MOST_ROWS, StudyRun
from workbench.report.curves import DASHES
from workbench.report.layout import WIDE, figure_legend, legend_rows, stack
from workbench.report.plot import Plot
from workbench.report.section import Section
from workbench.report.style import ALARM, PALETTE
from workbench.report.tables import Cell, Table, columns
from workbench.report.text import slug


@dataclass(frozen=True)
class Gap:
    """One model at one place of a study, held against the model that errs least."""

    case: str
    controller: str
    model: str
    speed: float
    rate: float
    bandwidth: float
    share: float
    """E / E0 - 1"""
    known: float
    """how much another step or route changes the share; NaN where there is none"""
    error: float
    """m, E"""
    remains: float
    """m, E0"""


def gap_section(run: StudyRun) -> Section | None:
    """The error that a model adds, as a share of what remains anyway, at every place that two models share."""
    by_place: dict[tuple[Any, ...], dict[str, dict[str, Any]]] = {}
    for row in run.runs:
        error = run.platform(row)
        if error is not None and row["model"] != "none" and row["rate_asked"] != "printed cost":
            place = row["case"], row["controller"], row["speed"], row["rate"], row["bandwidth"]
            by_place.setdefault(place, {})[row["model"]] = error
    models = list(dict.fromkeys(row["model"] for row in run.runs if row["model"] != "none"))
    if len(models) < 2:
        return None
    least = _best_model(by_place, models)
    gaps = [
        _gap(place, model, error, errors[least])
        for place, errors in by_place.items()
        if least in errors
        for model, error in errors.items()
        if model != least
    ]
    if not gaps:
        return None
    plots = [
        plot
        for case in dict.fromkeys(gap.case for gap in gaps)
        for over in (SPEED, RATE)
        if (plot := gap_curve(gaps, over, case, least, run.study.enough)) is not None
    ]
    context = {
        "paragraphs": _where_it_matters(run, gaps),
        "tables": [_table(run, gaps, least)],
        "figures": plots,
        "note": f"Platform's rms error, in percent above what remains with {least}, all else equal. Linear below 10 %,"
        " logarithmic above; bars: what half the step or MuJoCo's route changes.",
    }
    return Section("gap", "What the model adds", "sweep", context, tuple(plots))


def _gap(place: tuple[Any, ...], model: str, error: dict[str, Any], least: dict[str, Any]) -> Gap:
    share = error["rms"] / least["rms"] - 1.0
    others = [
        error[r] / least[r] - 1.0 for r in ("rms_halved", "rms_second") if is_number(error[r]) and is_number(least[r])
    ]
    known = max((abs(value - share) for value in others), default=math.nan)
    case, controller, speed, rate, bandwidth = place
    return Gap(case, controller, model, speed, rate, bandwidth, share, known, error["rms"], least["rms"])


def _best_model(by_place: dict[tuple[Any, ...], dict[str, dict[str, Any]]], models: list[str]) -> str:
    """The model with the least errors, summed as logarithms over the places that all share."""
    shared = [errors for errors in by_place.values() if all(model in errors for model in models)]
    return min(models, key=lambda model: sum(math.log(max(errors[model]["rms"], 1e-12)) for errors in shared))


def gap_lines(gaps: Sequence[Gap], over: str, case: str, held: float, bandwidth: float) -> dict[str, list[Gap]]:
    """Controller and model -> what the model adds along *over*, in order; *held* is the other of speed and rate."""
    other = SPEED if over == RATE else RATE
    found: dict[str, list[Gap]] = {}
    for gap in gaps:
        if gap.case == case and gap.bandwidth == bandwidth and math.isclose(getattr(gap, other), held):
            found.setdefault(f"{gap.controller}, {gap.model}", []).append(gap)
    lines = {name: sorted(line, key=lambda gap: float(getattr(gap, over))) for name, line in found.items()}
    return {name: line for name, line in lines.items() if len(line) > 1}


def gap_curve(gaps: Sequence[Gap], over: str, case: str, least: str, enough: float) -> Plot | None:
    """Draw what models add over speed or rate, one line for each controller with its model."""
    other = SPEED if over == RATE else RATE
    places = sorted({getattr(gap, other) for gap in gaps})
    held = min(places, key=lambda value: abs(math.log(value))) if over == RATE else places[len(places) // 2]
    widths = sorted({gap.bandwidth for gap in gaps})
    bandwidth = widths[(len(widths) - 1) // 2]
    lines = gap_lines(gaps, over, case, held, bandwidth)
    if not lines:
        return None

    def draw(figure: FigureBase) -> None:
        axes = stack(figure, [1.0], header=legend_rows(len(lines), 2), over=LABELS[over])[0]
        for turn, (name, line) in enumerate(lines.items()):
            axes.errorbar(
                [getattr(gap, over) for gap in line], [100 * gap.share for gap in line],
                yerr=[0.0 if math.isnan(gap.known) else 100 * gap.known for gap in line],
                label=name, color=PALETTE[turn % 6], linestyle=DASHES[turn % 4], marker="o", markersize=3,
                linewidth=1.2,
            )  # fmt: skip
        axes.set_yscale("symlog", linthresh=10.0)
        axes.axhline(0.0, color="0.6", linewidth=0.6)
        axes.axhline(100 * enough, color=ALARM, linewidth=0.9, linestyle=(0, (6, 2)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(
            FixedLocator(sparse(sorted({getattr(g, over) for ln in lines.values() for g in ln})))
        )
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.set_ylabel("added by the model [%]")
        figure_legend(figure, axes, columns=2)

    at = f"speed {held:g}" if over == RATE else f"{held:g} Hz"
    said = "; ".join(
        f"{name}: {100 * line[0].share:+.3g} % at {getattr(line[0], over):g}, {100 * line[-1].share:+.3g} % at"
        f" {getattr(line[-1], over):g}"
        for name, line in lines.items()
    )
    key = f"figure-control-gap-{over}-{slug(case)}".replace(".", "-")
    alt = f"What models add to the error that remains with {least}, over {LABELS[over]}, in {case}, {at}: {said}."
    caption = f"{case}, {at}, bandwidth {bandwidth:g} Hz; dashed: the {100 * enough:g} % that are called enough"
    return Plot(key, WIDE, draw, alt, caption)


def _table(run: StudyRun, gaps: Sequence[Gap], least: str) -> Table:
    numeric = ("Speed", "Rate [Hz]", "Bandwidth [Hz]", "Adds", "Known to", "Error [mm]", f"With {least} [mm]")
    rows = tuple(
        (
            Cell(gap.case), Cell(gap.controller), Cell(gap.model), Cell(f"{gap.speed:g}", gap.speed),
            Cell(f"{gap.rate:g}", gap.rate), Cell(f"{gap.bandwidth:g}", gap.bandwidth),
            Cell(f"{100 * gap.share:+.3g} %", gap.share, emphasis=gap.share > run.study.enough),
            Cell("–" if math.isnan(gap.known) else f"{100 * gap.known:.2g} %", gap.known),
            Cell(f"{1e3 * gap.error:.3g}", gap.error), Cell(f"{1e3 * gap.remains:.3g}", gap.remains),
        )
        for gap in gaps[:MOST_ROWS]
    )  # fmt: skip
    return Table(
        "control-gap",
        f"What a model adds to the error that remains with {least}, all else equal (rate, delay, encoder, gains).",
        columns(("Case", "Controller", "Model", *numeric), numeric=numeric),
        rows,
        f"Shares above {100 * run.study.enough:g} % stand out. All {len(gaps)} of them follow from errors.parquet.",
    )


def _where_it_matters(run: StudyRun, gaps: Sequence[Gap]) -> list[str]:
    """Where a model begins to matter: the slowest speed at which it adds more than is called enough."""
    said = []
    for case, controller, model in dict.fromkeys((gap.case, gap.controller, gap.model) for gap in gaps):
        mine = [gap for gap in gaps if (gap.case, gap.controller, gap.model) == (case, controller, model)]
        over = [gap for gap in mine if gap.share > run.study.enough and gap.error > run.study.wanted_m]
        if over:
            first = min(over, key=lambda gap: (gap.speed, gap.rate))
            said.append(
                f"{case}, {controller}: {model} begins to matter at speed {first.speed:g}, {first.rate:g} Hz and"
                f" {first.bandwidth:g} Hz bandwidth, where it adds {100 * first.share:.3g} %; it matters at {len(over)}"
                f" of {len(mine)} places."
            )
        else:
            said.append(f"{case}, {controller}: {model} does not matter at any of {len(mine)} places.")
    return said
