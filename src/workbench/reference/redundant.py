"""More actuators than freedoms: of all torques that produce the motion, those of least norm.

Torques that only strain the mechanism against itself do no work and move nothing. They are the columns of
``J_a^T N``, with N a basis of the multipliers that the passive freedoms do not feel (``J_p^T N = 0``). The reference
gives the torques that hold no such part: least ``sum tau^2``, newtons and newton-metres counted alike.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray
from workbench.dry_friction import direction
from workbench.errors import MotionError
from workbench.reference.structure import Structure

if TYPE_CHECKING:
    from workbench.reference.continuation import Assembly
    from workbench.reference.mujoco_reference import MujocoReference
    from workbench.reference.result import ReferenceResult

RANK_TOLERANCE = 1e-10
"""A singular value below this fraction of the largest counts as zero."""

CONSISTENT = 1e-9
"""rad or m, and times the speed: how far an excess actuator may be from where the others put it."""


def left_null_space(matrix: FloatArray) -> FloatArray:
    """Orthonormal basis ``(m, k)`` of all y with ``y^T matrix = 0``."""
    u, values, _ = np.linalg.svd(matrix, full_matrices=True)
    rank = int(np.count_nonzero(values > RANK_TOLERANCE * values.max(initial=0.0)))
    basis: FloatArray = u[:, rank:]
    return basis


def self_stress(jacobian: FloatArray, passive: np.ndarray, actuated: np.ndarray) -> tuple[FloatArray, FloatArray]:
    """Multipliers that the passive freedoms do not feel ``(m, k)``, and the torques that answer them ``(na, k)``."""
    free = left_null_space(jacobian[:, passive])
    return free, jacobian[:, actuated].T @ free


def excess_actuators(jacobian: FloatArray, passive: np.ndarray, actuated: np.ndarray) -> int:
    """Number of actuators beyond the freedoms: how many independent torques strain the mechanism against itself."""
    if not len(jacobian):
        return 0
    scale = max(float(np.abs(jacobian).max()), 1e-300)
    return int(np.linalg.matrix_rank(self_stress(jacobian, passive, actuated)[1], tol=1e-9 * scale))


def leading(structure: Structure, jacobian: FloatArray, rank: int) -> tuple[np.ndarray, Structure]:
    """Choose as many actuators as there are freedoms, those that determine the rest best.

    Parameters
    ----------
    structure
        Tables of a mechanism with excess actuators.
    jacobian
        Constraint Jacobian ``(m, nv)`` at home.
    rank
        Its rank.

    Returns
    -------
    numpy.ndarray, Structure
        Their places among the actuated joints, and the tables in which the other actuated joints are passive.
    """
    motions = np.linalg.svd(jacobian, full_matrices=True)[2][rank:]
    from scipy.linalg import qr  # few robots have actuators in excess

    order = qr(motions[:, structure.actuated], pivoting=True, mode="r")[1]
    chosen = np.sort(order[: len(motions)])
    actuated = structure.actuated[chosen]
    passive = np.setdiff1d(np.arange(jacobian.shape[1]), actuated)
    columns = np.full(jacobian.shape[1], -1, dtype=np.int64)
    columns[passive] = np.arange(len(passive))
    tables = dataclasses.replace(
        structure,
        actuated=actuated,
        actuated_qpos=structure.actuated_qpos[chosen],
        friction=dataclasses.replace(structure.friction, actuated=structure.friction.actuated[chosen]),
        passive=passive,
        joint_names=tuple(structure.joint_names[i] for i in chosen),
        columns=columns,
    )
    return chosen, tables


def refuse_inconsistent(
    what: str, given: FloatArray, follows: FloatArray, names: tuple[str, ...], tolerance: FloatArray | float
) -> None:
    """Refuse coordinates or rates ``(n, na)`` of excess actuators that do not follow from those of the others.

    Raises
    ------
    MotionError
        Naming the first such sample, the joint, its value and what it would have to be.
    """
    bad = ~(np.abs(given - follows) <= tolerance)
    if bad.any():
        sample, joint = np.argwhere(bad)[0]
        raise MotionError(
            f"sample {sample}, joint {names[joint]}: {what} = {given[sample, joint]:.9g}; there are more actuators than"
            f" freedoms, and the others make it {follows[sample, joint]:.9g}",
            sample=int(sample),
            joint=names[joint],
            value=float(given[sample, joint]),
        )


def shared(
    leader: MujocoReference,
    columns: np.ndarray,
    structure: Structure,
    q: FloatArray,
    qd: FloatArray,
    qdd: FloatArray,
    mass_model: str,
    external_force: ArrayLike | None,
    along: ArrayLike | None = None,
    near: ArrayLike | Assembly | None = None,
) -> ReferenceResult:
    """Inverse dynamics of excess actuators: the leading ones give motion and power, all of them share the load.

    With A = dqd/dqd_lead, torques that do the same work fulfil ``A^T tau = tau_lead``; those of least norm are
    ``pinv(A^T) tau_lead``. Dry friction of an excess actuator's joint is its own business, as that of a leading one is.
    Reactions depend on how the load is shared; they are left out.

    Raises
    ------
    MotionError
        Positions, rates or accelerations that do not fit together.
    """
    lead = q[:, columns], qd[:, columns], qdd[:, columns]
    found = leader.inverse_dynamics(*lead, mass_model, external_force, along=along, near=near)
    names = structure.joint_names
    speed = 1.0 + np.abs(qd).max(axis=1, keepdims=True)
    refuse_inconsistent("q", q, found.qpos[:, structure.actuated_qpos], names, CONSISTENT)
    refuse_inconsistent("qd", qd, found.qvel[:, structure.actuated], names, CONSISTENT * speed)
    rise = speed**2 + np.abs(qdd).max(axis=1, keepdims=True)
    refuse_inconsistent("qdd", qdd, found.qacc[:, structure.actuated], names, CONSISTENT * rise)
    dry = structure.friction.actuated * direction(qd)
    per_lead = leader.tangent(q[:, columns], along is not None, near)[:, structure.actuated]
    work = found.tau - dry[:, columns]
    tau = np.matmul(np.linalg.pinv(per_lead.transpose(0, 2, 1)), work[:, :, None])[:, :, 0] + dry
    slack = np.matmul(np.abs(np.linalg.pinv(per_lead.transpose(0, 2, 1))), found.slack[:, :, None])[:, :, 0]
    return dataclasses.replace(found, tau=tau, reactions={}, slack=slack)
