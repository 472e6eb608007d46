"""What the reference counts and the second engine does not: named, so that the two never differ in silence."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from workbench.errors import ModelError
from workbench.reference.closures import name_of
from workbench.reference.kinds import TENDON
from workbench.reference.structure import Structure
from workbench.reference.uncovered import switched_off


def refuse_uncounted(model: mujoco.MjModel, structure: Structure) -> None:
    """Refuse a model of which the second engine would leave something out.

    Raises
    ------
    ModelError
        Naming all of it.
    """
    found = list(_uncounted(model, structure))
    if found:
        raise ModelError(
            f"{structure.file}: the second engine, Pinocchio, does not count {', '.join(found)}; run with --engines"
            " mujoco",
            file=structure.file,
            uncounted=found,
        )


def _uncounted(model: mujoco.MjModel, structure: Structure) -> Iterator[str]:
    springs = np.array(
        [stiffness.any() for stiffness in np.column_stack([model.jnt_stiffness, model.jnt_stiffnesspoly])]
    )
    if springs.any() and not switched_off(model, "spring"):
        yield f"the spring of {_joint(model, springs)}"
    bent = model.dof_dampingpoly.any(axis=1)
    if bent.any():
        joint = name_of(model, mujoco.mjtObj.mjOBJ_JOINT, int(model.dof_jntid[int(np.argmax(bent))]))
        yield f'the damping beyond its first number of joint "{joint}"'
    if model.opt.density or model.opt.viscosity:
        yield "the fluid"
    if model.body_gravcomp.any():
        yield f'the gravcomp of body "{name_of(model, mujoco.mjtObj.mjOBJ_BODY, int(np.argmax(model.body_gravcomp)))}"'
    pulls = (model.tendon_stiffness, model.tendon_damping, model.tendon_armature, model.tendon_frictionloss)
    more = (model.tendon_stiffnesspoly, model.tendon_dampingpoly)
    if any(np.any(values) for values in (*pulls, *more)) or TENDON in structure.blocks[:, 0]:
        yield f'tendon "{name_of(model, mujoco.mjtObj.mjOBJ_TENDON, 0)}"'
    driven = (model.actuator_armature, model.actuator_damping, model.actuator_dampingpoly)
    if any(np.any(values) for values in driven):
        yield "armature or damping of an actuator"
    free = np.array([kind == mujoco.mjtJoint.mjJNT_FREE.value for kind in model.jnt_type], dtype=bool)
    if free.any():
        yield f"the free {_joint(model, free)}"
    if np.ptp(_ball_values(model), axis=1).any():
        yield "a ball joint whose freedoms differ in armature"


def _joint(model: mujoco.MjModel, which: np.ndarray) -> str:
    return f'joint "{name_of(model, mujoco.mjtObj.mjOBJ_JOINT, int(np.argmax(which)))}"'


def _ball_values(model: mujoco.MjModel) -> np.ndarray:
    """Armature of the freedoms of all ball joints ``(k, 3)``."""
    balls = [j for j in range(model.njnt) if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_BALL.value]
    values = [np.asarray(model.dof_armature)[model.jnt_dofadr[j] : model.jnt_dofadr[j] + 3] for j in balls]
    return np.array(values).reshape(-1, 3)
