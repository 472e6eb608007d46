"""What a robot is by its robot file and model: names, units, task coordinates, limits."""

from __future__ import annotations

from functools import cached_property

import mujoco
import numpy as np

from workbench.capabilities.limits import coordinate_limits
from workbench.robots.description import Description
from workbench.robots.load import Base


class RobotIdentity:
    """Facts about a robot that no parameter changes."""

    _base: Base
    _description: Description

    @property
    def description(self) -> Description:
        """What the robot file says of the model."""
        return self._description

    @property
    def name(self) -> str:
        """The robot's name."""
        return self._description.name

    @property
    def title(self) -> str:
        """The robot's title; its name where the file gives none."""
        return self._description.robot.spec.title or self.name

    @property
    def reference_key(self) -> str:
        """Bibliography key of its source, explained in docs/references.md; may be empty."""
        return self._description.robot.spec.reference

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints, in the order of q and tau."""
        return self._description.joints

    @property
    def computed(self) -> frozenset[str]:
        """Parameters that cannot be set: MuJoCo computes them from other numbers of the file."""
        return frozenset(self._base.computed)

    @cached_property
    def _slides(self) -> tuple[bool, ...]:
        model = self._base.model
        ids = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint) for joint in self.joints]
        return tuple(bool(model.jnt_type[i] == mujoco.mjtJoint.mjJNT_SLIDE) for i in ids)

    @property
    def coordinate_units(self) -> tuple[str, ...]:
        """Unit of each q, ``m`` or ``rad``."""
        return tuple("m" if slide else "rad" for slide in self._slides)

    @property
    def force_units(self) -> tuple[str, ...]:
        """Unit of each tau, ``N`` or ``N m``."""
        return tuple("N" if slide else "N m" for slide in self._slides)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Task coordinates: some of ``x y z rx ry rz``."""
        return self._description.robot.spec.platform.task

    @property
    def platform_axes(self) -> tuple[str, ...]:
        """Names of the task coordinates as the robot's source writes them."""
        platform = self._description.robot.spec.platform
        return tuple(platform.names or platform.task)

    @property
    def position_axes(self) -> tuple[str, str, str]:
        """Names of x, y, z of the base's frame: as the robot's source writes those that are task coordinates."""
        named = dict(zip(self.coordinates, self.platform_axes, strict=True))
        return named.get("x", "x"), named.get("y", "y"), named.get("z", "z")

    @property
    def task_units(self) -> tuple[str, ...]:
        """Unit of each task coordinate, ``m`` or ``rad``."""
        return tuple("rad" if name.startswith("r") else "m" for name in self.coordinates)

    @cached_property
    def up(self) -> tuple[float, float, float]:
        """Unit vector against gravity along one axis of the base body's frame."""
        model = self._base.model
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, self._description.robot.spec.base)
        gravity = np.asarray(model.opt.gravity) @ data.xmat[max(body, 0)].reshape(3, 3)
        axis = int(np.argmax(np.abs(gravity))) if gravity.any() else 2
        sign = -1.0 if gravity[axis] > 0 else 1.0
        return tuple(sign if i == axis else 0.0 for i in range(3))  # type: ignore[return-value]

    @property
    def joint_limits(self) -> tuple[tuple[float, float], ...]:
        """Range of each actuated coordinate: of the robot file, of the model's joints, or as far as one may look."""
        return coordinate_limits(self._description, self._base.model)

    @property
    def mass_models(self) -> tuple[str, ...]:
        """Mass models that the reference has."""
        return ("distributed", "lumped") if self._description.robot.spec.lumped else ("distributed",)
