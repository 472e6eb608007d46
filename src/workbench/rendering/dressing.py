"""What a model whose author chose no colours and no view is given for a picture, in memory.

MuJoCo draws such a model in one grey and looks at where it stands before its loops are closed.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.arrays import FloatArray
from workbench.mjcf.compile import custom_text
from workbench.rendering.solids import SHOWN_GROUPS

GREY = (0.5, 0.5, 0.5, 1.0)
"""What MuJoCo gives a geom without a colour."""
FIXED = (0.24, 0.27, 0.32, 1.0)
DRIVEN = (0.13, 0.36, 0.66, 1.0)
PASSIVE = (0.70, 0.73, 0.78, 1.0)
PLATFORM = (0.85, 0.36, 0.13, 1.0)
"""Colours by role: base, bodies with an actuated joint, other bodies, platform; told apart without red and green."""
MARGIN = 0.88
"""Share of the picture that the robot may fill, each way."""
UNSAID = (90.0, -45.0)
"""Azimuth and elevation, degrees, of a model that says nothing."""
OBLIQUE = (120.0, -25.0)
ALONG = ((180.0, 0.0), (90.0, 0.0), (90.0, -90.0))
"""Against x, along y, down z: what lies to the right is y, x, x."""
FLAT = 1e-6
"""How far from parallel, and from square, axes of a planar robot may be."""
DISTANCE = 1.5
"""The free camera of MuJoCo stands so many extents of the model away."""


def dress(model: mujoco.MjModel, poses: FloatArray, aspect: float) -> None:
    """Colour bodies by their role and look at all poses, in place, where the model's author left either open.

    Parameters
    ----------
    model
        A compiled model.
    poses
        ``(n, nq)``, all that will be drawn: the view holds still.
    aspect
        Width over height of the picture.
    """
    shown = _shown(model)
    if not shown.size:
        return
    colours, plain = model.geom_rgba[shown], model.geom_matid[shown] < 0
    if np.all(plain) and np.all(np.isclose(colours, GREY)):
        for geom in shown:
            model.geom_rgba[geom] = _role(model, int(model.geom_bodyid[geom]))
        marks = (model.site_matid < 0) & np.all(np.isclose(model.site_rgba, GREY), axis=1)
        model.site_rgba[marks, 3] = 0.0  # balls as large as a small robot's bodies
    if _view_is_open(model):
        model.vis.global_.azimuth, model.vis.global_.elevation = _direction(model, poses[0])
        _look_at(model, _corners(model, shown, poses), aspect)


def _shown(model: mujoco.MjModel) -> NDArray[np.intp]:
    visible = np.where(model.geom_matid >= 0, 1.0, model.geom_rgba[:, 3]) > 0
    solid = model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE  # of no size: neither a role nor a reason to stand back
    return np.flatnonzero(visible & solid & (model.geom_group < SHOWN_GROUPS))


def _role(model: mujoco.MjModel, body: int) -> tuple[float, float, float, float]:
    welded = int(model.body_weldid[body])
    if welded == 0:
        return FIXED
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, custom_text(model, "platform_site") or "")
    if site >= 0 and welded == model.body_weldid[model.site_bodyid[site]]:
        return PLATFORM
    joints = model.actuator_trnid[model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT, 0]
    return DRIVEN if welded in model.jnt_bodyid[joints] else PASSIVE


def _view_is_open(model: mujoco.MjModel) -> bool:
    """Whether nobody chose a direction to look in, and the camera is one that stands somewhere."""
    view = model.vis.global_
    return (view.azimuth, view.elevation) == UNSAID and not view.orthographic


def _direction(model: mujoco.MjModel, pose: FloatArray) -> tuple[float, float]:
    """Azimuth and elevation, degrees: a planar robot is looked at along the axes of its hinges."""
    data = mujoco.MjData(model)
    data.qpos[:] = pose
    mujoco.mj_kinematics(model, data)
    hinges = data.xaxis[model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE]
    slides = data.xaxis[model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE]
    if not len(hinges) or len(hinges) + len(slides) < model.njnt:
        return OBLIQUE
    normal = np.abs(hinges[0])
    if np.any(np.abs(hinges @ hinges[0]) < 1 - FLAT) or np.any(np.abs(slides @ hinges[0]) > FLAT):
        return OBLIQUE
    return next((ALONG[axis] for axis in range(3) if normal[axis] > 1 - FLAT), OBLIQUE)


def _corners(model: mujoco.MjModel, shown: NDArray[np.intp], poses: FloatArray) -> FloatArray:
    """``(k, 3)`` corners of the boxes around what is drawn, world frame, m."""
    signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T
    boxes = model.geom_aabb[shown]
    local = boxes[:, None, :3] + signs * boxes[:, None, 3:]
    data, found = mujoco.MjData(model), []
    for pose in poses:
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        turned = np.einsum("gij,gkj->gki", data.geom_xmat[shown].reshape(-1, 3, 3), local)
        found.append((data.geom_xpos[shown, None] + turned).reshape(-1, 3))
    return np.concatenate(found)


def _look_at(model: mujoco.MjModel, points: FloatArray, aspect: float) -> None:
    """Put the free camera as near as all points stay within the picture; its direction is the model's own."""
    view = model.vis.global_
    azimuth, elevation = np.radians([view.azimuth, view.elevation])
    forward = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    axes = np.stack([right, np.cross(right, forward), forward])
    seen = points @ axes.T
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    across, along, depth = (seen - middle).T
    half = MARGIN * np.tan(np.radians(view.fovy) / 2)
    distance = float(np.max(np.maximum(np.abs(across) / aspect, np.abs(along)) / half - depth))
    if distance > 0:
        model.stat.center[:] = middle @ axes
        model.stat.extent = distance / DISTANCE
