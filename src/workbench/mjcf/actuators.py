"""Of a model's actuators what belongs to the mechanism whoever drives it: rotor inertia and damping.

MuJoCo adds an actuator's ``armature`` and ``damping``, both times gear squared, to mass matrix and passive forces of
what it drives. A workbench that takes the file's actuators out and puts its own motors in must keep both at the joint.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.mjcf.refusal import Refusal

JOINTS = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)


@dataclass(frozen=True)
class ActuatorEffects:
    """What the actuators add at the joints, by joint number; joints that get nothing are absent."""

    armature: dict[int, float]
    """kg or kg m^2, to be added to the joint's own"""
    damping: dict[int, FloatArray]
    """``(3,)`` coefficients of -(a v + b v|v| + c v^3), to be added to the joint's own ``damping``"""
    refusals: tuple[Refusal, ...]
    """effects that no joint attribute can stand for"""


def actuator_effects(model: mujoco.MjModel) -> ActuatorEffects:
    """Collect rotor inertia and damping of all actuators of *model*, per joint."""
    armature: dict[int, float] = {}
    damping: dict[int, FloatArray] = {}
    refusals = []
    for actuator in range(model.nu):
        rotor = float(model.actuator_armature[actuator])
        losses = np.array([model.actuator_damping[actuator], *model.actuator_dampingpoly[actuator]])
        if not rotor and not losses.any():
            continue
        joint = int(model.actuator_trnid[actuator, 0])
        kind = mujoco.mjtTrn(model.actuator_trntype[actuator])
        scalar = kind in JOINTS and mujoco.mjtJoint(model.jnt_type[joint]) in (
            mujoco.mjtJoint.mjJNT_HINGE,
            mujoco.mjtJoint.mjJNT_SLIDE,
        )
        if not scalar:
            name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator) or f"#{actuator}"
            refusals.append(
                Refusal(
                    f'actuator "{name}" has armature or damping and drives no hinge or slide joint',
                    "actuator",
                    name,
                    "write both at the joints, or as armature and damping of its tendon",
                    "actuator effects",
                )
            )
            continue
        gear = float(model.actuator_gear[actuator, 0])
        if rotor:
            armature[joint] = armature.get(joint, 0.0) + rotor * gear**2
        if losses.any():
            # gear squared for all three: MuJoCo takes the powers of the joint's own speed
            damping[joint] = damping.get(joint, np.zeros(3)) + losses * gear**2
    return ActuatorEffects(armature, damping, tuple(refusals))
