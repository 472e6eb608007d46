"""Inverse dynamics of closed chains by MuJoCo's own constraint Jacobian and dense null spaces: an oracle.

It shares no code with the reference. Of MuJoCo it takes `efc_J` of the equalities in force, mass matrix, bias and
passive forces; velocities of closed motions come from the null space by singular values, the rate of the Jacobian from
differences of `efc_J` along the motion. A spin that nothing feels is recognised as a motion of the null space in which
no actuated joint moves; it is held at zero where it turns one body about its own axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

RANK = 1e-8
STEP = 1e-4
"""s: differences of the Jacobian, fourth order, along the motion."""


@dataclass(frozen=True)
class Found:
    """One sample."""

    tau: np.ndarray
    qpos: np.ndarray
    qvel: np.ndarray
    qacc: np.ndarray
    idle: int
    """motions of the null space with all actuated joints at rest"""


class NullSpaceOracle:
    """One model; the actuated joints are named.

    Parameters
    ----------
    text
        MJCF; contacts and limits are switched off here.
    actuated
        Names of hinge and slide joints.
    spins
        Rods that may turn idly: body, and the two ends of its axis, each as (body, position in it).
    spoil
        A fault that is planted on purpose, for twins of tests: ``"rate"`` leaves the Jacobian's rate out,
        ``"friction"`` the dry friction of passive joints.
    """

    def __init__(
        self,
        text: str,
        actuated: list[str],
        spins: list[tuple[str, tuple[str, list[float]], tuple[str, list[float]]]] | None = None,
        spoil: str = "",
    ) -> None:
        spec = mujoco.MjSpec.from_string(text)
        flags = mujoco.mjtDisableBit
        spec.option.disableflags |= flags.mjDSBL_CONTACT.value | flags.mjDSBL_LIMIT.value
        spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.spins = spins or []
        self.spoil = spoil
        joints = [self.model.joint(name).id for name in actuated]
        self.dofs = [int(self.model.jnt_dofadr[j]) for j in joints]
        self.adrs = [int(self.model.jnt_qposadr[j]) for j in joints]
        self.passive = [d for d in range(self.model.nv) if d not in self.dofs]

    def rows(self, qpos: np.ndarray, qvel: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Equality rows ``(m, nv)`` and their residuals, spins of rods last; kinematics stay in ``data``."""
        model, data = self.model, self.data
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        equality = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY.value
        jacobian = np.array(data.efc_J).reshape(-1, model.nv)[equality]
        residual = np.array(data.efc_pos)[equality]
        extra = []
        for body, near, far in self.spins:
            turn = np.zeros((3, model.nv))
            mujoco.mj_jacBody(model, data, None, turn, model.body(body).id)
            ends = [data.xpos[model.body(b).id] + data.xmat[model.body(b).id].reshape(3, 3) @ p for b, p in (near, far)]
            extra.append((ends[1] - ends[0]) @ turn)
        if extra:
            jacobian = np.vstack([jacobian, *extra])
            residual = np.concatenate([residual, np.zeros(len(extra))])
        return jacobian, residual

    def close(self, qpos: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Newton on the passive joints at actuated coordinates *q*, from a pose nearby."""
        qpos = np.array(qpos)
        start, zero = qpos[self.adrs].copy(), np.zeros(self.model.nv)
        for part in np.linspace(0.0, 1.0, 21)[1:]:
            qpos[self.adrs] = start + part * (q - start)
            for _ in range(12):
                jacobian, residual = self.rows(qpos, zero)
                step = np.zeros(self.model.nv)
                step[self.passive] = -np.linalg.lstsq(jacobian[:, self.passive], residual, rcond=RANK)[0]
                mujoco.mj_integratePos(self.model, qpos, step, 1.0)
                if np.abs(step).max(initial=0.0) < 1e-14:
                    break
        return qpos

    def null_space(self, jacobian: np.ndarray) -> np.ndarray:
        """Velocities per actuated velocity ``(nv, na)`` with J W = 0, by the null space's basis."""
        values, vectors = np.linalg.svd(jacobian, full_matrices=True)[1:]
        rank = int(np.count_nonzero(values > RANK * max(values, default=1.0)))
        basis = vectors[rank:].T
        return basis @ np.linalg.pinv(basis[self.dofs], rcond=RANK)

    def inverse_dynamics(
        self, qpos: np.ndarray, qd: np.ndarray, qdd: np.ndarray, site: str, force: np.ndarray
    ) -> Found:
        """Torques of one sample at a closed pose; *force* acts on the site, world frame."""
        model, data = self.model, self.data
        jacobian, _ = self.rows(qpos, np.zeros(model.nv))
        w = self.null_space(jacobian)
        qvel = w @ qd
        values = np.linalg.svd(jacobian, compute_uv=False)
        rank = int(np.count_nonzero(values > RANK * max(values, default=1.0)))
        drift = self.drift(qpos, qvel)
        qacc = w @ qdd
        jp = jacobian[:, self.passive]
        qacc[self.passive] += np.linalg.lstsq(jp, -drift, rcond=RANK)[0]
        self.rows(qpos, qvel)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        generalized = mass @ qacc + data.qfrc_bias - data.qfrc_passive
        point = np.zeros((3, model.nv))
        mujoco.mj_jacSite(model, data, point, None, model.site(site).id)
        generalized -= point.T @ force
        moving = np.where(np.abs(qvel) > 1e-9, np.sign(qvel), 0.0)
        dry = np.array(model.dof_frictionloss) * moving
        if self.spoil == "friction":
            dry[self.passive] = 0.0
        generalized += dry
        for tendon in np.flatnonzero(model.tendon_frictionloss):
            row = self.tendon_row(int(tendon), qpos)
            speed = row @ qvel
            generalized += row * model.tendon_frictionloss[tendon] * (np.sign(speed) if abs(speed) > 1e-9 else 0.0)
        return Found(w.T @ generalized, np.array(qpos), qvel, qacc, model.nv - rank - len(self.dofs))

    def tendon_row(self, tendon: int, qpos: np.ndarray) -> np.ndarray:
        """Length of a tendon per velocity ``(nv,)``; exact to rounding for fixed tendons, whose length is linear."""
        row = np.zeros(self.model.nv)
        for d in range(self.model.nv):
            lengths = []
            for sign in (0.5, -0.5):
                moved, unit = np.array(qpos), np.zeros(self.model.nv)
                unit[d] = sign
                mujoco.mj_integratePos(self.model, moved, unit, 1.0)
                self.data.qpos[:] = moved
                mujoco.mj_fwdPosition(self.model, self.data)
                lengths.append(float(self.data.ten_length[tendon]))
            row[d] = lengths[0] - lengths[1]
        return row

    def drift(self, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
        """Rate of the Jacobian times velocity ``(m,)``, by fourth-order differences along the velocity."""
        total = 0.0
        for weight, k in ((8.0, 1), (-8.0, -1), (-1.0, 2), (1.0, -2)):
            moved = np.array(qpos)
            mujoco.mj_integratePos(self.model, moved, qvel, k * STEP)
            total = total + weight * (self.rows(moved, qvel)[0] @ qvel)
        return np.asarray(total / (12.0 * STEP)) * (0.0 if self.spoil == "rate" else 1.0)
