"""What the reference has to know of a compiled MJCF: actuated and passive freedoms, loop closures, idle spins.

Names are resolved here, once; whatever the projection does not cover is refused here, in one line.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.polynomial import Polynomial

from workbench.arrays import FloatArray
from workbench.errors import ModelError
from workbench.mjcf.compile import custom_text
from workbench.robots.values import inertia_matrix

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

CONNECT, WELD, JOINT, SPIN = 0, 1, 2, 3
"""Kinds of constraint blocks; SPIN says that a rod between two spherical joints does not turn about its own axis."""

LOPSIDED = 1e-6
"""Of a rod's length and of its inertia: how unlike a body of revolution a rod with an idle spin may be; six digits in a
file stay below it."""

ROWS = {CONNECT: 3, WELD: 6, JOINT: 1, SPIN: 1}


@dataclass(frozen=True)
class Structure:
    """Tables of one model; ``blocks`` is ``(k, 5)``: kind, body 1, body 2, site 1, site 2 (joints for JOINT)."""

    file: str
    actuated: IntArray
    """velocity addresses of the actuated joints, in actuator order"""
    actuated_qpos: IntArray
    passive: IntArray
    joint_names: tuple[str, ...]
    dof_names: tuple[str, ...]
    blocks: IntArray
    block_names: tuple[str, ...]
    block_rows: IntArray
    polynomials: FloatArray
    """``(k, 5)`` coefficients of joint equalities"""
    moves: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
    """``(nbody, nv)``: does the velocity move the body"""
    root: IntArray
    base: int
    platform_site: int
    idle: tuple[str, ...]
    """bodies whose spin about their own axis is idle"""
    home_qpos: FloatArray
    columns: IntArray = field(repr=False)
    """for each velocity its place among the passive ones, or -1"""

    @property
    def rows(self) -> int:
        """Number of constraint rows, spin rows included."""
        return int(self.block_rows[-1])

    @property
    def loop_rows(self) -> int:
        """Number of rows of the loop closures alone."""
        return self.rows - len(self.idle)


def _name(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    return mujoco.mj_id2name(model, kind, index) or f"#{index}"


def read_structure(model: mujoco.MjModel, file: str) -> Structure:
    """Resolve the tables of *model*.

    Raises
    ------
    ModelError
        Something the projection does not cover (contacts, tendons, limits, closures by body and anchor ...), with the
        element's name and what would be accepted.
    """
    _refuse_uncovered(model, file)
    obj = mujoco.mjtObj
    joints = [int(model.actuator_trnid[a, 0]) for a in range(model.nu)]
    if not joints:
        raise ModelError(
            f"{file}: no actuator; a motor says which joint is actuated, or a campaign does (actuated)", file=file
        )
    actuated = np.array([model.jnt_dofadr[j] for j in joints], dtype=np.int64)
    moves = np.zeros((model.nbody, model.nv), dtype=np.bool_)
    for body in range(1, model.nbody):
        moves[body] = moves[model.body_parentid[body]]
        first = model.body_dofadr[body]
        if first >= 0:
            moves[body, first : first + model.body_dofnum[body]] = True
    blocks, names, polynomials = _closures(model, file)
    idle = _idle_rods(model, blocks)
    for body, site in idle:
        _refuse_lopsided(model, body, site, file)
    for body, site in idle:
        blocks.append((SPIN, body, 0, site, int(model.body_jntadr[body])))
        names.append(f"spin of {_name(model, obj.mjOBJ_BODY, body)}")
        polynomials.append(np.zeros(5))
    passive = np.array([d for d in range(model.nv) if d not in set(actuated.tolist())], dtype=np.int64)
    columns = np.full(model.nv, -1, dtype=np.int64)
    columns[passive] = np.arange(len(passive))
    home = mujoco.mj_name2id(model, obj.mjOBJ_KEY, "home")
    return Structure(
        file=file,
        actuated=actuated,
        actuated_qpos=np.array([model.jnt_qposadr[j] for j in joints], dtype=np.int64),
        passive=passive,
        joint_names=tuple(_name(model, obj.mjOBJ_JOINT, j) for j in joints),
        dof_names=tuple(_name(model, obj.mjOBJ_JOINT, model.dof_jntid[d]) for d in range(model.nv)),
        blocks=np.array(blocks, dtype=np.int64).reshape(-1, 5),
        block_names=tuple(names),
        block_rows=np.concatenate([[0], np.cumsum([ROWS[b[0]] for b in blocks])]).astype(np.int64),
        polynomials=np.array(polynomials, dtype=np.float64).reshape(-1, 5),
        moves=moves,
        root=np.array(model.body_rootid, dtype=np.int64),
        base=_named(model, obj.mjOBJ_BODY, "base_body", "body", file),
        platform_site=_named(model, obj.mjOBJ_SITE, "platform_site", "site", file),
        idle=tuple(_name(model, obj.mjOBJ_BODY, body) for body, _ in idle),
        home_qpos=np.array(model.key_qpos[home] if home >= 0 else model.qpos0, dtype=np.float64),
        columns=columns,
    )


def _named(model: mujoco.MjModel, kind: mujoco.mjtObj, key: str, element: str, file: str) -> int:
    name = custom_text(model, key)
    if name is None:
        raise ModelError(f'{file}: <custom> has no <text name="{key}">; it names the {element}', file=file, key=key)
    index = int(mujoco.mj_name2id(model, kind, name))
    if index < 0:
        raise ModelError(f'{file}: <text name="{key}"> names {element} "{name}", which does not exist', file=file)
    return index


def _closures(
    model: mujoco.MjModel, file: str
) -> tuple[list[tuple[int, int, int, int, int]], list[str], list[FloatArray]]:
    blocks: list[tuple[int, int, int, int, int]] = []
    names: list[str] = []
    polynomials: list[FloatArray] = []
    kinds = {mujoco.mjtEq.mjEQ_CONNECT: CONNECT, mujoco.mjtEq.mjEQ_WELD: WELD, mujoco.mjtEq.mjEQ_JOINT: JOINT}
    for eq in range(model.neq):
        if not model.eq_active0[eq]:
            continue
        name = _name(model, mujoco.mjtObj.mjOBJ_EQUALITY, eq)
        kind = kinds.get(mujoco.mjtEq(model.eq_type[eq]))
        if kind is None:
            raise ModelError(f'{file}: equality "{name}" is neither connect, weld nor joint', file=file, element=name)
        one, two = int(model.eq_obj1id[eq]), int(model.eq_obj2id[eq])
        if kind == JOINT:
            blocks.append((JOINT, 0, 0, one, two))
            polynomials.append(_absolute_polynomial(model, eq, one, two))
        else:
            if mujoco.mjtObj(model.eq_objtype[eq]) != mujoco.mjtObj.mjOBJ_SITE:
                raise ModelError(
                    f'{file}: equality "{name}" closes a loop by bodies; give site1 and site2, which stay right when a'
                    " length is edited",
                    file=file,
                    element=name,
                )
            blocks.append((kind, int(model.site_bodyid[one]), int(model.site_bodyid[two]), one, two))
            polynomials.append(np.zeros(5))
        names.append(name)
    return blocks, names, polynomials


def _absolute_polynomial(model: mujoco.MjModel, eq: int, one: int, two: int) -> FloatArray:
    """Coefficients ``(5,)`` of a joint equality in the coordinates themselves; MuJoCo counts both from qpos0."""
    coefficients = Polynomial(np.array(model.eq_data[eq, :5], dtype=np.float64))
    if two >= 0:
        coefficients = coefficients(Polynomial([-float(model.qpos0[model.jnt_qposadr[two]]), 1.0]))
    absolute = np.zeros(5)
    absolute[: len(coefficients.coef)] = coefficients.coef
    absolute[0] += model.qpos0[model.jnt_qposadr[one]]
    return absolute


def _idle_rods(model: mujoco.MjModel, blocks: list[tuple[int, int, int, int, int]]) -> list[tuple[int, int]]:
    """Bodies that hang on a ball joint and are closed by one connect: their spin about the line between is idle."""
    rods: list[tuple[int, int]] = []
    for body in range(1, model.nbody):
        first = model.body_jntadr[body]
        alone = model.body_jntnum[body] == 1 and not np.any(model.body_parentid[1:] == body)
        if not alone or mujoco.mjtJoint(model.jnt_type[first]) != mujoco.mjtJoint.mjJNT_BALL:
            continue
        touching = [(b[0], b[3] if b[1] == body else b[4]) for b in blocks if body in (b[1], b[2])]
        if len(touching) == 1 and touching[0][0] == CONNECT:
            rods.append((body, touching[0][1]))
    return rods


def _refuse_lopsided(model: mujoco.MjModel, body: int, site: int, file: str) -> None:
    """Refuse a rod whose mass is not alike all around its axis: its spin is not idle, and no actuator holds it."""
    joint = int(model.body_jntadr[body])
    along = np.array(model.site_pos[site]) - model.jnt_pos[joint]
    length = float(np.linalg.norm(along))
    name = _name(model, mujoco.mjtObj.mjOBJ_BODY, body)
    remedy = (
        f'what spins it no actuator holds; put two hinges in place of ball joint "'
        f'{_name(model, mujoco.mjtObj.mjOBJ_JOINT, joint)}", or make the rod alike all around'
    )
    if not length:
        end = _name(model, mujoco.mjtObj.mjOBJ_SITE, site)
        raise ModelError(
            f'{file}: body "{name}" is closed by site "{end}", which lies in the centre of its ball joint; place the'
            " site at the rod's other end",
            file=file,
            element=name,
        )
    axis = along / length
    off = float(np.linalg.norm(np.cross(axis, model.body_ipos[body] - model.jnt_pos[joint])))
    if off > LOPSIDED * length:
        raise ModelError(
            f'{file}: body "{name}" hangs between two spherical joints, and its mass centre lies {off:.3g} m off the'
            f" line between them; {remedy}",
            file=file,
            element=name,
        )
    inertia = inertia_matrix(model, body)
    across = np.linalg.svd(axis[None, :])[2][1:]
    seen = np.vstack([axis, across]) @ inertia @ np.vstack([axis, across]).T
    uneven = float(max(abs(seen[0, 1]), abs(seen[0, 2]), abs(seen[1, 2]), abs(seen[1, 1] - seen[2, 2])))
    if uneven > LOPSIDED * float(np.trace(inertia)):
        raise ModelError(
            f'{file}: body "{name}" hangs between two spherical joints, and its moments of inertia differ around the'
            f" line between them by {uneven:.3g} kg m^2; {remedy}",
            file=file,
            element=name,
        )


def _refuse_uncovered_friction(model: mujoco.MjModel, file: str) -> None:
    """Refuse dry friction of passive joints, damping that is not linear, and friction that MuJoCo is told to ignore."""
    driven = {int(joint) for joint in model.actuator_trnid[:, 0]}
    for dof in range(model.nv):
        joint, dry = int(model.dof_jntid[dof]), float(model.dof_frictionloss[dof])
        name = _name(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
        if dry and joint not in driven:
            raise ModelError(
                f'{file}: joint "{name}" is passive and has frictionloss {dry:g}; dry friction is covered at actuated'
                " joints only",
                file=file,
                joint=name,
            )
        if model.dof_dampingpoly[dof].any():
            raise ModelError(
                f'{file}: joint "{name}" has damping {model.dof_damping[dof]:g} and further terms'
                f" {model.dof_dampingpoly[dof].tolist()}; damping is covered where it is one number",
                file=file,
                joint=name,
            )
    for flag, values in (("damper", model.dof_damping), ("frictionloss", model.dof_frictionloss)):
        off = model.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}").value
        if off and values.any():
            joint = int(model.dof_jntid[int(np.argmax(values != 0))])
            name = _name(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
            raise ModelError(
                f'{file}: <flag {flag}> is disabled, yet joint "{name}" has such friction; enable it or set it to zero',
                file=file,
                joint=name,
            )


def _off(model: mujoco.MjModel, flag: str) -> bool:
    """Whether the model's ``<flag>`` disables something."""
    return bool(model.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}").value)


def _refuse_uncovered(model: mujoco.MjModel, file: str) -> None:
    """Refuse what the closed-chain inverse dynamics leaves out, so that no error is ever silent."""
    obj = mujoco.mjtObj
    if model.ntendon:
        raise ModelError(f"{file}: {model.ntendon} tendon(s); none is covered", file=file)
    if _off(model, "gravity"):
        raise ModelError(f"{file}: <flag gravity> is disabled; set gravity to zero by the parameter g", file=file)
    for flag in ("constraint", "equality"):
        if model.neq and _off(model, flag):
            raise ModelError(
                f"{file}: <flag {flag}> is disabled, so that the file's loops are open; enable it, or take the"
                " equalities out",
                file=file,
            )
    for option in ("density", "viscosity"):
        value = float(getattr(model.opt, option))
        if value:
            raise ModelError(
                f"{file}: <option {option}> is {value:g}; forces of a surrounding fluid are not covered", file=file
            )
    if model.body_gravcomp.any():
        body = int(np.argmax(model.body_gravcomp != 0))
        raise ModelError(
            f'{file}: body "{_name(model, obj.mjOBJ_BODY, body)}" has gravcomp {model.body_gravcomp[body]:g}; gravity'
            " compensation is not covered",
            file=file,
        )
    if not _off(model, "contact") and np.any(model.geom_contype | model.geom_conaffinity):
        geom = int(np.argmax(model.geom_contype | model.geom_conaffinity))
        raise ModelError(
            f'{file}: geom "{_name(model, obj.mjOBJ_GEOM, geom)}" can collide; contacts are not covered, disable them'
            ' by <flag contact="disable"/>',
            file=file,
        )
    for joint in range(model.njnt):
        name = _name(model, obj.mjOBJ_JOINT, joint)
        if mujoco.mjtJoint(model.jnt_type[joint]) == mujoco.mjtJoint.mjJNT_FREE:
            raise ModelError(
                f'{file}: joint "{name}" is free; fix the body if it is the base; if it is the platform, give it three'
                " slides and a ball in place of the free joint",
                file=file,
                joint=name,
            )
        if model.jnt_limited[joint] and not _off(model, "limit"):
            raise ModelError(
                f'{file}: joint "{name}" has a range {model.jnt_range[joint].tolist()}; limits are not covered',
                file=file,
            )
        stiffness = np.array([model.jnt_stiffness[joint], *model.jnt_stiffnesspoly[joint]])
        if stiffness.any() and not _off(model, "spring"):
            shown = " ".join(f"{number:g}" for number in np.trim_zeros(stiffness, "b"))
            raise ModelError(f'{file}: joint "{name}" has stiffness {shown}; springs are not covered', file=file)
    _refuse_uncovered_friction(model, file)
    for actuator in range(model.nu):
        name = _name(model, obj.mjOBJ_ACTUATOR, actuator)
        if mujoco.mjtTrn(model.actuator_trntype[actuator]) != mujoco.mjtTrn.mjTRN_JOINT:
            raise ModelError(f'{file}: actuator "{name}" does not drive a joint', file=file)
        kind = mujoco.mjtJoint(model.jnt_type[model.actuator_trnid[actuator, 0]])
        if kind not in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
            raise ModelError(f'{file}: actuator "{name}" must drive a hinge or slide joint', file=file)
