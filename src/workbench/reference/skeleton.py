"""The mechanism as points and lines: what a drawing of it needs, without geometry of the bodies."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.reference.mujoco_reference import MujocoReference

SAME_PLACE = 1e-9
"""m: two points of one body that are closer than this are drawn as one."""

KINDS = {
    mujoco.mjtJoint.mjJNT_HINGE: "hinge",
    mujoco.mjtJoint.mjJNT_BALL: "ball",
    mujoco.mjtJoint.mjJNT_SLIDE: "slide",
}


@dataclass(frozen=True)
class Skeleton:
    """Points over time, and which of them the bodies join."""

    points: dict[str, FloatArray]
    """``body.NAME``, ``joint.NAME`` or ``site.NAME`` to ``(n, 3)``, m, base (paper) frame"""
    links: dict[str, list[list[str]]]
    """moving body to pairs of points, each a straight line of the drawing"""
    joints: dict[str, dict[str, str | bool]]
    """joint to the ``point`` where it is drawn, its ``kind`` and whether it is ``actuated``"""
    platform: str
    """the point of the platform site"""
    up: tuple[float, float, float]
    """against gravity, base frame"""

    def facts(self) -> dict[str, object]:
        """What is constant over time, for the manifest; the points themselves go to the series."""
        return {"links": self.links, "joints": self.joints, "platform": self.platform, "up": list(self.up)}


def skeleton(reference: MujocoReference, qpos: FloatArray) -> Skeleton:
    """Return the lines of every moving body: from its origin to its joints, its sites and what slides on it.

    Parameters
    ----------
    reference
        The reference whose model is drawn.
    qpos
        MuJoCo's coordinates ``(n, nq)``, as `ReferenceResult.qpos` holds them.
    """
    model, structure = reference.compiled(), reference.structure
    places = _places(model, reference.base_rotation, structure.base, qpos)
    fixed = {body for body in range(model.nbody) if not structure.moves[body].any()}
    obj = mujoco.mjtObj
    origins = [f"body.{_name(model, obj.mjOBJ_BODY, body)}" for body in range(model.nbody)]
    used: dict[str, FloatArray] = {}
    links: dict[str, list[list[str]]] = {}
    drawn: dict[int, dict[str, FloatArray]] = {body: {origins[body]: places[0][:, body]} for body in range(model.nbody)}

    def point_on(body: int, name: str, place: FloatArray) -> str:
        """Return the point's name, or that of an earlier point of the body in the same place."""
        for known, where in drawn[body].items():
            if np.abs(where - place).max(initial=0.0) < SAME_PLACE:
                used[known] = where
                return known
        drawn[body][name] = used[name] = place
        return name

    def line(body: int, name: str, place: FloatArray) -> None:
        end = point_on(body, name, place)
        if body not in fixed and end != origins[body]:
            used[origins[body]] = places[0][:, body]
            links.setdefault(origins[body].removeprefix("body."), []).append([origins[body], end])

    joints: dict[str, dict[str, str | bool]] = {}
    driven = set(model.actuator_trnid[:, 0].tolist())
    for joint in range(model.njnt):
        name = _name(model, obj.mjOBJ_JOINT, joint)
        child = int(model.jnt_bodyid[joint])
        parent = int(model.body_parentid[child])
        kind = KINDS.get(mujoco.mjtJoint(model.jnt_type[joint]), "free")
        slides = kind == "slide"
        place = places[0][:, child] if slides else places[1][:, joint]
        own = point_on(child, origins[child] if slides else f"joint.{name}", place)
        if not slides:
            line(child, own, place)
        if parent not in fixed:
            line(parent, own, place)
        joints[name] = {"point": own, "kind": kind, "actuated": joint in driven}
    for site in range(model.nsite):
        line(int(model.site_bodyid[site]), f"site.{_name(model, obj.mjOBJ_SITE, site)}", places[2][:, site])
    platform_site = structure.platform_site
    platform = point_on(
        int(model.site_bodyid[platform_site]),
        f"site.{_name(model, obj.mjOBJ_SITE, platform_site)}",
        places[2][:, platform_site],
    )
    gravity = np.array(model.opt.gravity) @ reference.base_rotation
    size = float(np.linalg.norm(gravity))
    up = -gravity / size if size > 0 else np.array([0.0, 0.0, 1.0]) @ reference.base_rotation
    return Skeleton(used, links, joints, platform, (float(up[0]) + 0.0, float(up[1]) + 0.0, float(up[2]) + 0.0))


def _places(
    model: mujoco.MjModel, rotation: FloatArray, base: int, qpos: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Origins of bodies, anchors of joints and places of sites, each ``(n, k, 3)``, base frame."""
    data = mujoco.MjData(model)
    counts = (model.nbody, model.njnt, model.nsite)
    bodies, anchors, sites = (np.zeros((len(qpos), count, 3)) for count in counts)
    for sample, coordinates in enumerate(qpos):
        data.qpos[:] = coordinates
        mujoco.mj_kinematics(model, data)
        bodies[sample], anchors[sample], sites[sample] = data.xpos, data.xanchor, data.site_xpos
    origin = bodies[:, base : base + 1].copy()
    return (bodies - origin) @ rotation, (anchors - origin) @ rotation, (sites - origin) @ rotation


def _name(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    return mujoco.mj_id2name(model, kind, index) or f"#{index}"
