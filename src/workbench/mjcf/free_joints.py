"""Bodies on free joints: loose things, bases of robots that walk, and platforms that loops hold.

The reference counts hinges, slides and balls. A loose body stands still where it is (its motion and the mechanism's do
not feel each other); so does a base that the user fixes. A platform that loops hold gets three slides along the world's
axes and a ball in place of its free joint, which is the same motion in other coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError, did_you_mean

SLIDES = ("x", "y", "z")
SIX = 6
LOOPS = (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD)
FREE = mujoco.mjtJoint.mjJNT_FREE


@dataclass(frozen=True)
class Split:
    """A free joint that becomes three slides and a ball."""

    joint: int
    body: int
    names: tuple[str, str, str, str]
    axes: tuple[tuple[float, ...], ...]
    """the world's axes seen in the body's frame as it is drawn"""


@dataclass(frozen=True)
class FreeJoints:
    """What becomes of the free joints, by their numbers in the user's model."""

    fixed: tuple[int, ...] = ()
    """the body stands still where it is drawn"""
    split: tuple[Split, ...] = ()

    def carried(self, model: mujoco.MjModel, prepared: mujoco.MjModel, qpos: FloatArray) -> FloatArray:
        """Coordinates ``(nq,)`` of the prepared model at the user's *qpos*."""
        found = np.array(prepared.qpos0)
        new = 0
        for joint in range(model.njnt):
            if joint in self.fixed:
                continue
            here = qpos[model.jnt_qposadr[joint] :]
            at = int(prepared.jnt_qposadr[new])
            if any(split.joint == joint for split in self.split):
                drawn = model.qpos0[model.jnt_qposadr[joint] :][:7]
                found[at : at + 3] = here[:3] - drawn[:3]
                back, turn = np.zeros(4), np.zeros(4)
                mujoco.mju_negQuat(back, drawn[3:])
                mujoco.mju_mulQuat(turn, back, here[3:7])
                found[at + 3 : at + 7] = turn
                new += 4
                continue
            size = {mujoco.mjtJoint.mjJNT_BALL: 4, FREE: 7}.get(mujoco.mjtJoint(model.jnt_type[joint]), 1)
            found[at : at + size] = here[:size]
            new += 1
        return found


def user_qpos(model: mujoco.MjModel, prepared: mujoco.MjModel, free: FreeJoints, qpos: FloatArray) -> FloatArray:
    """The user's coordinates ``(n, nq)`` at those of the prepared model; bodies that stand still are where drawn."""
    found: FloatArray = np.tile(model.qpos0, (len(qpos), 1))
    new = 0
    for joint in range(model.njnt):
        if joint in free.fixed:
            continue
        at, here = int(model.jnt_qposadr[joint]), qpos[:, prepared.jnt_qposadr[new] :]
        if any(split.joint == joint for split in free.split):
            whole, drawn = np.zeros(4), np.array(model.qpos0[at + 3 : at + 7])
            found[:, at : at + 3] += here[:, :3]
            for sample, turn in enumerate(here[:, 3:7]):
                mujoco.mju_mulQuat(whole, drawn, turn)
                found[sample, at + 3 : at + 7] = whole
            new += 4
            continue
        size = {mujoco.mjtJoint.mjJNT_BALL: 4, FREE: 7}.get(mujoco.mjtJoint(model.jnt_type[joint]), 1)
        found[:, at : at + size] = here[:, :size]
        new += 1
    return found


def free_joints(model: mujoco.MjModel, file: str, fix_base: str, rest: bool) -> FreeJoints:
    """Sort the free joints of a model.

    Parameters
    ----------
    model, file
        The user's compiled model and its name.
    fix_base
        Top-level body whose joints, free or not, are taken out: a robot hangs on it.
    rest
        Take out those of all bodies that no loop holds.

    Raises
    ------
    ModelError
        *fix_base* names a body that does not float.
    """
    held = held_roots(model)
    fixed, split = [], []
    base = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, fix_base)) if fix_base else -1
    for joint in range(model.njnt):
        body, free = int(model.jnt_bodyid[joint]), mujoco.mjtJoint(model.jnt_type[joint]) == FREE
        if body == base or (free and rest and body not in held):
            fixed.append(joint)
        elif free and body in held:
            split.append(_split(model, joint, body))
    if fix_base and (model.body_parentid[base] or not model.body_jntnum[base]):
        floating = [name for name in floating_bases(model) if name]
        raise ModelError(
            f'{file}: fix_base = "{fix_base}": is no body that floats{did_you_mean(fix_base, floating)}', file=file
        )
    return FreeJoints(tuple(fixed), tuple(split))


def floating_bases(model: mujoco.MjModel) -> list[str]:
    """Names of top-level bodies with six freedoms of their own: a free joint, or slides and hinges or a ball."""
    driven = {
        int(model.actuator_trnid[actuator, 0])
        for actuator in range(model.nu)
        if mujoco.mjtTrn(model.actuator_trntype[actuator]) == mujoco.mjtTrn.mjTRN_JOINT
    }
    found = []
    for body in range(1, model.nbody):
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        own = set(range(first, first + count))
        if model.body_parentid[body] == 0 and model.body_dofnum[body] == SIX and not own & driven:
            found.append(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body) or "")
    return found


def held_roots(model: mujoco.MjModel) -> set[int]:
    """Top-level bodies that a loop joins to something else than what hangs on them."""
    held: set[int] = set()
    body_kind, site_kind = mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_SITE
    for eq in range(model.neq):
        if not model.eq_active0[eq] or mujoco.mjtEq(model.eq_type[eq]) not in LOOPS:
            continue
        kind = mujoco.mjtObj(model.eq_objtype[eq])
        ends = [int(model.eq_obj1id[eq]), int(model.eq_obj2id[eq])]
        if kind == site_kind:
            ends = [int(model.site_bodyid[end]) for end in ends]
        elif kind != body_kind:
            continue
        roots = {int(model.body_rootid[end]) for end in ends}
        if len(roots) > 1:
            held |= roots
    return held


def _split(model: mujoco.MjModel, joint: int, body: int) -> Split:
    name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint) or f"free{body}"
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_quat[body])
    axes = turn.reshape(3, 3)  # row i: the world's axis i in the body's frame
    x, y, z = (f"{name}_{axis}" for axis in SLIDES)
    return Split(joint, body, (x, y, z, f"{name}_ball"), tuple(tuple(map(float, axis)) for axis in axes))


def split_free_joint(body: mujoco.MjsBody, free: mujoco.MjsJoint, split: Split) -> None:
    """Add three slides and a ball beside the free joint, with its armature, damping and dry friction."""
    for name, axis in zip(split.names, (*split.axes, (0.0, 0.0, 1.0)), strict=True):
        joint = body.add_joint()
        joint.name = name
        joint.type = mujoco.mjtJoint.mjJNT_BALL if name == split.names[3] else mujoco.mjtJoint.mjJNT_SLIDE
        joint.axis, joint.pos, joint.ref, joint.springref = list(axis), [0.0] * 3, 0.0, 0.0
        joint.limited = joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_FALSE
        joint.armature, joint.damping, joint.frictionloss = free.armature, free.damping, free.frictionloss
        joint.stiffness, joint.springdamper, joint.actgravcomp = [0.0] * 3, [0.0] * 2, False
        joint.range, joint.actfrcrange, joint.margin = [0.0] * 2, [0.0] * 2, 0.0
