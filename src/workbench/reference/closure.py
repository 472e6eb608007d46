"""Close the loops: from actuated coordinates to the full configuration, always on the home assembly branch.

How samples are reached, and what keeps them on the branch, stands in `workbench.reference.continuation`.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError, MotionError
from workbench.reference.along import OrderedClosure
from workbench.reference.bench import Mechanism, bench
from workbench.reference.closing import LINES, NEAR, advance
from workbench.reference.continuation import NEWTON_STEPS, SMALLEST_STEP, Assembly
from workbench.reference.engine import Engine, Evaluator
from workbench.reference.kernels import integrate, newton_step
from workbench.reference.kinds import JOINT, TENDON
from workbench.reference.kinematics import is_covered, kinematics_of
from workbench.reference.linear import room_to_factor
from workbench.reference.rows import constraint_rows
from workbench.reference.sides import pattern_of
from workbench.reference.structure import Structure
from workbench.reference.tables import Tables
from workbench.reference.tolerance import KEY, RANK

CONFIRMED = 2.0
"""By so many times what closes a loop MuJoCo may find it open at the pose in which the package's own kinematics closed
it: both round."""

FREE_STEPS = 60
LONGEST_FREE_STEP = 0.2
"""rad or m: damped, so that an open home pose closes on the branch that it is nearest to."""


class LoopCloser(OrderedClosure):
    """Closes the loops of one model."""

    _seen: tuple[FloatArray, tuple[FloatArray, FloatArray]] | None = None

    def __init__(self, engine: Engine, structure: Structure, *, compiled: bool = True) -> None:
        super().__init__(engine, structure)
        self.mechanism = self._mechanism() if compiled and is_covered(engine.model) else None
        self._home = self._close_home(structure.home_qpos[None, :].copy())
        self.home = self._home.qpos[0]
        pattern, group = pattern_of(structure, self.joints[2])
        self._look_at_sides(self.jacobian(self.home), pattern, group, structure.passive)
        if self.mechanism is not None:
            self.mechanism = self.mechanism._replace(sides=self._side_table)
        self.start = self.home[structure.actuated_qpos]

    def _close_home(self, home: FloatArray) -> Assembly:
        """Close the pose ``(1, nq)`` from which all others are reached."""
        found = self._newton_alone(home.copy(), home[:, self.structure.actuated_qpos])
        if not found.residual[0] <= self.tolerance.closed:
            # edited lengths can put the file's home pose out of reach: move the actuated joints too, but little
            closed, residual = self._close_freely(home.copy())
            if self.tolerance.closed < residual <= self.tolerance.allowed:
                self._close_by_digits()
            elif not residual <= self.tolerance.closed:
                self._refuse_home(home, closed, residual)
            found = self._newton_alone(closed.copy(), closed[:, self.structure.actuated_qpos])
        if not self.tolerance.few_digits and self._locked(found.qpos[0]):
            # axes that are parallel to six digits only leave no freedom, where the robot that is meant has some
            self._close_by_digits()
            found = self._newton_alone(found.qpos.copy(), found.qpos[:, self.structure.actuated_qpos])
        self.confirm(np.abs(self._rows(found.qpos)[1]), "home pose")
        return found

    def _mechanism(self) -> Mechanism:
        model, structure = self.engine.model, self.structure
        joined = structure.blocks[structure.blocks[:, 0] != JOINT]
        joined = joined[joined[:, 0] != TENDON][:, 3:5]
        points = np.unique(joined[joined >= 0]).astype(np.int64)
        return Mechanism(
            kinematics_of(model, structure.frames, points, self.centres), self.tables.closures, self.joints,
            structure.passive, structure.actuated, structure.actuated_qpos, *self._weights,
        )  # fmt: skip

    def confirm(self, residual: FloatArray, what: str = "") -> None:
        """Refuse poses in which MuJoCo finds the loops open by *residual* ``(n,)``, although they were closed.

        Raises
        ------
        ModelError
            Kinematics of the package's own differ from MuJoCo's.
        """
        worst = int(np.argmax(residual)) if len(residual) else 0
        if len(residual) and not residual[worst] <= CONFIRMED * self.tolerance.residual:
            raise ModelError(
                f"{self.structure.file}: {what or f'sample {worst}'}: MuJoCo finds the loops open by"
                f" {residual[worst]:.3g} m where they were closed (allowed:"
                f" {CONFIRMED * self.tolerance.residual:.3g}); this is a fault of the workbench, please report it with"
                " the file",
                file=self.structure.file,
                value=float(residual[worst]),
            )

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
        drawn = np.abs(self._rows(home)[1])
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

    def _solved(self, qpos: FloatArray) -> FloatArray:
        return loop_rows(self.engine, self.tables, qpos)

    @property
    def at_home(self) -> Assembly:
        """The pose from which all others are reached, and what is known of it."""
        return self._home

    def jacobian(self, qpos: FloatArray) -> FloatArray:
        """Constraint Jacobian ``(m, nv)`` of one configuration ``(nq,)``, not to be written into."""
        return self._rows(qpos[None, :])[0]

    def _rows(self, qpos: FloatArray) -> tuple[FloatArray, FloatArray]:
        """`constraint_jacobian` of one configuration ``(1, nq)``; the last one's is kept, which is the home pose's."""
        last = self._seen
        if last is None or not np.array_equal(last[0], qpos):
            last = self._seen = qpos.copy(), constraint_jacobian(self.engine, self.tables, qpos)
        return last[1]

    def jacobian_near_home(self, way: FloatArray) -> FloatArray:
        """Constraint Jacobian of the closed pose that is nearest to home moved by a velocity ``(nv,)``."""
        moved = np.empty_like(self.home)
        integrate(self.home, way, self.joints, moved)
        return self.jacobian(self._close_freely(moved[None, :])[0][0])

    def _close_freely(self, qpos: FloatArray) -> tuple[FloatArray, float]:
        """Close one configuration ``(1, nq)`` by least-norm Newton steps on all joints, the actuated ones included.

        Returns the best pose met and its residual.
        """
        best, least = qpos.copy(), np.inf
        for _ in range(FREE_STEPS):
            jacobian, open_by = constraint_jacobian(self.engine, self.tables, qpos)
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

    def _newton(self, evaluator: Evaluator, start: FloatArray, aim: FloatArray) -> Assembly:
        """Newton on the passive joints of up to a block of configurations; the actuated coordinates stay."""
        count = len(start)
        start[:, self.structure.actuated_qpos] = aim
        found = self._nothing(count, aim.shape[1])
        if self.mechanism is not None:
            work = bench(self.mechanism)
            advance(self.mechanism, self.rules(), work, NEAR, start, start, 0, count, *found.closed, np.zeros(0))
            return found
        qpos = evaluator.qpos
        qpos[:count] = start
        limits, room = self.limits, room_to_factor(self.structure.rows, len(self.structure.passive))
        active = np.arange(count)
        for _ in range(NEWTON_STEPS):
            poses = evaluator.place(active)
            active = newton_step(
                active, self.tables.closures, self.joints, self.tables.split, self._side_table, poses.tables, limits,
                qpos, found.qpos, found.residual, found.tangent, found.rank, found.condition, found.weakest, found.side,
                room,
            )  # fmt: skip
            if not len(active):
                break
        return found

    def _continue(
        self,
        evaluator: Evaluator,
        here: Assembly,
        origin: FloatArray,
        target: FloatArray,
        names: np.ndarray,
        marked_below: float,
    ) -> tuple[Assembly, np.ndarray]:
        if self.mechanism is None:
            return super()._continue(evaluator, here, origin, target, names, marked_below)
        done = np.zeros(len(target))
        rules = self.rules(marked_below or SMALLEST_STEP)
        advance(
            self.mechanism, rules, bench(self.mechanism), LINES, np.array(origin, order="C"),
            np.array(target, order="C"), 0, len(target), *here.closed, done,
        )  # fmt: skip
        if (done < 1.0).any() and not marked_below:
            row = int(np.argmax(done < 1.0))
            reached = origin[row] + (target[row] - origin[row]) * done[row]
            self._refuse(int(names[row]), target[row], reached, here.at(slice(row, row + 1)))
        return here, done >= 1.0

    def _refuse(self, sample: int, target: FloatArray, reached: FloatArray, there: Assembly) -> None:
        joint = int(np.argmax(np.abs(target - reached)))
        shown = ", ".join(
            f"{name} = {value:.6g}" for name, value in zip(self.structure.joint_names, target, strict=True)
        )
        raise MotionError(
            f"sample {sample}, joint {self.structure.joint_names[joint]}: the loops cannot be closed at {shown}; the"
            f" way there ends at {reached[joint]:.6g}",
            sample=sample,
            joint=self.structure.joint_names[joint],
            value=target.tolist(),
            reached=reached.tolist(),
        )


def constraint_jacobian(engine: Engine, tables: Tables, qpos: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Constraint Jacobian ``(m, nv)``, spin rows last, and residual ``(m,)`` of one configuration ``(1, nq)``."""
    poses, rows = engine.poses(qpos), int(tables.closures.block_rows[-1])
    jacobian, residual = np.zeros((rows, poses.cdof.shape[1])), np.zeros(rows)
    constraint_rows(tables.closures, tables.joints, qpos[0], *(array[0] for array in poses.tables), jacobian, residual)
    return jacobian, residual


def loop_rows(engine: Engine, tables: Tables, qpos: FloatArray) -> FloatArray:
    """Constraint Jacobians ``(k, m, nv)`` of configurations ``(k, nq)``, spin rows last."""
    found = np.zeros((len(qpos), int(tables.closures.block_rows[-1]), engine.model.nv))
    open_by = np.zeros(found.shape[1])

    def block(evaluator: Evaluator, rows: slice) -> None:
        evaluator.qpos[: rows.stop - rows.start] = qpos[rows]
        poses = evaluator.place(np.arange(rows.stop - rows.start, dtype=np.int32))
        for place, sample in enumerate(range(rows.start, rows.stop)):
            here = (array[place] for array in poses.tables)
            constraint_rows(tables.closures, tables.joints, qpos[sample], *here, found[sample], open_by)

    engine.in_blocks(block, len(qpos))
    return found
