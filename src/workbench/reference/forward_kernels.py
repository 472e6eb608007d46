"""Forward dynamics of a closed chain in its actuated coordinates, in machine code: M(q) qdd + h(q, qd) = tau.

With W all velocities per actuated one (J W = 0), M = W^T M_tree W and h = W^T (M_tree c + bias - applied), c the full
accelerations at qdd = 0. Loops are closed by Newton at every evaluation, from the configuration that the step began at,
by the rules of `workbench.reference.closing`. Bodies are summed one by one in world coordinates; nothing here is
MuJoCo's own evaluation, which `workbench.reference.forward` holds it against.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import borrowing, compiled, merged, types
from workbench.reference.bench import Mechanism
from workbench.reference.closing import _copy, _copy_rows, _on_side, close_one, solve_again
from workbench.reference.kernels import follow_tangent, integrate
from workbench.reference.kinematics import FLOATING, TURNING, _turned
from workbench.reference.rows import acceleration_rows, point_motion
from workbench.shielded import shielded

with shielded():
    from numba.experimental import structref

DONE, OPEN, LOST = 0, 1, 2
"""How a stretch of time ended: at its end, where the loops cannot be closed on the branch, where numbers are lost."""


class Masses(NamedTuple):
    """What moves and what acts on it; SI, world frame where no other is named."""

    mass: FloatArray
    """``(nbody,)``"""
    centre: FloatArray
    """``(nbody, 3)`` mass centre in the body's frame"""
    inertia: FloatArray
    """``(nbody, 3, 3)`` about the mass centre, axes of the body's frame"""
    pull: FloatArray
    """``(nbody, 3)`` gravity that the body feels, m/s^2"""
    armature: FloatArray
    """``(nv,)``"""
    damping: FloatArray
    """``(nv,)``"""
    dry: FloatArray
    """``(nv,)`` largest dry friction"""
    soft: float
    """rad/s or m/s: below this speed dry friction is softened, by tanh"""
    stiffness: FloatArray
    """``(nv,)`` of springs of hinges and slides"""
    rest: FloatArray
    """``(nv,)`` their coordinates without force"""
    address: np.ndarray
    """``(nv,)`` coordinate of each hinge's and slide's velocity"""
    platform: int
    """body that carries the platform site"""
    site: FloatArray
    """``(3,)`` the site in the body's frame"""
    force: FloatArray
    """``(3,)`` external force on the site"""


class Room(NamedTuple):
    """The state, and room for the work on it."""

    q: FloatArray
    """``(na,)``"""
    qd: FloatArray
    qdd: FloatArray
    mass: FloatArray
    """``(na, na)`` of the last evaluation"""
    bias: FloatArray
    """``(na,)``"""
    carried: FloatArray
    """``(nv,)`` full accelerations at qdd = 0"""
    carried_here: FloatArray
    """``(nv,)`` the same where the step began"""
    qvel: FloatArray
    rates: FloatArray
    v: FloatArray
    """``(nbody, 6)`` spatial velocities about each tree's fixed point"""
    a: FloatArray
    more: FloatArray
    """``(nbody, 6)`` what passive accelerations add to them"""
    per_rate: FloatArray
    """``(nbody, 6, na)`` spatial velocity per actuated velocity"""
    stages: FloatArray
    """``(5, na)``: three accelerations, coordinates, velocities"""
    site: FloatArray
    """``(3,)`` the platform's site"""
    factor: FloatArray
    """``(na, na)``"""
    linear: FloatArray
    """``(6, na)``"""
    frames: FloatArray
    """``(3, 3, 3)``"""


@structref.register
class HeldType(types.StructRef):  # type: ignore[misc]
    """To the compiler, a plant's arrays held together."""


class Held(structref.StructRefProxy):  # type: ignore[misc]
    """A plant's arrays, handed to machine code once: taking some hundred out of Python takes longer than a step."""


structref.define_proxy(Held, HeldType, ["mechanism", "rules", "masses", "bench", "room"])


@compiled
def hold(mechanism, rules, masses, bench, room):  # type: ignore[no-untyped-def]
    """Hold a plant's arrays together, for `move`; they stay the same arrays."""
    return Held(mechanism, rules, masses, bench, room)


def room_for(mechanism: Mechanism) -> Room:
    """Room for one mechanism."""
    na, nv, nb = len(mechanism.actuated), len(mechanism.weights), len(mechanism.kinematics.parent)
    m = int(mechanism.closures.block_rows[-1])
    return Room(
        np.zeros(na), np.zeros(na), np.zeros(na), np.zeros((na, na)), np.zeros(na), np.zeros(nv), np.zeros(nv),
        np.zeros(nv), np.zeros(m), np.zeros((nb, 6)), np.zeros((nb, 6)), np.zeros((nb, 6)),
        np.zeros((nb, 6, na)), np.zeros((5, na)), np.zeros(3), np.zeros((na, na)), np.zeros((6, na)),
        np.zeros((3, 3, 3)),
    )  # fmt: skip


@borrowing
def _motions(kin, cdof, qvel, qacc, tangent, v, a, per_rate):  # type: ignore[no-untyped-def]
    """Spatial velocities, accelerations, and velocities per actuated velocity of all bodies, about fixed points."""
    na = tangent.shape[1]
    for b in range(1, kin.parent.shape[0]):
        p = kin.parent[b]
        for i in range(6):
            v[b, i], a[b, i] = v[p, i], a[p, i]
            for k in range(na):
                per_rate[b, i, k] = per_rate[p, i, k]
        for j in range(kin.first[b], kin.first[b] + kin.number[b]):
            first, count = kin.dof_of[j], 1
            if kin.kind[j] == FLOATING:
                # along the world's axes, which do not turn
                for e in range(first, first + 3):
                    for i in range(6):
                        v[b, i] += cdof[e, i] * qvel[e]
                        a[b, i] += cdof[e, i] * qacc[e]
                        for k in range(na):
                            per_rate[b, i, k] += cdof[e, i] * tangent[e, k]
                first, count = first + 3, 3
            elif kin.kind[j] == TURNING:
                count = 3
            # the axes move with what carries the joint
            w0, w1, w2, l0, l1, l2 = v[b, 0], v[b, 1], v[b, 2], v[b, 3], v[b, 4], v[b, 5]
            for e in range(first, first + count):
                s0, s1, s2, t0, t1, t2 = cdof[e, 0], cdof[e, 1], cdof[e, 2], cdof[e, 3], cdof[e, 4], cdof[e, 5]
                rate = qvel[e]
                a[b, 0] += (w1 * s2 - w2 * s1) * rate
                a[b, 1] += (w2 * s0 - w0 * s2) * rate
                a[b, 2] += (w0 * s1 - w1 * s0) * rate
                a[b, 3] += (w1 * t2 - w2 * t1 + l1 * s2 - l2 * s1) * rate
                a[b, 4] += (w2 * t0 - w0 * t2 + l2 * s0 - l0 * s2) * rate
                a[b, 5] += (w0 * t1 - w1 * t0 + l0 * s1 - l1 * s0) * rate
                for i in range(6):
                    v[b, i] += cdof[e, i] * rate
                    a[b, i] += cdof[e, i] * qacc[e]
                    for k in range(na):
                        per_rate[b, i, k] += cdof[e, i] * tangent[e, k]


@merged
def _add_accelerations(kin, cdof, qacc, more, a):  # type: ignore[no-untyped-def]
    """Add to the bodies' accelerations what *qacc* ``(nv,)`` brings: they are linear in it."""
    for b in range(1, kin.parent.shape[0]):
        for i in range(6):
            more[b, i] = more[kin.parent[b], i]
        for j in range(kin.first[b], kin.first[b] + kin.number[b]):
            first = kin.dof_of[j]
            count = 6 if kin.kind[j] == FLOATING else (3 if kin.kind[j] == TURNING else 1)
            for e in range(first, first + count):
                for i in range(6):
                    more[b, i] += cdof[e, i] * qacc[e]
        for i in range(6):
            a[b, i] += more[b, i]


@borrowing
def _forces(kin, masses, xpos, xquat, v, a, per_rate, lines, frames, mass, bias):  # type: ignore[no-untyped-def]
    """Add all bodies' inertia to ``mass (na, na)``, ``bias (na,)``; room: ``lines (6, na)``, ``frames (3, 3, 3)``."""
    na = bias.shape[0]
    turn, inertia, half = frames[0], frames[1], frames[2]
    for b in range(1, masses.mass.shape[0]):
        x, y, z = _turned(xquat[b], masses.centre[b])
        point = xpos[b, 0] + x, xpos[b, 1] + y, xpos[b, 2] + z
        rx, ry, rz = point[0] - kin.centre[b, 0], point[1] - kin.centre[b, 1], point[2] - kin.centre[b, 2]
        w, qx, qy, qz = xquat[b, 0], xquat[b, 1], xquat[b, 2], xquat[b, 3]
        turn[0, 0], turn[0, 1], turn[0, 2] = 1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - w * qz), 2 * (qx * qz + w * qy)
        turn[1, 0], turn[1, 1], turn[1, 2] = 2 * (qx * qy + w * qz), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz - w * qx)
        turn[2, 0], turn[2, 1], turn[2, 2] = 2 * (qx * qz - w * qy), 2 * (qy * qz + w * qx), 1 - 2 * (qx * qx + qy * qy)
        for i in range(3):
            for j in range(3):
                half[i, j] = 0.0
                for k in range(3):
                    half[i, j] += turn[i, k] * masses.inertia[b, k, j]
        for i in range(3):
            for j in range(3):
                inertia[i, j] = half[i, 0] * turn[j, 0] + half[i, 1] * turn[j, 1] + half[i, 2] * turn[j, 2]
        for k in range(na):
            s0, s1, s2 = per_rate[b, 0, k], per_rate[b, 1, k], per_rate[b, 2, k]
            lines[0, k], lines[1, k], lines[2, k] = s0, s1, s2
            lines[3, k] = per_rate[b, 3, k] + s1 * rz - s2 * ry
            lines[4, k] = per_rate[b, 4, k] + s2 * rx - s0 * rz
            lines[5, k] = per_rate[b, 5, k] + s0 * ry - s1 * rx
        _, _, _, ax, ay, az = point_motion(v[b], a[b], kin.centre[b], point)
        m = masses.mass[b]
        fx, fy, fz = m * (ax - masses.pull[b, 0]), m * (ay - masses.pull[b, 1]), m * (az - masses.pull[b, 2])
        w0, w1, w2 = v[b, 0], v[b, 1], v[b, 2]
        h0 = inertia[0, 0] * w0 + inertia[0, 1] * w1 + inertia[0, 2] * w2
        h1 = inertia[1, 0] * w0 + inertia[1, 1] * w1 + inertia[1, 2] * w2
        h2 = inertia[2, 0] * w0 + inertia[2, 1] * w1 + inertia[2, 2] * w2
        n0 = inertia[0, 0] * a[b, 0] + inertia[0, 1] * a[b, 1] + inertia[0, 2] * a[b, 2] + w1 * h2 - w2 * h1
        n1 = inertia[1, 0] * a[b, 0] + inertia[1, 1] * a[b, 1] + inertia[1, 2] * a[b, 2] + w2 * h0 - w0 * h2
        n2 = inertia[2, 0] * a[b, 0] + inertia[2, 1] * a[b, 1] + inertia[2, 2] * a[b, 2] + w0 * h1 - w1 * h0
        for k in range(na):
            bias[k] += lines[0, k] * n0 + lines[1, k] * n1 + lines[2, k] * n2
            bias[k] += lines[3, k] * fx + lines[4, k] * fy + lines[5, k] * fz
            h0 = inertia[0, 0] * lines[0, k] + inertia[0, 1] * lines[1, k] + inertia[0, 2] * lines[2, k]
            h1 = inertia[1, 0] * lines[0, k] + inertia[1, 1] * lines[1, k] + inertia[1, 2] * lines[2, k]
            h2 = inertia[2, 0] * lines[0, k] + inertia[2, 1] * lines[1, k] + inertia[2, 2] * lines[2, k]
            l0, l1, l2 = m * lines[3, k], m * lines[4, k], m * lines[5, k]
            for j in range(k + 1):
                mass[k, j] += l0 * lines[3, j] + l1 * lines[4, j] + l2 * lines[5, j]
                mass[k, j] += h0 * lines[0, j] + h1 * lines[1, j] + h2 * lines[2, j]


@borrowing
def _evaluate(mechanism, masses, w, r, qpos, tangent, velocity):  # type: ignore[no-untyped-def]
    """Fill M, h and the accelerations that the loops carry, for *velocity* ``(na,)`` where `close_one` was last."""
    kin, seen = mechanism.kinematics, w.seen
    na, nv = velocity.shape[0], r.carried.shape[0]
    follow_tangent(tangent, velocity, r.qvel)
    for d in range(nv):
        r.carried[d] = 0.0
    _motions(kin, w.places.cdof, r.qvel, r.carried, tangent, r.v, r.a, r.per_rate)
    if mechanism.passive.shape[0]:
        acceleration_rows(
            mechanism.closures, mechanism.joints, qpos, kin.centre, seen.site_xpos, seen.anchors, r.qvel, r.carried,
            r.v, r.a, r.rates,
        )  # fmt: skip
        for i in range(r.rates.shape[0]):
            r.rates[i] = -r.rates[i]
        solve_again(mechanism, w, r.rates, r.carried)
        _add_accelerations(kin, w.places.cdof, r.carried, r.more, r.a)
    for k in range(na):
        r.bias[k] = 0.0
        for j in range(na):
            r.mass[k, j] = 0.0
    _forces(kin, masses, w.places.xpos, w.places.xquat, r.v, r.a, r.per_rate, r.linear, r.frames, r.mass, r.bias)
    for d in range(nv):
        force = masses.armature[d] * r.carried[d] + masses.damping[d] * r.qvel[d]
        if masses.dry[d] > 0.0:
            force += masses.dry[d] * math.tanh(r.qvel[d] / masses.soft)
        if masses.stiffness[d] > 0.0:
            force += masses.stiffness[d] * (qpos[masses.address[d]] - masses.rest[d])
        for k in range(na):
            r.bias[k] += tangent[d, k] * force
            if masses.armature[d] > 0.0:
                for j in range(k + 1):
                    r.mass[k, j] += masses.armature[d] * tangent[d, k] * tangent[d, j]
    b = masses.platform
    x, y, z = _turned(w.places.xquat[b], masses.site)
    r.site[0], r.site[1], r.site[2] = w.places.xpos[b, 0] + x, w.places.xpos[b, 1] + y, w.places.xpos[b, 2] + z
    rx, ry, rz = r.site[0] - kin.centre[b, 0], r.site[1] - kin.centre[b, 1], r.site[2] - kin.centre[b, 2]
    for k in range(na):
        s0, s1, s2 = r.per_rate[b, 0, k], r.per_rate[b, 1, k], r.per_rate[b, 2, k]
        r.bias[k] -= masses.force[0] * (r.per_rate[b, 3, k] + s1 * rz - s2 * ry)
        r.bias[k] -= masses.force[1] * (r.per_rate[b, 4, k] + s2 * rx - s0 * rz)
        r.bias[k] -= masses.force[2] * (r.per_rate[b, 5, k] + s0 * ry - s1 * rx)
        for j in range(k):
            r.mass[j, k] = r.mass[k, j]


@borrowing
def accelerations(r, tau, qdd):  # type: ignore[no-untyped-def]
    """Solve M qdd = tau - h by Cholesky's factor; whether M is positive definite."""
    na, low = tau.shape[0], r.factor
    for k in range(na):
        for j in range(k + 1):
            value = r.mass[k, j]
            for i in range(j):
                value -= low[k, i] * low[j, i]
            if j < k:
                low[k, j] = value / low[j, j]
            elif not value > 0.0:
                return False
            else:
                low[k, k] = math.sqrt(value)
    for k in range(na):
        value = tau[k] - r.bias[k]
        for i in range(k):
            value -= low[k, i] * qdd[i]
        qdd[k] = value / low[k, k]
    for k in range(na - 1, -1, -1):
        value = qdd[k]
        for i in range(k + 1, na):
            value -= low[i, k] * qdd[i]
        qdd[k] = value / low[k, k]
    return True


@merged
def _close_at(mechanism, rules, w, r, q, time):  # type: ignore[no-untyped-def]
    """Close the loops at *q* ``(na,)``, *time* after the step began, from its configuration; whether on the branch."""
    squared, moved = 0.0, 0.0
    for j in range(q.shape[0]):
        w.ways[2, j] = q[j] - w.here[mechanism.actuated_qpos[j]]
    follow_tangent(w.tangent_here, w.ways[2], w.step)
    for d in range(w.step.shape[0]):
        w.step[d] += 0.5 * time * time * r.carried_here[d]
        moved += (w.step[d] * mechanism.weights[d]) ** 2
    if not moved <= rules.longest**2:
        return False
    integrate(w.here, w.step, mechanism.joints, w.predicted)
    for j in range(q.shape[0]):
        w.predicted[mechanism.actuated_qpos[j]] = q[j]
    _copy(w.predicted, w.qpos)
    w.away[0] = math.sqrt(moved) if time > 0.0 else math.inf  # where a run begins nothing was factored
    close_one(mechanism, rules, w)
    for i in range(w.here.shape[0]):
        squared += ((w.kept[i] - w.predicted[i]) * mechanism.coordinate_weights[i]) ** 2
    small = math.sqrt(squared) <= max(rules.correction * math.sqrt(moved), rules.negligible)
    return w.facts[0] <= rules.closed and small and w.facts[1] == mechanism.passive.shape[0]


@merged
def _stage(r, stage, h):  # type: ignore[no-untyped-def]
    """Fill coordinates and velocities ``(na,)`` of a stage of Nystrom's method, from the accelerations so far."""
    first, second, third, fourth, q, v = r.stages[0], r.stages[1], r.stages[2], r.qdd, r.stages[3], r.stages[4]
    for j in range(q.shape[0]):
        if stage == 1:
            q[j] = r.q[j] + 0.5 * h * r.qd[j] + 0.125 * h * h * first[j]
            v[j] = r.qd[j] + 0.5 * h * first[j]
        elif stage == 2:
            v[j] = r.qd[j] + 0.5 * h * second[j]
        elif stage == 3:
            q[j] = r.q[j] + h * r.qd[j] + 0.5 * h * h * third[j]
            v[j] = r.qd[j] + h * third[j]
        else:
            q[j] = r.q[j] + h * r.qd[j] + h * h / 6.0 * (first[j] + second[j] + third[j])
            v[j] = r.qd[j] + h / 6.0 * (first[j] + 2.0 * second[j] + 2.0 * third[j] + fourth[j])


@compiled
def move(held, tau, duration, steps, stand):  # type: ignore[no-untyped-def]
    """Move on by *duration* under constant torques ``(na,)``, in equal steps of Nystrom's classical method, order four.

    The second and third stage share their coordinates, so a step closes the loops three times. With *stand* time does
    not move on: the state that the room and ``Bench.here`` hold is closed and evaluated. One kernel for both, and each
    call in it once, since handing so many arrays over takes seconds to compile.
    """
    mechanism, rules, masses, w, r = held.mechanism, held.rules, held.masses, held.bench, held.room
    na, h = tau.shape[0], 0.0 if stand else duration / steps
    q, v = r.stages[3], r.stages[4]
    for _ in range(steps):
        if not stand and not accelerations(r, tau, r.stages[0]):
            return LOST
        for stage in range(4 if stand else 1, 5):
            if stand:
                for j in range(na):
                    r.qdd[j] = r.stages[0, j] = r.stages[1, j] = r.stages[2, j] = 0.0
            _stage(r, stage, h)
            if stage != 2 and not _close_at(mechanism, rules, w, r, q, 0.5 * h if stage == 1 else h):
                return OPEN
            if stage == 4:
                if not _on_side(mechanism, w):
                    return OPEN
                _copy(w.kept, w.here)
                _copy_rows(w.tangent, w.tangent_here)
                w.sides[1] = w.sides[0]
                for j in range(na):
                    r.q[j], r.qd[j] = q[j], v[j]
            _evaluate(mechanism, masses, w, r, w.kept, w.tangent, v)
            if stage == 4:
                _copy(r.carried, r.carried_here)
            elif not accelerations(r, tau, r.qdd if stage == 3 else r.stages[stage]):
                return LOST
    return DONE
