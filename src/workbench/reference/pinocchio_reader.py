"""Read an MJCF through Pinocchio's own reader, and make sure that it read the robot that the file describes.

Pinocchio 4.1 reads only part of MJCF and says nothing about the rest: of several top-level bodies it keeps the first,
and of that one not the pose; it drops ``<frame>``, sites of the root body, damping of ball joints and
``<option gravity>``; it merges the joints of one body into a nameless one; it misplaces sites of bodies welded to one
whose joint has ``pos``; it ignores ``pos`` in defaults of sites; it takes axes of ``axisangle`` for unit vectors; and
geoms that nothing collides with have no mass for it. It does handle ``ref``: coordinates are MuJoCo's.

So the file is read twice: as it is written, with all top-level bodies wrapped in one that is fixed, and in a normal
form that holds nothing but poses, joints and inertias as the MJCF compiler resolves them. Where both readings agree,
the file as written is used; where they do not, the normal form. Gravity, damping and dry friction are set afterwards.
No kinematics and no dynamics are taken from MuJoCo.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import MissingExtraError, ModelError
from workbench.mjcf.text import scan
from workbench.reference.engine import NONE
from workbench.reference.frames import Frames
from workbench.reference.uncovered import switched_off

INSTALL = 'pip install "parallel-robot-workbench[pinocchio]"'
OLDEST = (4, 1)
"""Before this release the reader leaves `ref` out of the kinematics."""

AGREEMENT = 1e-12
"""Largest difference between two readings: metres, direction cosines; inertias relative to the largest entry."""

WRAPPER = "workbench_world"
NOTHING = '<inertial pos="0 0 0" mass="0" diaginertia="0 0 0"/>'


@dataclass(frozen=True)
class Reading:
    """A Pinocchio model and where it keeps what MuJoCo numbers."""

    model: Any
    joints: tuple[int, ...]
    """Pinocchio's joint for each MuJoCo joint"""
    sites: dict[int, int]
    """frame for each MuJoCo site asked for"""
    bodies: tuple[int, ...]
    """frame for each MuJoCo body; the world is 0"""
    difference: str
    """why the file as written is not what was used; empty if it is"""


def import_pinocchio() -> ModuleType:
    """Import the optional engine.

    Raises
    ------
    MissingExtraError
        Not installed, too old, or another package of that name; the message holds the install command.
    """
    try:
        import pinocchio
    except ImportError as error:
        raise MissingExtraError(f"the engine pinocchio is not installed; {INSTALL}", extra="pinocchio") from error
    version = str(getattr(pinocchio, "__version__", "unknown"))
    if not hasattr(pinocchio, "buildModelFromMJCF") or _release(version) < OLDEST:
        raise MissingExtraError(
            f"the installed package pinocchio {version} cannot be used, pin >= {'.'.join(map(str, OLDEST))} is needed;"
            f" {INSTALL}",
            extra="pinocchio",
            value=version,
        )
    module: ModuleType = pinocchio
    return module


def _release(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in version.split(".")[:2] if part.isdigit())


def read(
    pin: ModuleType, text: str, compiled: mujoco.MjModel, sites: set[int], file: str, frames: Frames = NONE
) -> Reading:
    """Read *text*; see the head of this module.

    Parameters
    ----------
    pin
        The engine, from `import_pinocchio`.
    text, compiled, file
        The MJCF, what MuJoCo compiled of it, and its name.
    sites
        MuJoCo's numbers of the sites that are needed.
    frames
        Closures by bodies, which are numbered after the sites.

    Raises
    ------
    ModelError
        Pinocchio does not even read the normal form.
    """
    try:
        normal = _read_normal_form(pin, compiled, sites)
    except (RuntimeError, ValueError) as error:
        raise ModelError(f"{file}: Pinocchio does not read it: {_last_line(error)}", file=file) from error
    try:
        reading, difference = _read_as_written(pin, text, compiled, sites, file)
        difference = difference or _difference(pin, reading, normal, compiled)
    except (RuntimeError, ValueError, IndexError, KeyError, TypeError) as error:
        # whatever its reader stumbles over, the normal form does not hold it
        reading, difference = normal, _last_line(error)
    if difference:
        reading = Reading(normal.model, normal.joints, normal.sites, normal.bodies, difference)
    model = reading.model
    _add_frames(pin, reading, frames, compiled.nsite)
    model.gravity.linear = np.zeros(3) if switched_off(compiled, "gravity") else np.array(compiled.opt.gravity)
    damping, friction = np.zeros(model.nv), np.zeros(model.nv)
    for joint, place in enumerate(reading.joints):
        first, width = model.idx_vs[place], model.nvs[place]
        damping[first : first + width] = compiled.dof_damping[compiled.jnt_dofadr[joint]]
        friction[first : first + width] = compiled.dof_frictionloss[compiled.jnt_dofadr[joint]]
    model.damping, model.friction = damping, friction
    return reading


def _add_frames(pin: ModuleType, reading: Reading, frames: Frames, after: int) -> None:
    model = reading.model
    for k in range(len(frames)):
        body = reading.bodies[int(frames.bodies[k])]
        parent = model.frames[body]
        placement = parent.placement * pin.SE3(_rotation(frames.quaternions[k]), frames.positions[k])
        frame = pin.Frame(f"workbench_frame{k}", parent.parentJoint, body, placement, pin.FrameType.OP_FRAME)
        reading.sites[after + k] = int(model.addFrame(frame))


def without_inertia(pin: ModuleType, reading: Reading, compiled: mujoco.MjModel, bodies: tuple[str, ...]) -> Any:
    """A copy of the model in which the named bodies have no rotational inertia: exactly none, not a small one."""
    model = reading.model.copy()
    for name in bodies:
        body = int(mujoco.mj_name2id(compiled, mujoco.mjtObj.mjOBJ_BODY, name))
        frame = model.frames[reading.bodies[body]]
        turn = frame.placement.rotation @ _rotation(compiled.body_iquat[body])
        whole = model.inertias[frame.parentJoint]
        rest = whole.inertia - turn @ np.diag(compiled.body_inertia[body]) @ turn.T
        rest[np.abs(rest) <= AGREEMENT * np.abs(whole.inertia).max()] = 0.0  # what subtraction leaves of a lone bar
        model.inertias[frame.parentJoint] = pin.Inertia(whole.mass, whole.lever, rest)
    return model


def _build(pin: ModuleType, text: str) -> Any:
    """Pinocchio reads files only."""
    with tempfile.TemporaryDirectory(prefix="workbench-") as directory:
        path = Path(directory) / "model.xml"
        path.write_text(text, encoding="utf-8")
        return pin.buildModelFromMJCF(str(path))


def _read_as_written(
    pin: ModuleType, text: str, compiled: mujoco.MjModel, sites: set[int], file: str
) -> tuple[Reading, str]:
    """Read the file itself; everything is found by its name. The second value says what is missing."""
    model = _build(pin, _under_one_body(text, file))
    obj = mujoco.mjtObj
    joints, frames, bodies = [], {}, [0]
    for joint in range(compiled.njnt):
        name = mujoco.mj_id2name(compiled, obj.mjOBJ_JOINT, joint)
        if not name or not model.existJointName(name):
            return Reading(model, (), {}, (), ""), f'joint "{name or f"#{joint}"}" is missing'
        joints.append(int(model.getJointId(name)))
    for body in range(1, compiled.nbody):
        name = mujoco.mj_id2name(compiled, obj.mjOBJ_BODY, body)
        if not name or not model.existFrame(name, pin.FrameType.BODY):
            return Reading(model, (), {}, (), ""), f'body "{name or f"#{body}"}" is missing'
        bodies.append(int(model.getFrameId(name, pin.FrameType.BODY)))
    for site in sites:
        name = mujoco.mj_id2name(compiled, obj.mjOBJ_SITE, site)
        if not name or not model.existFrame(name, pin.FrameType.OP_FRAME):
            return Reading(model, (), {}, (), ""), f'site "{name or f"#{site}"}" is missing'
        frames[site] = int(model.getFrameId(name, pin.FrameType.OP_FRAME))
    return Reading(model, tuple(joints), frames, tuple(bodies), ""), ""


def _under_one_body(text: str, file: str) -> str:
    """Wrap what stands in the world in one fixed body, whose pose, none, the reader may drop."""
    worlds = [element for element in scan(text, file) if element.tag == "worldbody"]
    if len(worlds) != 1:
        return text
    start, end = worlds[0].end, text.rfind("</worldbody")
    return f'{text[:start]}<body name="{WRAPPER}">{NOTHING}{text[start:end]}</body>{text[end:]}'


def _read_normal_form(pin: ModuleType, compiled: mujoco.MjModel, sites: set[int]) -> Reading:
    model = _build(pin, normal_form(compiled))
    joints = tuple(int(model.getJointId(f"joint{joint}")) for joint in range(compiled.njnt))
    bodies = tuple(int(model.getFrameId(f"body{body}", pin.FrameType.BODY)) for body in range(compiled.nbody))
    frames = {}
    for site in sites:
        body = bodies[int(compiled.site_bodyid[site])]
        parent = model.frames[body]
        placement = parent.placement * pin.SE3(_rotation(compiled.site_quat[site]), np.array(compiled.site_pos[site]))
        frame = pin.Frame(f"site{site}", parent.parentJoint, body, placement, pin.FrameType.OP_FRAME)
        frames[site] = int(model.addFrame(frame))
    return Reading(model, joints, frames, bodies, "")


def normal_form(compiled: mujoco.MjModel) -> str:
    """Write a bare MJCF of bodies, joints and inertias, one joint a body, everything under one fixed body.

    Numbers are written so that they read back bit-equal.
    """
    children: dict[int, list[int]] = {}
    for body in range(1, compiled.nbody):
        children.setdefault(int(compiled.body_parentid[body]), []).append(body)

    def write(body: int) -> str:
        pose = f'pos="{_numbers(compiled.body_pos[body])}" quat="{_numbers(compiled.body_quat[body])}"'
        inertia = (
            f'<inertial pos="{_numbers(compiled.body_ipos[body])}" quat="{_numbers(compiled.body_iquat[body])}"'
            f' mass="{_numbers(compiled.body_mass[body])}" diaginertia="{_numbers(compiled.body_inertia[body])}"/>'
        )
        first, count = int(compiled.body_jntadr[body]), int(compiled.body_jntnum[body])
        out = ""
        for joint in range(first, first + count - 1):  # all but the last joint move bodies that are only frames
            out += f'<body name="carrier{joint}" {pose}>{NOTHING}{_joint(compiled, joint)}'
            pose = ""
        last = _joint(compiled, first + count - 1) if count else ""
        out += f'<body name="body{body}" {pose}>{inertia}{last}'
        out += "".join(write(child) for child in children.get(body, []))
        return out + "</body>" * max(count, 1)

    tree = "".join(write(body) for body in children.get(0, []))
    return (
        '<mujoco model="normal_form"><compiler angle="radian" autolimits="true"/><worldbody>'
        f'<body name="body0">{NOTHING}{tree}</body></worldbody></mujoco>'
    )


def _joint(compiled: mujoco.MjModel, joint: int) -> str:
    kind = mujoco.mjtJoint(compiled.jnt_type[joint])
    names = {mujoco.mjtJoint.mjJNT_HINGE: "hinge", mujoco.mjtJoint.mjJNT_SLIDE: "slide"}
    out = f'<joint name="joint{joint}" type="{names.get(kind, "ball")}" pos="{_numbers(compiled.jnt_pos[joint])}"'
    if kind in names:
        reference = compiled.qpos0[compiled.jnt_qposadr[joint]]
        out += f' axis="{_numbers(compiled.jnt_axis[joint])}" ref="{_numbers(reference)}"'
    return out + f' armature="{_numbers(compiled.dof_armature[compiled.jnt_dofadr[joint]])}"/>'


def _numbers(values: Any) -> str:
    return " ".join(repr(float(value)) for value in np.atleast_1d(values))


def _difference(pin: ModuleType, one: Reading, two: Reading, compiled: mujoco.MjModel) -> str:
    """Say where two readings differ: in joints, masses, inertias or frames; empty if nowhere."""
    a, b = one.model, two.model
    if (a.nq, a.nv) != (b.nq, b.nv):
        return f"{a.nv} freedoms instead of {b.nv}"
    for joint, (i, j) in enumerate(zip(one.joints, two.joints, strict=True)):
        name = mujoco.mj_id2name(compiled, mujoco.mjtObj.mjOBJ_JOINT, joint)
        same_parent = a.parents[i] == b.parents[j] == 0 or (
            a.parents[i] in one.joints and one.joints.index(a.parents[i]) == two.joints.index(b.parents[j])
        )
        if not same_parent or a.nvs[i] != b.nvs[j]:
            return f'joint "{name}" hangs elsewhere'
        pairs = (
            ("pose", a.jointPlacements[i].homogeneous, b.jointPlacements[j].homogeneous),
            ("axis", _motion(a, i), _motion(b, j)),
            ("inertia", a.inertias[i].matrix(), b.inertias[j].matrix()),
            ("armature", a.armature[a.idx_vs[i]], b.armature[b.idx_vs[j]]),
        )
        for what, first, second in pairs:
            scale = np.abs(second).max() if what == "inertia" else 1.0
            if not _close(first, second, scale):
                return f'joint "{name}": {what} differs'
    for kind, places in (("site", [(one.sites[s], two.sites[s]) for s in two.sites]),
                         ("body", list(zip(one.bodies, two.bodies, strict=True)))):  # fmt: skip
        for i, j in places:
            if not _close(a.frames[i].placement.homogeneous, b.frames[j].placement.homogeneous, 1.0):
                return f'{kind} "{a.frames[i].name}": pose differs'
    return ""


def _motion(model: Any, joint: int) -> FloatArray:
    """What a joint's first freedom does ``(6,)``, at its zero coordinate."""
    data = model.joints[joint].createData()
    neutral = np.zeros(model.nqs[joint])
    neutral[-1] = 1.0 if len(neutral) == 4 else 0.0  # a ball joint's quaternion ends with its real part
    whole = np.zeros(model.nq)
    whole[model.idx_qs[joint] : model.idx_qs[joint] + len(neutral)] = neutral
    model.joints[joint].calc(data, whole)
    return np.asarray(data.S, dtype=np.float64).reshape(6, -1)[:, 0]


def _close(one: Any, two: Any, scale: float) -> bool:
    return bool(np.all(np.abs(np.asarray(one) - np.asarray(two)) <= AGREEMENT * scale))


def _rotation(quaternion: Any) -> FloatArray:
    """Rotation matrix of a unit quaternion w, x, y, z."""
    w, x, y, z = (float(value) for value in quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _last_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__
