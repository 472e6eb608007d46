"""The check after every preparation: the prepared model is the user's robot, but for what was meant to change.

Compiled arrays are compared number by number, and mass matrix, Coriolis and gravity forces and passive forces at random
states, so that what no array shows (a rotor's inertia that belongs to an actuator) is seen too.
"""

from __future__ import annotations

import copy
from typing import Any

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError
from workbench.mjcf.free_joints import user_qpos
from workbench.mjcf.setup import OWN_TEXTS, PLATFORM, Preparation

BODIES = ("body_parentid", "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia",
          "body_gravcomp", "body_mocapid")  # fmt: skip
SITES = ("site_bodyid", "site_pos", "site_quat")
GEOMS = ("geom_type", "geom_bodyid", "geom_pos", "geom_quat", "geom_size", "geom_contype", "geom_conaffinity",
         "geom_fluid")  # fmt: skip
JOINTS = ("jnt_type", "jnt_bodyid", "jnt_pos", "jnt_axis", "jnt_stiffness", "jnt_stiffnesspoly", "jnt_limited",
          "jnt_range")  # fmt: skip
EQUALITIES = ("eq_type", "eq_objtype", "eq_active0", "eq_data")
TENDONS = ("tendon_num", "tendon_stiffness", "tendon_damping", "tendon_armature", "tendon_frictionloss",
           "tendon_lengthspring", "tendon_limited", "tendon_range")  # fmt: skip
OPTIONS = ("gravity", "wind", "magnetic", "density", "viscosity", "timestep", "integrator", "cone", "enableflags")
PLAIN = ("actuator_biastype", "actuator_gaintype", "actuator_dyntype", "actuator_armature", "actuator_damping",
         "actuator_dampingpoly", "actuator_ctrllimited", "actuator_forcelimited", "actuator_biasprm")  # fmt: skip
"""zero in a motor that gives its control as torque and adds nothing of its own"""
STATES = 3
SAME = 1e-10
"""Relative to the largest entry: what rounding leaves of a moved rotor inertia or of a platform's new coordinates."""


def check_same_robot(user: mujoco.MjModel, prepared: mujoco.MjModel, preparation: Preparation, file: str) -> None:
    """Refuse a prepared model that differs from the user's in more than was meant.

    Raises
    ------
    ModelError
        What differs: array, element, both values.
    """
    check = _Check(user, prepared, preparation, file)
    check.tables()
    check.loops()
    check.driven()
    check.motion()


class _Check:
    def __init__(self, user: mujoco.MjModel, prepared: mujoco.MjModel, plan: Preparation, file: str) -> None:
        self.user, self.prepared, self.plan, self.file = user, prepared, plan, file
        gone = {*plan.free.fixed, *(split.joint for split in plan.free.split)}
        self.kept = [joint for joint in range(user.njnt) if joint not in gone]
        names = {name for split in plan.free.split for name in split.names}
        self.same = [j for j in range(prepared.njnt) if _name(prepared, mujoco.mjtObj.mjOBJ_JOINT, j) not in names]

    def refuse(self, what: str, before: Any, after: Any) -> None:
        raise ModelError(
            f"{self.file}: the model as it was prepared is not the file's: {what} is {after}, in the file {before};"
            " this is a fault of the workbench, please report it with the file",
            file=self.file,
            element=what,
        )

    def equal(self, what: str, before: Any, after: Any, names: list[str] | None = None) -> None:
        before, after = np.asarray(before), np.asarray(after)
        if before.shape != after.shape:
            self.refuse(f"the number of {what}", len(before), len(after))
        off = before != after
        if off.any():
            row = int(np.argwhere(off)[0][0]) if off.ndim else 0
            where = f'{what} of "{names[row]}"' if names else what
            self.refuse(where, before[row] if before.ndim else before, after[row] if after.ndim else after)

    def tables(self) -> None:
        """Bodies, joints, sites, geoms, tendons, options."""
        user, prepared, obj = self.user, self.prepared, mujoco.mjtObj
        names = [_name(user, obj.mjOBJ_BODY, body) for body in range(user.nbody)]
        self.equal("bodies", names, [_name(prepared, obj.mjOBJ_BODY, body) for body in range(prepared.nbody)])
        for array in BODIES:
            self.equal(array, getattr(user, array), getattr(prepared, array), names)
        for array in GEOMS:
            self.equal(array, getattr(user, array), getattr(prepared, array))
        sites = [site for site in range(prepared.nsite) if not self._added(site)]
        for array in SITES:
            self.equal(array, getattr(user, array), getattr(prepared, array)[sites])
        joints = [_name(user, obj.mjOBJ_JOINT, joint) for joint in self.kept]
        self.equal("joints", joints, [_name(prepared, obj.mjOBJ_JOINT, joint) for joint in self.same])
        for array in JOINTS:
            self.equal(array, getattr(user, array)[self.kept], getattr(prepared, array)[self.same], joints)
        for array in ("dof_frictionloss",):
            self.equal(array, self._per_dof(user, array, self.kept), self._per_dof(prepared, array, self.same))
        for array in ("qpos0", "qpos_spring"):
            self.equal(array, self._per_qpos(user, array, self.kept), self._per_qpos(prepared, array, self.same))
        if "tendons" not in self.plan.setup.ignore:
            for array in TENDONS:
                self.equal(array, getattr(user, array), getattr(prepared, array))
        for option in OPTIONS:
            self.equal(f"option {option}", getattr(user.opt, option), getattr(prepared.opt, option))
        meant = {"contact", "limit", *(("spring",) if "springs" in self.plan.setup.ignore else ())}
        bits = sum(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}").value for flag in meant)
        self.equal("option flags", user.opt.disableflags | bits, prepared.opt.disableflags)

    def _added(self, site: int) -> bool:
        return bool(self.plan.setup.platform_body) and _name(self.prepared, mujoco.mjtObj.mjOBJ_SITE, site) == PLATFORM

    @staticmethod
    def _per_dof(model: mujoco.MjModel, array: str, joints: list[int]) -> FloatArray:
        width = {mujoco.mjtJoint.mjJNT_FREE: 6, mujoco.mjtJoint.mjJNT_BALL: 3}
        starts = [(int(model.jnt_dofadr[j]), width.get(mujoco.mjtJoint(model.jnt_type[j]), 1)) for j in joints]
        return np.concatenate([getattr(model, array)[a : a + n] for a, n in starts] or [np.zeros(0)])

    @staticmethod
    def _per_qpos(model: mujoco.MjModel, array: str, joints: list[int]) -> FloatArray:
        width = {mujoco.mjtJoint.mjJNT_FREE: 7, mujoco.mjtJoint.mjJNT_BALL: 4}
        starts = [(int(model.jnt_qposadr[j]), width.get(mujoco.mjtJoint(model.jnt_type[j]), 1)) for j in joints]
        return np.concatenate([getattr(model, array)[a : a + n] for a, n in starts] or [np.zeros(0)])

    def loops(self) -> None:
        """Equalities, by the names and places of what they join."""
        user, prepared = self.user, self.prepared
        ignored = mujoco.mjtEq.mjEQ_TENDON if "tendons" in self.plan.setup.ignore else None
        kept = [eq for eq in range(user.neq) if mujoco.mjtEq(user.eq_type[eq]) != ignored]
        for array in EQUALITIES:
            self.equal(array, getattr(user, array)[kept], getattr(prepared, array))
        for new, old in enumerate(kept):
            self.equal(f"what equality {old + 1} joins", _ends(user, old), _ends(prepared, new))

    def driven(self) -> None:
        """One plain motor for each driven joint, and the workbench's own texts."""
        prepared, setup = self.prepared, self.plan.setup
        joints = [_name(prepared, mujoco.mjtObj.mjOBJ_JOINT, int(j)) for j in prepared.actuator_trnid[:, 0]]
        self.equal("driven joints", list(setup.actuated), joints)
        gear = np.zeros((prepared.nu, 6))
        gear[:, :1] = 1.0
        self.equal("actuator_gear", gear, prepared.actuator_gear)
        for array in PLAIN:
            self.equal(array, np.zeros_like(getattr(prepared, array)), getattr(prepared, array))
        names = [_name(prepared, mujoco.mjtObj.mjOBJ_TEXT, i) for i in range(prepared.ntext)]
        if any(names.count(name) > 1 for name in OWN_TEXTS):
            self.refuse("texts", "one each", names)

    def motion(self) -> None:
        """Mass matrix, Coriolis and gravity forces, passive forces at random states."""
        user, prepared = self.user, self.prepared
        seen = copy.copy(user)
        if "springs" in self.plan.setup.ignore:
            seen.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SPRING.value
        if "tendons" in self.plan.setup.ignore:
            for array in ("tendon_stiffness", "tendon_damping", "tendon_armature"):
                getattr(seen, array)[:] = 0.0
        random = np.random.default_rng(0)
        for _ in range(STATES):
            qpos = np.array(prepared.qpos0) + random.uniform(-0.3, 0.3, prepared.nq)
            rates = random.uniform(-1.0, 1.0, prepared.nv)
            one, two, turn = self._state(qpos, rates)
            found = [_forces(seen, one[0], one[1]), _forces(prepared, two[0], two[1])]
            for what, first, second in zip(("mass matrix", "bias forces", "passive forces"), *found, strict=True):
                moved = turn.T @ first @ turn if first.ndim == 2 else turn.T @ first
                scale = max(float(np.abs(moved).max(initial=0.0)), float(np.abs(second).max(initial=0.0)))
                gap = np.abs(moved - second)
                if not gap.max(initial=0.0) <= SAME * scale:
                    dof = int(np.unravel_index(int(gap.argmax()), gap.shape)[0])
                    joint = _name(prepared, mujoco.mjtObj.mjOBJ_JOINT, int(prepared.dof_jntid[dof]))
                    self.refuse(f'{what} at joint "{joint}"', moved[dof], second[dof])

    def _state(
        self, qpos: FloatArray, rates: FloatArray
    ) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray], FloatArray]:
        """The same state of both models, and the user's velocities per velocity of the prepared one."""
        user, prepared = self.user, self.prepared
        mujoco.mj_normalizeQuat(prepared, qpos)
        theirs = user_qpos(user, prepared, self.plan.free, qpos[None])[0]
        turn = np.zeros((user.nv, prepared.nv))
        for old, new in zip(self.kept, self.same, strict=True):
            c, d = int(user.jnt_dofadr[old]), int(prepared.jnt_dofadr[new])
            width = {mujoco.mjtJoint.mjJNT_FREE: 6, mujoco.mjtJoint.mjJNT_BALL: 3}
            n = width.get(mujoco.mjtJoint(user.jnt_type[old]), 1)
            turn[c : c + n, d : d + n] = np.eye(n)
        for split in self.plan.free.split:
            first = mujoco.mj_name2id(prepared, mujoco.mjtObj.mjOBJ_JOINT, split.names[0])
            c, d = int(user.jnt_dofadr[split.joint]), int(prepared.jnt_dofadr[first])
            turn[c : c + 6, d : d + 6] = np.eye(6)
        return (theirs, turn @ rates), (qpos, rates), turn


def _forces(model: mujoco.MjModel, qpos: FloatArray, qvel: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    data = mujoco.MjData(model)
    data.qpos, data.qvel = qpos, qvel
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    mass = np.zeros((model.nv, model.nv))
    if model.nv:
        mujoco.mj_fullM(model, data, mass)
    return mass, np.array(data.qfrc_bias), np.array(data.qfrc_passive)


def _ends(model: mujoco.MjModel, eq: int) -> list[str]:
    kind = mujoco.mjtEq(model.eq_type[eq])
    obj = mujoco.mjtObj(model.eq_objtype[eq])
    if kind == mujoco.mjtEq.mjEQ_JOINT:
        obj = mujoco.mjtObj.mjOBJ_JOINT
    elif kind == mujoco.mjtEq.mjEQ_TENDON:
        obj = mujoco.mjtObj.mjOBJ_TENDON
    ends = (int(model.eq_obj1id[eq]), int(model.eq_obj2id[eq]))
    return [_name(model, obj, end) if end >= 0 else "" for end in ends]


def _name(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    return mujoco.mj_id2name(model, kind, index) or ""
