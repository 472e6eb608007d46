"""Close the loops: from actuated coordinates to the full configuration, always on the home assembly branch.

Samples need not form a trajectory. Each is reached from a configuration that is known to be on the branch (the home
pose, or a sample closed before) along a straight line in the actuated coordinates; a step counts only if the correction
after it is small against the step itself, so that it cannot jump to another branch. What cannot be reached is an error
that names the sample, never a result.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError, MotionError
from workbench.reference.engine import Engine, Evaluator
from workbench.reference.kernels import integrate, newton_step, predict
from workbench.reference.rows import constraint_rows
from workbench.reference.structure import Structure
from workbench.reference.tables import tables_of
from workbench.reference.tolerance import KEY, RANK, tolerance_of

CORRECTION = 0.1
"""A continuation step is accepted when Newton moves the configuration by less than this fraction of the step."""

LONGEST_STEP = 0.2
"""rad or m, over all joints: a longer step can land on another branch and still look like a good one."""

ALMOST = 1.0 - 1e-9
"""Steps are cut to this part of the longest, so that rounding does not make them longer."""

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

SEED_SPACINGS = (576, 24, 1)
"""One sample in so many, each level reached from the nearest of the level before, the first from the home pose."""


@dataclass(frozen=True)
class Assembly:
    """Closed configurations of n samples and what is known of the loops there."""

    qpos: FloatArray
    """``(n, nq)``"""
    residual: FloatArray
    """``(n,)`` largest open loop coordinate, m (rad for turns)"""
    tangent: FloatArray
    """``(n, nv, na)`` velocities per unit actuated velocity"""
    rank: np.ndarray
    """``(n,)`` rank of the loop constraints on the passive freedoms"""
    condition: FloatArray
    """``(n,)`` estimate of their condition number"""
    weakest: np.ndarray
    """``(n,)`` velocity address of the freedom that they determine worst"""

    @staticmethod
    def empty(samples: int, nq: int, nv: int, actuated: int) -> Assembly:
        """Nothing closed yet."""
        return Assembly(
            qpos=np.zeros((samples, nq)),
            residual=np.full(samples, np.inf),
            tangent=np.zeros((samples, nv, actuated)),
            rank=np.zeros(samples, dtype=np.int64),
            condition=np.full(samples, np.inf),
            weakest=np.zeros(samples, dtype=np.int64),
        )

    def at(self, rows: np.ndarray | slice) -> Assembly:
        """Some of the samples; with a slice, views."""
        return Assembly(*(array[rows] for array in self._arrays()))

    def put(self, rows: np.ndarray, other: Assembly, chosen: np.ndarray | slice = slice(None)) -> None:
        """Overwrite *rows* by the *chosen* samples of another assembly."""
        for mine, others in zip(self._arrays(), other._arrays(), strict=True):
            mine[rows] = others[chosen]

    def _arrays(self) -> tuple[np.ndarray, ...]:
        return self.qpos, self.residual, self.tangent, self.rank, self.condition, self.weakest


class LoopCloser:
    """Closes the loops of one model."""

    def __init__(self, engine: Engine, structure: Structure) -> None:
        self.engine = engine
        self.structure = structure
        self.tables = tables_of(engine.model, structure)
        self.joints = self.tables.joints
        self.tolerance = tolerance_of(engine.model, structure.home_qpos, structure.file)
        # a step in metres counts by the robot's size, one in radians as it is
        self._weights = _weights(engine.model, self.tolerance.size)
        self._home = self._close_home(structure.home_qpos[None, :])
        self.home = self._home.qpos[0]

    def _close_home(self, home: FloatArray) -> Assembly:
        """Close the pose ``(1, nq)`` from which all others are reached."""
        found = self._newton_alone(home)
        if not found.residual[0] <= self.tolerance.closed:
            # edited lengths can put the file's home pose out of reach: move the actuated joints too, but little
            closed, residual = self._close_freely(home.copy())
            if self.tolerance.closed < residual <= self.tolerance.allowed:
                self._close_by_digits()
            elif not residual <= self.tolerance.closed:
                self._refuse_home(home, closed, residual)
            found = self._newton_alone(closed)
        if not self.tolerance.few_digits and self._locked(found.qpos[0]):
            # axes that are parallel to six digits only leave no freedom, where the robot that is meant has some
            self._close_by_digits()
            found = self._newton_alone(found.qpos)
        return found

    def _close_by_digits(self) -> None:
        self.tolerance = dataclasses.replace(self.tolerance, few_digits=True)

    def _locked(self, qpos: FloatArray) -> bool:
        """Whether the loops leave fewer freedoms than there are actuators, and more of them with fewer digits."""
        jacobian = self.jacobian(qpos)
        if not len(jacobian):
            return False
        values = np.linalg.svd(jacobian, compute_uv=False)
        freedoms = jacobian.shape[1]
        few = self.tolerance.allowed / self.tolerance.size
        strict, coarse = (freedoms - int(np.count_nonzero(values > limit * values[0])) for limit in (RANK, few))
        return bool(strict < min(coarse, len(self.structure.actuated)))

    def _refuse_home(self, home: FloatArray, closed: FloatArray, residual: float) -> None:
        """Describe the file as it is drawn, then how near the loops come to closing."""
        structure, allowed = self.structure, self.tolerance
        drawn = np.abs(constraint_jacobian(self.engine, structure, self.joints, home)[1])
        worst = int(np.searchsorted(structure.block_rows, int(np.argmax(drawn)), side="right")) - 1
        raise ModelError(
            f"{structure.file}: the loops cannot be closed from the home pose; equality"
            f' "{structure.block_names[worst]}" is open by {float(drawn.max()):.3g} m as drawn, and the nearest pose'
            f" leaves {residual:.3g} m (allowed: {allowed.closed:.3g}, or {allowed.allowed:.3g} for loops that agree"
            f' only to some digits; <text name="{KEY}"> sets the latter)',
            file=structure.file,
            element=structure.block_names[worst],
            value=residual,
            drawn=float(drawn.max()),
            qpos=closed[0].tolist(),
        )

    @property
    def at_home(self) -> Assembly:
        """The pose from which all others are reached, and what is known of it."""
        return self._home

    def jacobian(self, qpos: FloatArray) -> FloatArray:
        """Constraint Jacobian ``(m, nv)`` of one configuration ``(nq,)``."""
        return constraint_jacobian(self.engine, self.structure, self.joints, qpos[None, :])[0]

    def jacobian_near_home(self, way: FloatArray) -> FloatArray:
        """Constraint Jacobian of the closed pose that is nearest to home moved by a velocity ``(nv,)``."""
        moved = np.empty_like(self.home)
        integrate(self.home, way, self.joints, moved)
        return self.jacobian(self._close_freely(moved[None, :])[0][0])

    def close(self, q: FloatArray) -> Assembly:
        """Close the loops for actuated coordinates ``(n, na)``, SI, any order of samples.

        Raises
        ------
        MotionError
            Naming the first sample that cannot be reached on the home branch, its coordinates and the open loop.
        """
        n = len(q)
        found = self._nothing(n)
        known = np.zeros(0, dtype=np.int64)
        scale = np.maximum(np.ptp(q, axis=0), 1e-9) if n else np.ones(q.shape[1])
        for spacing in SEED_SPACINGS:
            wanted = np.setdiff1d(np.arange(0, n, spacing), known)
            if not len(wanted):
                continue
            if len(known):
                nearest = known[_nearest(q[wanted] / scale, q[known] / scale)]
                self._reach(q, wanted, found, nearest, found)
            else:
                self._reach(q, wanted, self._home, np.zeros(len(wanted), dtype=np.int64), found)
            known = np.union1d(known, wanted)
        return found

    def _reach(self, q: FloatArray, wanted: np.ndarray, known: Assembly, origins: np.ndarray, found: Assembly) -> None:
        """Continuation from rows *origins* of closed configurations to rows *wanted* of *q* and *found*."""

        def block(evaluator: Evaluator, part: slice) -> None:
            names = wanted[part]
            found.put(names, self._continue(evaluator, known.at(origins[part]), q[names], names))

        self.engine.in_blocks(block, len(wanted))

    def _continue(self, evaluator: Evaluator, here: Assembly, target: FloatArray, names: np.ndarray) -> Assembly:
        """Follow straight lines in the actuated coordinates from closed configurations to *target* ``(k, na)``."""
        origin = here.qpos[:, self.structure.actuated_qpos]
        way = target - origin
        done, step = np.zeros(len(target)), np.ones(len(target))
        active = np.arange(len(target))
        while len(active):
            rates = np.matmul(here.tangent[active], way[active, :, None])[:, :, 0] * self._weights[0]
            speed = np.linalg.norm(rates, axis=1)
            with np.errstate(divide="ignore"):
                longest = ALMOST * LONGEST_STEP / speed
            part = np.minimum(np.minimum(step[active], 1.0 - done[active]), longest)
            last = (done[active] + part >= 1.0)[:, None]
            aim = np.where(last, target[active], origin[active] + way[active] * (done[active] + part)[:, None])
            moved, predicted = self._predict(here, active, way[active] * part[:, None])
            predicted[:, self.structure.actuated_qpos] = aim
            closed = self._newton(evaluator, predicted)
            correction = np.sqrt(np.sum(((closed.qpos - predicted) * self._weights[1]) ** 2, axis=1))
            small = correction <= np.maximum(CORRECTION * moved, NEGLIGIBLE)
            accepted = (closed.residual <= self.tolerance.residual) & small & (moved <= LONGEST_STEP)
            here.put(active[accepted], closed, accepted)
            done[active[accepted]] += part[accepted]
            step[active[accepted]] *= 2.0
            refused = active[~accepted]
            step[refused] = 0.5 * part[~accepted]
            blocked = active[np.where(accepted, longest, step[active]) < SMALLEST_STEP]
            if len(blocked):
                self._refuse(int(names[blocked[0]]), target[blocked[0]], here.qpos[blocked[0]])
            active = active[done[active] < 1.0]
        return here

    def _close_freely(self, qpos: FloatArray) -> tuple[FloatArray, float]:
        """Close one configuration ``(1, nq)`` by least-norm Newton steps on all joints, the actuated ones included.

        Returns the best pose met and its residual.
        """
        best, least = qpos.copy(), np.inf
        for _ in range(FREE_STEPS):
            jacobian, open_by = constraint_jacobian(self.engine, self.structure, self.joints, qpos)
            residual = float(np.abs(open_by).max(initial=0.0))
            if not np.isfinite(residual):
                break
            if residual < least:
                best, least = qpos.copy(), residual
            if residual <= self.tolerance.floor:
                break
            step = -np.linalg.lstsq(jacobian, open_by, rcond=self.tolerance.relative)[0]
            length = float(np.linalg.norm(step * self._weights[0]))
            step *= min(1.0, LONGEST_FREE_STEP / max(length, 1e-300))
            integrate(qpos[0], step, self.joints, qpos[0])
        return best, least

    def _predict(self, here: Assembly, rows: np.ndarray, change: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Tangent predictor: distance moved by a change of the actuated coordinates, and where that leads."""
        moved, out = np.empty(len(rows)), np.empty((len(rows), here.qpos.shape[1]))
        predict(here.qpos[rows], here.tangent[rows], change, self.joints, self._weights[0], out, moved)
        return moved, out

    def _newton(self, evaluator: Evaluator, start: FloatArray) -> Assembly:
        """Newton on the passive joints of up to a block of configurations; the actuated coordinates stay."""
        count = len(start)
        found = self._nothing(count)
        qpos = evaluator.qpos
        qpos[:count] = start
        # the floor: a closed sample gets one more step, which takes it to rounding; then it stays
        tolerance = self.tolerance
        limits = (tolerance.residual, tolerance.floor, ASTRAY * tolerance.size, tolerance.few_digits)
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

    def _newton_alone(self, qpos: FloatArray) -> Assembly:
        """`_newton` on one configuration ``(1, nq)``, outside of a block."""
        results: list[Assembly] = []
        self.engine.in_blocks(lambda evaluator, _: results.append(self._newton(evaluator, qpos)), 1)
        return results[0]

    def _nothing(self, samples: int) -> Assembly:
        model = self.engine.model
        return Assembly.empty(samples, model.nq, model.nv, len(self.structure.actuated))

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


def constraint_jacobian(
    engine: Engine, structure: Structure, joints: tuple[np.ndarray, ...], qpos: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Constraint Jacobian ``(m, nv)``, spin rows last, and residual ``(m,)`` of one configuration ``(1, nq)``."""
    poses, tables = engine.poses(qpos), tables_of(engine.model, structure)
    jacobian, residual = np.zeros((structure.rows, poses.cdof.shape[1])), np.zeros(structure.rows)
    constraint_rows(tables.closures, tables.joints, qpos[0], *(array[0] for array in poses.tables), jacobian, residual)
    return jacobian, residual


def _weights(model: mujoco.MjModel, size: float) -> tuple[FloatArray, FloatArray]:
    """What a unit of each velocity ``(nv,)`` and of each coordinate ``(nq,)`` counts: lengths by the robot's size."""
    velocities, coordinates = np.ones(model.nv), np.ones(model.nq)
    for joint in range(model.njnt):
        kind = mujoco.mjtJoint(model.jnt_type[joint])
        lengths = {mujoco.mjtJoint.mjJNT_SLIDE: 1, mujoco.mjtJoint.mjJNT_FREE: 3}.get(kind, 0)
        for array, first in ((velocities, model.jnt_dofadr[joint]), (coordinates, model.jnt_qposadr[joint])):
            array[first : first + lengths] = 1.0 / size
    return velocities, coordinates


def _nearest(points: FloatArray, seeds: FloatArray) -> np.ndarray:
    """Index of the nearest seed for each point; a tree, so that memory stays linear in the number of samples."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(seeds).query(points)[1])
