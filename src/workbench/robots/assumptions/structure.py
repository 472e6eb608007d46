"""Checks of a compiled model's structure against the layout that a closed form assumes, and of what it leaves out."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.robots.assumptions.layout import BodyInfo
from workbench.robots.assumptions.rules import ALIGNMENT, OBJECTS, Assumption, Context, show, text_rule, vector_rule
from workbench.robots.values import inertia_matrix

KINDS = {
    mujoco.mjtJoint.mjJNT_HINGE.value: "hinge",
    mujoco.mjtJoint.mjJNT_SLIDE.value: "slide",
    mujoco.mjtJoint.mjJNT_BALL.value: "ball",
    mujoco.mjtJoint.mjJNT_FREE.value: "free",
}
LOOP_KINDS = {"connect": mujoco.mjtEq.mjEQ_CONNECT.value, "weld": mujoco.mjtEq.mjEQ_WELD.value}

LEFT_OUT: tuple[tuple[str, str, str, str], ...] = (
    ("joint", "damping", "dof_damping", "no damping"),
    ("joint", "damping beyond its first number", "dof_dampingpoly", "no damping but the linear one"),
    ("joint", "armature", "dof_armature", "no rotor inertia"),
    ("joint", "frictionloss", "dof_frictionloss", "no dry friction"),
    ("joint", "stiffness", "jnt_stiffness", "no spring"),
    ("joint", "stiffness", "jnt_stiffnesspoly", "no spring"),
    ("joint", "range", "jnt_limited", "no limit"),
    ("joint", "actuatorfrcrange", "jnt_actfrclimited", "no limit"),
    ("joint", "actuatorgravcomp", "jnt_actgravcomp", "no gravity compensation"),
    ("body", "gravcomp", "body_gravcomp", "no gravity compensation"),
    ("body", "mocap", "body_mocapid", "no mocap body"),
    ("actuator", "ctrlrange", "actuator_ctrllimited", "no limit"),
    ("actuator", "forcerange", "actuator_forcelimited", "no limit"),
    ("actuator", "actrange", "actuator_actlimited", "no limit"),
    ("actuator", "damping", "actuator_damping", "no damping"),
    ("actuator", "damping", "actuator_dampingpoly", "no damping"),
    ("actuator", "armature", "actuator_armature", "no rotor inertia"),
    ("actuator", "delay", "actuator_delay", "no delay"),
)
"""Element, attribute, compiled array, and what the closed form assumes: everything in these arrays is zero. An
attribute that a mechanism reads a parameter from (`Target`) is its own business and passed over."""

ABSENT = ("tendon", "plugin", "flex")
"""Kinds of objects of which the closed form knows none."""

OPTIONS = (("density", 0.0), ("viscosity", 0.0))
"""Options that would add forces of a medium."""

DISABLED = ("CONSTRAINT", "EQUALITY", "GRAVITY", "ACTUATION")
"""Flags that must not be disabled: they are parts of the robot."""

ENABLED = ("INVDISCRETE", "OVERRIDE", "SLEEP", "IPC")
"""Flags that must not be enabled: they change what MuJoCo computes."""

AT_ZERO = "where its joint's coordinate is zero"


def names(context: Context) -> Iterator[Assumption]:
    """Bodies, joints and sites exist."""
    layout = context.layout
    for tag, wanted in (
        ("body", [layout.base, *(b.name for b in layout.bodies)]),
        ("joint", [b.joint for b in layout.bodies if b.joint]),
        ("site", [*layout.sites, *(t.name for t in context.mechanism.targets if t.element == "site")]),
    ):
        for name in dict.fromkeys(wanted):
            if context.index(tag, name) < 0:
                yield context.absent("name", tag, name)


def custom(context: Context) -> Iterator[Assumption]:
    """The names in ``<custom>`` that the reference goes by."""
    layout = context.layout
    wanted = {
        "base_body": (layout.base,),
        "platform_site": (layout.platform_site,),
        "lumped_bodies": layout.lumped_bodies,
    }
    for key, expected in wanted.items():
        index = int(mujoco.mj_name2id(context.model, mujoco.mjtObj.mjOBJ_TEXT, key))
        found: tuple[str, ...] = ()
        if index >= 0:
            start, size = context.model.text_adr[index], context.model.text_size[index]
            found = tuple(bytes(context.model.text_data[start : start + size - 1]).decode().split())
        ok = set(found) == set(expected)
        yield context.rule("custom name", "text", key, "data", f'"{" ".join(found)}"', f'"{" ".join(expected)}"', ok)


def base(context: Context) -> Iterator[Assumption]:
    """The base is fixed, and gravity has its direction in the base's frame."""
    model, layout = context.model, context.layout
    body = context.index("body", layout.base)
    if body < 0:
        return
    fixed = int(model.body_weldid[body]) == 0
    yield context.rule("fixed base", "body", layout.base, "", "fixed" if fixed else "moving", "fixed", fixed)
    rotation = np.eye(3)
    while body > 0:
        rotation = _matrix(model.body_quat[body]) @ rotation
        body = int(model.body_parentid[body])
    down = rotation.T @ np.array([0.0, 0.0, -1.0])
    yield vector_rule(
        context,
        "gravity direction",
        "body",
        layout.base,
        "orientation",
        down,
        layout.gravity,
        "the world's -z in its frame",
    )


def bodies(context: Context) -> Iterator[Assumption]:
    """Every body hangs where the closed form has it, and nothing else moves or has mass."""
    model = context.model
    known = {0, context.index("body", context.layout.base)}
    joints = set()
    for info in context.layout.bodies:
        body = context.index("body", info.name)
        if body < 0:
            continue
        known.add(body)
        parent = context.name("body", int(model.body_parentid[body])) if model.body_parentid[body] else "world"
        yield text_rule(context, "parent", "body", info.name, "parent", parent, (info.parent,))
        joints.add(context.index("joint", info.joint) if info.joint else -1)
        yield from _body(context, info, body)
    for joint in range(model.njnt):
        if joint not in joints:
            name = context.name("joint", joint)
            kind = KINDS[int(model.jnt_type[joint])]
            yield context.rule("no other joint", "joint", name, "", f"an extra {kind} joint", "no other joint", False)
    for body in range(1, model.nbody):
        moving = int(model.body_weldid[body]) != 0
        if body not in known and moving and model.body_mass[body] > 0:
            name, mass = context.name("body", body), float(model.body_mass[body])
            yield context.rule(
                "no other mass",
                "body",
                name,
                "mass",
                f"{mass:g} kg",
                "0",
                False,
                "the closed form does not know this body",
            )


def _body(context: Context, info: BodyInfo, body: int) -> Iterator[Assumption]:
    model, name = context.model, info.name
    count = int(model.body_jntnum[body])
    yield context.rule(
        "joints", "body", name, "joints", str(count), str(int(bool(info.joint))), count == bool(info.joint)
    )
    shift: FloatArray = np.asarray(model.body_pos[body])
    quat: FloatArray = np.asarray(model.body_quat[body])
    pinned = info.kind != "fixed" or info.turns or any(b.parent == name for b in context.layout.bodies)
    pinned = pinned or name in context.layout.sites.values()
    slides_freely, free_axis = False, None
    joint = context.index("joint", info.joint) if info.joint else -1
    if joint >= 0:
        kind = KINDS[int(model.jnt_type[joint])]
        yield text_rule(context, "joint type", "joint", info.joint, "type", kind, (info.kind,))
        holder = context.name("body", int(model.jnt_bodyid[joint]))
        yield text_rule(context, "joint place", "joint", info.joint, "body", holder, (name,))
        if kind != info.kind:
            return
        axis = np.asarray(model.jnt_axis[joint])
        if kind != "ball":
            yield vector_rule(context, "joint axis", "joint", info.joint, "axis", axis, info.axis)
        anchored = ("joint", info.joint, "pos") in context.covered
        if kind != "slide" and not anchored:
            yield vector_rule(
                context, "joint place", "joint", info.joint, "pos", np.asarray(model.jnt_pos[joint]), (0, 0, 0)
            )
        driven = info.joint in context.mechanism.joints
        start = float(model.qpos0[model.jnt_qposadr[joint]])
        if kind == "slide":
            shift = shift - start * _matrix(quat) @ axis if driven else shift
            slides_freely = not driven
        elif kind == "hinge" and driven:
            turn = np.empty(4)
            mujoco.mju_axisAngle2Quat(turn, axis, -start)
            mujoco.mju_mulQuat(turn, quat, turn.copy())
            quat = turn
        elif kind == "hinge" and not anchored:
            free_axis = axis
        elif kind == "ball":
            pinned = False
    if pinned:
        turned = quat[1:] if free_axis is None else quat[1:] - (quat[1:] @ free_axis) * free_axis
        sine = float(np.linalg.norm(turned))
        yield context.rule(
            "orientation", "body", name, "orientation", f"turned by {2 * np.arcsin(min(1.0, sine)):.6g} rad",
            f"0 within {ALIGNMENT:g}", sine <= ALIGNMENT, AT_ZERO if info.joint else "",
        )  # fmt: skip
    if info.kind == "fixed" and not info.turns and not pinned:
        return
    if slides_freely:
        axis = np.asarray(info.axis)
        shift = shift - (shift @ axis) * axis
    if ("body", name, "pos") not in context.covered:
        yield vector_rule(context, "place", "body", name, "pos", shift, (0, 0, 0), AT_ZERO if info.joint else "")


def principal_axes(context: Context, name: str) -> Iterator[Assumption]:
    """The axes of a body that turns are its principal axes, by the measure of the inertia that it has now."""
    body = context.index("body", name)
    if body < 0:
        return
    matrix = inertia_matrix(context.model, body)
    limit = ALIGNMENT * float(np.max(np.abs(np.diag(matrix))))
    off = max((matrix[0, 1], matrix[0, 2], matrix[1, 2]), key=abs)
    yield context.rule(
        "principal axes", "inertial", name, "products of inertia", f"{off + 0.0:.9g}", f"0 within {limit:.2g}",
        bool(abs(off) <= limit), "the body's own axes are its principal axes",
    )  # fmt: skip


def sites(context: Context) -> Iterator[Assumption]:
    """Sites that close loops, and the platform's, sit where the closed form has them."""
    model, layout = context.model, context.layout
    welded = {site for loop in layout.loops if loop.kind == "weld" for site in loop.sites}
    for name, holder in layout.sites.items():
        site = context.index("site", name)
        if site < 0:
            continue
        found = context.name("body", int(model.site_bodyid[site]))
        yield text_rule(context, "site place", "site", name, "body", found, (holder,))
        if ("site", name, "pos") not in context.covered:
            yield vector_rule(context, "site place", "site", name, "pos", np.asarray(model.site_pos[site]), (0, 0, 0))
        if name in welded:
            turned = np.asarray(model.site_quat[site])[1:]
            yield vector_rule(context, "site orientation", "site", name, "quat (vector part)", turned, (0, 0, 0))


def loops(context: Context) -> Iterator[Assumption]:
    """Each loop is closed by one active equality between its two sites, and there is no other."""
    model = context.model
    wanted = {frozenset(loop.sites): loop for loop in context.layout.loops}
    seen = set()
    for eq in range(model.neq):
        name = context.name("equality", eq)
        tag = {v: k for k, v in LOOP_KINDS.items()}.get(int(model.eq_type[eq]), "joint")
        pair = frozenset[str]()
        if int(model.eq_objtype[eq]) == OBJECTS["site"].value:
            pair = frozenset(context.name("site", int(i[eq])) for i in (model.eq_obj1id, model.eq_obj2id))
        loop = wanted.get(pair)
        if loop is None or pair in seen:
            joined = " and ".join(sorted(pair)) or "bodies or joints"
            loops_text = ", ".join(" and ".join(p.sites) for p in context.layout.loops)
            yield context.rule("loop", tag, name, "sites", joined, f"one closure each of {loops_text}", False)
            continue
        seen.add(pair)
        yield text_rule(context, "loop", tag, name, "type", tag, (loop.kind,))
        active = bool(model.eq_active0[eq])
        yield context.rule("loop", tag, name, "active", str(active).lower(), "true", active)
        if loop.kind == "weld" and tag == "weld":
            scale = float(model.eq_data[eq, 10])
            yield context.rule("loop", tag, name, "torquescale", f"{scale:g}", "> 0", scale > 0)
    for pair, loop in wanted.items():
        if pair not in seen:
            first, second = loop.sites
            text = (
                f'{context.file}: no <{loop.kind} site1="{first}" site2="{second}"> in <equality>; the loop stays open'
            )
            yield Assumption("loop", f"{first}, {second}", "open", "closed", False, text, first, "site1")


def actuators(context: Context) -> Iterator[Assumption]:
    """The actuators are motors on the actuated joints, in their order."""
    model, joints = context.model, context.mechanism.joints
    found = []
    for a in range(model.nu):
        name = context.name("actuator", a)
        on_joint = int(model.actuator_trntype[a]) == mujoco.mjtTrn.mjTRN_JOINT.value
        found.append(context.name("joint", int(model.actuator_trnid[a, 0])) if on_joint else "no joint")
        gear = np.asarray(model.actuator_gear[a])
        yield vector_rule(context, "gear", "motor", name, "gear", gear, (1, 0, 0, 0, 0, 0))
        gain, bias = np.asarray(model.actuator_gainprm[a]), np.asarray(model.actuator_biasprm[a])
        plain = (
            int(model.actuator_gaintype[a]) == mujoco.mjtGain.mjGAIN_FIXED.value
            and int(model.actuator_biastype[a]) == mujoco.mjtBias.mjBIAS_NONE.value
            and int(model.actuator_dyntype[a]) == mujoco.mjtDyn.mjDYN_NONE.value
            and gain[0] == 1
            and not bias.any()
        )
        value = "a motor" if plain else f"gain {gain[0]:g}, bias {show(bias[:3])}"
        yield context.rule("motor", "motor", name, "", value, "a motor: force = control", plain)
    ok = tuple(found) == joints
    yield context.rule(
        "actuators", "actuator", "", "joints", f'"{" ".join(found)}"', f'"{" ".join(joints)}" in this order', ok
    )


def left_out(context: Context) -> Iterator[Assumption]:
    """Effects that the closed form does not describe are zero."""
    model, covered = context.model, context.covered
    for tag, attribute, array, limit in LEFT_OUT:
        values = np.asarray(getattr(model, array), dtype=np.float64)
        values = values + 1 if array == "body_mocapid" else values
        if context.brief and not values.any():
            continue
        values = np.abs(values.reshape(len(values), -1)).max(axis=1, initial=0.0)
        first = ""
        for index in np.flatnonzero(values):
            owner = int(model.dof_jntid[index]) if array.startswith("dof_") else int(index)
            name = context.name(tag, owner)
            if (tag, name, attribute) in covered or name == first:
                continue
            first = name
            shown = "set" if array.endswith(("limited", "comp", "mocapid")) and tag != "body" else f"{values[index]:g}"
            yield context.rule("left out", "motor" if tag == "actuator" else tag, name, attribute, shown, limit, False)
        if not first:
            yield context.rule("left out", "every " + tag, "", attribute, "0", limit, True)
    for kind in ABSENT:
        count = int(getattr(model, f"n{kind}"))
        yield context.rule("left out", kind, "", "", f"present {count} times" if count else "absent", "none", not count)


def options(context: Context) -> Iterator[Assumption]:
    """Options and flags leave the physics as the closed form has it."""
    model = context.model
    for name, expected in OPTIONS:
        value = float(getattr(model.opt, name))
        yield context.rule("option", "option", "", name, f"{value:g}", f"{expected:g}", value == expected)
    discrete = int(model.opt.integrator) == mujoco.mjtIntegrator.mjINT_DISCRETE.value
    shown = "discrete" if discrete else "continuous"
    yield context.rule("option", "option", "", "integrator", shown, "any but discrete", not discrete)
    for flag in DISABLED:
        off = bool(model.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}").value)
        yield context.rule("option", "flag", "", flag.lower(), "disable" if off else "enable", "enable", not off)
    for flag in ENABLED:
        on = bool(model.opt.enableflags & getattr(mujoco.mjtEnableBit, f"mjENBL_{flag}").value)
        yield context.rule("option", "flag", "", flag.lower(), "enable" if on else "disable", "disable", not on)
    no_contact = bool(model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT.value)
    can = bool(np.any(np.asarray(model.geom_contype) | np.asarray(model.geom_conaffinity))) or bool(model.npair)
    shown = "enable, and geoms can collide" if can and not no_contact else "no geom can collide"
    yield context.rule(
        "contact", "flag", "", "contact", shown, "disable, or geoms without contact", no_contact or not can
    )


def _matrix(quat: FloatArray) -> FloatArray:
    flat = np.empty(9)
    mujoco.mju_quat2Mat(flat, np.asarray(quat))
    return flat.reshape(3, 3)


STRUCTURAL_CHECKS: tuple[Callable[[Context], Iterator[Assumption]], ...] = (
    names, base, bodies, sites, loops, actuators, left_out, options, custom,
)  # fmt: skip
