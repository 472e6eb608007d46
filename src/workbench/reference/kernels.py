"""Compiled arithmetic of the reference over a block of samples: closure steps, projection, joint reactions.

All kinematics, inertia and bias terms come from MuJoCo; what stands here is the algebra of the closed loops.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import borrowing, compiled, inlined
from workbench.reference.kinds import BALL, CONNECT, FREE, WELD
from workbench.reference.linear import (
    Elimination,
    Lengths,
    factor,
    room_to_factor,
    solve,
    solve_beside,
    solve_transposed,
)
from workbench.reference.rows import (
    acceleration_rows,
    body_accelerations,
    body_velocities,
    constraint_rows,
    point_motion,
)
from workbench.reference.sides import UNKNOWN, side_of


@borrowing
def integrate(qpos, velocity, joints, out):  # type: ignore[no-untyped-def]
    """Move one configuration along a velocity (hinge, slide, ball, free), for unit time; *out* may be *qpos*."""
    kinds, qpos_of, dof_of = joints
    for j in range(kinds.shape[0]):
        a, d = qpos_of[j], dof_of[j]
        if kinds[j] == FREE:
            # translation in the world's frame, turning in the body's own, as for a ball
            for i in range(3):
                out[a + i] = qpos[a + i] + velocity[d + i]
            a, d = a + 3, d + 3
        if kinds[j] in (BALL, FREE):
            x, y, z = velocity[d], velocity[d + 1], velocity[d + 2]
            angle = math.sqrt(x * x + y * y + z * z)
            half = 0.5 * angle
            s = 0.5 if angle < 1e-12 else math.sin(half) / angle
            c = math.cos(half)
            w0, x0, y0, z0 = qpos[a], qpos[a + 1], qpos[a + 2], qpos[a + 3]
            x, y, z = s * x, s * y, s * z
            w1 = w0 * c - x0 * x - y0 * y - z0 * z
            x1 = w0 * x + x0 * c + y0 * z - z0 * y
            y1 = w0 * y - x0 * z + y0 * c + z0 * x
            z1 = w0 * z + x0 * y - y0 * x + z0 * c
            n = 1.0 / math.sqrt(w1 * w1 + x1 * x1 + y1 * y1 + z1 * z1)
            out[a], out[a + 1], out[a + 2], out[a + 3] = w1 * n, x1 * n, y1 * n, z1 * n
        else:
            out[a] = qpos[a] + velocity[d]


@compiled
def predict(start, tangent, change, joints, weights, out, moved):  # type: ignore[no-untyped-def]
    """Follow the tangent: configurations ``(n, nq)`` after a change ``(n, na)`` of the actuated coordinates.

    ``tangent (n, nv, na)`` holds velocities per unit actuated velocity; ``moved (n,)`` receives the distance, in which
    velocities count by their ``weights (nv,)``.
    """
    step = np.empty(tangent.shape[1])
    for s in range(start.shape[0]):
        follow_tangent(tangent[s], change[s], step)
        squared = 0.0
        for d in range(step.shape[0]):
            squared += (step[d] * weights[d]) ** 2
        moved[s] = math.sqrt(squared)
        integrate(start[s], step, joints, out[s])


@inlined
def follow_tangent(tangent, rates, velocity):  # type: ignore[no-untyped-def]
    """Fill velocity ``(nv,)`` = tangent rates."""
    for d in range(tangent.shape[0]):
        value = 0.0
        for j in range(tangent.shape[1]):
            value += tangent[d, j] * rates[j]
        velocity[d] = value


@borrowing
def velocities(tangent, qd, qvel):  # type: ignore[no-untyped-def]
    """Fill full velocities ``(n, nv)`` from actuated ones ``(n, na)``."""
    for s in range(tangent.shape[0]):
        follow_tangent(tangent[s], qd[s], qvel[s])


@inlined
def keep_if_better(res, limits, qpos, kept, best, s):  # type: ignore[no-untyped-def]
    """Judge a sample by its residuals ``(m,)``: into ``kept (nq,)`` and ``best[s]`` goes what is better than before.

    Returns whether it needs another step, and whether it is better and closed; ``limits`` as of `newton_step`.
    """
    closed, floor, astray, settles = limits
    worst = 0.0
    for i in range(res.shape[0]):
        worst = max(worst, abs(res[i]))
        if math.isnan(res[i]):
            worst = math.inf
    better = worst < best[s] or (settles and worst < astray)
    again = floor < worst < astray and (worst <= best[s] or settles)
    if better:
        best[s] = worst
        for k in range(qpos.shape[0]):
            kept[k] = qpos[k]
    return again, better and worst <= closed


@compiled
def newton_step(  # type: ignore[no-untyped-def]
    ids, closures, joints, split, table, poses, limits, qpos, kept, best, tangent, rank, condition, weakest, side, room
):  # fmt: skip
    """One Newton step on the passive joints of the listed samples; returns those that need another, as a new list.

    ``poses`` belong to ``qpos``. The best configuration so far goes to ``kept``, its largest residual to ``best``; once
    it is closed, also its tangent (velocities per unit actuated velocity), the rank of the passive Jacobian, an
    estimate of its condition, the freedom that it determines worst, and the side of its singular poses by ``table``
    (`workbench.reference.sides`). ``limits``: residual of a closed loop, residual
    at which rounding is reached, residual from which Newton does not come back, and whether the loops agree only to
    some digits: then the residual has a floor of its own, every step counts, and the last one is kept.
    """
    cdof, com, site_xpos, site_xquat, anchors = poses
    passive, actuated = split
    m, nv, p, na = closures.block_rows[-1], cdof.shape[1], passive.shape[0], actuated.shape[0]
    jac, res, rhs = np.empty((m, nv)), np.empty(m), np.empty(m)
    a, beta, perm, lengths = room
    step, work, x = np.zeros(nv), Elimination(np.empty((p, p)), np.empty(p, dtype=np.int64)), np.empty(p)
    active = np.empty_like(ids)
    more = 0
    for n in range(ids.shape[0]):
        s = ids[n]
        constraint_rows(closures, joints, qpos[s], cdof[s], com[s], site_xpos[s], site_xquat[s], anchors[s], jac, res)
        again, good = keep_if_better(res, limits, qpos[s], kept[s], best, s)
        if not (again or good):
            continue
        for i in range(m):
            for j in range(p):
                a[i, j] = jac[i, passive[j]]
        found = factor(a, beta, perm, lengths)
        if good:
            for j in range(na):
                for i in range(m):
                    rhs[i] = -jac[i, actuated[j]]
                solve(a, beta, perm, found, rhs, x)
                for k in range(p):
                    tangent[s, passive[k], j] = x[k]
                for k in range(na):
                    tangent[s, actuated[k], j] = 1.0 if k == j else 0.0
            rank[s] = found
            if p == 0:  # an open chain: nothing to solve for, and no entry to look at
                condition[s], weakest[s] = 1.0, actuated[0]
            else:
                condition[s] = abs(a[0, 0] / a[p - 1, p - 1]) if found == p else math.inf
                weakest[s] = passive[perm[min(found, p - 1)]]
            if side[s] == UNKNOWN or limits[3]:  # the step to rounding does not change it
                side[s] = side_of(jac, found, table, work)
        if again:
            for i in range(m):
                rhs[i] = -res[i]
            solve(a, beta, perm, found, rhs, x)
            for j in range(p):
                step[passive[j]] = x[j]
            integrate(qpos[s], step, joints, qpos[s])
            active[more] = s
            more += 1
    return active[:more]


DUST = 2.0**-52
"""A row of a Jacobian shorter than this part of the whole is rounding of zero, as where a planar loop is held in space
too. It is left out: what changes by that is no more than what the entries of the others are rounded by."""


class ProjectionRoom(NamedTuple):
    """Room for the work of `projection` on one sample."""

    jacobian: FloatArray
    residual: FloatArray
    rates: FloatArray
    a: FloatArray
    beta: FloatArray
    order: np.ndarray
    lengths: Lengths
    columns: np.ndarray
    """``(2, p)`` velocity address of each column to be factored, in the order of the last sample's pivots, and of each
    pivot"""
    kept: np.ndarray
    """``(m,)`` rows that are factored"""
    squares: FloatArray
    """``(m,)`` squared lengths of rows"""
    force: FloatArray
    passive_force: FloatArray
    kept_multipliers: FloatArray
    multipliers: FloatArray
    velocity: FloatArray
    """``(nbody, 6)`` spatial, as `acceleration`"""
    acceleration: FloatArray
    carried: FloatArray
    """``(nbody, 3)`` forces"""


def projection_room(rows: int, freedoms: int, passive: int, bodies: int) -> ProjectionRoom:
    """Room for a model of so many constraint rows, velocities, passive velocities and bodies."""
    m, nv, p, nb = rows, freedoms, passive, bodies
    return ProjectionRoom(
        np.empty((m, nv)), np.empty(m), np.empty(m), *room_to_factor(m, p, 1), np.empty((2, p), dtype=np.int64),
        np.empty(m, dtype=np.int64), np.empty(m), np.empty(nv), np.empty(p), np.empty(max(m, p)), np.empty(m),
        np.empty((nb, 6)), np.empty((nb, 6)), np.empty((nb, 3)),
    )  # fmt: skip


@inlined
def _kept_rows(jac, passive, squares, kept):  # type: ignore[no-untyped-def]
    """List the rows that are more than `DUST`; returns how many. What is no number is kept."""
    whole = 0.0
    for i in range(squares.shape[0]):
        square = 0.0
        for j in range(passive.shape[0]):
            square += jac[i, passive[j]] * jac[i, passive[j]]
        squares[i] = square
        whole += square
    count = 0
    for i in range(squares.shape[0]):
        kept[count] = i
        count += not squares[i] <= DUST * DUST * whole
    return count


@borrowing
def projection(  # type: ignore[no-untyped-def]
    closures, joints, split, bodies, poses, dynamics, mass_layout, platform, masses, gravity, base_rotation,
    base_position, qpos, qvel, tangent, qdd, applied, qacc, tau, closure_residual, velocity_residual,
    acceleration_residual, rank, condition, weakest, motion, turning, reactions, slack, first, room,
):  # fmt: skip
    """Accelerations, actuator torques, platform motion and reaction forces of a block.

    With W the tangent (J W = 0), tau = W^T (M qacc + bias - applied): the constraint forces do no work along W. Their
    least-norm values come from the same factor as qacc and are the loop reactions; its pivots say ``rank (n,)``,
    estimate ``condition (n,)`` and name the freedom that is ``weakest (n,)``. ``mass`` holds M's lower triangle.
    ``motion (3, n, 3)`` receives x, xd, xdd; ``turning``, three arrays, the platform site's rotation ``(n, 3, 3)``, its
    angular velocity and acceleration ``(n, 3)``; ``reactions (loops + joints, n, 3)`` forces; all in the base's frame.
    ``gravity (nbody, 3)`` is what pulls each body. ``slack (n, na)``, or empty, receives what the rows' disagreement is
    worth: the power, per actuated velocity, of least-norm multipliers along ``J W``, which is zero in loops that close.
    """
    cdof, com, site_xpos, site_xquat, anchors = poses
    cdof_dot, mass, bias, damping, body_com = dynamics
    mass_row, mass_col = mass_layout
    passive, actuated = split
    body, site = platform
    blocks, block_rows = closures.blocks, closures.block_rows
    root, moving, depth = closures.root, closures.moving, closures.depth
    m, nv, p, na = block_rows[-1], cdof.shape[1], passive.shape[0], actuated.shape[0]
    jac, res, rates = room.jacobian, room.residual, room.rates
    a, beta, perm, lengths = room.a, room.beta, room.order, room.lengths
    force, passive_force, multipliers = room.force, room.passive_force, room.multipliers
    v, acc, carried = room.velocity, room.acceleration, room.carried
    columns, pivots, kept = room.columns[0], room.columns[1], room.kept
    for j in range(p):
        columns[j] = passive[j]
    for s in range(qpos.shape[0]):
        constraint_rows(closures, joints, qpos[s], cdof[s], com[s], site_xpos[s], site_xquat[s], anchors[s], jac, res)
        worst, open_by = 0.0, 0.0
        for i in range(m):
            value = 0.0
            for d in range(nv):
                value += jac[i, d] * qvel[s, d]
            # a maximum passes over what is no number
            worst = math.inf if math.isnan(value) else max(worst, abs(value))
            open_by = math.inf if math.isnan(res[i]) else max(open_by, abs(res[i]))
        closure_residual[s], velocity_residual[s] = open_by, worst
        follow_tangent(tangent[s], qdd[s], qacc[s])
        body_velocities(bodies, cdof[s], qvel[s], v)
        body_accelerations(bodies, cdof[s], cdof_dot[s], qvel[s], qacc[s], acc)
        acceleration_rows(closures, joints, qpos[s], com[s], site_xpos[s], anchors[s], qvel[s], qacc[s], v, acc, rates)
        count = _kept_rows(jac, passive, room.squares, kept)
        for n in range(count):
            i = kept[n]
            a[n, p] = -rates[i]
            for j in range(p):
                a[n, j] = jac[i, columns[j]]
        high = max(count, p)
        for n in range(count, high):
            for j in range(p + 1):
                a[n, j] = 0.0
        rank[s] = found = factor(a[:high], beta, perm, lengths)
        for k in range(p):
            pivots[k] = columns[perm[k]]
        if p == 0:  # an open chain: nothing to solve for
            condition[s], weakest[s] = 1.0, actuated[0]
        else:
            condition[s] = abs(a[0, 0] / a[p - 1, p - 1]) if found == p else math.inf
            weakest[s] = pivots[min(found, p - 1)]
        solve_beside(a, p, found)
        for k in range(p):
            qacc[s, pivots[k]] += a[k, p]
        body_accelerations(bodies, cdof[s], cdof_dot[s], qvel[s], qacc[s], acc)
        acceleration_rows(closures, joints, qpos[s], com[s], site_xpos[s], anchors[s], qvel[s], qacc[s], v, acc, rates)
        worst = 0.0
        for i in range(m):
            worst = math.inf if math.isnan(rates[i]) else max(worst, abs(rates[i]))
        acceleration_residual[s] = worst
        # generalized force of the motion
        for d in range(nv):
            force[d] = bias[s, d] - damping[s, d]
        for e in range(mass.shape[1]):
            i, j = mass_row[e], mass_col[e]
            force[i] += mass[s, e] * qacc[s, j]
            if i != j:
                force[j] += mass[s, e] * qacc[s, i]
        _subtract_applied(cdof[s], com[s, root[body]], site_xpos[s, site], moving, depth[body], body, applied[s], force)
        # J_passive^T lambda = force at the passive freedoms; the rest of the balance is at the actuators
        for j in range(p):
            passive_force[j] = force[columns[j]]
        solve_transposed(a[:high], beta, perm, found, passive_force, room.kept_multipliers[:high])
        for i in range(m):
            multipliers[i] = 0.0
        for n in range(count):
            multipliers[kept[n]] = room.kept_multipliers[n]
        for j in range(p):
            columns[j] = pivots[j]
        for j in range(na):
            value = force[actuated[j]]
            for i in range(m):
                value -= jac[i, actuated[j]] * multipliers[i]
            tau[s, j] = value
        if slack.shape[0]:
            for j in range(na):
                slack[s, j] = 0.0
            for i in range(m):
                for j in range(na):
                    value = 0.0
                    for d in range(nv):
                        value += jac[i, d] * tangent[s, d, j]
                    slack[s, j] += abs(multipliers[i] * value)
        px, py, pz = site_xpos[s, site, 0], site_xpos[s, site, 1], site_xpos[s, site, 2]
        vx, vy, vz, ax, ay, az = point_motion(v[body], acc[body], com[s, root[body]], site_xpos[s, site])
        px, py, pz = px - base_position[0], py - base_position[1], pz - base_position[2]
        for k in range(3):
            rx, ry, rz = base_rotation[0, k], base_rotation[1, k], base_rotation[2, k]
            motion[0, first + s, k] = px * rx + py * ry + pz * rz
            motion[1, first + s, k] = vx * rx + vy * ry + vz * rz
            motion[2, first + s, k] = ax * rx + ay * ry + az * rz
        _turning(base_rotation, site_xquat[s, site], v[body], acc[body], turning, s)
        _reactions(
            blocks, block_rows, bodies, masses, gravity, base_rotation, body, com[s], body_com[s], v, acc, multipliers,
            applied[s], carried, reactions, first + s,
        )  # fmt: skip


@inlined
def _turning(base_rotation, quaternion, v, acc, turning, s):  # type: ignore[no-untyped-def]
    """Rotation, angular velocity and angular acceleration of a site (unit quaternion, world) in the base's frame."""
    rotation, omega, alpha = turning
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    for k in range(3):
        rx, ry, rz = base_rotation[0, k], base_rotation[1, k], base_rotation[2, k]
        rotation[s, k, 0] = rx * (1.0 - 2.0 * (y * y + z * z)) + ry * 2.0 * (x * y + w * z) + rz * 2.0 * (x * z - w * y)
        rotation[s, k, 1] = rx * 2.0 * (x * y - w * z) + ry * (1.0 - 2.0 * (x * x + z * z)) + rz * 2.0 * (y * z + w * x)
        rotation[s, k, 2] = rx * 2.0 * (x * z + w * y) + ry * 2.0 * (y * z - w * x) + rz * (1.0 - 2.0 * (x * x + y * y))
        omega[s, k] = v[0] * rx + v[1] * ry + v[2] * rz
        alpha[s, k] = acc[0] * rx + acc[1] * ry + acc[2] * rz


@inlined
def _subtract_applied(cdof, com, point, moving, depth, body, applied, force):  # type: ignore[no-untyped-def]
    """Take off the generalized force ``(nv,)`` of an external force at a point of a body."""
    rx, ry, rz = point[0] - com[0], point[1] - com[1], point[2] - com[2]
    for k in range(depth):
        d = moving[body, k]
        wx, wy, wz = cdof[d, 0], cdof[d, 1], cdof[d, 2]
        force[d] -= (
            applied[0] * (cdof[d, 3] + wy * rz - wz * ry)
            + applied[1] * (cdof[d, 4] + wz * rx - wx * rz)
            + applied[2] * (cdof[d, 5] + wx * ry - wy * rx)
        )


@inlined
def _reactions(  # type: ignore[no-untyped-def]
    blocks, block_rows, bodies, masses, gravity, base_rotation, platform, com, body_com, v, acc, multipliers, applied,
    carried, reactions, s,
):  # fmt: skip
    """Forces at the loop closures, then through each body's joints, from Newton's law of everything beyond them."""
    parent, root, _first, _number = bodies
    for b in range(parent.shape[0]):
        _, _, _, ax, ay, az = point_motion(v[b], acc[b], com[root[b]], body_com[b])
        carried[b, 0] = masses[b] * (ax - gravity[b, 0])
        carried[b, 1] = masses[b] * (ay - gravity[b, 1])
        carried[b, 2] = masses[b] * (az - gravity[b, 2])
    for i in range(3):
        carried[platform, i] -= applied[i]
    loops = 0
    for k in range(blocks.shape[0]):
        if not is_site_closure(blocks, k):
            continue
        for i in range(3):
            force = multipliers[block_rows[k] + i]
            carried[blocks[k, 1], i] -= force
            carried[blocks[k, 2], i] += force
        for i in range(3):
            value = 0.0
            for j in range(3):
                value += multipliers[block_rows[k] + j] * base_rotation[j, i]
            reactions[loops, s, i] = value
        loops += 1
    for b in range(parent.shape[0] - 1, 0, -1):
        for i in range(3):
            carried[parent[b], i] += carried[b, i]
        for i in range(3):
            value = 0.0
            for j in range(3):
                value += carried[b, j] * base_rotation[j, i]
            reactions[loops + b - 1, s, i] = value


@inlined
def is_site_closure(blocks, k):  # type: ignore[no-untyped-def]
    """Whether a block joins two places of bodies, and so carries a force that is reported."""
    return blocks[k, 0] in (CONNECT, WELD)
