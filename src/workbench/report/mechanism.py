"""The mechanism drawn as lines and joints from stored points, in three views, and the frames that animate it."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from workbench.arrays import FloatArray
from workbench.report.layout import place_below, size_of
from workbench.report.light_axis import LightAxes
from workbench.report.load import Run, Series
from workbench.report.manifest import DrawingRecord
from workbench.report.plot import Plot
from workbench.report.style import BACKGROUND, INK, PALETTE
from workbench.report.svg import OWN, POINTS_PER_INCH

SIZE = (9.0, 3.6)
NARROW = 7.0
"""Inches below which panels stand close together: in the style of a paper."""
UPWARDS = "upwards [m]"
SKETCH, FLAT = (4.4, 3.4), (5.8, 4.2)
"""inches: of the first screen's picture, and of a planar robot's drawing"""
PLANAR, THICKEST, UPRIGHT = 1e-6, 0.5, 0.5
"""Shares: of motion out of the plane, of a planar robot's layers, and of gravity that lies in the plane."""
FRAME_COUNTS = (24, 48, 96, 192, 384)
SMOOTH = 0.008
"""Share of the drawing by which a point may leave the straight line between two frames."""
SCALE = 10
"""Frames hold tenths of a point of the drawing, or less."""
AZIMUTH, ELEVATION = np.radians(38.0), np.radians(22.0)
DRIVEN = PALETTE[1]
PLATFORM = PALETTE[0]


@dataclass(frozen=True)
class View:
    """An orthographic projection: point ``(..., 3)`` -> ``(..., 2)``."""

    title: str
    right: FloatArray
    up: FloatArray
    side: str = UPWARDS
    """label of the axis that points up on paper"""

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
    views = views_of(record, found, run.manifest.platform_axes)
    kept = _frames(found.points)
    whole = SIZE if len(views) > 1 else FLAT
    layout = _layout(views, found.points, whole)

    def draw(figure: FigureBase) -> None:
        for number, (view, box, limits) in enumerate(layout):
            axes = _panel(figure, view, box, limits, () if view.title else run.manifest.platform_axes)
            _draw_mechanism(axes, view, found, number)

    number, seen = len(record.joints), "in three views" if len(views) > 1 else "in its plane"
    driven = ", ".join(name for name, joint in record.joints.items() if joint.actuated)
    return Plot(
        f"{key}-mechanism",
        whole,
        draw,
        f"The mechanism in case {case} at its first sample, {seen}: {len(record.links)} moving bodies, "
        f"{number} joints, driven by {driven}; a thin line is the path of the platform over the case.",
        "The mechanism, drawn from the reference's own positions at the first sample: bodies as lines, circles are "
        "hinges and ball joints (filled), squares slides, orange what is driven; blue the platform and its path",
        key,
        _animation(found, kept, series["t"], layout, whole),
    )


def robot_sketch(run: Run, case: str, series: Series) -> Plot | None:
    """Draw the robot as a reader meets it first, obliquely at the first sample; None where no points are stored."""
    record = run.manifest.cases[case].drawing
    found = _skeleton(record, series) if record else None
    if record is None or found is None:
        return None
    views = views_of(record, found, run.manifest.platform_axes)[:1]
    ((view, box, limits),) = _layout(views, found.points, SKETCH)

    def draw(figure: FigureBase) -> None:
        axes = _panel(figure, view, box, limits, () if view.title else run.manifest.platform_axes)
        _draw_mechanism(axes, view, found, 0)

    return Plot(
        "figure-robot",
        SKETCH,
        draw,
        f"The mechanism in case {case} at its first sample: {len(record.links)} moving bodies, {len(record.joints)} "
        "joints; a thin line is the path of the platform.",
        f"The robot in case {case}, drawn from the reference's own positions; orange is driven, blue the platform",
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


def views_of(record: DrawingRecord, skeleton: Skeleton, names: tuple[str, ...]) -> tuple[View, ...]:
    """Return the view of the plane in which a planar robot moves; else an oblique and two horizontal ones."""
    up = np.array(record.up, dtype=np.float64)
    normal = plane_of(record, skeleton.points)
    return _views(up, names) if normal is None else (_plane_view(normal, up, names),)


def plane_of(record: DrawingRecord, points: FloatArray) -> FloatArray | None:
    """Return the normal of the plane in which all *points* ``(n, k, 3)`` move; None of a spatial robot.

    A ball joint makes a robot spatial, whatever it does in this case.
    """
    if any(joint.kind == "ball" for joint in record.joints.values()):
        return None
    moved = (points - points[0]).reshape(-1, 3)
    _, sizes, axes = np.linalg.svd(moved, full_matrices=False)
    if len(sizes) < 3 or sizes[1] <= PLANAR * sizes[0]:
        return None  # along a line: in many planes
    normal: FloatArray = axes[2]
    extent = float(np.ptp(points[0], axis=0).max())
    flat = sizes[2] <= PLANAR * sizes[0] and np.ptp(points[0] @ normal) <= THICKEST * extent
    return normal if flat else None


def _plane_view(normal: FloatArray, up: FloatArray, names: tuple[str, ...]) -> View:
    """Gravity points down where it lies in the plane; else the paper's axes lie as they are used to."""
    axes = sorted(sorted(range(3), key=lambda k: abs(normal[k]))[:2])
    across, along = (np.eye(3)[k] - normal[k] * normal for k in axes)
    told = [f"{names[k] if k < len(names) else f'x{k + 1}'} [m]" for k in axes]
    upright = up - (up @ normal) * normal
    if np.linalg.norm(upright) > UPRIGHT:
        upright /= np.linalg.norm(upright)
        level, title = (across, told[0]) if abs(across @ upright) < abs(along @ upright) else (along, told[1])
        level = level - (level @ upright) * upright
        return View(title, level / np.linalg.norm(level), upright)
    right = across / np.linalg.norm(across)
    upwards = along - (along @ right) * right
    return View(told[0], right, upwards / np.linalg.norm(upwards), told[1])


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


def _layout(views: tuple[View, ...], points: FloatArray, whole: tuple[float, float] = SIZE) -> Layout:
    """Give each view a box, fractions of the figure, and limits of equal scale that hold everything at all times."""
    width, height = whole
    left, gap = 0.05 if not views[0].title else 0.6, 0.62
    bottom, top = 0.45 if views[-1].title else 0.05, 0.12
    room = (width - (len(views) - 1) * gap - left - 0.1) / len(views)
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
    axes = figure.add_axes(box, axes_class=LightAxes)
    axes.set_xlim(limits[0], limits[1])
    axes.set_ylim(limits[2], limits[3])
    axes.set_box_aspect(box[3] * size_of(figure)[1] / (box[2] * size_of(figure)[0]))
    if not triad:
        axes.locator_params(nbins=5)
        axes.set_xlabel(view.title)
        place_below(figure, axes)
        if size_of(figure)[0] < NARROW and box[2] < 0.5:  # beside the axis it would run into the neighbour
            axes.annotate(view.side, (0.03, 0.98), xycoords="axes fraction", va="top")
        else:
            axes.set_ylabel(view.side)
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


def _animation(
    skeleton: Skeleton, kept: np.ndarray, time: FloatArray, layout: Layout, whole: tuple[float, float]
) -> str:
    """Return times, lines, joints, positions in space and the views' projections onto the drawing, as JSON.

    Positions are whole multiples of ``1 / scale``, in the order of time and as differences; each view has two rows
    ``[ax, ay, az, b]``, which make a point of the drawing ``(a . p + b)``.
    """
    width, height = np.array(whole) * POINTS_PER_INCH
    centre = skeleton.points[kept].reshape(-1, 3).mean(axis=0)
    views, largest = [], 0.0
    for view, box, (x0, x1, y0, y1) in layout:
        across, down = box[2] * width / (x1 - x0), box[3] * height / (y1 - y0)
        start = np.array([box[0] * width, (1 - box[1]) * height])
        middle = view(centre) - [x0, y0]
        views.append(
            [
                [*(across * view.right), start[0] + across * middle[0]],
                [*(-down * view.up), start[1] - down * middle[1]],
            ]
        )
        largest = max(largest, across, down)
    scale = SCALE * largest
    places = np.rint((skeleton.points[kept] - centre) * scale).astype(int).reshape(len(kept), -1)
    told = {
        "t": [float(f"{v:.6g}") for v in time[kept]],
        "scale": float(f"{scale:.9g}"),
        "lines": {kind: [list(pair) for pair in pairs] for kind, pairs in skeleton.lines},
        "joints": {kind: list(members) for kind, members in skeleton.joints},
        "views": [[[float(f"{v:.7g}") for v in row] for row in rows] for rows in views],
        # differences: smaller numbers, a third of the bytes
        "places": [places[0].tolist(), *np.diff(places, axis=0).tolist()],
    }
    return json.dumps(told, separators=(",", ":"))
