"""Closed poses of samples that are moved along q + qd t + qdd t^2/2, kept for all mass models that ask for them.

Masses move nothing: the loops of a displaced sample close alike under each of them, so they are closed once.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import MotionError
from workbench.reference.continuation import Assembly
from workbench.reference.engine import Evaluator
from workbench.reference.kernels import velocities
from workbench.reference.mujoco_reference import MujocoReference


@dataclass(frozen=True)
class Displaced:
    """Samples of a motion, and where they have been moved to.

    Parameters
    ----------
    reference
        The robot.
    qpos
        ``(n, nq)`` closed configurations of the samples themselves, m and rad: from home another assembly may be on the
        way to a displaced one.
    q, qd, qdd
        ``(n, na)`` each, SI.
    times
        ``(k,)`` times of the displacements, in steps.
    """

    reference: MujocoReference
    qpos: FloatArray
    q: FloatArray
    qd: FloatArray
    qdd: FloatArray
    times: FloatArray
    _closed: dict[float, tuple[np.ndarray, Assembly]] = field(default_factory=dict, repr=False)
    """by step: the samples that were moved by it, in order, and their poses, k to a sample"""

    def moved(self, samples: np.ndarray, step: float) -> tuple[FloatArray, FloatArray]:
        """Coordinates and rates of *samples* ``(m,)``, ``(m k, na)`` each, moved by *step* seconds times `times`.

        Along the curve excess actuators would leave the mechanism's motions; these are those of the leading ones, which
        determine its state.
        """
        _, lead = self.reference.determining
        q, qd, qdd = (array[samples] for array in (self.q, self.qd, self.qdd))
        times = step * self.times[:, None, None]
        moved = (q + qd * times + 0.5 * qdd * times**2).swapaxes(0, 1).reshape(-1, q.shape[1])
        speed = (qd + qdd * times).swapaxes(0, 1).reshape(-1, q.shape[1])
        return moved[:, lead], speed[:, lead]

    def closed(self, samples: np.ndarray, step: float) -> Assembly:
        """The poses of *samples* ``(m,)``, increasing, so moved: k to a sample.

        Raises
        ------
        MotionError
            One of them cannot be reached.
        """
        known, poses = self._closed.get(step, (np.zeros(0, dtype=np.int64), None))
        missing = np.setdiff1d(samples, known)
        if len(missing) or poses is None:
            solver, count = self.reference.determining[0], len(self.times)
            found = solver.closer.close_near(self.moved(missing, step)[0], self.qpos[missing], count)
            together = np.concatenate([known, missing])
            order = np.argsort(together, kind="stable")
            if poses is not None:
                pairs = zip(poses.arrays, found.arrays, strict=True)
                found = Assembly(*(np.concatenate([one, other]) for one, other in pairs))
            known, poses = together[order], found.at(self._rows(order))
            self._closed[step] = known, poses
        return poses.at(self._rows(np.searchsorted(known, samples)))

    def energy(self, samples: np.ndarray, step: float, mass_model: str) -> FloatArray:
        """Kinetic and potential energy ``(m k,)`` of *samples* so moved, J.

        Raises
        ------
        MotionError
            One of them cannot be reached, or the actuators do not determine its velocities.
        """
        solver, _ = self.reference.determining
        closed, (_, speed) = self.closed(samples, step), self.moved(samples, step)
        if (closed.rank < len(solver.structure.passive)).any():
            raise MotionError(f"{solver.file}: a displaced sample is in a singular pose")
        engine = solver.engine(mass_model)
        qvel, energy = np.zeros((len(speed), engine.model.nv)), np.zeros(len(speed))
        velocities(closed.tangent, np.ascontiguousarray(speed), qvel)

        def block(evaluator: Evaluator, rows: slice) -> None:
            _, dynamics = evaluator.move(closed.qpos[rows], qvel[rows])
            energy[rows] = dynamics.energy[: rows.stop - rows.start].sum(axis=1)

        engine.in_blocks(block, len(speed))
        return energy

    def _rows(self, places: np.ndarray) -> np.ndarray:
        count = len(self.times)
        rows: np.ndarray = (count * places[:, None] + np.arange(count)).ravel()
        return rows
