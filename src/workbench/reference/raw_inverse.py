"""What `mj_inverse` returns for a closed chain as it comes: a warning in numbers, never a reference.

MuJoCo's equality constraints are soft. In its inverse problem their force is ``(aref - J qacc - Jdot qvel) / R`` with a
small regularisation R. A motion that closes the loops exactly makes the numerator zero but for rounding, so the forces
that the loops really carry are absent from the result; in the rigid limit they are 0/0. What is left at the actuated
joints are the torques of open branches, each of which carries its own bodies alone, and rounding over R.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray, as_batches, as_force
from workbench.reference.mujoco_reference import MujocoReference
from workbench.reference.result import ReferenceResult


def raw_mj_inverse(
    reference: MujocoReference,
    q: ArrayLike,
    qd: ArrayLike,
    qdd: ArrayLike,
    mass_model: str = "distributed",
    external_force: ArrayLike | None = None,
    along: ArrayLike | None = None,
    *,
    known: ReferenceResult | None = None,
) -> FloatArray:
    """`qfrc_inverse` at the actuated joints, on the exactly closed motion, without projection.

    Parameters
    ----------
    reference
        The robot; it closes the loops, so that position, velocity and acceleration handed to MuJoCo are exact.
    q, qd, qdd
        Actuated position, velocity, acceleration, each ``(n, na)``, SI.
    mass_model
        ``"distributed"`` or ``"lumped"``.
    external_force
        Newtons, paper frame, on the platform: ``(3,)`` or ``(n, 3)``. What it does at the actuated joints is taken off.
    along
        Times ``(n,)`` of samples that are one motion, as for `MujocoReference.inverse_dynamics`.
    known
        What `MujocoReference.inverse_dynamics` gives for this motion, where it is at hand.

    Returns
    -------
    numpy.ndarray
        ``(n, na)``, N and N m; over the paper's motions about as far from the truth as zero is.

    Raises
    ------
    MotionError
        As `MujocoReference.inverse_dynamics`.
    """
    structure = reference.structure
    q, qd, qdd = as_batches(len(structure.actuated), q=q, qd=qd, qdd=qdd)
    force = as_force("external_force", external_force, len(q)) @ reference.base_rotation.T
    motion = known or reference.inverse_dynamics(q, qd, qdd, mass_model, along=along)
    model = reference.compiled(mass_model)
    data = mujoco.MjData(model)
    point = np.zeros((3, model.nv))
    tau = np.zeros_like(q)
    for sample in range(len(q)):
        data.qpos[:] = motion.qpos[sample]
        data.qvel[:] = motion.qvel[sample]
        data.qacc[:] = motion.qacc[sample]
        mujoco.mj_inverse(model, data)
        mujoco.mj_jacSite(model, data, point, None, structure.platform_site)
        tau[sample] = (data.qfrc_inverse - force[sample] @ point)[structure.actuated]
    return tau
