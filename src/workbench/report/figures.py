"""The figures of one case, drawn from its stored series.

Numbers that a figure marks (worst moment, normaliser, bound, peak speed) come from summary.csv and manifest.json.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import FigureBase

from workbench.report.curves import (
    DASHES,
    LONGEST_NAME,
    Curve,
    error_of_row,
    error_panel,
    platform_lines,
    torque_lines,
)
from workbench.report.layout import SMALL, TALL, WIDE, figure_legend, legend, legend_rows, mark, stack
from workbench.report.load import ErrorRow, Run, Series
from workbench.report.plot import Plot
from workbench.report.style import PALETTE
from workbench.report.text import exact, pretty_unit, scientific, torque_label, torque_name

REACTIONS_DRAWN = 6
"""Reactions in one figure, the largest; the table holds them all."""


def motion_plots(run: Run, case: str, key: str, series: Series) -> list[Plot]:
    """Draw the actuated coordinates, the platform's position, and its speed and acceleration."""
    manifest = run.manifest
    record = manifest.cases[case]
    time = series["t"]
    units = list(dict.fromkeys(manifest.coordinate_units))

    def joints(figure: FigureBase) -> None:
        for axes, unit in zip(stack(figure, [1.0] * len(units)), units, strict=True):
            for index, joint in enumerate(manifest.joints):
                if manifest.coordinate_units[index] == unit:
                    style = DASHES[index % 4]
                    axes.plot(time, series[f"q{index + 1}"], color=PALETTE[index % 6], linestyle=style, label=joint)
            axes.set_ylabel(f"q [{pretty_unit(unit)}]")
            legend(axes)

    def platform(figure: FigureBase) -> None:
        (axes,) = stack(figure, [1.0])
        platform_lines(axes, run, series, "x")
        axes.set_ylabel("position [m]")
        legend(axes)

    def speed(figure: FigureBase) -> None:
        peaks = (
            ("xd", "speed [m/s]", record.peak_speed, record.speed_at_s),
            ("xdd", "acceleration [m/s²]", record.peak_acceleration, record.acceleration_at_s),
        )
        for index, (axes, (prefix, label, peak, at)) in enumerate(zip(stack(figure, [1.0, 1.0]), peaks, strict=True)):
            size = np.sqrt(sum(series[f"{prefix}{k + 1}"] ** 2 for k in range(len(manifest.platform_axes))))
            axes.plot(time, size, color=PALETTE[index], label=label.partition(" ")[0])
            axes.set_ylabel(label)
            axes.set_ylim(0, 1.18 * float(np.nanmax(size)) or 1.0)
            if peak is not None and at is not None:
                mark(axes, at, peak, f"{peak:.4g}")

    return [
        Plot(
            f"{key}-joints",
            SMALL,
            joints,
            f"Actuated coordinates {', '.join(manifest.joints)} over time in case {case}.",
            "Actuated coordinates",
            key,
        ),
        Plot(
            f"{key}-platform",
            SMALL,
            platform,
            f"Platform position {', '.join(manifest.platform_axes)} over time in case {case}.",
            "Platform position",
            key,
        ),
        Plot(
            f"{key}-speed",
            SMALL,
            speed,
            f"Size of the platform's velocity and acceleration over time in case {case}; "
            f"peaks {exact(record.peak_speed)} m/s and {exact(record.peak_acceleration)} m/s².",
            "Platform speed and acceleration; the triangles mark the reference's peaks",
            key,
        ),
    ]


def torque_plots(run: Run, case: str, key: str, series: Series) -> list[Plot]:
    """Draw, per joint, candidates and references in one panel and every error of summary.csv below it."""
    plots = []
    for index, joint in enumerate(run.manifest.joints):
        rows = [row for row in run.rows_of_case[case] if row.joint == joint and row.kind != "contrast"]
        if rows:
            plots.append(_torque_plot(run, case, key, series, index, rows))
    return plots


def _torque_plot(run: Run, case: str, key: str, series: Series, index: int, rows: list[ErrorRow]) -> Plot:
    joint = run.manifest.joints[index]
    unit = pretty_unit(run.manifest.force_units[index])
    names = list(dict.fromkeys(row.candidate for row in rows))
    elsewhere = {row.candidate for row in rows if row.kind == "recorded"}
    curves = [Curve(name, False, name in elsewhere) for name in names]
    curves += [Curve(name, True) for name in dict.fromkeys(row.reference for row in rows)]
    errors = [error_of_row(row, series, PALETTE[names.index(row.candidate) % 6]) for row in rows]

    def draw(figure: FigureBase) -> None:
        above, below = stack(figure, [1.5, 1.0], header=legend_rows(len(curves)))
        torque_lines(above, run, series, joint, curves)
        above.set_ylabel(torque_label(joint, run.manifest.force_units[index]))
        figure_legend(figure, above)
        error_panel(below, [e for e in errors if e is not None], [row.bound for row in rows if row.bound])

    worst = max(rows, key=lambda row: row.badness)
    return Plot(
        f"{key}-torque-{index + 1}",
        TALL,
        draw,
        f"Case {case}: {torque_name(joint)} in {unit} over time of {', '.join(c.label for c in curves)}; "
        f"below, the error relative to the reference's peak on a logarithmic axis. Worst against its bound: "
        f"{worst.candidate} against the {worst.reference} reference, {scientific(worst.peak_error)}."
        + (" The band around the reference is what a recorded motion leaves open." if elsewhere else ""),
        f"Joint {joint}: force or torque above, error over the reference's peak below",
        key,
    )


def reaction_plot(run: Run, case: str, key: str, series: Series) -> Plot | None:
    """Draw the size of the largest joint reactions over time; None where the series holds none."""
    peaks = run.manifest.cases[case].peak_reactions
    known = [name for name in peaks if all(f"reaction_{name}_{axis}" in series for axis in "xyz")]
    names = sorted(known, key=lambda name: -(peaks[name] or 0.0))[:REACTIONS_DRAWN]
    if not names:
        return None

    def draw(figure: FigureBase) -> None:
        (axes,) = stack(figure, [1.0], header=legend_rows(len(names), columns=3))
        for index, name in enumerate(names):
            force = np.sqrt(sum(series[f"reaction_{name}_{axis}"] ** 2 for axis in "xyz"))
            style = DASHES[index % 4]
            axes.plot(series["t"], force, color=PALETTE[index % 6], linestyle=style, label=name[:LONGEST_NAME])
        axes.set_ylim(bottom=0.0)
        axes.set_ylabel("force [N]")
        figure_legend(figure, axes, columns=3)

    listed = ", ".join(f"{name} {exact(peaks[name], 3)} N" for name in names)
    left = len(known) - len(names)
    return Plot(
        f"{key}-reactions",
        WIDE,
        draw,
        f"Size of the joint reactions over time in case {case}, with their peaks: {listed}.",
        "Joint reactions: size of the force in each joint"
        + (f"; the {len(names)} largest, the other {left} stand in the table" if left else ""),
        key,
    )
