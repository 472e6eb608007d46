"""Loop closures in Pinocchio's kinematics: residuals, Jacobian, accelerations, and Newton on the passive joints.

Written for one sample at a time and apart from the MuJoCo reference, with which it shares only the list of closures.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError, MotionError
from workbench.reference.kinds import CONNECT, JOINT, SPIN, WELD
from workbench.reference.pinocchio_reader import Reading
from workbench.reference.structure import Structure

CLOSED = 1e-13
"""Largest residual of a closed loop, metres (for turns: radians)."""

RANK = 1e-9
"""Singular values below this fraction of the largest count as zero: an exact redundancy leaves 1e-16."""

NEWTON_STEPS = 20
LONGEST_STEP = 0.2
"""Norm over all joints (rad, m) of a step towards a sample; the next bound means little for longer ones."""

CORRECTION = 0.1
"""A step counts when the correction after it is smaller than this fraction of it: no jump to another assembly."""

NEGLIGIBLE = 1e-7
"""Corrections below this (rad, m) are rounding, whatever the step."""

SMALLEST_STEP = 1e-6
"""Fraction of the way to a sample below which the way is taken as blocked."""
POOL_SPACING = 32
"""One closed sample in so many is kept as a start for later ones, beside the last one and the home pose."""


@dataclass(frozen=True)
class Linear:
    """Closures at one configuration."""

    residual: FloatArray
    """``(m,)`` metres, radians"""
    jacobian: FloatArray
    """``(m, nv)``"""


class PinocchioLoops:
    """The closed loops of one model, with Pinocchio's own numbering of freedoms."""

    def __init__(self, pin: ModuleType, reading: Reading, structure: Structure, compiled: mujoco.MjModel) -> None:
        self.pin = pin
        self.model = reading.model
        self.data = self.model.createData()
        self.structure = structure
        self._reading = reading
        owner = {int(compiled.jnt_dofadr[j]): place for j, place in enumerate(reading.joints)}
        self.actuated = np.array([self.model.idx_vs[owner[int(d)]] for d in structure.actuated])
        self.actuated_q = np.array([self.model.idx_qs[owner[int(d)]] for d in structure.actuated])
        self.passive = np.setdiff1d(np.arange(self.model.nv), self.actuated)
        self.home = self._close_home(self._from_mujoco(structure.home_qpos, compiled))

    def _from_mujoco(self, qpos: FloatArray, compiled: mujoco.MjModel) -> FloatArray:
        q: FloatArray = self.pin.neutral(self.model)
        for joint, place in enumerate(self._reading.joints):
            here, there = int(compiled.jnt_qposadr[joint]), self.model.idx_qs[place]
            if self.model.nqs[place] == 4:
                w, x, y, z = qpos[here : here + 4]
                q[there : there + 4] = x, y, z, w
            else:
                q[there] = qpos[here]
        normal: FloatArray = self.pin.normalize(self.model, q)
        return normal

    def linear(self, q: FloatArray) -> Linear:
        """Residual and Jacobian of all closures; leaves frame placements in ``data``."""
        pin, model, data = self.pin, self.model, self.data
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        rows, residuals = [], []
        for block, polynomial in zip(self.structure.blocks, self.structure.polynomials, strict=True):
            kind, one, two = int(block[0]), int(block[3]), int(block[4])
            if kind in (CONNECT, WELD):
                a, b = data.oMf[self._reading.sites[one]], data.oMf[self._reading.sites[two]]
                relative = self.frame_jacobian(one) - self.frame_jacobian(two)
                rows.append(relative[: 6 if kind == WELD else 3])
                residuals.append(a.translation - b.translation)
                if kind == WELD:
                    residuals.append(pin.log3(a.rotation @ b.rotation.T))
            elif kind == JOINT:
                row, open_by = self._joint_row(q, one, two, polynomial)
                rows.append(row)
                residuals.append(open_by)
            elif kind == SPIN:
                rows.append(self._rod(one, two)[None] @ self._turning(int(block[1])))
                residuals.append(np.zeros(1))
        if not rows:
            return Linear(np.zeros(0), np.zeros((0, model.nv)))
        return Linear(np.concatenate(residuals), np.vstack(rows))

    def frame_jacobian(self, site: int) -> FloatArray:
        """Jacobian ``(6, nv)`` of a site, linear rows first, world axes."""
        frame = self._reading.sites[site]
        world_axes = self.pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        jacobian: FloatArray = self.pin.getFrameJacobian(self.model, self.data, frame, world_axes)
        return jacobian.reshape(6, -1)  # with one freedom Pinocchio returns a vector

    def _rod(self, far: int, near: int) -> FloatArray:
        """The vector between a rod's ends; as long as the rod, so that rows are metres a second."""
        rod: FloatArray = self._end(far) - self._end(near)
        return rod

    def _end(self, point: int) -> FloatArray:
        """A site or frame, or the anchor of joint ``-1 - point``."""
        if point < 0:
            return np.array(self.data.oMi[self._reading.joints[-1 - point]].translation)
        return np.array(self.data.oMf[self._reading.sites[point]].translation)

    def _turning(self, body: int) -> FloatArray:
        """Angular Jacobian ``(3, nv)`` of a body, world axes."""
        world_axes = self.pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        frame = self._reading.bodies[body]
        jacobian: FloatArray = self.pin.getFrameJacobian(self.model, self.data, frame, world_axes).reshape(6, -1)[3:]
        return jacobian

    def _turn_rate(self, body: int) -> FloatArray:
        """Angular acceleration ``(3,)`` of a body, world axes; needs forward kinematics."""
        world_axes = self.pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        frame = self._reading.bodies[body]
        rate: FloatArray = self.pin.getFrameAcceleration(self.model, self.data, frame, world_axes).angular
        return rate

    def _joint_row(self, q: FloatArray, one: int, two: int, c: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joint equality; the structure's polynomial is already one of the coordinates themselves."""
        first = self._reading.joints[one]
        row = np.zeros((1, self.model.nv))
        row[0, self.model.idx_vs[first]] = 1.0
        y = 0.0
        if two >= 0:
            second = self._reading.joints[two]
            y = q[self.model.idx_qs[second]]
            row[0, self.model.idx_vs[second]] = -np.polynomial.polynomial.polyval(y, c[1:] * np.arange(1, 5))
        value = q[self.model.idx_qs[first]] - np.polynomial.polynomial.polyval(y, c)
        return row, np.array([value])

    def drift(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Second derivative of the closures ``(m,)`` that the velocities alone produce; velocities stay in ``data``."""
        pin, model, data = self.pin, self.model, self.data
        pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
        pin.updateFramePlacements(model, data)
        out = []
        for block, c in zip(self.structure.blocks, self.structure.polynomials, strict=True):
            kind, one, two = int(block[0]), int(block[3]), int(block[4])
            if kind in (CONNECT, WELD):
                relative = self.acceleration(one) - self.acceleration(two)
                out.append(relative[: 6 if kind == WELD else 3])
            elif kind == JOINT:
                bend = 0.0
                if two >= 0:
                    place = self._reading.joints[two]
                    y = q[model.idx_qs[place]]
                    curve = c[2:] * np.array([2.0, 6.0, 12.0])
                    bend = np.polynomial.polynomial.polyval(y, curve) * v[model.idx_vs[place]] ** 2
                out.append(np.array([-bend]))
            elif kind == SPIN:
                # omega . axis = 0 at all times and the axis turns with the rod, so its own rate drops out
                out.append(np.array([self._rod(one, two) @ self._turn_rate(int(block[1]))]))
        return np.concatenate(out) if out else np.zeros(0)

    def acceleration(self, site: int) -> FloatArray:
        """Acceleration ``(6,)`` of a site's material point, linear first, world axes; needs forward kinematics."""
        frame = self._reading.sites[site]
        motion: FloatArray = self.pin.getFrameClassicalAcceleration(
            self.model, self.data, frame, self.pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        ).vector
        return motion

    def solve(self, jacobian: FloatArray, right: FloatArray) -> tuple[FloatArray, int]:
        """Least-squares passive freedoms for ``jacobian[:, passive] x = right``, and the rank."""
        x, _, rank, _ = np.linalg.lstsq(jacobian[:, self.passive], right, rcond=RANK)
        return np.asarray(x, dtype=np.float64), int(rank)

    def close(self, q: FloatArray, ordered: bool = False) -> tuple[FloatArray, FloatArray]:
        """Close the loops for actuated coordinates ``(n, na)``: in any order of samples, or as one motion, in order.

        Returns
        -------
        tuple
            Configurations ``(n, nq)``, Pinocchio's order, and residuals ``(n,)``.

        Raises
        ------
        MotionError
            A sample cannot be reached from the home pose without leaving its assembly.
        """
        configurations, residuals = np.zeros((len(q), self.model.nq)), np.zeros(len(q))
        scale = np.maximum(np.ptp(q, axis=0), 1e-9) if len(q) else np.ones(q.shape[1])
        pool_q, pool = np.empty((len(q) // POOL_SPACING + 2, q.shape[1])), [self.home]
        pool_q[0] = self.home[self.actuated_q]
        for sample, aim in enumerate(q):
            known = pool_q[: len(pool)]
            nearest = int(np.argmin(np.sum(((known - aim) / scale) ** 2, axis=1)))
            start = pool[nearest]
            if sample and np.sum(((q[sample - 1] - aim) / scale) ** 2) < np.sum(((known[nearest] - aim) / scale) ** 2):
                start = configurations[sample - 1]
            if ordered and sample:
                found = self._reach(configurations[sample - 1], aim)
            else:
                found = self._reach(start, aim) or self._reach(self.home, aim)
            if found is None:
                self._refuse(sample, aim)
            else:
                configurations[sample], residuals[sample] = found
            if sample % POOL_SPACING == 0:
                pool_q[len(pool)] = aim
                pool.append(configurations[sample])
        return configurations, residuals

    def _reach(self, start: FloatArray, aim: FloatArray) -> tuple[FloatArray, float] | None:
        """Follow the closed configurations from *start* to the actuated coordinates *aim*; None where the way ends."""
        here, origin = start, start[self.actuated_q]
        done, step, residual = 0.0, 1.0, 0.0
        jacobian = self.linear(here).jacobian
        while done < 1.0:
            part = min(step, 1.0 - done)
            to = aim if done + part >= 1.0 else origin + (done + part) * (aim - origin)
            after = self._step(here, jacobian, to)
            if after is not None:
                (here, residual, jacobian), done, step = after, done + part, 2.0 * step
            else:
                step = 0.5 * part
                if step < SMALLEST_STEP:
                    return None
        return here, residual

    def _step(
        self, here: FloatArray, jacobian: FloatArray, to: FloatArray
    ) -> tuple[FloatArray, float, FloatArray] | None:
        """Go along the tangent to the actuated coordinates *to* and close; None where that may be another assembly."""
        velocity = np.zeros(self.model.nv)
        velocity[self.actuated] = to - here[self.actuated_q]
        velocity[self.passive] = self.solve(jacobian, -jacobian[:, self.actuated] @ velocity[self.actuated])[0]
        moved = float(np.linalg.norm(velocity))
        if not moved <= LONGEST_STEP:
            return None
        predicted = self.pin.integrate(self.model, here, velocity)
        predicted[self.actuated_q] = to
        closed, residual, after = self._newton(predicted)
        correction = np.linalg.norm(self.pin.difference(self.model, predicted, closed))
        small = residual <= CLOSED and correction <= max(CORRECTION * moved, NEGLIGIBLE)
        return (closed, residual, after) if small and self._same_side(jacobian, after) else None

    def _same_side(self, before: FloatArray, after: FloatArray) -> bool:
        """Whether no singular pose lies between two neighbours, which another assembly would be beyond.

        The change T of the passive columns, ``before T = after``, is near one for near neighbours; a column that lost
        its independence on the way and regained it the other way round is an eigenvalue on the other side of zero.
        """
        if not len(self.passive):
            return True
        change = np.linalg.lstsq(before[:, self.passive], after[:, self.passive], rcond=RANK)[0]
        return bool(np.isfinite(change).all() and np.linalg.eigvals(change).real.min() > 0.0)

    def _newton(self, q: FloatArray) -> tuple[FloatArray, float, FloatArray]:
        """Newton on the passive joints until rounding stops it; the best configuration, its residual and Jacobian."""
        best, least, jacobian = q, np.inf, np.zeros((0, 0))
        for _ in range(NEWTON_STEPS):
            now = self.linear(q)
            residual = float(np.abs(now.residual).max(initial=0.0))
            if not residual < least:  # no better, or not a number
                break
            best, least, jacobian = q, residual, now.jacobian
            if residual <= 0.01 * CLOSED:
                break
            step = np.zeros(self.model.nv)
            step[self.passive] = self.solve(now.jacobian, -now.residual)[0]
            q = self.pin.integrate(self.model, q, step)
        return best, least, jacobian

    def _close_home(self, q: FloatArray) -> FloatArray:
        closed, residual, _ = self._newton(q)
        file = self.structure.file
        if not residual <= CLOSED:
            raise ModelError(
                f"{file}: Pinocchio cannot close the loops from the home pose; they stay open by {residual:.3g} m"
                f" (allowed: {CLOSED:g})",
                file=file,
                value=residual,
            )
        _, rank = self.solve(self.linear(closed).jacobian, np.zeros(self.structure.rows))
        if rank < len(self.passive):
            loose = len(self.passive) - rank
            raise ModelError(
                f"{file}: {loose} freedom(s) that no actuator holds; add an actuator or a constraint", file=file
            )
        return closed

    def _refuse(self, sample: int, aim: FloatArray) -> None:
        names = self.structure.joint_names
        shown = ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, aim, strict=True))
        joint = names[int(np.argmax(np.abs(aim - self.home[self.actuated_q])))]
        raise MotionError(
            f"sample {sample}, joint {joint}: Pinocchio cannot close the loops at {shown} from the home pose",
            sample=sample,
            joint=joint,
            value=aim.tolist(),
        )
