"""The error of a case with its sign and unit: where a formula asks for too much, and where for too little."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import FigureBase

from workbench.report.curves import DASHES, Curve
from workbench.report.layout import figure_legend, legend_rows, stack
from workbench.report.load import ErrorRow, Run, Series
from workbench.report.plot import Plot
from workbench.report.style import PALETTE
from workbench.report.text import torque_label

PANEL, WIDTH = 1.25, 5.8
"""inches"""


def signed_plot(run: Run, case: str, key: str, series: Series) -> Plot | None:
    """Draw candidate less reference, joint by joint in N or N m; None where nothing was compared."""
    manifest = run.manifest
    rows = [row for row in run.rows_of_case[case] if row.kind != "contrast"]
    pairs = [
        pair
        for pair in dict.fromkeys((row.candidate, row.reference, row.kind == "recorded") for row in rows)
        if any(_difference(series, pair, joint) is not None for joint in manifest.joints)
    ]
    joints = [joint for joint in manifest.joints if any(_difference(series, p, joint) is not None for p in pairs)]
    if not pairs:
        return None
    names = list(dict.fromkeys(name for name, _, _ in pairs))

    def draw(figure: FigureBase) -> None:
        panels = stack(figure, [1.0] * len(joints), header=legend_rows(len(pairs)))
        for axes, joint in zip(panels, joints, strict=True):
            for turn, pair in enumerate(pairs):
                error = _difference(series, pair, joint)
                if error is not None:
                    colour = PALETTE[names.index(pair[0]) % 6]
                    axes.plot(
                        series["t"], error, color=colour, linestyle=DASHES[turn % 4], linewidth=1.0, label=_label(pair)
                    )
            axes.axhline(0.0, color="black", linewidth=0.5, zorder=1)
            axes.set_ylabel(f"Δ{torque_label(joint, manifest.unit_of(joint))}")
        figure_legend(figure, panels[0])

    size = WIDTH, 0.62 + 0.165 * legend_rows(len(pairs)) + PANEL * len(joints)
    return Plot(
        f"{key}-signed",
        size,
        draw,
        f"Case {case}: candidate less reference over time, with sign and unit, on {', '.join(joints)}: "
        f"{', '.join(_label(pair) for pair in pairs)}. {_worst(rows)}",
        "Signed error: the candidate's force or torque less the reference's; what lies on zero differs by rounding",
        key,
    )


Pair = tuple[str, str, bool]
"""Candidate, reference, and whether the torques are recorded."""


def _difference(series: Series, pair: Pair, joint: str) -> np.ndarray | None:
    candidate = series.get(Curve(pair[0], False, pair[2]).column(joint))
    reference = series.get(Curve(pair[1], True).column(joint))
    return None if candidate is None or reference is None else candidate - reference


def _label(pair: Pair) -> str:
    return f"{Curve(pair[0], False).label} − {pair[1]}"


def _worst(rows: list[ErrorRow]) -> str:
    row = max(rows, key=lambda found: found.peak_error * found.normaliser if found.normaliser > 0 else 0.0)
    size = row.peak_error * row.normaliser
    return f"Largest: {size:.3g} {row.unit}, {row.candidate} on {row.joint} at {row.worst_time_s:.4g} s."
