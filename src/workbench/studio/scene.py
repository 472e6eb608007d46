"""The robot in three dimensions: its solids, its ghost, and marks for what has no shape of its own."""

from __future__ import annotations

from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.rendering.solids import Movement, Solid
from workbench.studio.outcome import Outcome
from workbench.studio.solid_meshes import colour_of, same, triangles

MARKS = ("joints", "loops", "mass centres", "frames", "torques", "reactions", "external force", "path")
"""What can be switched on and off."""
SHOWN_AT_FIRST = ("joints", "torques", "path")

DRIVEN, PASSIVE, LOOP, CENTRE = (230, 126, 34), (120, 120, 130), (142, 68, 173), (40, 40, 40)
TORQUE, REACTION, EXTERNAL, GHOST = (230, 126, 34), (41, 128, 185), (192, 57, 43), (110, 110, 125)
PATH = (39, 174, 96)
FLOOR = (((190, 190, 195), (160, 160, 168)), ((52, 54, 60), (76, 80, 88)))
"""Colours of the floor's cells and sections, on light and on dark."""
GHOST_OPACITY = 0.4
LONGEST_ARROW = 0.35
"""Of the robot's size, for the largest of its kind over the motion."""


class Scene:
    """A robot drawn with viser's scene; everything below ``/robot`` and ``/ghost``, world frame, z up."""

    def __init__(self, server: Any, dark: bool = False) -> None:
        self._scene = server.scene
        self._dark = dark
        self._server = server
        self._frames: dict[str, list[Any]] = {"/robot": [], "/ghost": []}
        self._drawn: dict[str, tuple[Solid, ...]] = {"/robot": (), "/ghost": ()}
        self._nodes: dict[str, dict[int, Any]] = {"/robot": {}, "/ghost": {}}
        self._marks: dict[str, list[Any]] = {}
        self._outcome: Outcome | None = None
        self._ghost: Outcome | None = None
        self.shown = set(SHOWN_AT_FIRST)
        self.size = 1.0
        self.centre = np.zeros(3)

    def show(self, outcome: Outcome, ghost: Outcome | None) -> None:
        """Draw another outcome, and the ghost of what it is compared with; only what differs is sent."""
        first = self._outcome is None
        self._outcome, self._ghost = outcome, ghost
        if first:
            self._measure(outcome)
            self._floor(outcome)
        self._solids("/robot", outcome, None)
        self._scene_visible("/ghost", ghost is not None)
        if ghost is not None:
            self._solids("/ghost", ghost, GHOST_OPACITY)
        self._make_marks(outcome)

    def _measure(self, outcome: Outcome) -> None:
        low, high = bounds(outcome.movement)
        self.centre, self.size = 0.5 * (low + high), max(float(np.linalg.norm(high - low)), 1e-3)
        across = flat_axis(outcome.movement)
        view = np.array([1.0, -1.25, 0.65]) if across is None else -np.eye(3)[across]
        if across == 2:
            view = np.array([0.0, -0.02, 1.0])
        view = view / np.linalg.norm(view)
        camera = self._server.initial_camera
        camera.look_at = tuple(self.centre)
        camera.position = tuple(self.centre + 1.2 * self.size * view)
        camera.near, camera.far = 0.01 * self.size, 100.0 * self.size

    def in_the(self, dark: bool) -> None:
        """Draw a floor that is seen on light, or on dark, and does not glare."""
        self._dark = dark
        if self._outcome is not None:
            self._floor(self._outcome)

    def _floor(self, outcome: Outcome) -> None:
        cells, sections = FLOOR[self._dark]
        low, _ = bounds(outcome.movement)
        cell = 10.0 ** np.floor(np.log10(self.size)) / 2
        position = (*self.centre[:2], low[2] - 0.12 * self.size)
        self._scene.add_grid(
            "/floor", width=3 * self.size, height=3 * self.size, cell_size=float(cell), section_size=float(2 * cell),
            plane="xy", position=position, cell_color=cells, section_color=sections,
        )  # fmt: skip

    def _scene_visible(self, root: str, visible: bool) -> None:
        for frame in self._frames[root]:
            frame.visible = visible

    def _solids(self, root: str, outcome: Outcome, opacity: float | None) -> None:
        bodies = outcome.movement.places.shape[1]
        frames = self._frames[root]
        while len(frames) < bodies:
            frames.append(self._scene.add_frame(f"{root}/{len(frames)}", show_axes=False))
        old, new, nodes = self._drawn[root], outcome.solids, self._nodes[root]
        for index, solid in enumerate(new):
            if index < len(old) and same(old[index], solid):
                continue
            if index in nodes:
                nodes.pop(index).remove()
            vertices, faces = triangles(solid)
            nodes[index] = self._scene.add_mesh_simple(
                f"{root}/{solid.body}/{index}", vertices, faces, color=GHOST if opacity else colour_of(solid),
                opacity=opacity or (solid.colour[3] if solid.colour[3] < 1.0 else None), position=solid.position,
                wxyz=solid.wxyz, cast_shadow=opacity is None, receive_shadow=opacity is None, side="double",
            )  # fmt: skip
        for index in [i for i in nodes if i >= len(new)]:
            nodes.pop(index).remove()
        self._drawn[root] = new

    def switch(self, mark: str, on: bool) -> None:
        """Show or hide a kind of mark."""
        (self.shown.add if on else self.shown.discard)(mark)
        for handle in self._marks.get(mark, []):
            handle.visible = on

    def _make_marks(self, outcome: Outcome) -> None:
        for handle in (handle for handles in self._marks.values() for handle in handles):
            handle.remove()
        size, moved, add = self.size, outcome.movement, self._scene
        self._marks = {mark: [] for mark in MARKS}

        def points(mark: str, name: str, places: FloatArray, colour: tuple[int, int, int], radius: float) -> None:
            if len(places):
                self._marks[mark].append(
                    add.add_point_cloud(
                        f"/marks/{name}", places, colour, point_size=radius * size, point_shape="circle",
                        precision="float32", visible=mark in self.shown,
                    )
                )  # fmt: skip

        def arrows(mark: str, name: str, spans: FloatArray, colour: tuple[int, int, int]) -> None:
            if len(spans):
                self._marks[mark].append(
                    add.add_arrows(
                        f"/marks/{name}", spans, colour, shaft_radius=0.006 * size, head_radius=0.016 * size,
                        head_length=0.04 * size, visible=mark in self.shown,
                    )
                )  # fmt: skip

        at = _Moment(outcome, 0, size)
        points("joints", "driven", at.joints(True), DRIVEN, 0.022)
        points("joints", "passive", at.joints(False), PASSIVE, 0.014)
        for anchor in moved.anchors:
            if anchor.actuated:
                label = add.add_label(f"/marks/label {anchor.name}", anchor.name, position=anchor.place[0])
                label.visible = "joints" in self.shown
                self._marks["joints"].append(label)
        points("loops", "loops", at.loops(), LOOP, 0.024)
        points("mass centres", "centres", at.centres(), CENTRE, 0.018)
        arrows("torques", "torques", at.torques(), TORQUE)
        arrows("reactions", "reactions", at.reactions(), REACTION)
        arrows("external force", "external", at.external(), EXTERNAL)
        frame = add.add_batched_axes(
            "/marks/frames", moved.turns[0], moved.places[0], axes_length=0.06 * size, axes_radius=0.0025 * size
        )
        frame.visible = "frames" in self.shown
        self._marks["frames"].append(frame)
        path = np.stack([moved.platform[:-1], moved.platform[1:]], axis=1)
        if len(path):
            self._marks["path"].append(
                add.add_line_segments(
                    "/marks/path", path, PATH, thickness=2.0, thickness_units="screen", visible="path" in self.shown
                )
            )

    def pose(self, sample: int) -> None:
        """Put the robot, its ghost and all marks at a sample."""
        outcome = self._outcome
        if outcome is None:
            return
        with self._server.atomic():
            self._place("/robot", outcome.movement, sample)
            if self._ghost is not None:
                self._place("/ghost", self._ghost.movement, min(sample, len(self._ghost.t) - 1))
            self._place_marks(_Moment(outcome, sample, self.size))

    def pose_as(self, movement: Movement) -> None:
        """Put the robot at a pose of its own, off the motion; marks that belong to the motion stay where they were."""
        with self._server.atomic():
            self._place("/robot", movement, 0)

    def _place(self, root: str, movement: Movement, sample: int) -> None:
        for body, frame in enumerate(self._frames[root]):
            frame.position, frame.wxyz = movement.places[sample, body], movement.turns[sample, body]

    def _place_marks(self, at: _Moment) -> None:
        marks = self._marks
        if "joints" in self.shown:
            handles = iter(marks["joints"])
            for driven in (True, False):
                if len(places := at.joints(driven)):
                    next(handles).points = places
            for handle, anchor in zip(handles, [a for a in at.moved.anchors if a.actuated], strict=False):
                handle.position = anchor.place[at.sample]
        for mark, values in (
            ("loops", at.loops), ("mass centres", at.centres), ("torques", at.torques), ("reactions", at.reactions),
            ("external force", at.external),
        ):  # fmt: skip
            if mark in self.shown and marks[mark]:
                marks[mark][0].points = values()
        if "frames" in self.shown:
            frame = marks["frames"][0]
            frame.batched_wxyzs, frame.batched_positions = at.moved.turns[at.sample], at.moved.places[at.sample]

    def cells(self, places: FloatArray, colours: FloatArray, size: float, visible: bool) -> None:
        """Draw the cells of a workspace slice ``(k, 3)``, world frame."""
        if len(places):
            self._scene.add_point_cloud(
                "/slice", places, (255 * colours).astype(np.uint8), point_size=size, point_shape="square",
                precision="float32", visible=visible, point_shading="flat",
            )  # fmt: skip

    def no_cells(self) -> None:
        """Take the slice away."""
        self._scene.remove_by_name("/slice")


class _Moment:
    """What the marks show at one sample, world frame."""

    def __init__(self, outcome: Outcome, sample: int, size: float) -> None:
        self.outcome, self.sample, self.moved = outcome, sample, outcome.movement
        self.longest = LONGEST_ARROW * size
        self.rotation = outcome.case.robot.reference.base_rotation

    def joints(self, driven: bool) -> FloatArray:
        return _stack([a.place[self.sample] for a in self.moved.anchors if a.actuated == driven])

    def loops(self) -> FloatArray:
        return _stack([place[self.sample] for place in self.moved.loops.values()])

    def centres(self) -> FloatArray:
        found: FloatArray = self.moved.centres[self.sample][self.moved.masses > 0.0]
        return found

    def torques(self) -> FloatArray:
        """Along each driven joint's axis, in shares of the joint's own peak."""
        tau, peaks = self.outcome.tau[self.sample], np.abs(self.outcome.tau).max(axis=0)
        by_name = {anchor.name: anchor for anchor in self.moved.anchors}
        spans = []
        for joint, value, peak in zip(self.outcome.case.robot.joints, tau, peaks, strict=True):
            anchor = by_name[joint]
            start = anchor.place[self.sample]
            spans.append((start, start + self.longest * value / (peak or 1.0) * anchor.axis[self.sample]))
        return _spans(spans)

    def reactions(self) -> FloatArray:
        """At each joint and loop closure, in shares of the largest of them."""
        forces = self.outcome.result.reactions
        largest = max((float(np.linalg.norm(f, axis=1).max()) for f in forces.values()), default=0.0) or 1.0
        places = {a.name: a.place for a in self.moved.anchors} | self.moved.loops
        return _spans(
            [
                (places[name][self.sample],
                 places[name][self.sample] + self.longest * (self.rotation @ force[self.sample]) / largest)
                for name, force in forces.items()
                if name in places
            ]
        )  # fmt: skip

    def external(self) -> FloatArray:
        """At the platform; its head is the platform's point."""
        force = self.rotation @ self.outcome.case.force[self.sample]
        size = float(np.linalg.norm(force))
        if not size > 0.0:
            return np.zeros((0, 2, 3))
        end = self.moved.platform[self.sample]
        return _spans([(end - self.longest * force / size, end)])


def _stack(places: list[FloatArray]) -> FloatArray:
    return np.stack(places) if places else np.zeros((0, 3))


def _spans(spans: list[tuple[FloatArray, FloatArray]]) -> FloatArray:
    return np.stack([np.stack(span) for span in spans]) if spans else np.zeros((0, 2, 3))


def bounds(movement: Movement) -> tuple[FloatArray, FloatArray]:
    """Corners ``(3,)`` of the box that holds all joints, sites and mass centres over the motion, m."""
    places = [anchor.place.reshape(-1, 3) for anchor in movement.anchors]
    places += [movement.platform.reshape(-1, 3), movement.centres[:, movement.masses > 0.0].reshape(-1, 3)]
    everything = np.concatenate(places)
    return everything.min(axis=0), everything.max(axis=0)


def flat_axis(movement: Movement) -> int | None:
    """The world axis along which nothing moves, of a planar robot; None where everything does, or two do not."""
    places = movement.places
    still = np.ptp(places, axis=0).max(axis=0) < 1e-6 * max(float(np.ptp(places, axis=0).max()), 1e-12)
    axes = np.flatnonzero(still)
    return int(axes[0]) if len(axes) == 1 else None
