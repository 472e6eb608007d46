"""An oracle for real files: MuJoCo's own constraint Jacobian, dense, and nothing of the workbench's reference.

At a pose and velocity of the user's own compiled file, with J the rows of ``efc_J`` that belong to equalities and N a
basis of its null space, accelerations and torques follow from one linear system: ``J a = -Jdot v`` (Jdot by central
differences of J), ``a`` at the driven joints as asked, and ``N^T (M a + bias - passive + dry friction) = N^T B tau``.
Freedoms that nothing drives (spins of rods between two spherical joints) either rest, as the reference has them (one
more row for each: its body's spin about the axis that the null space shows), or move as they would; for a rod that is
alike all around both give the same torques.
"""

from __future__ import annotations

import copy

import mujoco
import numpy as np

STEP = 2e-3
LOOSE = 1e-9
AT_REST = 1e-10
"""speed below which dry friction does not show, of the fastest joint"""


class DenseOracle:
    """Torques of one file, sample by sample."""

    def __init__(self, model: mujoco.MjModel, driven: list[str], still: list[str], spins_rest: bool) -> None:
        self.model = copy.copy(model)
        flags = mujoco.mjtDisableBit
        option = self.model.opt
        option.disableflags |= flags.mjDSBL_CONTACT | flags.mjDSBL_LIMIT | flags.mjDSBL_FRICTIONLOSS
        option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        option.enableflags &= ~mujoco.mjtEnableBit.mjENBL_SLEEP.value
        self.data = mujoco.MjData(self.model)
        held: list[int] = []
        for body in still:
            first = self.model.body(body).dofadr[0]
            held += range(first, first + 6)
        self.moving = np.setdiff1d(np.arange(self.model.nv), held)
        dofs = [int(self.model.joint(name).dofadr[0]) for name in driven]
        self.driven = np.searchsorted(self.moving, dofs)
        self.spins_rest = spins_rest
        self.axes: list[tuple[int, np.ndarray]] = []

    def _jacobian(self, qpos: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        model, data = self.model, self.data
        data.qpos = qpos
        mujoco.mj_fwdPosition(model, data)
        rows = np.asarray(data.efc_type) == mujoco.mjtConstraint.mjCNSTR_EQUALITY.value
        whole = np.array(data.efc_J).reshape(-1)[: len(rows) * model.nv].reshape(-1, model.nv)
        loops = whole[rows][:, self.moving]
        spins = self._spins(loops) if self.spins_rest else []
        return np.vstack([loops, *spins]) if spins else loops, np.array(data.efc_pos)[rows]

    def _spins(self, loops: np.ndarray) -> list[np.ndarray]:
        """Rows ``(1, n)``: spin of each body that turns in a motion in which all driven joints rest."""
        drive = np.zeros((len(self.driven), len(self.moving)))
        drive[np.arange(len(self.driven)), self.driven] = 1.0
        values, vectors = np.linalg.svd(np.vstack([loops, drive]), full_matrices=True)[1:]
        idle = vectors[int(np.count_nonzero(values > LOOSE * values.max())) :].T
        rows: list[np.ndarray] = []
        if not idle.shape[1]:
            return rows
        for body in range(1, self.model.nbody):
            turning = np.zeros((3, self.model.nv))
            mujoco.mj_jacBody(self.model, self.data, None, turning, body)
            turning = turning[:, self.moving]
            along, size, _ = np.linalg.svd(turning @ idle)
            if size[0] < 1e-6 or (len(size) > 1 and size[1] > 1e-6 * size[0]):
                continue
            known = next((axis for other, axis in self.axes if other == body), None)
            axis = along[:, 0] * (1.0 if known is None or known @ along[:, 0] > 0 else -1.0)
            if known is None:
                self.axes.append((body, axis))
            row = (axis @ turning)[None, :]
            if np.linalg.matrix_rank(np.vstack([*rows, row]) @ idle, tol=1e-6) > len(rows):
                rows.append(row)
        return rows

    def _shifted(self, qpos: np.ndarray, qvel: np.ndarray, time: float) -> np.ndarray:
        moved = np.array(qpos)
        mujoco.mj_integratePos(self.model, moved, qvel, time)
        return self._jacobian(moved)[0]

    def torques(self, qpos: np.ndarray, qvel: np.ndarray, qdd: np.ndarray) -> tuple[np.ndarray, float, float]:
        """Torques ``(na,)``, how far the loops are open, and by how much the velocity breaks them."""
        model, data, moving = self.model, self.data, self.moving
        fast = max(float(np.abs(qvel).max()), 1e-12)
        h = STEP / fast
        sides = [self._shifted(qpos, qvel, k * h) for k in (-2, -1, 1, 2)]
        jacobian, position = self._jacobian(qpos)
        rate = (sides[0] - 8 * sides[1] + 8 * sides[2] - sides[3]) / (12 * h)
        data.qvel = qvel
        mujoco.mj_fwdVelocity(model, data)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        mass = mass[np.ix_(moving, moving)]
        v = qvel[moving]
        dry = np.array(model.dof_frictionloss) * np.sign(qvel) * (np.abs(qvel) > AT_REST * fast)
        if model.ntendon:
            tendon = np.zeros((model.ntendon, model.nv))
            mujoco.mju_sparse2dense(
                tendon, np.asarray(data.ten_J).reshape(-1), model.ten_J_rownnz, model.ten_J_rowadr, model.ten_J_colind
            )
            slip = np.sign(tendon @ qvel) * (np.abs(tendon @ qvel) > AT_REST * fast)
            dry += tendon.T @ (np.array(model.tendon_frictionloss) * slip)
        load = (data.qfrc_bias - data.qfrc_passive + dry)[moving]
        if len(jacobian):
            values, vectors = np.linalg.svd(jacobian, full_matrices=True)[1:]
            null = vectors[int(np.count_nonzero(values > LOOSE * values.max(initial=0.0))) :].T
            particular = -np.linalg.lstsq(jacobian, rate @ v, rcond=LOOSE)[0]
        else:
            null, particular = np.eye(len(moving)), np.zeros(len(moving))
        drive = null[self.driven]
        free, count = null.shape[1], len(self.driven)
        system = np.zeros((free + count, free + count))
        system[:free, :free] = null.T @ mass @ null
        system[:free, free:] = -drive.T
        system[free:, :free] = drive
        right = np.concatenate([-null.T @ (mass @ particular + load), qdd - particular[self.driven]])
        # rows of unlike size: light robots have masses of 1e-6 kg m^2
        scale = np.concatenate([1.0 / np.maximum(np.abs(system[:free]).max(axis=1), 1e-12), np.ones(count)])
        solved = np.linalg.lstsq(system * scale[:, None], right * scale, rcond=1e-13)[0]
        opened = float(np.abs(position).max(initial=0.0))
        return solved[free:], opened, float(np.abs(jacobian @ v).max(initial=0.0)) / fast
