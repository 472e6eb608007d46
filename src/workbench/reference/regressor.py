"""The inertial regressor of a closed chain: torque = Y pi, pi ten numbers a body, Y = W^T Y_tree.

The ten numbers of a body, in its own frame and about its frame's origin: mass m, first moments m c_x, m c_y, m c_z,
and the inertia I_xx, I_xy, I_xz, I_yy, I_yz, I_zz. Y knows geometry and motion only; it is what identification from
measured torques stands on, and what tells a wrong mass from wrong kinematics.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray, as_batches
from workbench.reference.body_forces import felt_gravity
from workbench.reference.body_motion import body_motion
from workbench.reference.mujoco_reference import MujocoReference

NUMBERS = ("m", "mcx", "mcy", "mcz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""places of the six inertias in the tensor"""


@dataclass(frozen=True)
class Regressor:
    """Y in three parts that add up, each ``(n, na, nb, 10)``; bodies as `bodies` names them."""

    bodies: tuple[str, ...]
    weight: FloatArray
    acceleration: FloatArray
    velocity: FloatArray

    @property
    def matrix(self) -> FloatArray:
        """The whole Y, ``(n, na, 10 nb)``."""
        whole = self.weight + self.acceleration + self.velocity
        return whole.reshape(*whole.shape[:2], -1)


def inertial_regressor(reference: MujocoReference, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Regressor:
    """Evaluate Y.

    Parameters
    ----------
    reference
        The robot; its masses do not matter, its gravity does.
    q, qd, qdd
        Actuated motion, ``(n, na)`` each, SI.

    Raises
    ------
    ParameterError
        More actuators than freedoms.
    MotionError, ArrayError
        As `MujocoReference.inverse_dynamics`.
    """
    q, qd, qdd = as_batches(len(reference.joint_names), q=q, qd=qd, qdd=qdd)
    moving = body_motion(reference, q, qd, qdd, centres=False)
    pulls = felt_gravity(reference.compiled())[1:]

    def local(vector: FloatArray) -> FloatArray:
        turned: FloatArray = np.einsum("nbji,nbj...->nbi...", moving.axes, vector)
        return turned

    linear, angular, spin = local(moving.linear), local(moving.angular), local(moving.spin)
    still = np.zeros_like(spin)
    hanging = local(np.broadcast_to(-pulls, spin.shape))
    parts = (
        _columns(linear, angular, hanging, still, still),
        _columns(linear, angular, local(moving.linear_driven), local(moving.angular_driven), still),
        _columns(linear, angular, local(moving.linear_carried), local(moving.angular_carried), spin),
    )
    return Regressor(moving.names, *parts)


def inertial_numbers(model: mujoco.MjModel) -> FloatArray:
    """The ten numbers of every body but the world, ``(nb, 10)``, from a compiled model."""
    numbers = np.zeros((model.nbody - 1, len(NUMBERS)))
    for body in range(1, model.nbody):
        mass, centre = float(model.body_mass[body]), np.asarray(model.body_ipos[body])
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.body_iquat[body])
        frame = turn.reshape(3, 3)
        tensor = frame @ np.diag(model.body_inertia[body]) @ frame.T
        tensor = tensor + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        numbers[body - 1] = [mass, *(mass * centre), *(tensor[pair] for pair in PAIRS)]
    return numbers


def _columns(
    linear: FloatArray, angular: FloatArray, acceleration: FloatArray, turning: FloatArray, spin: FloatArray
) -> FloatArray:
    """Torques ``(n, na, nb, 10)`` per number, all vectors in body frames.

    Force m a + alpha x mc + omega x (omega x mc), moment about the origin I alpha + omega x I omega + mc x a.
    """
    n, nb = acceleration.shape[:2]
    force, moment = np.zeros((2, n, nb, 3, 10))
    force[..., 0] = acceleration
    for axis in range(3):
        unit = np.zeros_like(spin)
        unit[..., axis] = 1.0
        force[..., 1 + axis] = np.cross(turning, unit) + np.cross(spin, np.cross(spin, unit))
        moment[..., 1 + axis] = np.cross(unit, acceleration)
    for number, (row, column) in enumerate(PAIRS):
        tensor = np.zeros((3, 3))
        tensor[row, column] = tensor[column, row] = 1.0
        moment[..., 4 + number] = turning @ tensor + np.cross(spin, spin @ tensor)
    found: FloatArray = np.einsum("nbca,nbck->nabk", linear, force) + np.einsum("nbca,nbck->nabk", angular, moment)
    return found
