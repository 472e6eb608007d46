"""The figures of one case, drawn from its stored series.

Numbers that a figure marks (worst moment, normaliser, bound, peak speed) come from summary.csv and manifest.json.
"""

from __future__ import annotations

import numpy as np

from workbench.report.curves import DASHES, Curve, Plot, error_of_row, error_panel, platform_lines, torque_lines
from workbench.report.layout import SMALL, TALL, figure_legend, legend, legend_rows, mark, stack
from workbench.report.load import Run, Series
from workbench.report.style import PALETTE, new_figure, svg_of
from workbench.report.text import exact, pretty_unit, scientific


def motion_plots(run: Run, case: str, key: str, series: Series) -> list[Plot]:
    """Draw the actuated coordinates, the platform's position, and its speed and acceleration."""
    manifest = run.manifest
    record = manifest.cases[case]
    time = series["t"]
    units = list(dict.fromkeys(manifest.coordinate_units))
    figure = new_figure(*SMALL)
    for axes, unit in zip(stack(figure, [1.0] * len(units)), units, strict=True):
        for index, joint in enumerate(manifest.joints):
            if manifest.coordinate_units[index] == unit:
                axes.plot(
                    time, series[f"q{index + 1}"], color=PALETTE[index % 6], linestyle=DASHES[index % 4], label=joint
                )
        axes.set_ylabel(f"[{pretty_unit(unit)}]")
        legend(axes)
    joints = Plot(
        f"{key}-joints",
        svg_of(figure, f"{key}-joints"),
        f"Actuated coordinates {', '.join(manifest.joints)} over time in case {case}.",
        "Actuated coordinates",
    )
    figure = new_figure(*SMALL)
    (axes,) = stack(figure, [1.0])
    platform_lines(axes, run, series, "x")
    axes.set_ylabel("[m]")
    legend(axes)
    platform = Plot(
        f"{key}-platform",
        svg_of(figure, f"{key}-platform"),
        f"Platform position {', '.join(manifest.platform_axes)} over time in case {case}.",
        "Platform position",
    )
    figure = new_figure(*SMALL)
    peaks = (
        ("xd", "speed [m/s]", record.peak_speed, record.speed_at_s),
        ("xdd", "acceleration [m/s²]", record.peak_acceleration, record.acceleration_at_s),
    )
    for index, (axes, (prefix, label, peak, at)) in enumerate(zip(stack(figure, [1.0, 1.0]), peaks, strict=True)):
        size = np.sqrt(sum(series[f"{prefix}{k + 1}"] ** 2 for k in range(len(manifest.platform_axes))))
        axes.plot(time, size, color=PALETTE[index])
        axes.set_ylabel(label)
        axes.set_ylim(0, 1.18 * float(np.nanmax(size)) or 1.0)
        if peak is not None and at is not None:
            mark(axes, at, peak, f"{peak:.4g}")
    speed = Plot(
        f"{key}-speed",
        svg_of(figure, f"{key}-speed"),
        f"Size of the platform's velocity and acceleration over time in case {case}; "
        f"peaks {exact(record.peak_speed)} m/s and {exact(record.peak_acceleration)} m/s².",
        "Platform speed and acceleration; the triangles mark the reference's peaks",
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
        figure = new_figure(*TALL)
        above, below = stack(figure, [1.5, 1.0], header=legend_rows(len(curves)))
        torque_lines(above, run, series, joint, curves)
        above.set_ylabel(f"{joint} [{unit}]")
        figure_legend(figure, above)
        errors = [error_of_row(row, series, PALETTE[names.index(row.candidate) % 6]) for row in rows]
        error_panel(below, [e for e in errors if e is not None], [row.bound for row in rows if row.bound])
        figure_key = f"{key}-torque-{index + 1}"
        worst = max(rows, key=lambda row: row.badness)
        plots.append(
            Plot(
                figure_key,
                svg_of(figure, figure_key),
                f"Case {case}, joint {joint}: force or torque in {unit} over time of "
                f"{', '.join(c.label for c in curves)}; "
                f"below, the error relative to the reference's peak on a logarithmic axis. Worst against its bound: "
                f"{worst.candidate} against the {worst.reference} reference, {scientific(worst.peak_error)}.",
                f"Joint {joint}: force or torque above, error over the reference's peak below",
            )
        )
    return plots
