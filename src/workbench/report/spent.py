"""What the torque is spent on: weight, acceleration, velocity, friction, force; and which bodies take it."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import FigureBase
from matplotlib.patches import Polygon

from workbench.arrays import FloatArray
from workbench.report.layout import TALL, figure_legend, legend_rows, stack
from workbench.report.load import Run, Series
from workbench.report.manifest import CaseRecord
from workbench.report.plot import Plot
from workbench.report.style import PALETTE
from workbench.report.tables import Cell, Table, columns
from workbench.report.text import exact, torque_label

PARTS = ("weight", "acceleration", "velocity", "springs", "friction", "external force")
"""In the order in which they are stacked."""

EDGE_OFF = 0.004
"""What an area's edge may leave the data by, as a part of the largest torque: less than half a point on a page. Lines
are thinned by matplotlib; areas are not, and with a corner for every sample they were three quarters of a report."""


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
            tau = np.array([series.get(column(part, joint), np.zeros(len(time))) for part in parts])
            # what pushes and what pulls are stacked apart, each from zero
            edges = [np.cumsum([0.0 * time, *np.maximum(tau, 0.0)], axis=0)]
            edges += [np.cumsum([0.0 * time, *np.minimum(tau, 0.0)], axis=0)]
            off = EDGE_OFF * float(np.abs(edges).max())
            for side in edges:
                # each edge is thinned once, so that the areas on its two sides leave no gap
                seen = [corners(time, edge, off) for edge in side]
                for index, part in enumerate(parts):
                    low, high = seen[index], seen[index + 1]
                    if not np.any(side[index] != side[index + 1]):
                        low = high = np.array([0, len(time) - 1])  # nothing to see but its name in the legend
                    outline = np.column_stack(
                        [time[[*low, *high[::-1]]], [*side[index, low], *side[index + 1, high[::-1]]]]
                    )
                    area = Polygon(outline, color=PALETTE[index % 6], alpha=0.75, linewidth=0)
                    area.set_label(part if side is edges[0] else None)
                    axes.add_artist(area)
                    axes.update_datalim(outline)  # `Axes.fill` looks for the extent of each edge as if it were a curve
            axes.plot(time, tau.sum(axis=0), color="black", linewidth=0.8)
            axes.set_ylabel(torque_label(joint, unit))
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


def corners(time: FloatArray, curve: FloatArray, off: float) -> np.ndarray:
    """Samples between which straight lines leave a curve ``(n,)`` by no more than *off* (Ramer, Douglas, Peucker)."""
    kept, spans = {0, len(time) - 1}, [(0, len(time) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        slope = (curve[last] - curve[first]) / (time[last] - time[first])
        gaps = np.abs(curve[first:last] - curve[first] - slope * (time[first:last] - time[first]))
        middle = first + int(gaps.argmax())
        if gaps[middle - first] > off:
            kept.add(middle)
            spans += [(first, middle), (middle, last)]
    return np.array(sorted(kept))


def spent_table(run: Run, record: CaseRecord, anchor: str) -> Table:
    """Root mean squares of the torque's parts, and of what each body takes, joint by joint."""
    joints, units = run.manifest.joints, run.manifest.force_units
    rows = []
    for what, sums in (("part", record.spent.parts), ("body", record.spent.bodies)):
        for name, sizes in sums.items():
            if any(sizes.get(joint) for joint in joints):
                cells = [Cell(exact(sizes.get(joint), 3), sizes.get(joint)) for joint in joints]
                rows.append((Cell(name), Cell(what), *cells))
    titles = [torque_label(joint, unit) for joint, unit in zip(joints, units, strict=True)]
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
