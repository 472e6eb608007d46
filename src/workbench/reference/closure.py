"""Close the loops: from actuated coordinates to the full configuration, always on the home assembly branch.

Samples need not form a trajectory. Each is reached from a configuration that is known to be on the branch (the home
pose, or a sample closed before) along a straight line in the actuated coordinates; a step counts only if the correction
after it is small against the step itself, so that it cannot jump to another branch. What cannot be reached is an error
that names the sample, never a result.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError, MotionError
from workbench.reference.engine import Engine
from workbench.reference.kernels import closure_steps, integrate, rows_sample
from workbench.reference.structure import Structure

CLOSED = 1e-13
"""Largest residual of a closed loop, metres (for turns: radians)."""

CORRECTION = 0.1
"""A continuation step is accepted when Newton moves the configuration by less than this fraction of the step."""

LONGEST_STEP = 0.2
"""rad or m, over all joints: a longer step can land on another branch and still look like a good one."""

NEGLIGIBLE = 1e-7
"""Corrections below this (rad, m) are accepted whatever the step: they are rounding, not another branch."""

SMALLEST_STEP = 1e-6
"""Fraction of the way from the start to a sample; a smaller step means that the way is blocked."""

NEWTON_STEPS = 8
ASTRAY = 1e3
"""A residual (m) from which Newton does not come back."""

FREE_STEPS = 60
LONGEST_FREE_STEP = 0.2
"""rad or m: damped, so that an open home pose closes on the branch that it is nearest to."""

SEED_SPACING = 24
"""One sample in so many is reached from the home pose; the others start from the nearest of those."""


@dataclass(frozen=True)
class Assembly:
    """Closed configurations ``(n, nq)`` and their residuals ``(n,)`` in metres."""

    qpos: FloatArray
    residual: FloatArray


class LoopCloser:
    """Closes the loops of one model."""

    def __init__(self, engine: Engine, structure: Structure) -> None:
        self.engine = engine
        self.structure = structure
        model = engine.model
        ball = mujoco.mjtJoint.mjJNT_BALL.value
        self.joints = (
            (np.asarray(model.jnt_type) == ball).astype(np.int64),
            np.asarray(model.jnt_qposadr).astype(np.int64),
            np.asarray(model.jnt_dofadr).astype(np.int64),
        )
        home = structure.home_qpos[None, :]
        q_home = home[:, structure.actuated_qpos]
        closed, done, residual = self._newton(home.copy(), q_home, np.zeros(1, dtype=np.int64))
        if not done[0]:
            # edited lengths can put the file's home pose out of reach: move the actuated joints too, but little
            closed, residual = self._close_freely(home.copy())
            if not residual[0] <= CLOSED:
                raise ModelError(
                    f"{structure.file}: the loops cannot be closed from the home pose; {self._worst_block(closed)}"
                    f" stays open by {residual[0]:.3g} m (allowed: {CLOSED:g})",
                    file=structure.file,
                    value=float(residual[0]),
                )
        self.home = closed[0]

    def close(self, q: FloatArray) -> Assembly:
        """Close the loops for actuated coordinates ``(n, na)``, SI, any order of samples.

        Raises
        ------
        MotionError
            Naming the first sample that cannot be reached on the home branch, its coordinates and the open loop.
        """
        n = len(q)
        qpos = np.tile(self.home, (n, 1))
        residual = np.full(n, np.inf)
        seeds = np.arange(0, n, SEED_SPACING)
        if len(seeds):
            qpos[seeds], residual[seeds] = self._reach(q[seeds], np.tile(self.home, (len(seeds), 1)), seeds)
        others = np.setdiff1d(np.arange(n), seeds)
        if len(others):
            scale = np.maximum(np.ptp(q, axis=0), 1e-9)
            nearest = _nearest(q[others] / scale, q[seeds] / scale)
            qpos[others], residual[others] = self._reach(q[others], qpos[seeds[nearest]], others)
        return Assembly(qpos, residual)

    def _reach(self, target: FloatArray, start: FloatArray, names: np.ndarray) -> tuple[FloatArray, FloatArray]:
        """Continuation from *start* configurations to *target* actuated coordinates."""
        structure = self.structure
        n = len(target)
        qpos = start.copy()
        residual = np.zeros(n)
        origin = start[:, structure.actuated_qpos]
        done = np.zeros(n)
        step = np.ones(n)
        active = np.arange(n)
        while len(active):
            here, way = qpos[active], target[active] - origin[active]
            part = np.minimum(step[active], 1.0 - done[active])
            change = way * part[:, None]
            aim = np.where(
                (done[active] + part >= 1.0)[:, None],
                target[active],
                origin[active] + way * (done[active] + part)[:, None],
            )
            predicted, moved = self._step(here, change)
            predicted[:, structure.actuated_qpos] = aim
            closed, success, error = self._newton(predicted, aim, np.arange(len(active)))
            correction = self._distance(closed, predicted)
            small = correction <= np.maximum(CORRECTION * moved, NEGLIGIBLE)
            accepted = success & small & (moved <= LONGEST_STEP)
            moving = active[accepted]
            qpos[moving] = closed[accepted]
            residual[moving] = error[accepted]
            done[moving] += part[accepted]
            step[moving] *= 2.0
            refused = active[~accepted]
            step[refused] = 0.5 * part[~accepted]
            stuck = refused[step[refused] < SMALLEST_STEP]
            if len(stuck):
                self._refuse(int(names[stuck[0]]), target[stuck[0]], qpos[stuck[0]])
            active = active[(done[active] < 1.0)]
        return qpos, residual

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
            integrate(qpos[0].copy(), step, *self.joints, qpos[0])
        return qpos, residual

    def _step(self, qpos: FloatArray, change: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Tangent predictor: configurations after a change of the actuated coordinates, and the distance moved."""
        steps, _, _ = self._linear(qpos, change, np.arange(len(qpos)))
        out = np.empty_like(qpos)
        for i in range(len(qpos)):
            integrate(qpos[i], steps[i], *self.joints, out[i])
        return out, np.sqrt(np.sum(steps**2, axis=1))

    def _newton(self, qpos: FloatArray, q: FloatArray, ids: np.ndarray) -> tuple[FloatArray, np.ndarray, FloatArray]:
        """Newton on the passive joints; returns configurations, success and residuals."""
        qpos = qpos.copy()
        qpos[:, self.structure.actuated_qpos] = q
        still = np.zeros((len(qpos), len(self.structure.actuated)))
        residual = np.full(len(qpos), np.inf)
        best = residual.copy()
        kept = qpos.copy()
        active = ids
        for _ in range(NEWTON_STEPS):
            steps, now, _ = self._linear(qpos, still, active)
            residual[active] = now[active]
            better = active[residual[active] < best[active]]
            kept[better] = qpos[better]
            best[better] = residual[better]
            # a closed sample gets one more step, which takes it to the floor of rounding; then it stays
            active = active[
                (residual[active] > 0.01 * CLOSED) & (residual[active] < ASTRAY) & (residual[active] <= best[active])
            ]
            if not len(active):
                break
            for i in active:
                integrate(qpos[i].copy(), steps[i], *self.joints, qpos[i])
        return kept, best <= CLOSED, best

    def _linear(
        self, qpos: FloatArray, change: FloatArray, ids: np.ndarray
    ) -> tuple[FloatArray, FloatArray, np.ndarray]:
        structure = self.structure
        n = len(qpos)
        steps, residuals, ranks = np.zeros((n, self.engine.model.nv)), np.full(n, np.inf), np.zeros(n, dtype=np.int64)
        poses = self.engine.poses(qpos, None if len(ids) == n else ids)
        closure_steps(
            ids, poses.cdof, poses.com, structure.moves, structure.root, structure.blocks, structure.block_rows,
            structure.polynomials, poses.site_xpos, poses.site_xquat, poses.anchors, qpos, self.joints,
            structure.passive, structure.actuated, change, steps, residuals, ranks,
        )  # fmt: skip
        return steps, residuals, ranks

    def _distance(self, one: FloatArray, two: FloatArray) -> FloatArray:
        difference: FloatArray = np.sqrt(np.sum((one - two) ** 2, axis=1))
        return difference

    def _refuse(self, sample: int, q: FloatArray, nearest: FloatArray) -> None:
        reached = nearest[self.structure.actuated_qpos]
        joint = int(np.argmax(np.abs(q - reached)))
        shown = ", ".join(f"{name} = {value:.6g}" for name, value in zip(self.structure.joint_names, q, strict=True))
        raise MotionError(
            f"sample {sample}, joint {self.structure.joint_names[joint]}: the loops cannot be closed at {shown}; the"
            f" way from the home pose ends at {reached[joint]:.6g}",
            sample=sample,
            joint=self.structure.joint_names[joint],
            value=q.tolist(),
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
    poses = engine.poses(qpos)
    jacobian, residual = np.zeros((structure.rows, poses.cdof.shape[1])), np.zeros(structure.rows)
    rows_sample(
        poses.cdof[0], poses.com[0], structure.moves, structure.root, structure.blocks, structure.block_rows,
        structure.polynomials, poses.site_xpos[0], poses.site_xquat[0], poses.anchors[0], qpos[0][joints[1]], joints[2],
        jacobian, residual,
    )  # fmt: skip
    return jacobian, residual


def _nearest(points: FloatArray, seeds: FloatArray) -> np.ndarray:
    """Index of the nearest seed for each point; a tree, so that memory stays linear in the number of samples."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(seeds).query(points)[1])
