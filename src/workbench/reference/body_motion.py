"""How every body moves with the actuated joints: Jacobians per actuated rate, accelerations, axes.

MuJoCo's axes of motion are folded with W, all velocities per actuated one, so that the loops are in them. What the
terms of the torque and the inertial regressor are made of.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray
from workbench.errors import ParameterError
from workbench.reference.engine import lean
from workbench.reference.mujoco_reference import MujocoReference
from workbench.reference.result import ReferenceResult

BLOCK = 512
"""Samples that are evaluated at a time, some 10 kB each."""


@dataclass(frozen=True)
class BodyMotion:
    """Motion of every body but the world at n samples, world frame, SI; nb bodies, na actuated joints."""

    names: tuple[str, ...]
    linear: FloatArray
    """``(n, nb, 3, na)`` velocity of the body's point per actuated rate"""
    angular: FloatArray
    """``(n, nb, 3, na)`` angular velocity per actuated rate"""
    spin: FloatArray
    """``(n, nb, 3)`` angular velocity, rad/s"""
    linear_driven: FloatArray
    """``(n, nb, 3)`` the point's acceleration from qdd alone, m/s^2"""
    linear_carried: FloatArray
    """``(n, nb, 3)`` the point's acceleration at qdd = 0, from the rates alone, m/s^2"""
    angular_driven: FloatArray
    """``(n, nb, 3)`` angular acceleration from qdd alone, rad/s^2"""
    angular_carried: FloatArray
    """``(n, nb, 3)`` angular acceleration from the rates alone, rad/s^2"""
    axes: FloatArray
    """``(n, nb, 3, 3)`` world vector = axes @ vector in the frame that inertia is given in"""
    tangent: FloatArray
    """``(n, nv, na)`` W, all velocities per actuated one"""
    springs: FloatArray
    """``(n, nv)`` forces of springs on all coordinates, N and N m"""
    dampers: FloatArray
    """``(n, nv)`` those of dampers of joints and tendons"""
    fluid: FloatArray
    """``(n, nv)`` those of a fluid"""
    result: ReferenceResult
    """the reference's own inverse dynamics at the samples"""


def body_motion(
    reference: MujocoReference,
    q: FloatArray,
    qd: FloatArray,
    qdd: FloatArray,
    mass_model: str = "distributed",
    external_force: FloatArray | None = None,
    centres: bool = True,
    along: ArrayLike | None = None,
    *,
    known: ReferenceResult | None = None,
) -> BodyMotion:
    """Evaluate the motion of every body.

    Parameters
    ----------
    reference
        The robot.
    q, qd, qdd
        Actuated motion, ``(n, na)`` each, SI.
    mass_model
        ``"distributed"`` or ``"lumped"``.
    external_force
        Newtons on the platform, base frame, ``(3,)`` or ``(n, 3)``; it enters the result only.
    centres
        True: points are mass centres and axes principal ones; False: points are body frames' origins, axes theirs.
    along
        Times ``(n,)`` of samples that are one motion, as for `MujocoReference.inverse_dynamics`.
    known
        What `MujocoReference.inverse_dynamics` gives for these arguments, where it is at hand.

    Raises
    ------
    ParameterError
        More actuators than freedoms: the torque is then no sum over bodies, but one of many.
    MotionError, ArrayError
        As `MujocoReference.inverse_dynamics`.
    """
    if reference.excess_actuators:
        raise ParameterError(
            f"{reference.file}: {reference.excess_actuators} actuator(s) more than freedoms; the torque is one of many"
            " and has no parts by body"
        )
    result = known or reference.inverse_dynamics(q, qd, qdd, mass_model, external_force, along=along)
    ordered = along is not None  # then the reference holds what it closed last
    tangent = reference.tangent(np.asarray(q, dtype=np.float64), ordered, None if ordered else result.qpos)
    model = reference.compiled(mass_model)
    n, na, nb = len(result.tau), tangent.shape[2], model.nbody - 1
    linear, angular = np.zeros((2, n, nb, 3, na))
    spin, carried_l, carried_a = np.zeros((3, n, nb, 3))
    axes = np.zeros((n, nb, 3, 3))
    springs, dampers, fluid = np.zeros((3, n, model.nv))
    # qacc = W qdd + what the loops need at qdd = 0
    carried = result.qacc - np.einsum("nva,na->nv", tangent, np.asarray(qdd, dtype=np.float64))
    moves, root = reference.structure.moves[1:].astype(np.float64), np.asarray(model.body_rootid)[1:]
    kept = min(n, BLOCK)
    batch = Batch(lean(model), kept, 1)
    names = ("cdof", "cdof_dot", "subtree_com", *(("xipos", "ximat") if centres else ("xpos", "xmat")))
    cdof, cdof_dot, com, positions, frames = (batch.bind(name) for name in names)
    forces = [batch.bind(name) for name in ("qfrc_spring", "qfrc_damper", "qfrc_fluid")]
    for first in range(0, n, BLOCK):
        rows = slice(first, min(first + BLOCK, n))
        count, rates = rows.stop - rows.start, result.qvel[rows, :, None, None]
        batch.qpos[:count], batch.qvel[:count] = result.qpos[rows], result.qvel[rows]
        batch.forward(np.arange(count, dtype=np.int32), stage=mujoco.mjtStage.mjSTAGE_VEL.value)
        for kind, force in zip((springs, dampers, fluid), forces, strict=True):
            kind[rows] = force[:count]
        axes[rows] = frames[:count, 1:].reshape(count, nb, 3, 3)
        offset = (positions[:count, 1:] - com[:count, root])[..., None]
        # of each joint, turning and sliding about the mass centre of its tree, times what it does: per actuated rate,
        # its acceleration at qdd = 0, its rate; and how what it does itself turns, times its rate
        axis, done = cdof[:count, :, :, None], np.concatenate([tangent[rows], carried[rows, :, None]], axis=2)
        each = np.concatenate([axis * done[:, :, None], axis * rates, cdof_dot[:count, :, :, None] * rates], axis=3)
        whole = (moves @ each.reshape(count, model.nv, -1)).reshape(count, nb, 6, na + 3)
        turned = whole[:, :, :3]
        at_point = whole[:, :, 3:] + np.cross(turned, offset, axis=2)
        angular[rows], linear[rows] = turned[..., :na], at_point[..., :na]
        spin[rows], carried_a[rows] = turned[..., na + 1], turned[..., na] + turned[..., na + 2]
        carried_l[rows] = at_point[..., na] + at_point[..., na + 2] + np.cross(spin[rows], at_point[..., na + 1])
    qdd = np.asarray(qdd, dtype=np.float64)
    return BodyMotion(
        names=tuple(model.body(body).name or f"#{body}" for body in range(1, model.nbody)),
        linear=linear,
        angular=angular,
        spin=spin,
        linear_driven=np.einsum("nbca,na->nbc", linear, qdd),
        linear_carried=carried_l,
        angular_driven=np.einsum("nbca,na->nbc", angular, qdd),
        angular_carried=carried_a,
        axes=axes,
        tangent=tangent,
        springs=springs,
        dampers=dampers,
        fluid=fluid,
        result=result,
    )
