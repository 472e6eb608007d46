"""The workspace slice, and the platform in a hand: the robot follows by inverse kinematics where it can."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import WorkbenchError
from workbench.rendering.solids import movement
from workbench.studio.slices import planes_of, slice_of
from workbench.studio.words import number

if TYPE_CHECKING:
    from workbench.studio.page import Page

NONE = "none"


class Pointing:
    """Two tools of the page that look beyond the motion."""

    def __init__(self, page: Page) -> None:
        self._page, gui = page, page.server.gui
        self._pose: FloatArray | None = None
        robot = page.session.robot()
        self._planes = planes_of(robot)
        with gui.add_folder("beyond the motion"):
            self._plane = gui.add_dropdown("workspace slice", (NONE, *self._planes))
            self._drag = gui.add_checkbox("drag the platform", False, disabled=not self._usable())
            self._said = gui.add_html("")
        page.hands.listen(self._plane, lambda _: page.worker.ask("slice", self._slice))
        page.hands.listen(self._drag, lambda _: self._grip_or_not())
        self._grip: Any = None

    def _usable(self) -> bool:
        robot = self._page.session.robot()
        return robot.has_task and any(name in robot.coordinates for name in "xyz")

    def follow(self) -> None:
        """Redraw the slice of a robot that was changed."""
        if self._plane.value != NONE:
            self._page.worker.ask("slice", self._slice)

    def _frame(self) -> tuple[FloatArray, FloatArray]:
        """World = origin + rotation @ base."""
        outcome = self._page.session.good
        reference = outcome.case.robot.reference
        return outcome.movement.places[0, reference.structure.base], reference.base_rotation

    def _slice(self) -> None:
        page = self._page
        plane = str(self._plane.value)
        page.scene.no_cells()
        if plane == NONE:
            self._said.content = ""
            return
        outcome = page.session.good
        sample = min(page.sample, len(outcome.t) - 1)
        try:
            found = slice_of(outcome.case.robot, outcome.case.x[sample], outcome.result.x[sample], plane)
        except WorkbenchError as error:
            self._say(str(error))
            return
        origin, rotation = self._frame()
        page.scene.cells(origin + found.x @ rotation.T, found.colours, found.spacing, True)
        said = (
            f"{len(found.x)} cells of {number(1e3 * found.spacing, 3)} mm in reach, plane {plane} through the platform"
        )
        has = bool(outcome.case.robot.singularity_measures(outcome.case.motion.q[:1]))
        self._say(f"{said}; {'red: singular, blue: far from it' if has else 'no measure of singular poses'}")

    def _say(self, text: str) -> None:
        self._said.content = f'<p style="font-size:0.8rem;margin:0.3em 0.7em">{escape(text)}</p>'

    def _grip_or_not(self) -> None:
        page = self._page
        if self._grip is not None:
            self._grip.remove()
            self._grip = None
        if not self._drag.value:
            page.at(page.sample)
            self._said.content = ""
            return
        page.play(False)
        robot, outcome = page.session.robot(), page.session.good
        origin, rotation = self._frame()
        names = robot.coordinates
        active = "x" in names, "y" in names, "z" in names
        self._grip = page.server.scene.add_transform_controls(
            "/target", scale=0.22 * page.scene.size, disable_rotations=True, active_axes=active, depth_test=False,
            position=outcome.movement.platform[page.sample], wxyz=_quaternion(rotation),
        )  # fmt: skip
        self._start = outcome.case.x[page.sample].copy()
        self._grip.on_update(lambda _: page.worker.ask("drag", lambda: self._to(origin, rotation)))

    def _to(self, origin: FloatArray, rotation: FloatArray) -> None:
        if self._grip is None:
            return
        page, robot = self._page, self._page.session.robot()
        position = (np.asarray(self._grip.position) - origin) @ rotation
        x = self._start.copy()
        for index, name in enumerate("xyz"):
            if name in robot.coordinates:
                x[robot.coordinates.index(name)] = position[index]
        try:
            qpos = page.session.target(x)
        except WorkbenchError as error:
            self._say(f"Out of reach; the robot stays where it last could follow. {error}")
            return
        reference = robot.reference
        page.scene.pose_as(movement(reference.compiled(), qpos[None, :], reference.structure.platform_site))
        shown = ", ".join(f"{n} {number(float(v), 3)}" for n, v in zip(robot.platform_axes, x, strict=False))
        q = qpos[reference.structure.actuated_qpos]
        joints = ", ".join(f"{n} {number(float(v), 3)} {u}" for n, v, u in
                           zip(robot.joints, q, robot.coordinate_units, strict=True))  # fmt: skip
        self._say(f"In reach: {shown}; {joints}")


def _quaternion(rotation: FloatArray) -> FloatArray:
    """(w, x, y, z) of a rotation matrix."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(rotation).as_quat()
    return np.array([w, x, y, z])
