"""How far the joints of a robot may go, and the box that its platform then stays in."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import MotionError
from workbench.robots.description import Description

if TYPE_CHECKING:
    from workbench.capabilities.robot import Robot

FARTHEST_SLIDE = 2.0
"""Times the model's extent: how far a slide without limits is looked at."""

PROBES = 512
"""Poses of the joints, spread evenly, from which a box in task coordinates is found."""

MARGIN = 0.1
"""Part of the box's size by which it is made wider: the platform may reach a little further between the probes."""


def coordinate_limits(description: Description, model: mujoco.MjModel) -> tuple[tuple[float, float], ...]:
    """Range of each actuated coordinate, m or rad: the robot file's, the joint's, or as far as one may look."""
    found = []
    for joint in description.joints:
        given = description.robot.spec.limits.get(joint)
        index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
        if given is not None:
            low, high = given
        elif model.jnt_limited[index]:
            low, high = (float(value) for value in model.jnt_range[index])
        else:
            start = float(model.qpos0[model.jnt_qposadr[index]])
            slide = model.jnt_type[index] == mujoco.mjtJoint.mjJNT_SLIDE
            reach = FARTHEST_SLIDE * float(model.stat.extent) if slide else math.pi
            low, high = start - reach, start + reach
        found.append((float(low), float(high)))
    return tuple(found)


def reach_box(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Corners ``(m,)`` of a box in task coordinates around what `PROBES` poses of the joints reach.

    Raises
    ------
    MotionError
        None of them can be assembled on the home branch.
    """
    from scipy.stats import qmc

    low, high = np.array(robot.joint_limits).T
    probes = low + (high - low) * qmc.Sobol(len(low), rng=np.random.default_rng(0)).random(PROBES)
    points = robot.reference.reached_places(probes, robot.coordinates)
    if not len(points):
        raise MotionError(
            f"{robot.name}: no pose within the joints' limits can be assembled; give limits in the robot file"
        )
    wide = MARGIN * np.ptp(points, axis=0)
    return points.min(axis=0) - wide, points.max(axis=0) + wide
