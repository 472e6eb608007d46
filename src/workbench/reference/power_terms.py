"""The terms of a power balance that MuJoCo gives body by body: further losses, and how large what cancels is."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.reference.body_forces import felt_gravity


@dataclass(frozen=True)
class Terms:
    """Of m samples, each ``(m,)``."""

    energy: FloatArray
    """J: the sizes of all summands of the energy, added up"""
    power: FloatArray
    """W: the sizes of all summands of force times velocity, added up"""


def terms_of(model: mujoco.MjModel, qpos: FloatArray, qvel: FloatArray, qacc: FloatArray) -> Terms:
    """Evaluate states one by one.

    Parameters
    ----------
    model
        The compiled model.
    qpos, qvel, qacc
        MuJoCo's coordinates, velocities and accelerations, ``(m, nq)`` and ``(m, nv)``.
    """
    data = mujoco.MjData(model)
    pulls = np.asarray(model.body_mass)[:, None] * felt_gravity(model)
    energy, power = np.zeros((2, len(qpos)))
    lengths, mass = _lengths(model, qpos), np.zeros((model.nv, model.nv))
    for sample in range(len(qpos)):
        data.qpos[:], data.qvel[:] = qpos[sample], qvel[sample]
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        v = np.abs(qvel[sample])
        mujoco.mj_fullM(model, data, mass)
        size = np.abs(mass)
        energy[sample] = np.sum(np.abs(pulls * data.xipos)) + 0.5 * v @ size @ v
        energy[sample] += np.abs(data.qfrc_spring) @ lengths[sample]
        power[sample] = v @ (size @ np.abs(qacc[sample]) + np.abs(data.qfrc_bias) + np.abs(data.qfrc_passive))
    return Terms(energy, power)


def further_losses(model: mujoco.MjModel, qpos: FloatArray, qvel: FloatArray) -> FloatArray:
    """What passive forces other than springs and linear damping of joints take, ``(m,)`` in watts."""
    losses = np.zeros(len(qpos))
    # what the plain formula counts is not counted twice, to the last bit
    if not _more_than_joints_damp(model):
        return losses
    data, damping = mujoco.MjData(model), np.asarray(model.dof_damping)
    for sample in range(len(qpos)):
        data.qpos[:], data.qvel[:] = qpos[sample], qvel[sample]
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        other = data.qfrc_passive - data.qfrc_spring + damping * qvel[sample]
        losses[sample] = -float(other @ qvel[sample])
    return losses


def _lengths(model: mujoco.MjModel, qpos: FloatArray) -> FloatArray:
    """A coordinate's size for each velocity ``(m, nv)``; 1 for turns of ball and free joints."""
    sizes = np.ones((len(qpos), model.nv))
    for joint in range(model.njnt):
        if mujoco.mjtJoint(model.jnt_type[joint]) in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
            sizes[:, model.jnt_dofadr[joint]] = np.abs(qpos[:, model.jnt_qposadr[joint]])
    return sizes


def _more_than_joints_damp(model: mujoco.MjModel) -> bool:
    """Whether anything but springs and linear damping of joints is among the passive forces."""
    option = model.opt
    arrays = (
        model.dof_dampingpoly, model.actuator_damping, model.actuator_dampingpoly, model.tendon_damping,
        model.tendon_dampingpoly, model.body_gravcomp,
    )  # fmt: skip
    return bool(option.density or option.viscosity or any(np.any(array) for array in arrays))
