"""Close the loops from the platform's side: from task coordinates to the full configuration, on the home branch.

Newton's method on all joints, passive and actuated, with the task coordinates as rows below those of the loops. How
samples are reached, and what keeps them on the branch, stands in `workbench.reference.continuation`; one rule is added,
since a way that is straight for the platform can lead through a pose in which the actuators lose hold of it: a step
counts only where the determinant of the actuated velocities per task velocity keeps the sign that it has at home.
"""

from __future__ import annotations

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError, MotionError, ParameterError
from workbench.reference.closure import LoopCloser, loop_rows
from workbench.reference.continuation import NEWTON_STEPS, Assembly, Continuation
from workbench.reference.engine import Evaluator
from workbench.reference.linear import room_to_factor
from workbench.reference.platform_kernels import platform_accelerations, platform_jacobian, platform_newton
from workbench.reference.sides import pattern_of
from workbench.reference.task import COORDINATES, POSITIONS, Task, task_of
from workbench.reference.tolerance import rank_of

DEPENDENT = 1e-9
"""A singular value of the task coordinates over the robot's motions below this (lengths in robot sizes) is zero."""

NEARBY = 1e-2
"""rad or m: how far the actuators are moved from home to see whether only the home pose is to blame."""

LOOSE = 0.02
"""Below this closeness to a singular pose of the actuators, that is what a blocked way is put down to."""


class PlatformCloser(Continuation):
    """Closes the loops of one model with the platform held.

    Parameters
    ----------
    loops
        The model's loops, closed from the actuators' side.
    task
        As many coordinates as there are freedoms.
    leading
        Places, among the actuated joints, of as many as there are freedoms.

    Raises
    ------
    ParameterError
        Too many or too few coordinates, or some that the robot does not have.
    ModelError
        The home pose is a singular one.
    """

    def __init__(self, loops: LoopCloser, task: Task, leading: np.ndarray) -> None:
        super().__init__(loops.engine, loops.structure)
        self.tolerance = loops.tolerance
        model, structure = self.engine.model, self.structure
        self.task = task
        self.leading = leading
        self.home = loops.home
        with self.engine.shelf.data_of(model) as data:
            data.qpos[:] = self.home
            mujoco.mj_kinematics(model, data)
            rotation = data.xmat[structure.base].reshape(3, 3).copy()
            self._base = rotation, data.xpos[structure.base].copy(), data.xquat[structure.base].copy()
            self.size = _size(data, structure.platform_site)
            """m: the robot's length, by which turns and distances are compared"""
        self._site = int(model.site_bodyid[structure.platform_site]), structure.platform_site
        self._table = task.table(*self._site)
        self._lengths = np.where(_turning(model), self.size, 1.0)
        if len(task.names) != len(leading):
            has = " ".join(self._has(loops))
            raise ParameterError(
                f"{structure.file}: {len(task.names)} task coordinate(s) ({' '.join(task.names)}), but the robot has"
                f" {len(leading)} freedom(s); give {len(leading)} of {has}",
                value=list(task.names),
            )
        aim = np.zeros((1, len(leading)))
        rows, self.start = (array[0] for array in self._rows(self.home[None, :], aim))
        self._refuse_dependent(loops, rows)
        self._sign = np.ones(1)
        self._home = self._newton_alone(self.home[None, :].copy(), self.start[None, :])
        self._sign = self._signs(self._home)
        pattern, group = pattern_of(structure, self.joints[2])
        moved = np.tile(structure.moves[self._site[0]], (len(leading), 1))
        # the task coordinates are of one body
        task_group = np.full(len(leading), len(structure.blocks))
        self._look_at_sides(
            self._solved(self.home[None, :])[0],
            np.concatenate([pattern, moved]),
            np.concatenate([group, task_group]),
            np.arange(model.nv),
        )

    def accelerations(
        self, assembly: Assembly, x: FloatArray, xd: FloatArray, xdd: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """All velocities and accelerations ``(n, nv)`` of a motion of the platform, and its velocity residual ``(n,)``.

        ``x, xd, xdd (n, m)`` are task coordinates; they must not be read-only.
        """
        n, nv = len(x), self.engine.model.nv
        qvel = np.ascontiguousarray(np.matmul(assembly.tangent, xd[:, :, None])[:, :, 0])
        qacc = np.zeros((n, nv))
        velocity, acceleration = np.zeros((2, n))
        tables = self.tables

        def block(evaluator: Evaluator, rows: slice) -> None:
            poses, dynamics = evaluator.move(assembly.qpos[rows], qvel[rows])
            platform_accelerations(
                tables.closures, tables.joints, tables.bodies, self._table, self._base, poses.tables,
                dynamics.cdof_dot, x[rows], xd[rows], xdd[rows], assembly.tangent[rows], assembly.qpos[rows],
                qvel[rows], qacc[rows], velocity[rows], acceleration[rows],
                room_to_factor(int(tables.closures.block_rows[-1]) + x.shape[1], qvel.shape[1]),
            )  # fmt: skip

        self.engine.in_blocks(block, n)
        return qvel, qacc, velocity

    def jacobian(self, qpos: FloatArray, tangent: FloatArray) -> FloatArray:
        """Task velocities per velocity of what *tangent* ``(n, nv, k)`` belongs to: ``(n, m, k)``."""
        rows = self._rows(qpos, np.zeros((len(qpos), len(self.task.names))))[0]
        found: FloatArray = np.matmul(rows, tangent)
        return found

    def coordinates(self, qpos: FloatArray, near: FloatArray) -> FloatArray:
        """Task coordinates ``(n, m)`` of configurations ``(n, nq)``; of equal rotations, those nearest to *near*."""
        return self._rows(qpos, near)[1]

    def closeness(self, qpos: FloatArray, tangent: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Closeness ``(n,)`` to singular poses of the direct and of the inverse problem, 0 in one.

        Of all motions of the mechanism at unit overall speed (root of the sum of squares over all joints, turns times
        `size`), the least speed of the actuators, and the least of the platform in task coordinates, rotations times
        `size`. ``tangent (n, nv, k)`` spans the motions.
        """
        if not len(qpos):
            return np.zeros(0), np.zeros(0)
        motions = np.linalg.qr(tangent * self._lengths[:, None])[0]
        platform = self.jacobian(qpos, motions / self._lengths[:, None])
        platform[:, self.task.turn_columns] *= self.size
        actuators = motions[:, self.structure.actuated]
        return _least(actuators), _least(platform)

    def _rows(
        self, qpos: FloatArray, near: FloatArray, table: tuple[object, ...] = ()
    ) -> tuple[FloatArray, FloatArray]:
        """Jacobian ``(n, m, nv)`` and values ``(n, m)`` of task coordinates."""
        n, m = near.shape
        rows, values = np.zeros((n, m, self.engine.model.nv)), np.zeros((n, m))
        table = table or self._table

        def block(evaluator: Evaluator, part: slice) -> None:
            evaluator.qpos[: part.stop - part.start] = qpos[part]
            poses = evaluator.place(np.arange(part.stop - part.start, dtype=np.int32))
            platform_jacobian(
                table, self._base, self.tables.closures, poses.tables, near[part], rows[part], values[part]
            )

        self.engine.in_blocks(block, n)
        return rows, values

    def _solved(self, qpos: FloatArray) -> FloatArray:
        loops = loop_rows(self.engine, self.tables, qpos)
        return np.concatenate([loops, self._rows(qpos, np.tile(self.start, (len(qpos), 1)))[0]], axis=1)

    def _newton(self, evaluator: Evaluator, start: FloatArray, aim: FloatArray) -> Assembly:
        count = len(start)
        found = self._nothing(count, aim.shape[1])
        qpos = evaluator.qpos
        qpos[:count] = start
        limits, loops = self.limits, int(self.tables.closures.block_rows[-1])
        room = room_to_factor(loops + aim.shape[1], self.engine.model.nv)
        active = np.arange(count)
        for _ in range(NEWTON_STEPS):
            poses = evaluator.place(active)
            active = platform_newton(
                active, self.tables.closures, self.joints, self._table, self._base, self._side_table, poses.tables,
                limits, aim, qpos, found.qpos, found.residual, found.tangent, found.rank, found.condition,
                found.weakest, found.side, room,
            )  # fmt: skip
            if not len(active):
                break
        return found

    def _on_branch(self, closed: Assembly) -> np.ndarray:
        on: np.ndarray = self._signs(closed) == self._sign
        return on

    def _signs(self, assembly: Assembly) -> FloatArray:
        """Sign ``(k,)`` of the determinant of actuated velocities per task velocity; it turns at a singular pose."""
        square = assembly.tangent[:, self.structure.actuated[self.leading]]
        signs: FloatArray = np.sign(np.linalg.det(square)) if len(square) else np.zeros(0)
        return signs

    def _refuse(self, sample: int, target: FloatArray, reached: FloatArray, there: Assembly) -> None:
        direct = self.closeness(there.qpos, there.tangent)[0][0]
        why = "; there the actuators lose hold of it (a singular pose)" if direct < LOOSE else ""
        raise MotionError(
            f"sample {sample}: the platform cannot reach {self.task.shown(target)} on the home branch; the way from the"
            f" home pose ends at {self.task.shown(reached)}{why}",
            sample=sample,
            coordinates=list(self.task.names),
            value=target.tolist(),
            reached=reached.tolist(),
            nearest=reached.tolist(),
        )

    def _has(self, loops: LoopCloser) -> list[str]:
        """Task coordinates that change when the robot moves from home."""
        body, home = self._site[0], self.home[None, :]
        slides = self._rows(home, np.zeros((1, 3)), task_of(POSITIONS).table(*self._site))[0][0]
        # angular velocity itself, which has no convention and no singular orientation
        turns = self.engine.poses(home).cdof[0][:, :3] * self.structure.moves[body][:, None] @ self._base[0]
        speeds = np.linalg.norm(self._motions(loops, self.home, np.concatenate([slides, turns.T * self.size])), axis=1)
        return [name for name, speed in zip(COORDINATES, speeds, strict=True) if speed > DEPENDENT * self.size]

    def _motions(self, loops: LoopCloser, qpos: FloatArray, rows: FloatArray) -> FloatArray:
        """Velocities *rows* ``(m, nv)`` of an orthonormal basis of the mechanism's motions at *qpos*: ``(m, k)``."""
        closures = loops.jacobian(qpos) / self._lengths
        rank = rank_of(closures, self.tolerance)
        basis = np.linalg.svd(closures)[2][rank:] if len(closures) else np.eye(len(self._lengths))
        found: FloatArray = (rows / self._lengths) @ basis.T
        return found

    def _refuse_dependent(self, loops: LoopCloser, rows: FloatArray) -> None:
        """Refuse coordinates that do not determine the home pose, and say whether the robot or the pose is to blame."""
        names, wanted, file = self.task.names, len(self.leading), self.structure.file
        if not np.isfinite(rows).all():
            raise ModelError(
                f"{file}: in the home pose the platform site's axes are turned over against the base's, by half a turn"
                f" about an axis across {names[int(self.task.turn_columns[0])]}, so that its angle has no value; turn"
                " the site (euler)",
                file=file,
            )
        rank = self._rank(loops, self.home)
        if rank == wanted:
            return
        has = self._has(loops)
        lacking = [name for name in names if name not in has]
        for way in np.concatenate([np.eye(wanted), -np.eye(wanted), np.ones((1, wanted))]) * NEARBY:
            target = self.home[self.structure.actuated_qpos].copy()
            target[self.leading] += way
            try:
                near = loops.close(target[None, :]).qpos[0]
            except MotionError:
                continue
            if self._rank(loops, near) == wanted:
                raise ModelError(
                    f"{file}: the home pose is a singular one: there {' '.join(names)} do not determine the joints;"
                    " begin from another pose, by a keyframe or initial coordinates",
                    file=file,
                )
        if lacking:
            said = f"task coordinate {', '.join(lacking)} does not change when the robot moves"
        else:
            said = f"of task coordinates {' '.join(names)} only {rank} can be chosen; the others follow from them"
        raise ParameterError(
            f"{file}: {said}; give {wanted} of those it has: {' '.join(has)}", value=list(names), allowed=has
        )

    def _rank(self, loops: LoopCloser, qpos: FloatArray) -> int:
        rows = self._rows(qpos[None, :], np.zeros((1, len(self.task.names))))[0][0]
        rows[self.task.turn_columns] *= self.size
        values = np.linalg.svd(self._motions(loops, qpos, rows), compute_uv=False)
        return int(np.count_nonzero(values > DEPENDENT * self.size))


def _turning(model: mujoco.MjModel) -> np.ndarray:
    """Which velocities ``(nv,)`` are angular; of a free joint the last three."""
    kinds = np.asarray(model.jnt_type)[model.dof_jntid]
    place = np.arange(model.nv) - np.asarray(model.jnt_dofadr)[model.dof_jntid]
    free = kinds == mujoco.mjtJoint.mjJNT_FREE.value
    turning: np.ndarray = (kinds != mujoco.mjtJoint.mjJNT_SLIDE.value) & ~(free & (place < 3))
    return turning


def _least(matrices: FloatArray) -> FloatArray:
    """Least singular value ``(n,)`` of each matrix ``(n, a, b)``, a >= b."""
    values = np.linalg.svd(matrices, compute_uv=False)
    return np.asarray(values[:, -1], dtype=np.float64)


def _size(data: mujoco.MjData, site: int) -> float:
    """Largest distance between two joints, or a joint and the platform site, m; one where all are in one place."""
    points = np.concatenate([np.array(data.xanchor), data.site_xpos[site][None, :]])
    return float(np.linalg.norm(points[:, None] - points[None, :], axis=2).max()) or 1.0
