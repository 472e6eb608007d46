"""Torque and power of two runs over time, one over the other."""

from __future__ import annotations

from collections.abc import Callable

from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from workbench.arrays import FloatArray
from workbench.report.layout import figure_legend, stack
from workbench.report.load import Run, Series
from workbench.report.plot import Plot
from workbench.report.style import INK, PALETTE
from workbench.report.text import torque_label

WIDTH = 4.4
HEAD, PANEL = 0.7, 1.15
"""Inches: of legend and axis, and of each joint's panel."""


def case_plots(old: Run, new: Run, case: str, key: str) -> list[Plot]:
    """Draw the reference's torque and power of every joint that both runs have; nothing where one has no series.

    Raises
    ------
    OutputError
        A series file is missing or unreadable.
    """
    runs = [(run, run.manifest.cases[case].demand.mass_model) for run in (old, new)]
    if not all(model for _, model in runs):
        return []
    series = [run.series(case) for run, _ in runs]
    units = dict(zip(new.manifest.joints, new.manifest.force_units, strict=True))
    joints = [
        joint
        for joint in new.manifest.joints
        if joint in old.manifest.joints
        and all(f"ref_{model}_{joint}" in one for one, (_, model) in zip(series, runs, strict=True))
    ]
    if not joints:
        return []

    def torque(number: int, joint: str) -> FloatArray:
        return series[number][f"ref_{runs[number][1]}_{joint}"]

    def power(number: int, joint: str) -> FloatArray:
        return torque(number, joint) * series[number][f"qd{runs[number][0].manifest.joints.index(joint) + 1}"]

    size = (WIDTH, HEAD + PANEL * len(joints))

    def draw(figure: FigureBase, values: Callable[[int, str], FloatArray], labels: dict[str, str]) -> None:
        panels = stack(figure, [1.0] * len(joints), header=1)
        for axes, joint in zip(panels, joints, strict=True):
            axes.axhline(0.0, color=INK, linewidth=0.4)
            _lines(axes, series, [values(number, joint) for number in (0, 1)])
            axes.set_ylabel(labels[joint])
        figure_legend(figure, panels[0])

    return [
        Plot(
            f"{key}-torque",
            size,
            lambda figure: draw(figure, torque, {joint: torque_label(joint, units[joint]) for joint in joints}),
            f"Force or torque of {', '.join(joints)} over time in case {case}, run A dashed, run B as a line.",
            "Force or torque by the reference: A dashed, B as a line",
        ),
        Plot(
            f"{key}-power",
            size,
            lambda figure: draw(figure, power, {joint: f"P {joint} [W]" for joint in joints}),
            f"Mechanical power of {', '.join(joints)} over time in case {case}, run A dashed, run B as a line.",
            "Mechanical power, above zero where the actuator drives: A dashed, B as a line",
        ),
    ]


def _lines(axes: Axes, series: list[Series], values: list[FloatArray]) -> None:
    looks = (("A", PALETTE[1], (0, (4, 1.6))), ("B", PALETTE[0], "-"))
    for (label, colour, dashes), one, value in zip(looks, series, values, strict=True):
        axes.plot(one["t"], value, color=colour, linestyle=dashes, label=label)
