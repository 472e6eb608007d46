"""One figure that shows a campaign at a glance: a row for each case, its errors against bounds, and what is measured.

Left are the errors that have a bound to keep, right those of other assumptions and of formulas that nothing judges.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.ticker import FixedLocator, FuncFormatter

from workbench.campaign.verdict import EXPECTED_FAILURE, RECORDED, WITHOUT_BOUND
from workbench.report.case_section import joint_heading
from workbench.report.curves import LONGEST_NAME, MARKERS
from workbench.report.layout import SMALLEST_DRAWN, figure_legend, legend_rows, size_of
from workbench.report.light_axis import LightAxes
from workbench.report.load import ErrorRow, Run
from workbench.report.plot import Plot
from workbench.report.style import ALARM, BACKGROUND, GRID, PALETTE
from workbench.report.tables import CHECKED, FAILURES, NOT_COMPUTED
from workbench.report.text import exact, percent

MOST_CASES = 24
"""Cases that the figure has room for; of more, the worst."""
WIDTH, ROW, LETTER = 10.0, 0.2, 0.072
"""inches: of the figure, of a case, of a letter"""
NARROW = 7.0
"""inches from which on there is room for more labels; in the style of a paper there is less"""
LARGEST_DRAWN = 1e3
"""Errors above this, and such that are no number, are drawn here."""
MEASURED = (*WITHOUT_BOUND, RECORDED)
"""Kinds of the right panel."""


def overview_plot(run: Run) -> Plot | None:
    """Draw the largest errors of every case and joint; None where a run has no rows to show."""
    judged = {case: _judged(rows) for case, rows in run.rows_of_case.items()}
    measured = {case: [row for row in rows if row.kind in MEASURED] for case, rows in run.rows_of_case.items()}
    if not any(judged.values()) and not any(measured.values()):
        return None
    cases = list(run.manifest.cases)
    worst_first = sorted(cases, key=lambda case: _rank(run, case, judged[case], measured[case]))
    shown = [case for case in cases if case in set(worst_first[:MOST_CASES])]
    panels = [found for found in (judged, measured) if any(found[case] for case in shown)]
    height = 0.62 + 0.165 * legend_rows(len(run.manifest.joints), 6) + ROW * len(shown)

    def draw(figure: FigureBase) -> None:
        all_axes = _panels(figure, shown, len(panels))
        for axes, found in zip(all_axes, panels, strict=True):
            if found is judged:
                _draw_judged(axes, run, shown, judged)
            else:
                _draw_measured(axes, run, shown, measured)
            _rows(axes, run, shown)
        for index, joint in enumerate(run.manifest.joints):
            all_axes[0].plot(
                [], [], linestyle="none", marker=MARKERS[index % 4], color=PALETTE[index % 6], markersize=5,
                label=joint_heading(run, joint),
            )  # fmt: skip
        figure_legend(figure, all_axes[0], 6)

    left = len(cases) - len(shown)
    return Plot(
        "figure-at-a-glance", (WIDTH, height), draw, _alt(judged, measured),
        "The campaign at a glance: the largest error of every case and joint over the peak of the reference. "
        "Left against the bound (dashed; open markers are declared failures, a ring marks what fails), right what is "
        "measured and has no bound: modelling errors, open where another kind"
        + (f". The {len(shown)} worst cases; the other {left} stand in the tables" if left else ""),
    )  # fmt: skip


def _judged(rows: Sequence[ErrorRow]) -> list[ErrorRow]:
    return [row for row in rows if row.verdict in CHECKED or row.verdict in FAILURES or row.kind == EXPECTED_FAILURE]


def _rank(run: Run, case: str, judged: Sequence[ErrorRow], measured: Sequence[ErrorRow]) -> tuple[float, float, float]:
    """Failures first, then by error over bound, then by what is measured."""
    lost = run.manifest.cases[case].status in NOT_COMPUTED or any(row.verdict in FAILURES for row in judged)
    return (
        -float(lost),
        -max((row.badness for row in judged if row.kind != EXPECTED_FAILURE), default=0.0),
        -max((row.badness for row in measured), default=0.0),
    )


def _panels(figure: FigureBase, cases: Sequence[str], number: int) -> list[Axes]:
    """Panels beside each other; the first leaves room for the cases' names."""
    width, height = size_of(figure)
    left = 0.2 + LETTER * max(len(_name(case)) for case in cases)
    bottom, top, gap = 0.44 / height, 1 - (height - 0.5 - ROW * len(cases)) / height, 0.55
    room = (width - left - 0.3 - gap * (number - 1)) / number
    boxes = [((left + turn * (room + gap)) / width, bottom, room / width, top - bottom) for turn in range(number)]
    return [figure.add_axes(box, axes_class=LightAxes) for box in boxes]


def _name(case: str) -> str:
    return case if len(case) <= LONGEST_NAME else f"{case[: LONGEST_NAME - 1]}…"


def _rows(axes: Axes, run: Run, cases: Sequence[str]) -> None:
    """A line for each case, the first on top, named at the left of the first panel."""
    axes.set_ylim(len(cases) - 0.5, -0.5)
    axes.yaxis.set_major_locator(FixedLocator(list(range(len(cases)))))
    first = axes.figure.axes[0] is axes if axes.figure.axes else True
    axes.set_yticklabels([_name(case) for case in cases] if first else [])
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    for place, case in enumerate(cases):
        if run.manifest.cases[case].status in NOT_COMPUTED and first:
            axes.annotate(
                "not computed", (0.01, place), xycoords=("axes fraction", "data"), va="center", color=ALARM, fontsize=8
            )


def _largest(rows: Sequence[ErrorRow], joint: str) -> ErrorRow | None:
    return max((row for row in rows if row.joint == joint), key=lambda row: row.badness, default=None)


def _drawn(error: float) -> float:
    return LARGEST_DRAWN if math.isnan(error) else min(max(error, SMALLEST_DRAWN), LARGEST_DRAWN)


def _marker(axes: Axes, run: Run, row: ErrorRow, place: int, hollow: bool, scale: float = 1.0) -> None:
    index = run.manifest.joints.index(row.joint)
    colour = PALETTE[index % 6]
    # joints beside each other, so that equal errors do not hide each other
    y = place + 0.22 * (index - (len(run.manifest.joints) - 1) / 2) / max(1, len(run.manifest.joints) - 1) * 2
    axes.plot(
        [scale * _drawn(row.peak_error)], [y], marker=MARKERS[index % 4], color=colour, markersize=4.6,
        markerfacecolor=BACKGROUND if hollow else colour, linestyle="none", markeredgewidth=1.0,
    )  # fmt: skip
    if row.verdict in FAILURES:
        axes.plot(
            [scale * _drawn(row.peak_error)], [y], marker="o", color=ALARM, markersize=10.0,
            markerfacecolor="none", linestyle="none", markeredgewidth=1.3,
        )  # fmt: skip


def _draw_judged(axes: Axes, run: Run, cases: Sequence[str], judged: dict[str, list[ErrorRow]]) -> None:
    drawn: list[float] = []
    for place, case in enumerate(cases):
        declared = [row for row in judged[case] if row.kind == EXPECTED_FAILURE]
        others = [row for row in judged[case] if row.kind != EXPECTED_FAILURE]
        for rows, hollow in ((others, False), (declared, True)):
            for joint in run.manifest.joints:
                row = _largest(rows, joint)
                if row is not None:
                    _marker(axes, run, row, place, hollow)
                    drawn.append(_drawn(row.peak_error))
        for bound in sorted({row.bound for row in judged[case] if row.bound}):
            axes.plot([bound, bound], [place - 0.5, place + 0.5], color=ALARM, linewidth=1.2, linestyle=(0, (4, 2)))
            drawn.append(bound)
    _log_x(axes, drawn, lambda power: f"1e{power}")
    axes.set_xlabel("errors against their bounds")


def _draw_measured(axes: Axes, run: Run, cases: Sequence[str], measured: dict[str, list[ErrorRow]]) -> None:
    drawn: list[float] = []
    for place, case in enumerate(cases):
        for joint in run.manifest.joints:
            row = _largest(measured[case], joint)
            if row is not None:
                _marker(axes, run, row, place, hollow=row.kind != WITHOUT_BOUND[0], scale=100.0)
                drawn.append(100.0 * _drawn(row.peak_error))
    _log_x(axes, drawn, lambda power: f"{10.0**power:g} %" if power > -4 else f"1e{power} %")
    axes.set_xlabel("modelling errors")


def _log_x(axes: Axes, values: Sequence[float], label: object) -> None:
    low, high = min(values, default=1e-2), max(values, default=1.0)
    bottom, top = math.floor(math.log10(0.7 * low)), math.ceil(math.log10(1.4 * high))
    top = max(top, bottom + 2)
    axes.set_xscale("log")
    axes.set_xlim(10.0**bottom, 10.0**top)
    labels = 6 if size_of(axes.figure)[0] > NARROW else 3
    step = math.ceil((top - bottom) / labels)
    axes.xaxis.set_major_locator(FixedLocator([10.0**power for power in range(bottom, top + 1, step)]))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: label(round(math.log10(value)))))  # type: ignore[operator]
    axes.minorticks_off()
    axes.grid(color=GRID)


def _alt(judged: dict[str, list[ErrorRow]], measured: dict[str, list[ErrorRow]]) -> str:
    told = ["The largest error of every case and joint on logarithmic axes."]
    kept = [row for rows in judged.values() for row in rows if row.kind != EXPECTED_FAILURE]
    if kept:
        worst = max(kept, key=lambda row: row.badness)
        bound = f" of a bound of {exact(worst.bound)}" if worst.bound else ""
        told.append(
            f"Worst against its bound: {exact(worst.peak_error, 3)}{bound}, {worst.candidate} on {worst.joint} in case "
            f"{worst.case}."
        )
    other = [row for rows in measured.values() for row in rows]
    if other:
        worst = max(other, key=lambda row: row.badness)
        told.append(
            f"Largest without a bound: {percent(worst.peak_error)}, {worst.candidate} against the {worst.reference} "
            f"reference on {worst.joint} in case {worst.case}."
        )
    return " ".join(told)
