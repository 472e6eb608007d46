"""Close the loops: from actuated coordinates to the full configuration, always on the home assembly branch.

How samples are reached, and what keeps them on the branch, stands in `workbench.reference.continuation`.
"""

from __future__ import annotations

import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError, MotionError
from workbench.reference.along import OrderedClosure
from workbench.reference.continuation import ASTRAY, CLOSED, NEWTON_STEPS, Assembly
from workbench.reference.engine import Engine, Evaluator
from workbench.reference.kernels import integrate, newton_step
from workbench.reference.rows import constraint_rows
from workbench.reference.structure import Structure
from workbench.reference.tables import tables_of

FREE_STEPS = 60
LONGEST_FREE_STEP = 0.2
"""rad or m: damped, so that an open home pose closes on the branch that it is nearest to."""


class LoopCloser(OrderedClosure):
    """Closes the loops of one model."""

    def __init__(self, engine: Engine, structure: Structure) -> None:
        super().__init__(engine, structure)
        home = structure.home_qpos[None, :].copy()
        found = self._newton_alone(home, home[:, structure.actuated_qpos])
        if not found.residual[0] <= CLOSED:
            # edited lengths can put the file's home pose out of reach: move the actuated joints too, but little
            closed, residual = self._close_freely(home.copy())
            if not residual[0] <= CLOSED:
                raise ModelError(
                    f"{structure.file}: the loops cannot be closed from the home pose; {self._worst_block(closed)}"
                    f" stays open by {residual[0]:.3g} m (allowed: {CLOSED:g})",
                    file=structure.file,
                    value=float(residual[0]),
                )
            found = self._newton_alone(closed, closed[:, structure.actuated_qpos])
        self._home = found
        self.home = found.qpos[0]
        self.start = self.home[structure.actuated_qpos]

    def close(self, q: FloatArray) -> Assembly:
        """Close the loops for actuated coordinates ``(n, na)``, SI, any order of samples.

        Raises
        ------
        MotionError
            Naming the first sample that cannot be reached on the home branch, its coordinates and the open loop.
        """
        return self.follow(q)

    def jacobian(self, qpos: FloatArray) -> FloatArray:
        """Constraint Jacobian ``(m, nv)`` of one configuration ``(nq,)``."""
        return constraint_jacobian(self.engine, self.structure, self.joints, qpos[None, :])[0]

    def jacobian_near_home(self, way: FloatArray) -> FloatArray:
        """Constraint Jacobian of the closed pose that is nearest to home moved by a velocity ``(nv,)``."""
        moved = np.empty_like(self.home)
        integrate(self.home, way, self.joints, moved)
        return self.jacobian(self._close_freely(moved[None, :])[0][0])

    def _close_freely(self, qpos: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Close one configuration ``(1, nq)`` by least-norm Newton steps on all joints, the actuated ones included."""
        structure = self.structure
        residual = np.full(1, np.inf)
        for _ in range(FREE_STEPS):
            jacobian, open_by = constraint_jacobian(self.engine, structure, self.joints, qpos)
            residual = np.abs(open_by).max(keepdims=True)
            if residual[0] <= 0.01 * CLOSED or not np.isfinite(residual[0]):
                break
            step = -np.linalg.lstsq(jacobian, open_by, rcond=1e-9)[0]
            step *= min(1.0, LONGEST_FREE_STEP / max(float(np.linalg.norm(step)), 1e-300))
            integrate(qpos[0], step, self.joints, qpos[0])
        return qpos, residual

    def _newton(self, evaluator: Evaluator, start: FloatArray, aim: FloatArray) -> Assembly:
        """Newton on the passive joints of up to a block of configurations; the actuated coordinates stay."""
        count = len(start)
        start[:, self.structure.actuated_qpos] = aim
        found = self._nothing(count, aim.shape[1])
        qpos = evaluator.qpos
        qpos[:count] = start
        # the floor: a closed sample gets one more step, which takes it to rounding; then it stays
        limits = (CLOSED, 0.01 * CLOSED, ASTRAY)
        active = np.arange(count)
        for _ in range(NEWTON_STEPS):
            poses = evaluator.place(active)
            active = newton_step(
                active, self.tables.closures, self.joints, self.tables.split, poses.tables, limits, qpos, found.qpos,
                found.residual, found.tangent, found.rank, found.condition, found.weakest,
            )  # fmt: skip
            if not len(active):
                break
        return found

    def _refuse(self, sample: int, target: FloatArray, reached: FloatArray, there: Assembly) -> None:
        joint = int(np.argmax(np.abs(target - reached)))
        shown = ", ".join(
            f"{name} = {value:.6g}" for name, value in zip(self.structure.joint_names, target, strict=True)
        )
        raise MotionError(
            f"sample {sample}, joint {self.structure.joint_names[joint]}: the loops cannot be closed at {shown}; the"
            f" way from the home pose ends at {reached[joint]:.6g}",
            sample=sample,
            joint=self.structure.joint_names[joint],
            value=target.tolist(),
            reached=reached.tolist(),
        )

    def _worst_block(self, qpos: FloatArray) -> str:
        structure = self.structure
        poses = self.engine.poses(qpos)
        gaps = [
            float(np.linalg.norm(poses.site_xpos[0, b[3]] - poses.site_xpos[0, b[4]])) if b[0] < 2 else 0.0
            for b in structure.blocks
        ]
        return f'equality "{structure.block_names[int(np.argmax(gaps))]}"' if gaps else "the model"


def constraint_jacobian(
    engine: Engine, structure: Structure, joints: tuple[np.ndarray, ...], qpos: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Constraint Jacobian ``(m, nv)``, spin rows last, and residual ``(m,)`` of one configuration ``(1, nq)``."""
    poses, tables = engine.poses(qpos), tables_of(engine.model, structure)
    jacobian, residual = np.zeros((structure.rows, poses.cdof.shape[1])), np.zeros(structure.rows)
    constraint_rows(tables.closures, tables.joints, qpos[0], *(array[0] for array in poses.tables), jacobian, residual)
    return jacobian, residual
