"""The reference's torque as a sum: over bodies, directions and rotation, and what the joints themselves add.

By virtual work each body gives ``m J^T (a - g) + R^T (I alpha + omega x I omega)`` to the actuators, J and R its
velocities per actuated rate. Split by weight, acceleration and velocity the items add up to the torque, to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray, as_batches, as_force
from workbench.dry_friction import direction
from workbench.errors import ParameterError
from workbench.reference.body_forces import felt_gravity
from workbench.reference.body_motion import BodyMotion, body_motion
from workbench.reference.mujoco_reference import MujocoReference
from workbench.reference.result import ReferenceResult

WEIGHT, ACCELERATION, VELOCITY = "weight", "acceleration", "velocity"
SPRINGS, FRICTION, FORCE = "springs", "friction", "external force"
PARTS = (WEIGHT, ACCELERATION, VELOCITY, SPRINGS, FRICTION, FORCE)

TURNING = "turning"
JOINTS = "joints"
"""what stands for a body where the joints themselves need torque: springs, friction, fluid, rotor inertia"""
PLATFORM = "platform"

COMPLETE = 1e-9
"""Of the largest torque or summand: items that add up to something else by more are refused."""


@dataclass(frozen=True)
class Item:
    """One summand."""

    part: str
    """one of `PARTS`"""
    body: str
    direction: str
    """``x``, ``y``, ``z`` of the base (paper) frame; ``turning``; or empty"""
    tau: FloatArray
    """``(n, na)``, N and N m"""


@dataclass(frozen=True)
class Terms:
    """A torque and its summands, all ``(n, na)``."""

    joints: tuple[str, ...]
    items: tuple[Item, ...]
    """those that are not zero throughout"""
    tau: FloatArray
    """the reference's own torque, from its own projection"""

    @property
    def total(self) -> FloatArray:
        """Sum of the items."""
        total = np.zeros_like(self.tau)
        for item in self.items:
            total += item.tau
        return total

    def by(self, *keys: str) -> dict[tuple[str, ...], FloatArray]:
        """Sums of items that share *keys*, among ``part``, ``body``, ``direction``; in the order of the items."""
        sums: dict[tuple[str, ...], FloatArray] = {}
        for item in self.items:
            key = tuple(str(getattr(item, name)) for name in keys)
            sums[key] = sums[key] + item.tau if key in sums else item.tau
        return sums


def torque_terms(
    reference: MujocoReference,
    q: ArrayLike,
    qd: ArrayLike,
    qdd: ArrayLike,
    mass_model: str = "distributed",
    external_force: ArrayLike | None = None,
    along: ArrayLike | None = None,
    *,
    known: ReferenceResult | None = None,
) -> Terms:
    """Take the torque of each sample apart.

    Parameters
    ----------
    reference
        The robot.
    q, qd, qdd
        Actuated motion, ``(n, na)`` each, SI.
    mass_model
        ``"distributed"`` or ``"lumped"``.
    external_force
        Newtons, base (paper) frame, on the platform: ``(3,)`` or ``(n, 3)``.
    along
        Times ``(n,)`` of samples that are one motion, as for `MujocoReference.inverse_dynamics`.
    known
        What `MujocoReference.inverse_dynamics` gives for these arguments, where it is at hand.

    Raises
    ------
    ParameterError
        More actuators than freedoms; a torque with a summand that is none of these.
    MotionError, ArrayError
        As `MujocoReference.inverse_dynamics`.
    """
    q, qd, qdd = as_batches(len(reference.joint_names), q=q, qd=qd, qdd=qdd)
    force = as_force("external_force", external_force, len(q))
    moving = body_motion(reference, q, qd, qdd, mass_model, force, along=along, known=known)
    found = [*_of_bodies(reference, moving, mass_model), *_of_joints(reference, moving, qd, qdd, mass_model)]
    found += _of_force(reference, moving, force)
    kept = tuple(item for item in found if item.tau.any())
    terms = Terms(reference.joint_names, kept, moving.result.tau)
    size = max((float(np.abs(tau).max()) for tau in (terms.tau, *(item.tau for item in kept))), default=0.0)
    left = float(np.abs(terms.total - terms.tau).max()) if terms.tau.size else 0.0
    if not left <= COMPLETE * size:
        raise ParameterError(
            f"{reference.file}: the torque has no parts by body: they leave out {left:.3g} of {size:.3g} N or N m,"
            " something beside weight, inertia, springs, friction, fluid and the force on the platform"
        )
    return terms


def _of_bodies(reference: MujocoReference, moving: BodyMotion, mass_model: str) -> list[Item]:
    model = reference.compiled(mass_model)
    turn = reference.base_rotation.T
    pulls = felt_gravity(model) @ turn.T
    items = []
    for index, name in enumerate(moving.names):
        mass = float(model.body_mass[index + 1])
        inertia = np.asarray(model.body_inertia[index + 1])
        linear = np.einsum("cd,nda->nca", turn, moving.linear[:, index])
        driven, carried = moving.linear_driven[:, index] @ turn.T, moving.linear_carried[:, index] @ turn.T
        gravity = pulls[index + 1]
        for axis, letter in enumerate("xyz"):
            along = mass * linear[:, axis, :]
            items += [
                Item(WEIGHT, name, letter, -gravity[axis] * along),
                Item(ACCELERATION, name, letter, driven[:, axis, None] * along),
                Item(VELOCITY, name, letter, carried[:, axis, None] * along),
            ]
        frame = moving.axes[:, index]
        tensor = np.einsum("nij,j,nkj->nik", frame, inertia, frame)
        spin = moving.spin[:, index]
        gyro = np.cross(spin, np.einsum("nij,nj->ni", tensor, spin))
        turning = np.einsum("nij,nj->ni", tensor, moving.angular_carried[:, index]) + gyro
        pushed = np.einsum("nij,nj->ni", tensor, moving.angular_driven[:, index])
        for part, moment in ((ACCELERATION, pushed), (VELOCITY, turning)):
            items.append(Item(part, name, TURNING, np.einsum("nca,nc->na", moving.angular[:, index], moment)))
    return items


def _of_joints(
    reference: MujocoReference, moving: BodyMotion, qd: FloatArray, qdd: FloatArray, mass_model: str
) -> list[Item]:
    """Rotor inertia, springs, dampers and fluid, and dry friction."""
    model, tangent = reference.compiled(mass_model), moving.tangent
    driven = np.einsum("nva,na->nv", tangent, qdd)
    carried = moving.result.qacc - driven
    armature, rub = np.asarray(model.dof_armature), reference.structure.friction

    def projected(forces: FloatArray) -> FloatArray:
        tau: FloatArray = np.einsum("nva,nv->na", tangent, forces)
        return tau

    dry = rub.actuated * direction(qd)
    if rub.inside:
        dry = dry - projected(rub.force(moving.result.qvel))
    return [
        Item(ACCELERATION, JOINTS, "", projected(armature * driven)),
        Item(VELOCITY, JOINTS, "", projected(armature * carried)),
        Item(SPRINGS, JOINTS, "", -projected(moving.springs)),
        Item(FRICTION, JOINTS, "viscous", -projected(moving.dampers)),
        Item(FRICTION, JOINTS, "fluid", -projected(moving.fluid)),
        Item(FRICTION, JOINTS, "dry", dry),
    ]


def _of_force(reference: MujocoReference, moving: BodyMotion, force: FloatArray) -> list[Item]:
    """What the external force on the platform takes off, by direction."""
    units = np.eye(force.shape[1])
    result, n = moving.result, len(force)
    na = result.tau.shape[1]
    jacobian = np.zeros((n, 3, na))
    if force.any():
        rest = np.zeros((n, na))
        q = result.qpos[:, reference.structure.actuated_qpos]
        for joint in range(na):
            rate = rest.copy()
            rate[:, joint] = 1.0
            jacobian[:, :, joint] = reference.inverse_dynamics(q, rate, rest, near=result.qpos).xd
    return [
        Item(FORCE, PLATFORM, letter, -(force @ units[axis])[:, None] * jacobian[:, axis])
        for axis, letter in enumerate("xyz")
    ]
