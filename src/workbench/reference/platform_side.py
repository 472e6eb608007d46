"""What the reference answers when the platform is given: inverse kinematics, reach, Jacobian, singular poses.

The part of `MujocoReference` that knows task coordinates; see `workbench.reference.task` for what they mean.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray, as_batch, as_batches
from workbench.errors import MotionError
from workbench.reference.closure import LoopCloser
from workbench.reference.continuation import Assembly
from workbench.reference.platform_closure import PlatformCloser
from workbench.reference.redundant import CONSISTENT, refuse_inconsistent
from workbench.reference.result import refuse_overflow
from workbench.reference.task import POSITIONS, task_motion, task_of

if TYPE_CHECKING:
    from workbench.reference.mujoco_reference import MujocoReference
    from workbench.reference.result import ReferenceResult

SAME_POSE = 1e-9
"""m or rad: where the loops, closed from the actuators' side, put the platform, against where it was asked to be."""

INCONSISTENT = 1e-9
"""A velocity residual above this fraction of the speed means a singular pose."""


@dataclass(frozen=True)
class PlatformReach:
    """Which poses the platform reaches on the home branch; entries of poses out of reach are NaN."""

    q: FloatArray
    """``(n, na)`` actuated coordinates, m or rad"""
    reachable: np.ndarray
    """``(n,)``, joint limits not considered"""
    measures: dict[str, FloatArray]
    """``direct`` and ``inverse`` closeness to singular poses, ``(n,)`` each; see `singularity_measures`"""
    condition: FloatArray
    """``(n,)`` estimate of the condition number of the system that is solved, from the pivots of its QR factor"""


class PlatformSide(ABC):
    """Kinematics of any robot from its platform's side. Arrays are float64, SI, batch first."""

    _closer: LoopCloser
    _platform: dict[tuple[str, ...], PlatformCloser]

    @property
    @abstractmethod
    def determining(self) -> tuple[MujocoReference, np.ndarray | slice]:
        """The same model driven by as many actuators as there are freedoms, and their places among all."""

    @abstractmethod
    def inverse_dynamics(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        qdd: ArrayLike,
        mass_model: str = "distributed",
        external_force: ArrayLike | None = None,
        *,
        along: ArrayLike | None = None,
        near: ArrayLike | None = None,
    ) -> ReferenceResult:
        """Everything about an actuated motion."""

    @abstractmethod
    def _assemble(self, q: FloatArray, ordered: bool = False, near: ArrayLike | None = None) -> Assembly:
        """Closed configurations for actuated coordinates ``(n, na)``."""

    def joint_motion(
        self, x: ArrayLike, xd: ArrayLike, xdd: ArrayLike, coordinates: Sequence[str] = POSITIONS
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Actuated position, velocity and acceleration, each ``(n, na)``, from a motion of the platform.

        Parameters
        ----------
        x, xd, xdd
            Task coordinates and their derivatives, each ``(n, m)``, base frame; samples need not form a trajectory.
        coordinates
            As many of ``x y z rx ry rz`` as the robot has freedoms, in the order of the columns.

        Raises
        ------
        MotionError
            A pose out of reach or singular; the message names the sample, the pose and where the way to it ends.
        ParameterError
            Coordinates that the robot does not have, too many or too few.
        """
        closer = self._platform_closer(coordinates)
        x, xd, xdd = as_batches(len(closer.task.names), x=x, xd=xd, xdd=xdd)
        x, xd, xdd = (np.require(array, requirements="W") for array in (x, xd, xdd))
        assembly = self._reach_all(closer, x)
        qvel, qacc, residual = closer.accelerations(assembly, x, xd, xdd)
        speed = np.maximum(np.abs(xd).max(axis=1, initial=0.0), 1.0)
        bad = (assembly.rank < qvel.shape[1]) | ~(residual <= INCONSISTENT * speed)
        if bad.any():
            sample = int(np.argmax(bad))
            joint = closer.structure.dof_names[int(assembly.weakest[sample])]
            raise MotionError(
                f"sample {sample}, joint {joint}: singular pose at {closer.task.shown(x[sample])}; the platform's"
                " motion does not determine the joints'",
                sample=sample,
                joint=joint,
                value=x[sample].tolist(),
            )
        refuse_overflow("accelerations", qacc, xd)
        actuated = closer.structure.actuated
        return assembly.qpos[:, closer.structure.actuated_qpos], qvel[:, actuated], qacc[:, actuated]

    def inverse_kinematics(self, x: ArrayLike, coordinates: Sequence[str] = POSITIONS) -> FloatArray:
        """Actuated coordinates ``(n, na)`` on the home branch from task coordinates ``(n, m)``; see `joint_motion`."""
        closer = self._platform_closer(coordinates)
        assembly = self._reach_all(closer, as_batch("x", x, len(closer.task.names)))
        return assembly.qpos[:, closer.structure.actuated_qpos]

    def reach(self, x: ArrayLike, coordinates: Sequence[str] = POSITIONS) -> PlatformReach:
        """Inverse kinematics that marks poses ``(n, m)`` out of reach instead of refusing them: for workspace maps.

        A pose counts as reachable when a straight line in the task coordinates, from home or from another pose of the
        batch, leads to it on the home branch and past no singular pose; a grid of poses is what this is meant for.
        """
        closer = self._platform_closer(coordinates)
        found, reachable = closer.mark(as_batch("x", x, len(closer.task.names)))
        q = found.qpos[:, closer.structure.actuated_qpos]
        measures = {name: np.full(len(q), np.nan) for name in ("direct", "inverse")}
        for values, closeness in zip(
            measures.values(), closer.closeness(found.qpos[reachable], found.tangent[reachable]), strict=True
        ):
            values[reachable] = closeness
        q[~reachable] = np.nan
        return PlatformReach(q, reachable, measures, np.where(reachable, found.condition, np.nan))

    def reached_places(self, q: ArrayLike, coordinates: Sequence[str] = POSITIONS) -> FloatArray:
        """Task coordinates ``(k, m)`` of those actuated coordinates ``(n, na)`` that a way from home leads to.

        The way is straight, from home or from another one of the batch, and passes no singular pose.
        """
        closer = self._platform_closer(coordinates)
        leader, columns = self.determining
        q = as_batch("q", q, len(closer.structure.actuated))
        found, reached = leader._closer.mark(np.ascontiguousarray(q[:, columns]))
        qpos = found.qpos[reached]
        return closer.coordinates(qpos, np.zeros((len(qpos), len(closer.task.names))))

    def jacobian(self, q: ArrayLike, coordinates: Sequence[str] = POSITIONS) -> FloatArray:
        """Platform Jacobian ``(n, m, na)``, xd = J qd, at actuated coordinates ``(n, na)``.

        With more actuators than freedoms many J give the same xd for all rates that fit together; this is the one of
        least norm.
        """
        closer = self._platform_closer(coordinates)
        assembly = self._assembled(closer, q)
        jacobian = closer.jacobian(assembly.qpos, assembly.tangent)
        if assembly.tangent.shape[2] == len(closer.structure.actuated):
            return jacobian
        per_lead = assembly.tangent[:, closer.structure.actuated]
        found: FloatArray = np.matmul(jacobian, np.linalg.pinv(per_lead))
        return found

    def singularity_measures(self, q: ArrayLike, coordinates: Sequence[str] = POSITIONS) -> dict[str, FloatArray]:
        """Closeness to singular poses, ``(n,)`` each, dimensionless: 0 is singular, 1 the most that there can be.

        Of all motions of the mechanism at unit overall speed, ``direct`` is the least speed of the actuators (at 0
        something moves while they rest) and ``inverse`` the least speed of the platform in task coordinates (at 0 the
        joints move while it rests). Speeds are roots of sums of squares; radians count as radians times the robot's
        size (largest distance between two joints, or a joint and the platform site, in the home pose), so ``inverse``
        may exceed 1.
        """
        closer = self._platform_closer(coordinates)
        assembly = self._assembled(closer, q)
        direct, inverse = closer.closeness(assembly.qpos, assembly.tangent)
        return {"direct": direct, "inverse": inverse}

    def platform_motion(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        qdd: ArrayLike,
        coordinates: Sequence[str] = POSITIONS,
        along: ArrayLike | None = None,
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Task coordinates with their derivatives, each ``(n, m)``, from an actuated motion: forward kinematics.

        Any of ``x y z rx ry rz`` may be asked for. Rotations are each sample's least; `task.continuous` joins those of
        a motion. *along* as of `inverse_dynamics`.
        """
        found = self.inverse_dynamics(q, qd, qdd, along=along)
        position = found.x, found.xd, found.xdd
        return task_motion(task_of(coordinates), position, found.rotation, found.omega, found.alpha)

    def check_coordinates(self, coordinates: Sequence[str]) -> None:
        """Refuse task coordinates that do not say where the robot is.

        Raises
        ------
        ParameterError
            Coordinates that the robot does not have, too many or too few; with those that it has.
        """
        self._platform_closer(coordinates)

    def _platform_closer(self, coordinates: Sequence[str]) -> PlatformCloser:
        task = task_of(coordinates)
        if task.names not in self._platform:
            count = len(self._closer.structure.actuated)
            self._platform[task.names] = PlatformCloser(self._closer, task, np.arange(count)[self.determining[1]])
        return self._platform[task.names]

    def _assembled(self, closer: PlatformCloser, q: ArrayLike) -> Assembly:
        """Closed configurations for all actuated coordinates, the tangent per leading actuator."""
        structure = closer.structure
        q = as_batch("q", q, len(structure.actuated))
        leader, columns = self.determining
        assembly = leader._assemble(np.ascontiguousarray(q[:, columns]))
        refuse_inconsistent("q", q, assembly.qpos[:, structure.actuated_qpos], structure.joint_names, CONSISTENT)
        return assembly

    def _reach_all(self, closer: PlatformCloser, x: FloatArray) -> Assembly:
        """Closed configurations for task coordinates ``(n, m)`` to which the actuators alone lead, too."""
        assembly = closer.follow(x)
        leader, columns = self.determining
        q = np.ascontiguousarray(assembly.qpos[:, closer.structure.actuated_qpos][:, columns])
        try:
            back = closer.coordinates(leader._assemble(q).qpos, x)
        except MotionError as error:
            sample = error.facts["sample"]
            raise MotionError(
                f"sample {sample}: the platform can be at {closer.task.shown(x[sample])}, but its actuators cannot be"
                f" led there straight from the home pose: {error}",
                **error.facts | {"value": x[sample].tolist(), "coordinates": list(closer.task.names)},
            ) from error
        bad = ~(np.abs(back - x) <= SAME_POSE).all(axis=1)
        if bad.any():
            sample = int(np.argmax(bad))
            raise MotionError(
                f"sample {sample}: {closer.task.shown(x[sample])} is on another assembly branch than the home pose: led"
                f" straight to the same places from home, the actuators put the platform at"
                f" {closer.task.shown(back[sample])}",
                sample=sample,
                coordinates=list(closer.task.names),
                value=x[sample].tolist(),
                reached=back[sample].tolist(),
            )
        return assembly
