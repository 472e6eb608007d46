"""What a compiled model may hold that the closed-chain inverse dynamics does not count: found all at once, by name.

Counted are: springs, damping and dry friction of joints and fixed tendons, fluid, gravity compensation, rotor inertia,
and the flags that switch spring, damper, gravity or frictionloss off. Whatever else acts on the bodies is listed here.
"""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from workbench.mjcf.refusal import Refusal
from workbench.reference.closures import Closures, is_fixed, name_of
from workbench.reference.kinds import CONNECT, WELD

SCALARS = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
SCALAR_KINDS = [kind.value for kind in SCALARS]
JOINTS = mujoco.mjtTrn.mjTRN_JOINT.value
FREE = mujoco.mjtJoint.mjJNT_FREE.value


def switched_off(model: mujoco.MjModel, flag: str) -> bool:
    """Whether the model's ``<flag>`` disables something."""
    return bool(model.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}").value)


def uncovered(model: mujoco.MjModel, closures: Closures) -> list[Refusal]:
    """List everything that would make a torque wrong."""
    found = [*_flags(model), *_contacts(model), *_limits(model), *_tendons(model), *_actuators(model)]
    found += closures.refusals
    found += _floating(model, closures)
    if model.nflex:
        found.append(Refusal(f"{model.nflex} deformable bodies", "flex", "", "take them out", "flexes"))
    return found


def _flags(model: mujoco.MjModel) -> Iterator[Refusal]:
    for flag in ("constraint", "equality"):
        if model.neq and switched_off(model, flag):
            yield Refusal(
                f"<flag {flag}> is disabled, so that the file's loops are open",
                "flag",
                flag,
                "enable it, or take the equalities out",
                f"flag {flag}",
            )
    for flag, losses in (("damper", model.dof_damping), ("frictionloss", model.dof_frictionloss)):
        if switched_off(model, flag) and losses.any():
            lossy = name_of(model, mujoco.mjtObj.mjOBJ_JOINT, int(model.dof_jntid[int(np.argmax(losses != 0))]))
            yield Refusal(
                f'<flag {flag}> is disabled, yet joint "{lossy}" has such friction',
                "flag",
                flag,
                "enable it or set the friction to zero",
                f"flag {flag}",
            )
    if model.body_gravcomp.any() and np.any(model.jnt_actgravcomp):
        joint = int(np.argmax(model.jnt_actgravcomp != 0))
        name = name_of(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
        yield Refusal(
            f'joint "{name}" has actuatorgravcomp, so that gravity compensation is a part of an actuator\'s force',
            "joint",
            name,
            "set actuatorgravcomp or gravcomp to zero",
            "actuatorgravcomp",
        )
    if model.nplugin:
        yield Refusal(f"{model.nplugin} engine plugins", "plugin", "", "take them out", "plugins")


def _contacts(model: mujoco.MjModel) -> Iterator[Refusal]:
    if switched_off(model, "contact") or switched_off(model, "constraint"):
        return
    obj = mujoco.mjtObj
    way = 'disable them by <flag contact="disable"/> or ignore = ["contacts"]'
    for geom in np.flatnonzero(model.geom_contype | model.geom_conaffinity):
        name = name_of(model, obj.mjOBJ_GEOM, int(geom))
        yield Refusal(f'geom "{name}" can collide; contacts are not covered', "geom", name, way, "contacts", "contacts")
    for pair in range(model.npair):
        name = name_of(model, obj.mjOBJ_PAIR, pair)
        one, two = (
            name_of(model, obj.mjOBJ_GEOM, int(geom)) for geom in (model.pair_geom1[pair], model.pair_geom2[pair])
        )
        yield Refusal(
            f'pair "{name}" makes geoms "{one}" and "{two}" collide; contacts are not covered',
            "pair",
            name,
            way,
            "contact pairs",
            "contacts",
        )


def _limits(model: mujoco.MjModel) -> Iterator[Refusal]:
    if switched_off(model, "limit") or switched_off(model, "constraint"):
        return
    obj = mujoco.mjtObj
    way = 'disable them by <flag limit="disable"/> or ignore = ["limits"]'
    for joint in np.flatnonzero(model.jnt_limited):
        name = name_of(model, obj.mjOBJ_JOINT, int(joint))
        yield Refusal(
            f'joint "{name}" has a range {model.jnt_range[joint].tolist()}; limits are not covered',
            "joint",
            name,
            way,
            "limits",
            "limits",
        )
    for tendon in np.flatnonzero(model.tendon_limited):
        name = name_of(model, obj.mjOBJ_TENDON, int(tendon))
        yield Refusal(
            f'tendon "{name}" has a range {model.tendon_range[tendon].tolist()}; limits are not covered',
            "tendon",
            name,
            way,
            "tendon limits",
            "limits",
        )


def _tendons(model: mujoco.MjModel) -> Iterator[Refusal]:
    for tendon in range(model.ntendon):
        name = name_of(model, mujoco.mjtObj.mjOBJ_TENDON, tendon)
        fixed = is_fixed(model, tendon)
        rubs = float(model.tendon_frictionloss[tendon])
        if rubs and not fixed and not switched_off(model, "frictionloss"):
            yield Refusal(
                f'tendon "{name}" has frictionloss {rubs:g}; dry friction is covered at joints and fixed tendons',
                "spatial",
                name,
                'set it to zero, or leave tendons out by ignore = ["tendons"]',
                "tendon friction",
                "tendons",
            )
        rotor = float(model.tendon_armature[tendon])
        if rotor and (not fixed or model.tendon_treenum[tendon] > 1):
            which = "between separate trees" if fixed else "of a spatial tendon"
            yield Refusal(
                f'tendon "{name}" has armature {rotor:g}, which is not covered {which}',
                "fixed" if fixed else "spatial",
                name,
                'set it to zero, or leave tendons out by ignore = ["tendons"]',
                "tendon armature",
                "tendons",
            )


def _actuators(model: mujoco.MjModel) -> Iterator[Refusal]:
    kinds = model.jnt_type[model.actuator_trnid[:, 0]] if (model.actuator_trntype == JOINTS).all() else None
    if kinds is not None and np.isin(kinds, SCALAR_KINDS).all():
        return
    obj = mujoco.mjtObj
    for actuator in range(model.nu):
        name = name_of(model, obj.mjOBJ_ACTUATOR, actuator)
        if mujoco.mjtTrn(model.actuator_trntype[actuator]) != mujoco.mjtTrn.mjTRN_JOINT:
            yield Refusal(
                f'actuator "{name}" does not drive a joint',
                "actuator",
                name,
                "name the actuated joints in the campaign (actuated)",
                "actuators",
            )
        elif mujoco.mjtJoint(model.jnt_type[model.actuator_trnid[actuator, 0]]) not in SCALARS:
            yield Refusal(
                f'actuator "{name}" must drive a hinge or slide joint',
                "actuator",
                name,
                "name the actuated joints in the campaign (actuated)",
                "actuators",
            )


def _floating(model: mujoco.MjModel, closures: Closures) -> Iterator[Refusal]:
    """Free joints whose tree no loop ties to the world: every freedom of such a base is loose."""
    if not (model.jnt_type == FREE).any():
        return
    root = np.array(model.body_rootid)
    free = {int(root[model.jnt_bodyid[j]]): j for j in np.flatnonzero(model.jnt_type == FREE).tolist()}
    # trees that loops tie together, the world and all trees without a free joint being one
    held = {int(body): (0 if int(body) not in free else int(body)) for body in np.unique(root)}
    for kind, one, two, _, _ in closures.blocks:
        if kind in (CONNECT, WELD):
            a, b = held[int(root[one])], held[int(root[two])]
            held = {tree: min(a, b) if group in (a, b) else group for tree, group in held.items()}
    for tree, joint in free.items():
        if held[tree] == 0:
            continue
        name = name_of(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
        body = name_of(model, mujoco.mjtObj.mjOBJ_BODY, tree)
        yield Refusal(
            f'joint "{name}" is free, and no loop ties its body "{body}" to the world',
            "joint",
            name,
            "fix the body (fix_base), or leave free bodies out of account where they take no part",
            "floating bodies",
            "free bodies",
        )
