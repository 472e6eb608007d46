"""A model's equalities as constraint blocks: by sites, by bodies and anchor, between joints, between fixed tendons."""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.polynomial import Polynomial

from workbench.arrays import FloatArray
from workbench.mjcf.refusal import Refusal
from workbench.reference.kinds import CONNECT, JOINT, TENDON, WELD

Block = tuple[int, int, int, int, int]
"""kind, body 1, body 2, then sites (or frames, numbered after the sites), joints or tendons"""

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


@dataclass
class Closures:
    """Blocks in the file's order."""

    blocks: list[Block] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    polynomials: list[FloatArray] = field(default_factory=list)
    """``(5,)`` coefficients of joint and tendon equalities, in the coordinates and lengths themselves"""
    frames: list[tuple[int, FloatArray, FloatArray]] = field(default_factory=list)
    refusals: list[Refusal] = field(default_factory=list)


def name_of(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    """An element's name, or ``#index`` where it has none."""
    return mujoco.mj_id2name(model, kind, index) or f"#{index}"


def fixed_tendons(model: mujoco.MjModel) -> FloatArray:
    """Coefficients ``(ntendon, njnt)`` of the linear forms that fixed tendons are; rows of spatial tendons are zero."""
    table = np.zeros((model.ntendon, model.njnt))
    for tendon in range(model.ntendon):
        for wrap in range(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon]):
            if model.wrap_type[wrap] == mujoco.mjtWrap.mjWRAP_JOINT:
                table[tendon, model.wrap_objid[wrap]] += model.wrap_prm[wrap]
    return table


def is_fixed(model: mujoco.MjModel, tendon: int) -> bool:
    """Whether a tendon is a linear form of joint coordinates."""
    return bool(model.wrap_type[model.tendon_adr[tendon]] == mujoco.mjtWrap.mjWRAP_JOINT)


def read_closures(model: mujoco.MjModel) -> Closures:
    """Collect all active equalities; what is none of them goes into the refusals."""
    found = Closures()
    obj, kinds = mujoco.mjtObj, mujoco.mjtEq
    tendons = fixed_tendons(model)
    for eq in range(model.neq):
        if not model.eq_active0[eq]:
            continue
        name, kind = name_of(model, obj.mjOBJ_EQUALITY, eq), kinds(model.eq_type[eq])
        one, two = int(model.eq_obj1id[eq]), int(model.eq_obj2id[eq])
        coefficients = np.zeros(5)
        if kind in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD):
            block = _loop(model, eq, found)
        elif kind == kinds.mjEQ_JOINT:
            start = [float(model.qpos0[model.jnt_qposadr[j]]) if j >= 0 else 0.0 for j in (one, two)]
            coefficients = absolute(np.array(model.eq_data[eq, :5]), start[0], start[1] if two >= 0 else None)
            block = (JOINT, 0, 0, one, two)
        elif kind == kinds.mjEQ_TENDON and all(t < 0 or is_fixed(model, t) for t in (one, two)):
            start = [float(tendons[t] @ _scalars(model)) if t >= 0 else 0.0 for t in (one, two)]
            coefficients = absolute(np.array(model.eq_data[eq, :5]), start[0], start[1] if two >= 0 else None)
            block = (TENDON, 0, 0, one, two)
        else:
            tag = kind.name.removeprefix("mjEQ_").lower()
            what = f"{tag} equality" + (" of a spatial tendon" if tag == "tendon" else "")
            found.refusals.append(
                Refusal(
                    f'equality "{name}" is a {what}, which is not covered',
                    tag,
                    name,
                    'take it out, or set active="false"; covered are connect, weld, joint, and tendon where the tendons'
                    " are fixed",
                    f"{tag} equality",
                )
            )
            continue
        found.blocks.append(block)
        found.names.append(name)
        found.polynomials.append(coefficients)
    return found


def _scalars(model: mujoco.MjModel) -> FloatArray:
    """The initial coordinate of each joint's first freedom, ``(njnt,)``."""
    initial: FloatArray = np.array(model.qpos0)[np.asarray(model.jnt_qposadr)]
    return initial


def absolute(coefficients: FloatArray, one: float, two: float | None) -> FloatArray:
    """Coefficients ``(5,)`` in the coordinates themselves.

    MuJoCo counts both coordinates from their initial values *one* and *two*; two is None where there is no second.
    """
    shifted = Polynomial(coefficients if two is not None else coefficients[:1])
    if two is not None:
        shifted = shifted(Polynomial([-two, 1.0]))
    result = np.zeros(5)
    result[: len(shifted.coef)] = shifted.coef
    result[0] += one
    return result


def _loop(model: mujoco.MjModel, eq: int, found: Closures) -> Block:
    """A connect or weld; by bodies the second anchor and pose are those that MuJoCo found in the initial pose."""
    one, two = int(model.eq_obj1id[eq]), int(model.eq_obj2id[eq])
    data = np.array(model.eq_data[eq])
    weld = mujoco.mjtEq(model.eq_type[eq]) == mujoco.mjtEq.mjEQ_WELD
    # a weld whose torquescale is zero holds no orientation
    kind = WELD if weld and data[10] != 0.0 else CONNECT
    if mujoco.mjtObj(model.eq_objtype[eq]) == mujoco.mjtObj.mjOBJ_SITE:
        return kind, int(model.site_bodyid[one]), int(model.site_bodyid[two]), one, two
    first = int(model.nsite) + len(found.frames)
    if weld:
        found.frames += [(one, data[3:6], data[6:10]), (two, data[0:3], UPRIGHT)]
    else:
        found.frames += [(one, data[0:3], UPRIGHT), (two, data[3:6], UPRIGHT)]
    return kind, one, two, first, first + 1
