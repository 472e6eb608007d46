"""A compiled model as plain numbers that any drawing library can show: visible solids, and where everything is.

World frame of the MJCF, z up; metres; quaternions (w, x, y, z).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.arrays import FloatArray

SHOWN_GROUPS = 3
"""Geoms of groups 0 to 2 are drawn, as MuJoCo's own viewer does."""

KINDS = {
    int(mujoco.mjtGeom.mjGEOM_PLANE): "plane",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "ellipsoid",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_MESH): "mesh",
}
"""What can be drawn; a height field or a signed distance field is left out."""

JOINTS = {
    int(mujoco.mjtJoint.mjJNT_HINGE): "hinge",
    int(mujoco.mjtJoint.mjJNT_SLIDE): "slide",
    int(mujoco.mjtJoint.mjJNT_BALL): "ball",
}


@dataclass(frozen=True)
class Solid:
    """One visible geom, fixed in its body."""

    body: int
    kind: str
    """one of `KINDS`"""
    size: tuple[float, float, float]
    """half sizes as MuJoCo has them: radius, half length, ..."""
    position: FloatArray
    """``(3,)`` in the body's frame"""
    wxyz: FloatArray
    colour: tuple[float, float, float, float]
    """red, green, blue, opacity; 0 to 1"""
    vertices: FloatArray = field(default_factory=lambda: np.zeros((0, 3)), repr=False)
    """``(k, 3)`` of a mesh"""
    faces: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 3), dtype=np.int32), repr=False)


@dataclass(frozen=True)
class Anchor:
    """A joint over time."""

    name: str
    kind: str
    """hinge, slide, ball or free"""
    actuated: bool
    place: FloatArray = field(repr=False)
    """``(n, 3)``"""
    axis: FloatArray = field(repr=False)
    """``(n, 3)`` unit vector; of a ball it says nothing"""


@dataclass(frozen=True)
class Movement:
    """Where bodies, mass centres, joints and sites are, sample by sample."""

    places: FloatArray = field(repr=False)
    """``(n, nbody, 3)``"""
    turns: FloatArray = field(repr=False)
    """``(n, nbody, 4)``"""
    centres: FloatArray = field(repr=False)
    """``(n, nbody, 3)`` mass centres"""
    masses: FloatArray = field(repr=False)
    """``(nbody,)`` kg"""
    anchors: tuple[Anchor, ...]
    sites: dict[str, FloatArray] = field(repr=False)
    """``(n, 3)`` by name"""
    platform: FloatArray = field(repr=False)
    """``(n, 3)`` of the platform site"""
    loops: dict[str, FloatArray] = field(repr=False)
    """``(n, 3)`` where each loop that is closed by sites closes, by the equality's name"""


def solids(model: mujoco.MjModel) -> tuple[Solid, ...]:
    """Return the visible geoms of a model."""
    found = []
    for geom in range(model.ngeom):
        kind = KINDS.get(int(model.geom_type[geom]))
        material = int(model.geom_matid[geom])
        colour = model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]
        if kind is None or int(model.geom_group[geom]) >= SHOWN_GROUPS or not colour[3] > 0:
            continue
        mesh = {}
        if kind == "mesh":
            index = int(model.geom_dataid[geom])
            first, count = int(model.mesh_vertadr[index]), int(model.mesh_vertnum[index])
            face, faces = int(model.mesh_faceadr[index]), int(model.mesh_facenum[index])
            mesh = {
                "vertices": np.array(model.mesh_vert[first : first + count], dtype=np.float64),
                "faces": np.array(model.mesh_face[face : face + faces], dtype=np.int32),
            }
        size = tuple(float(value) for value in model.geom_size[geom])
        found.append(
            Solid(
                int(model.geom_bodyid[geom]), kind, (size[0], size[1], size[2]), np.array(model.geom_pos[geom]),
                np.array(model.geom_quat[geom]), tuple(float(value) for value in colour), **mesh,  # type: ignore[arg-type]
            )
        )  # fmt: skip
    return tuple(found)


def movement(model: mujoco.MjModel, qpos: FloatArray, platform_site: int) -> Movement:
    """Return where everything is at poses ``(n, nq)``.

    Parameters
    ----------
    model, qpos
        MuJoCo's model, and its own coordinates as `ReferenceResult.qpos` holds them.
    platform_site
        Number of the platform's site.
    """
    data, n = mujoco.MjData(model), len(qpos)
    places, centres = np.zeros((2, n, model.nbody, 3))
    turns = np.zeros((n, model.nbody, 4))
    anchor, axis = np.zeros((2, n, model.njnt, 3))
    sites = np.zeros((n, model.nsite, 3))
    for sample, pose in enumerate(qpos):
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        places[sample], turns[sample], centres[sample] = data.xpos, data.xquat, data.xipos
        anchor[sample], axis[sample], sites[sample] = data.xanchor, data.xaxis, data.site_xpos
    driven = set(model.actuator_trnid[:, 0].tolist())
    obj = mujoco.mjtObj
    anchors = tuple(
        Anchor(
            mujoco.mj_id2name(model, obj.mjOBJ_JOINT, joint) or f"joint{joint}",
            JOINTS.get(int(model.jnt_type[joint]), "free"), joint in driven, anchor[:, joint], axis[:, joint],
        )
        for joint in range(model.njnt)
    )  # fmt: skip
    loops = {
        mujoco.mj_id2name(model, obj.mjOBJ_EQUALITY, index) or f"#{index}": sites[:, int(model.eq_obj1id[index])]
        for index in range(model.neq)
        if int(model.eq_objtype[index]) == int(obj.mjOBJ_SITE)
    }
    named = {name: sites[:, i] for i in range(model.nsite) if (name := mujoco.mj_id2name(model, obj.mjOBJ_SITE, i))}
    masses = np.array(model.body_mass, dtype=np.float64)
    return Movement(places, turns, centres, masses, anchors, named, sites[:, platform_site], loops)
