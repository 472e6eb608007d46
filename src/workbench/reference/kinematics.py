"""Positions of a mechanism computed by the package's own machine code: where bodies and points are, what moves them.

Closing loops takes several evaluations of a sample, each of which needs positions alone. These kernels compute them
from tables that are read once from MuJoCo's compiled model, in MuJoCo's conventions. They close loops and do nothing
else: whatever a result is made of MuJoCo evaluates at the closed pose, and its own numbers say whether the loops are
closed there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import borrowing, inlined
from workbench.reference.frames import Frames

SLIDE, HINGE, TURNING, FLOATING = 0, 1, 2, 3
"""Kinds of joints; the third is MuJoCo's ball, the fourth its free joint."""

JOINT_KINDS = {
    mujoco.mjtJoint.mjJNT_SLIDE: SLIDE,
    mujoco.mjtJoint.mjJNT_HINGE: HINGE,
    mujoco.mjtJoint.mjJNT_BALL: TURNING,
    mujoco.mjtJoint.mjJNT_FREE: FLOATING,
}

KIND_OF = np.array([JOINT_KINDS[kind] for kind in sorted(JOINT_KINDS, key=lambda kind: kind.value)], dtype=np.int64)
"""The same by MuJoCo's number."""

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


class Kinematics(NamedTuple):
    """Numbers of one compiled model; lengths in m, angles in rad, quaternions w x y z."""

    parent: IntArray
    """``(nbody,)``"""
    body_pos: FloatArray
    """``(nbody, 3)`` in the parent's frame"""
    body_quat: FloatArray
    """``(nbody, 4)``"""
    first: IntArray
    """``(nbody,)`` first joint of each body"""
    number: IntArray
    """``(nbody,)`` how many it has"""
    kind: IntArray
    """``(njnt,)``"""
    joint_pos: FloatArray
    """``(njnt, 3)`` in the body's frame"""
    joint_axis: FloatArray
    """``(njnt, 3)``"""
    qpos_of: IntArray
    dof_of: IntArray
    start: FloatArray
    """``(nq,)`` coordinates in which hinges and slides stand as drawn"""
    points: IntArray
    """``(k,)`` sites and frames that closures join, the frames numbered after the sites"""
    point_body: IntArray
    """``(k,)``"""
    point_pos: FloatArray
    """``(k, 3)`` in the body's frame"""
    point_quat: FloatArray
    """``(k, 4)``"""
    centre: FloatArray
    """``(nbody, 3)`` the fixed point about which each tree's motion vectors are taken, world"""


class Places(NamedTuple):
    """Where one sample is, world frame; room that is used for all samples of a call."""

    xpos: FloatArray
    """``(nbody, 3)``"""
    xquat: FloatArray
    """``(nbody, 4)``"""
    anchors: FloatArray
    """``(njnt, 3)``"""
    cdof: FloatArray
    """``(nv, 6)`` angular, linear about the tree's `Kinematics.centre`"""
    site_xpos: FloatArray
    """``(sites + frames, 3)``, those of `Kinematics.points`"""
    site_xquat: FloatArray


def is_covered(model: mujoco.MjModel) -> bool:
    """Whether positions follow from joints alone."""
    return bool(model.nmocap == 0 and model.nflex == 0 and model.nplugin == 0)


def kinematics_of(model: mujoco.MjModel, frames: Frames, points: IntArray, centres: FloatArray) -> Kinematics:
    """Read the tables of a compiled model.

    *points* are the sites and frames wanted, *centres* ``(nbody, 3)`` mass centres of subtrees in a usual pose, world.
    """
    bodies = np.concatenate([np.asarray(model.site_bodyid, dtype=np.int64).reshape(-1), frames.bodies])
    positions = np.concatenate([np.asarray(model.site_pos).reshape(-1, 3), frames.positions])
    turns = np.concatenate([np.asarray(model.site_quat).reshape(-1, 4), frames.quaternions])
    centre = centres[np.asarray(model.body_rootid)]
    centre.flags.writeable = False  # as the engine's own: for the kernels another type
    return Kinematics(
        parent=np.array(model.body_parentid, dtype=np.int64),
        body_pos=np.array(model.body_pos, dtype=np.float64),
        body_quat=np.array(model.body_quat, dtype=np.float64),
        first=np.array(model.body_jntadr, dtype=np.int64),
        number=np.array(model.body_jntnum, dtype=np.int64),
        kind=KIND_OF[np.asarray(model.jnt_type)],
        joint_pos=np.array(model.jnt_pos, dtype=np.float64).reshape(-1, 3),
        joint_axis=np.array(model.jnt_axis, dtype=np.float64).reshape(-1, 3),
        qpos_of=np.array(model.jnt_qposadr, dtype=np.int64),
        dof_of=np.array(model.jnt_dofadr, dtype=np.int64),
        start=np.array(model.qpos0, dtype=np.float64),
        points=points,
        point_body=bodies[points],
        point_pos=positions[points],
        point_quat=turns[points],
        centre=centre,
    )


def room(kinematics: Kinematics, freedoms: int) -> Places:
    """Room for one sample of a model with so many freedoms."""
    bodies, joints = len(kinematics.parent), len(kinematics.kind)
    points = int(kinematics.points.max()) + 1 if len(kinematics.points) else 1
    xquat = np.zeros((bodies, 4))
    xquat[0, 0] = 1.0
    return Places(
        np.zeros((bodies, 3)), xquat, np.zeros((joints, 3)), np.zeros((freedoms, 6)), np.zeros((points, 3)),
        np.zeros((points, 4)),
    )  # fmt: skip


@inlined
def _turned(quaternion, vector):  # type: ignore[no-untyped-def]
    """Turn a vector by a unit quaternion."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    px, py, pz = vector[0], vector[1], vector[2]
    cx, cy, cz = y * pz - z * py + w * px, z * px - x * pz + w * py, x * py - y * px + w * pz
    return px + 2.0 * (y * cz - z * cy), py + 2.0 * (z * cx - x * cz), pz + 2.0 * (x * cy - y * cx)


@inlined
def _times(one, w, x, y, z, out):  # type: ignore[no-untyped-def]
    """Quaternion product of *one* and (w, x, y, z) into *out*, which may be *one*."""
    a, b, c, d = one[0], one[1], one[2], one[3]
    out[0] = a * w - b * x - c * y - d * z
    out[1] = a * x + b * w + c * z - d * y
    out[2] = a * y - b * z + c * w + d * x
    out[3] = a * z + b * y - c * x + d * w


@inlined
def _turn_on(one, other, out):  # type: ignore[no-untyped-def]
    """Quaternion product of *one* and *other* into *out*; most are no turn at all."""
    if other[0] == 1.0 and other[1] == 0.0 and other[2] == 0.0 and other[3] == 0.0:
        out[0], out[1], out[2], out[3] = one[0], one[1], one[2], one[3]
    else:
        _times(one, other[0], other[1], other[2], other[3], out)


@inlined
def _turning(cdof, row, ax, ay, az, rx, ry, rz):  # type: ignore[no-untyped-def]
    """Motion vector of a turn about an axis through a point; r leads from the point to the centre."""
    cdof[row, 0], cdof[row, 1], cdof[row, 2] = ax, ay, az
    cdof[row, 3], cdof[row, 4], cdof[row, 5] = ay * rz - az * ry, az * rx - ax * rz, ax * ry - ay * rx


@inlined
def _turn_axes(cdof, row, quaternion, rx, ry, rz):  # type: ignore[no-untyped-def]
    """Motion vectors of turns about the three axes of a body."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    _turning(cdof, row, 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y), rx, ry, rz)
    _turning(cdof, row + 1, 2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x), rx, ry, rz)
    _turning(cdof, row + 2, 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y), rx, ry, rz)


@borrowing
def place(kin, qpos, places):  # type: ignore[no-untyped-def]
    """Fill the places of one configuration ``(nq,)``."""
    xpos, xquat, anchors, cdof = places.xpos, places.xquat, places.anchors, places.cdof
    for b in range(1, kin.parent.shape[0]):
        p, here, turn = kin.parent[b], xpos[b], xquat[b]
        x, y, z = _turned(xquat[p], kin.body_pos[b])
        here[0], here[1], here[2] = xpos[p, 0] + x, xpos[p, 1] + y, xpos[p, 2] + z
        _turn_on(xquat[p], kin.body_quat[b], turn)
        turned = False
        for j in range(kin.first[b], kin.first[b] + kin.number[b]):
            kind, a, d = kin.kind[j], kin.qpos_of[j], kin.dof_of[j]
            if kind == FLOATING:
                n = math.sqrt(qpos[a + 3] ** 2 + qpos[a + 4] ** 2 + qpos[a + 5] ** 2 + qpos[a + 6] ** 2)
                for i in range(3):
                    here[i] = anchors[j, i] = qpos[a + i]
                for i in range(4):
                    turn[i] = qpos[a + 3 + i] / n
                continue
            # most joints are at the origin of their body
            shifted = kin.joint_pos[j, 0] != 0.0 or kin.joint_pos[j, 1] != 0.0 or kin.joint_pos[j, 2] != 0.0
            cx, cy, cz = here[0], here[1], here[2]
            if shifted:
                x, y, z = _turned(turn, kin.joint_pos[j])
                cx, cy, cz = cx + x, cy + y, cz + z
            anchors[j, 0], anchors[j, 1], anchors[j, 2] = cx, cy, cz
            if kind == TURNING:
                n = 1.0 / math.sqrt(qpos[a] ** 2 + qpos[a + 1] ** 2 + qpos[a + 2] ** 2 + qpos[a + 3] ** 2)
                _times(turn, qpos[a] * n, qpos[a + 1] * n, qpos[a + 2] * n, qpos[a + 3] * n, turn)
            else:
                u = kin.joint_axis[j]
                x, y, z = _turned(turn, u)
                cdof[d, 0], cdof[d, 1], cdof[d, 2] = x, y, z  # the axis, for the second pass
                move = qpos[a] - kin.start[a]
                if kind == SLIDE:
                    here[0], here[1], here[2] = here[0] + x * move, here[1] + y * move, here[2] + z * move
                    continue
                s, c = math.sin(0.5 * move), math.cos(0.5 * move)
                _times(turn, c, s * u[0], s * u[1], s * u[2], turn)
            turned = True
            if shifted:
                x, y, z = _turned(turn, kin.joint_pos[j])
                here[0], here[1], here[2] = cx - x, cy - y, cz - z
        if turned:
            n = 1.0 / math.sqrt(turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2 + turn[3] ** 2)
            for i in range(4):
                turn[i] *= n
        for j in range(kin.first[b], kin.first[b] + kin.number[b]):
            kind, d = kin.kind[j], kin.dof_of[j]
            if kind == SLIDE:
                cdof[d, 3], cdof[d, 4], cdof[d, 5] = cdof[d, 0], cdof[d, 1], cdof[d, 2]
                cdof[d, 0], cdof[d, 1], cdof[d, 2] = 0.0, 0.0, 0.0
                continue
            rx, ry, rz = (
                kin.centre[b, 0] - anchors[j, 0], kin.centre[b, 1] - anchors[j, 1], kin.centre[b, 2] - anchors[j, 2]
            )  # fmt: skip
            if kind == HINGE:
                _turning(cdof, d, cdof[d, 0], cdof[d, 1], cdof[d, 2], rx, ry, rz)
                continue
            if kind == FLOATING:
                for i in range(3):
                    for k in range(6):
                        cdof[d + i, k] = 1.0 if k == 3 + i else 0.0
                d += 3
            _turn_axes(cdof, d, turn, rx, ry, rz)
    for k in range(kin.points.shape[0]):
        site, b = kin.points[k], kin.point_body[k]
        x, y, z = _turned(xquat[b], kin.point_pos[k])
        out = places.site_xpos[site]
        out[0], out[1], out[2] = xpos[b, 0] + x, xpos[b, 1] + y, xpos[b, 2] + z
        _turn_on(xquat[b], kin.point_quat[k], places.site_xquat[site])
