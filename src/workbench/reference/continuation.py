"""Continuation from the home pose: configurations followed along straight lines in some coordinates of the mechanism.

Samples need not form a trajectory. Each is reached from a configuration that is known to be on the branch (the home
pose, or a sample reached before) along a straight line in the coordinates that are given, those of the actuators or of
the platform; a step counts only if the correction after it is small against the step itself, so that it cannot jump to
another branch. What cannot be reached is an error that names the sample, or is marked; never a result.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.reference.bench import Rules
from workbench.reference.engine import Engine, Evaluator
from workbench.reference.kernels import predict
from workbench.reference.linear import room_to_eliminate
from workbench.reference.sides import NO_SIDES, UNKNOWN, SideTable, same_side, side_at, side_table
from workbench.reference.structure import IntArray, Structure
from workbench.reference.tables import tables_of
from workbench.reference.tolerance import tolerance_of, weights_of

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

SMALLEST_MARKED_STEP = 2.0**-8
"""The same where samples are only marked as out of reach: the way from a neighbour is short."""

SMALLEST_FAR_STEP = 2.0**-4
"""And where no neighbour is in reach, so that the way from the nearest sample that is most often leads out of reach."""

NEIGHBOURS = 1.8
"""Samples that are to be marked are neighbours up to this many times their usual distance: in a grid, diagonals too."""

CLOSER = 0.99
"""A marked sample is tried again from a neighbour that is nearer than this part of the last one's distance."""

NEWTON_STEPS = 8
ASTRAY = 1e3
"""A residual (m) from which Newton does not come back."""

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
    """``(n, nv, m)`` velocities per unit velocity of the given coordinates"""
    rank: np.ndarray
    """``(n,)`` rank of the loop constraints (and of given rows) on the freedoms that are solved for"""
    condition: FloatArray
    """``(n,)`` estimate of their condition number; NaN where `workbench.reference.closing` closed them, unasked for"""
    weakest: np.ndarray
    """``(n,)`` velocity address of the freedom that they determine worst"""
    side: np.ndarray
    """``(n,)`` on which side of their singular poses, see `workbench.reference.sides`"""

    @staticmethod
    def empty(samples: int, nq: int, nv: int, given: int) -> Assembly:
        """Nothing closed yet."""
        return Assembly(
            qpos=np.zeros((samples, nq)),
            residual=np.full(samples, np.inf),
            tangent=np.zeros((samples, nv, given)),
            rank=np.zeros(samples, dtype=np.int64),
            condition=np.full(samples, np.nan),
            weakest=np.zeros(samples, dtype=np.int64),
            side=np.full(samples, UNKNOWN, dtype=np.int64),
        )

    def at(self, rows: np.ndarray | slice) -> Assembly:
        """Some of the samples; with a slice, views."""
        return Assembly(*(array[rows] for array in self.arrays))

    def put(self, rows: np.ndarray, other: Assembly, chosen: np.ndarray | slice = slice(None)) -> None:
        """Overwrite *rows* by the *chosen* samples of another assembly."""
        for mine, others in zip(self.arrays, other.arrays, strict=True):
            mine[rows] = others[chosen]

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """All arrays."""
        return self.qpos, self.residual, self.tangent, self.rank, self.condition, self.weakest, self.side

    @property
    def closed(self) -> tuple[np.ndarray, ...]:
        """What `workbench.reference.closing` fills."""
        return self.qpos, self.residual, self.tangent, self.rank, self.side


class Continuation(ABC):
    """Follows the configurations of one model; what is given, and so what Newton holds fast, is a subclass's matter."""

    _home: Assembly
    """the home pose alone, to be set by the subclass"""
    _side_table: SideTable = NO_SIDES
    """which determinants are looked at; known once the home pose is"""
    start: FloatArray
    """``(m,)`` the given coordinates of the home pose, likewise"""

    def __init__(self, engine: Engine, structure: Structure) -> None:
        self.engine = engine
        self.structure = structure
        self.tables = engine.shelf.tables = tables_of(engine.model, structure, engine.shelf.tables)
        self.joints = self.tables.joints
        with engine.shelf.data_of(engine.model) as drawn:
            drawn.qpos[:] = structure.home_qpos
            mujoco.mj_kinematics(engine.model, drawn)
            mujoco.mj_comPos(engine.model, drawn)
            self.tolerance = tolerance_of(engine.model, drawn, structure.file)
            self.centres = np.array(drawn.subtree_com)
            """``(nbody, 3)`` mass centres of subtrees as drawn, world"""
            self.base: tuple[FloatArray, FloatArray] = (
                drawn.xpos[structure.base].copy(),
                drawn.xmat[structure.base].reshape(3, 3).copy(),
            )
            """position and axes of the base body, which is fixed, world"""
        # a step in metres counts by the robot's size, one in radians as it is
        self._weights = weights_of(engine.model, self.tolerance.size)

    def follow(self, target: FloatArray) -> Assembly:
        """Reach given coordinates ``(n, m)``, SI, any order of samples.

        Raises
        ------
        MotionError
            Naming the first sample that cannot be reached on the home branch, and where the way to it ends.
        """
        n = len(target)
        found = self._nothing(n, target.shape[1])
        known = np.zeros(0, dtype=np.int64)
        scale = _scale(target)
        for spacing in SEED_SPACINGS:
            wanted = np.setdiff1d(np.arange(0, n, spacing), known)
            if not len(wanted):
                continue
            if len(known):
                nearest = known[_nearest(target[wanted] / scale, target[known] / scale)[0]]
                self._reach(target, wanted, found, target[nearest], nearest, found)
            else:
                home, row = np.tile(self.start, (len(wanted), 1)), np.zeros(len(wanted), dtype=np.int64)
                self._reach(target, wanted, self._home, home, row, found)
            known = np.union1d(known, wanted)
        return found

    def mark(self, target: FloatArray) -> tuple[Assembly, np.ndarray]:
        """As `follow`, for samples that may be out of reach: ``(n,)`` says which were reached.

        The samples are reached like a rising tide: from home those nearby, from those their neighbours. When it stands
        still, what is farther off is tried, too, and what has a nearer neighbour in reach than when it was last tried.
        """
        n = len(target)
        # home is the last row
        points = np.concatenate([target, self.start[None, :]])
        found = self._nothing(n + 1, target.shape[1])
        found.put(np.array([n]), self._home)
        arrived = np.arange(n + 1) == n
        scaled = points / _scale(target)
        tried = np.full(n + 1, np.inf)
        radius = near = max(NEIGHBOURS * _spacing(scaled[:n]), _from_home(scaled))
        while not arrived.all():
            lost, known = np.flatnonzero(~arrived), np.flatnonzero(arrived)
            seeds, distances = _nearest(scaled[lost], scaled[known])
            nearer = distances < CLOSER * tried[lost]
            if not nearer.any():
                break
            radius = max(radius, float(distances[nearer].min()))
            chosen = nearer & (distances <= radius)
            wanted, origin = lost[chosen], known[seeds[chosen]]
            tried[wanted] = distances[chosen]
            smallest = SMALLEST_MARKED_STEP if radius <= near else SMALLEST_FAR_STEP
            arrived[wanted] = self._reach(points, wanted, found, points[origin], origin, found, smallest)
            if not arrived[wanted].any():
                radius *= 2.0
        return found.at(slice(0, n)), arrived[:n]

    def _reach(
        self,
        target: FloatArray,
        wanted: np.ndarray,
        known: Assembly,
        origins: FloatArray,
        rows: np.ndarray,
        found: Assembly,
        marked_below: float = 0.0,
    ) -> np.ndarray:
        """Continuation from *rows* of known configurations, at coordinates *origins*, to rows *wanted* of *target*."""
        arrived = np.zeros(len(wanted), dtype=np.bool_)

        def block(evaluator: Evaluator, part: slice) -> None:
            names = wanted[part]
            here, arrived[part] = self._continue(
                evaluator, known.at(rows[part]), origins[part], target[names], names, marked_below
            )
            found.put(names[arrived[part]], here, arrived[part])

        self.engine.in_blocks(block, len(wanted))
        return arrived

    def _continue(
        self,
        evaluator: Evaluator,
        here: Assembly,
        origin: FloatArray,
        target: FloatArray,
        names: np.ndarray,
        marked_below: float,
    ) -> tuple[Assembly, np.ndarray]:
        """Follow straight lines from closed configurations at *origin* to *target* ``(k, m)``; which ones arrived.

        A blocked way is an error, or, where *marked_below* is a smallest step, ends without one.
        """
        smallest = marked_below or SMALLEST_STEP
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
            closed = self._newton(evaluator, predicted, aim)
            correction = np.sqrt(np.sum(((closed.qpos - predicted) * self._weights[1]) ** 2, axis=1))
            small = correction <= np.maximum(CORRECTION * moved, NEGLIGIBLE)
            accepted = (closed.residual <= self.tolerance.residual) & small & (moved <= LONGEST_STEP)
            accepted &= self._on_branch(closed)
            accepted &= self._on_side(here, active, closed, accepted)
            here.put(active[accepted], closed, accepted)
            done[active[accepted]] += part[accepted]
            step[active[accepted]] *= 2.0
            refused = active[~accepted]
            step[refused] = 0.5 * part[~accepted]
            blocked = np.where(accepted, longest, step[active]) < smallest
            if blocked.any() and not marked_below:
                row = active[blocked][0]
                self._refuse(
                    int(names[row]), target[row], origin[row] + way[row] * done[row], here.at(slice(row, row + 1))
                )
            active = active[~blocked]
            active = active[done[active] < 1.0]
        return here, done >= 1.0

    @property
    def limits(self) -> tuple[float, float, float, bool]:
        """Residuals between which Newton goes on, as the kernels take them.

        The floor: a closed sample gets one more step, which takes it to rounding; then it stays.
        """
        tolerance = self.tolerance
        return tolerance.residual, tolerance.floor, ASTRAY * tolerance.size, tolerance.few_digits

    def rules(self, smallest: float = SMALLEST_STEP) -> Rules:
        """The bounds above as the kernels take them."""
        return Rules(*self.limits, NEWTON_STEPS, CORRECTION, LONGEST_STEP, ALMOST, NEGLIGIBLE, smallest)

    def _predict(self, here: Assembly, rows: np.ndarray, change: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Tangent predictor: distance moved by a change of the given coordinates, and where that leads."""
        moved, out = np.empty(len(rows)), np.empty((len(rows), here.qpos.shape[1]))
        predict(here.qpos[rows], here.tangent[rows], change, self.joints, self._weights[0], out, moved)
        return moved, out

    def _newton_alone(self, qpos: FloatArray, aim: FloatArray) -> Assembly:
        """`_newton` on one configuration ``(1, nq)``, outside of a block."""
        results: list[Assembly] = []
        self.engine.in_blocks(lambda evaluator, _: results.append(self._newton(evaluator, qpos, aim)), 1)
        return results[0]

    def _look_at_sides(self, rows: FloatArray, pattern: np.ndarray, group: IntArray, columns: IntArray) -> None:
        """From now on no step passes a singular pose; *rows* ``(m, nv)`` at home; *group* is the closure of each."""
        self._side_table = side_table(rows[:, columns], pattern[:, columns], group, columns)
        self._home.side[:] = side_at(rows, columns, self._side_table)

    def _on_side(self, here: Assembly, rows: np.ndarray, closed: Assembly, wanted: np.ndarray) -> np.ndarray:
        """Which of the *wanted* steps ``(k,)`` from *rows* of closed configurations pass no singular pose.

        A configuration in a singular pose has no side and inherits the one that it was reached from.
        """
        before, after, table = here.side[rows], closed.side, self._side_table
        if not table.least.any():
            lost = after == UNKNOWN
            after[lost] = before[lost]
            square: np.ndarray = (before == UNKNOWN) | (before == after)
            return square
        # chosen rows may turn over among the others, where the mechanism does not
        lost = closed.rank < len(table.columns)  # in a singular pose, which is refused elsewhere
        same: np.ndarray = ((before == after) & (after != UNKNOWN)) | lost
        doubtful = np.flatnonzero(wanted & ~same)
        if len(doubtful):
            size, found = len(table.columns), np.zeros(len(doubtful), dtype=np.bool_)
            jacobians = self._solved(here.qpos[rows[doubtful]]), self._solved(closed.qpos[doubtful])
            same_side(*jacobians, table, room_to_eliminate(size), found)
            same[doubtful] = found
        return same

    def _nothing(self, samples: int, given: int) -> Assembly:
        model = self.engine.model
        return Assembly.empty(samples, model.nq, model.nv, given)

    @abstractmethod
    def _newton(self, evaluator: Evaluator, start: FloatArray, aim: FloatArray) -> Assembly:
        """Close up to a block of configurations, beginning at *start*, with the given coordinates at *aim*.

        Where coordinates are held by writing them, they are written into *start*.
        """

    @abstractmethod
    def _solved(self, qpos: FloatArray) -> FloatArray:
        """Rows ``(k, m, nv)`` that Newton solves, at configurations ``(k, nq)``."""

    @abstractmethod
    def _refuse(self, sample: int, target: FloatArray, reached: FloatArray, there: Assembly) -> None:
        """Raise the error of a sample whose way ends at *reached*, in the configuration *there*."""

    def _on_branch(self, closed: Assembly) -> np.ndarray:
        """Which of these configurations ``(k,)`` are on the home branch for all that can be seen in one alone."""
        return np.ones(len(closed.qpos), dtype=np.bool_)


def _scale(points: FloatArray) -> FloatArray:
    """``(m,)`` the extent of each coordinate, so that distances in it mean something."""
    scale: FloatArray = np.maximum(np.ptp(points, axis=0), 1e-9) if len(points) else np.ones(points.shape[1])
    return scale


def _spacing(points: FloatArray) -> float:
    """Usual distance between neighbours, the median over all points ``(n, m)``."""
    from scipy.spatial import cKDTree

    return float(np.median(cKDTree(points).query(points, k=2)[0][:, 1])) if len(points) > 1 else np.inf


def _from_home(points: FloatArray) -> float:
    """Distance of the last point from the nearest other one."""
    return float(_nearest(points[-1:], points[:-1])[1][0]) if len(points) > 1 else np.inf


def _nearest(points: FloatArray, seeds: FloatArray) -> tuple[np.ndarray, FloatArray]:
    """Index of the nearest seed for each point and its distance; a tree, so that memory stays linear in the samples."""
    from scipy.spatial import cKDTree

    distances, rows = cKDTree(seeds).query(points)
    return np.asarray(rows), np.asarray(distances)
