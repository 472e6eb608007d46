"""What the torque is spent on: weight, acceleration, velocity, friction, force; and which bodies take it."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import FigureBase

from workbench.report.layout import TALL, figure_legend, legend_rows, stack
from workbench.report.load import Run, Series
from workbench.report.manifest import CaseRecord
from workbench.report.plot import Plot
from workbench.report.style import PALETTE
from workbench.report.tables import Cell, Table, columns
from workbench.report.text import exact, pretty_unit

PARTS = ("weight", "acceleration", "velocity", "springs", "friction", "external force")
"""In the order in which they are stacked."""


def spent_plot(run: Run, case: str, key: str, series: Series) -> Plot | None:
    """Stack the parts of each joint's torque over time; None where the series holds none."""
    manifest = run.manifest

    def column(part: str, joint: str) -> str:
        return f"part_{part.replace(' ', '_')}_{joint}"

    parts = [part for part in PARTS if any(column(part, joint) in series for joint in manifest.joints)]
    if not parts:
        return None
    time = series["t"]

    def draw(figure: FigureBase) -> None:
        panels = stack(figure, [1.0] * len(manifest.joints), header=legend_rows(len(parts), columns=3))
        for axes, joint, unit in zip(panels, manifest.joints, manifest.force_units, strict=True):
            high, low = np.zeros(len(time)), np.zeros(len(time))
            for index, part in enumerate(parts):
                tau = np.asarray(series[column(part, joint)]) if column(part, joint) in series else 0.0 * high
                # what pushes and what pulls are stacked apart, each from zero
                up, down = np.maximum(tau, 0.0), np.minimum(tau, 0.0)
                colour = PALETTE[index % 6]
                axes.fill_between(time, high, high + up, color=colour, alpha=0.75, linewidth=0, label=part)
                axes.fill_between(time, low, low + down, color=colour, alpha=0.75, linewidth=0)
                high, low = high + up, low + down
            axes.plot(time, high + low, color="black", linewidth=0.8)
            axes.set_ylabel(f"{joint} [{pretty_unit(unit)}]")
        figure_legend(figure, panels[0], columns=3)

    return Plot(
        f"{key}-spent",
        TALL,
        draw,
        f"What the reference's torques of case {case} are spent on over time: {', '.join(parts)}, stacked for each"
        " joint, positive ones up and negative ones down from zero; the line is their sum, the torque.",
        "What the torque is spent on; the line is the sum",
        key,
    )


def spent_table(run: Run, record: CaseRecord, anchor: str) -> Table:
    """Root mean squares of the torque's parts, and of what each body takes, joint by joint."""
    joints, units = run.manifest.joints, run.manifest.force_units
    rows = []
    for what, sums in (("part", record.spent.parts), ("body", record.spent.bodies)):
        for name, sizes in sums.items():
            if any(sizes.get(joint) for joint in joints):
                cells = [Cell(exact(sizes.get(joint), 3), sizes.get(joint)) for joint in joints]
                rows.append((Cell(name), Cell(what), *cells))
    titles = [f"{joint} [{pretty_unit(unit)}]" for joint, unit in zip(joints, units, strict=True)]
    return Table(
        f"{anchor}-spent",
        "What the torque is spent on: the reference's, under its"
        f" {record.spent.mass_model or 'own'} masses, by part and by body.",
        columns(["Item", "Of", *titles], titles),
        tuple(rows),
        "root mean squares over the case. Parts add up to the torque at every moment, and so do bodies; their root mean"
        " squares do not. “joints” are springs, friction and rotor inertia, “platform” as a body also takes the"
        " external force.",
    )
