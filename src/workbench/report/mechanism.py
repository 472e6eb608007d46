"""The mechanism drawn as lines and joints from stored points, in three views, and the frames that animate it."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from workbench.arrays import FloatArray
from workbench.report.layout import size_of
from workbench.report.load import Run, Series
from workbench.report.manifest import DrawingRecord
from workbench.report.plot import Plot
from workbench.report.style import BACKGROUND, INK, PALETTE
from workbench.report.svg import OWN, POINTS_PER_INCH

SIZE = (9.0, 3.6)
NARROW = 7.0
"""Inches below which panels stand close together: in the style of a paper."""
UPWARDS = "upwards [m]"
FRAME_COUNTS = (24, 48, 96, 192, 384)
SMOOTH = 0.008
"""Share of the drawing by which a point may leave the straight line between two frames."""
SCALE = 10
"""Frames hold tenths of a point."""
AZIMUTH, ELEVATION = np.radians(38.0), np.radians(22.0)
DRIVEN = PALETTE[1]
PLATFORM = PALETTE[0]


@dataclass(frozen=True)
class View:
    """An orthographic projection: point ``(..., 3)`` -> ``(..., 2)``."""

    title: str
    right: FloatArray
    up: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        """Project."""
        return np.stack([points @ self.right, points @ self.up], axis=-1)


@dataclass(frozen=True)
class Skeleton:
    """Points over time ``(n, k, 3)`` with the lines and joints among them, as numbers of points."""

    points: FloatArray
    lines: tuple[tuple[str, tuple[tuple[int, int], ...]], ...]
    joints: tuple[tuple[str, tuple[int, ...]], ...]
    platform: int


def mechanism_plot(run: Run, case: str, key: str, series: Series) -> Plot | None:
    """Draw the mechanism at the case's first sample, with the platform's path; None where no points are stored."""
    record = run.manifest.cases[case].drawing
    found = _skeleton(record, series) if record else None
    if record is None or found is None:
        return None
    views = _views(np.array(record.up, dtype=np.float64), run.manifest.platform_axes)
    kept = _frames(found.points)
    layout = _layout(views, found.points)

    def draw(figure: FigureBase) -> None:
        for number, (view, box, limits) in enumerate(layout):
            axes = _panel(figure, view, box, limits, () if number else run.manifest.platform_axes)
            _draw_mechanism(axes, view, found, number)

    number = len(record.joints)
    driven = ", ".join(name for name, joint in record.joints.items() if joint.actuated)
    return Plot(
        f"{key}-mechanism",
        SIZE,
        draw,
        f"The mechanism in case {case} at its first sample, in three views: {len(record.links)} moving bodies, "
        f"{number} joints, driven by {driven}; a thin line is the path of the platform over the case.",
        "The mechanism, drawn from the reference's own positions at the first sample: bodies as lines, circles are "
        "hinges and ball joints (filled), squares slides, orange what is driven; blue the platform and its path",
        key,
        _animation(found, kept, series["t"], layout),
    )


def _skeleton(record: DrawingRecord, series: Series) -> Skeleton | None:
    names = list(dict.fromkeys(point for pairs in record.links.values() for pair in pairs for point in pair))
    names += [point for joint in record.joints.values() if (point := joint.point) not in names]
    names = list(dict.fromkeys([*names, record.platform]))
    columns = [[f"point_{name}_{axis}" for axis in "xyz"] for name in names]
    if not all(column in series for triple in columns for column in triple):
        return None
    points = np.stack([np.stack([series[column] for column in triple], axis=-1) for triple in columns], axis=1)
    number = {name: index for index, name in enumerate(names)}
    lines: dict[str, list[tuple[int, int]]] = {"body": [], "driven": [], "platform": []}
    driven = {joint.point.partition(".")[2] for joint in record.joints.values() if joint.actuated}
    platform_body = _owner(record)
    for body, pairs in record.links.items():
        kind = "platform" if body == platform_body else "driven" if body in driven else "body"
        lines[kind] += [(number[a], number[b]) for a, b in pairs]
    joints: dict[str, list[int]] = {}
    for joint in record.joints.values():
        joints.setdefault(f"{joint.kind}{'-driven' if joint.actuated else ''}", []).append(number[joint.point])
    return Skeleton(
        points,
        tuple((kind, tuple(pairs)) for kind, pairs in lines.items() if pairs),
        tuple((kind, tuple(members)) for kind, members in joints.items()),
        number[record.platform],
    )


def _owner(record: DrawingRecord) -> str:
    """Return the body that the platform's point belongs to, and not one that a line merely leads from to it."""
    for side in (0, 1):
        for body, pairs in record.links.items():
            if any(pair[side] == record.platform for pair in pairs):
                return body
    return ""


def _views(up: FloatArray, names: tuple[str, ...]) -> tuple[View, ...]:
    """Return an oblique view and two along horizontal axes of the paper's frame."""
    flat = sorted(sorted(range(3), key=lambda k: abs(up[k]))[:2])
    first, second = (np.eye(3)[k] - up[k] * up for k in flat)
    first, second = first / np.linalg.norm(first), second / np.linalg.norm(second)
    across = np.cross(up, first)
    level = np.cos(AZIMUTH) * first + np.sin(AZIMUTH) * across
    towards = np.cos(ELEVATION) * level + np.sin(ELEVATION) * up
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    a, b = (names[k] if k < len(names) else f"x{k + 1}" for k in flat)
    return (
        View("", right, np.cross(towards, right)),
        View(f"{b} [m]", second, up),
        View(f"{a} [m]", first, up),
    )


def _frames(points: FloatArray) -> np.ndarray:
    """Choose as few samples as straight lines between them allow."""
    extent = float(np.ptp(points.reshape(-1, 3), axis=0).max()) or 1.0
    count = len(points)
    kept = np.arange(count)
    for wanted in FRAME_COUNTS:
        if wanted >= count:
            return np.arange(count)
        kept = np.unique(np.linspace(0, count - 1, wanted).round().astype(int))
        middle = (kept[:-1] + kept[1:]) // 2
        share = ((middle - kept[:-1]) / (kept[1:] - kept[:-1]))[:, None, None]
        straight = (1 - share) * points[kept[:-1]] + share * points[kept[1:]]
        if float(np.abs(points[middle] - straight).max()) <= SMOOTH * extent:
            break
    return kept


Layout = list[tuple[View, tuple[float, float, float, float], tuple[float, float, float, float]]]


def _layout(views: tuple[View, ...], points: FloatArray) -> Layout:
    """Give each view a box, fractions of the figure, and limits of equal scale that hold everything at all times."""
    width, height = SIZE
    left, gap, bottom, top = 0.05, 0.62, 0.45, 0.12
    room = (width - 2 * gap - left - 0.1) / 3
    layout: Layout = []
    for number, view in enumerate(views):
        flat = view(points).reshape(-1, 2)
        low, high = flat.min(axis=0), flat.max(axis=0)
        centre, size = (low + high) / 2, np.maximum(high - low, 1e-3) * 1.12
        tall = height - bottom - top
        scale = max(size[0] / room, size[1] / tall)
        half = np.array([room, tall]) * scale / 2
        box = ((left + number * (room + gap)) / width, bottom / height, room / width, tall / height)
        layout.append((view, box, (centre[0] - half[0], centre[0] + half[0], centre[1] - half[1], centre[1] + half[1])))
    return layout


def _panel(
    figure: FigureBase,
    view: View,
    box: tuple[float, float, float, float],
    limits: tuple[float, float, float, float],
    triad: tuple[str, ...],
) -> Axes:
    axes = figure.add_axes(box)
    axes.set_xlim(limits[0], limits[1])
    axes.set_ylim(limits[2], limits[3])
    axes.set_box_aspect(box[3] * size_of(figure)[1] / (box[2] * size_of(figure)[0]))
    if not triad:
        axes.locator_params(nbins=5)
        axes.set_xlabel(view.title)
        if size_of(figure)[0] < NARROW:  # beside the axis it would run into the neighbour
            axes.set_title(UPWARDS)
        else:
            axes.set_ylabel(UPWARDS)
        return axes
    axes.set_axis_off()
    length = 0.12 * (limits[1] - limits[0])
    origin = np.array([limits[0] + 0.14 * (limits[1] - limits[0]), limits[2] + 0.14 * (limits[3] - limits[2])])
    for name, direction in zip(triad, np.eye(3), strict=False):
        tip = origin + length * view(direction)
        axes.plot(*np.stack([origin, tip]).T, color=INK, linewidth=0.8)
        x, y = origin + 1.35 * (tip - origin)
        axes.text(x, y, name, fontsize=7.5, ha="center", va="center")
    return axes


def _draw_mechanism(axes: Axes, view: View, skeleton: Skeleton, number: int) -> None:
    flat = view(skeleton.points)
    first = flat[0]
    path = flat[_frames(skeleton.points), skeleton.platform]
    axes.plot(path[:, 0], path[:, 1], color=PLATFORM, linewidth=0.7)
    colours = {"body": INK, "driven": DRIVEN, "platform": PLATFORM}
    for kind, pairs in skeleton.lines:
        steps = [point for a, b in pairs for point in (first[a], first[b], [np.nan, np.nan])]
        axes.plot(
            *np.array(steps).T,
            color=colours[kind],
            linewidth=2.4,
            solid_capstyle="round",
            gid=f"{OWN}line-{number}-{kind}",
        )
    for kind, members in skeleton.joints:
        name, _, driven = kind.partition("-")
        colour = DRIVEN if driven else INK
        axes.plot(
            *first[list(members)].T,
            linestyle="none",
            marker="s" if name == "slide" else "o",
            markersize=5.0,
            markeredgecolor=colour,
            markerfacecolor=colour if name == "ball" or driven else BACKGROUND,
            markeredgewidth=1.1,
            gid=f"{OWN}joint-{number}-{kind}",
        )


def _animation(skeleton: Skeleton, kept: np.ndarray, time: FloatArray, layout: Layout) -> str:
    """Return times, lines, joints and positions in tenths of a point of the drawing, as JSON."""
    to_points = np.array([SIZE[0], SIZE[1]]) * POINTS_PER_INCH
    views = []
    for view, box, (x0, x1, y0, y1) in layout:
        flat = view(skeleton.points[kept])
        x = (box[0] + box[2] * (flat[..., 0] - x0) / (x1 - x0)) * to_points[0]
        y = (1 - box[1] - box[3] * (flat[..., 1] - y0) / (y1 - y0)) * to_points[1]
        tenths = np.rint(SCALE * np.stack([x, y], axis=-1)).astype(int).reshape(len(kept), -1)
        first, steps = tenths[0], np.diff(tenths, axis=0)
        views.append([first.tolist(), *steps.tolist()])  # differences: smaller numbers, a third of the bytes
    told = {
        "t": [float(f"{v:.6g}") for v in time[kept]],
        "scale": SCALE,
        "lines": {kind: [list(pair) for pair in pairs] for kind, pairs in skeleton.lines},
        "joints": {kind: list(members) for kind, members in skeleton.joints},
        "views": views,
    }
    return json.dumps(told, separators=(",", ":"))
