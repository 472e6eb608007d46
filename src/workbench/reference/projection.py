"""The projection of a block of samples onto its closed loops: accelerations, torques, joint reactions; compiled.

All kinematics, inertia and bias terms come from MuJoCo; what stands here is the algebra of the closed loops. Samples go
by groups, whose Jacobians are factored at once (`workbench.reference.many`); where that cannot be, each by itself.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import borrowing, inlined, merged
from workbench.reference.kernels import follow_tangent
from workbench.reference.kinds import CONNECT, WELD
from workbench.reference.linear import Lengths, factor, room_to_factor, solve_beside, solve_transposed
from workbench.reference.many import LANES, Many, factor_many, room_for_many, solve_many, solve_transposed_many
from workbench.reference.rows import (
    acceleration_rows,
    body_accelerations,
    body_velocities,
    constraint_rows,
    point_motion,
)

DUST = 2.0**-52
"""A row of a Jacobian shorter than this part of the whole is rounding of zero, as where a planar loop is held in space
too. It is left out: what changes by that is no more than what the entries of the others are rounded by."""


class ProjectionRoom(NamedTuple):
    """Room for the work of `projection` on a group of samples, the first axis, and on one."""

    jacobian: FloatArray
    """``(lanes, m, nv)``"""
    rates: FloatArray
    """``(lanes, m)``"""
    velocity: FloatArray
    """``(lanes, nbody, 6)`` spatial, as `acceleration`"""
    acceleration: FloatArray
    force: FloatArray
    """``(lanes, nv)``"""
    many: Many
    residual: FloatArray
    a: FloatArray
    beta: FloatArray
    order: np.ndarray
    lengths: Lengths
    columns: np.ndarray
    """``(2, p)`` velocity address of each column to be factored, in the order of the last pivots, and of each pivot"""
    kept: np.ndarray
    """``(m,)`` rows that are factored"""
    needed: np.ndarray
    """``(m,)`` whether a row is"""
    squares: FloatArray
    """``(m,)`` squared lengths of rows"""
    one: FloatArray
    """``(high,)``, as `other`"""
    other: FloatArray
    multipliers: FloatArray
    carried: FloatArray
    """``(nbody, 3)`` forces"""


def projection_room(rows: int, freedoms: int, passive: int, bodies: int, samples: int) -> ProjectionRoom:
    """Room for a model of so many constraint rows, velocities, passive velocities and bodies."""
    m, nv, p, nb, high, lanes = rows, freedoms, passive, bodies, max(rows, passive), min(samples, LANES)
    return ProjectionRoom(
        np.empty((lanes, m, nv)), np.empty((lanes, m)), np.empty((lanes, nb, 6)), np.empty((lanes, nb, 6)),
        np.empty((lanes, nv)), room_for_many(m, p, lanes), np.empty(m), *room_to_factor(m, p, 1),
        np.empty((2, p), dtype=np.int64), np.empty(m, dtype=np.int64), np.empty(m, dtype=np.bool_), np.empty(m),
        np.empty(high), np.empty(high), np.empty(m), np.empty((nb, 3)),
    )  # fmt: skip


@merged
def _need_rows(jac, passive, squares, needed):  # type: ignore[no-untyped-def]
    """Mark the rows that are more than `DUST`; what is no number is."""
    whole = 0.0
    for i in range(squares.shape[0]):
        square = 0.0
        for j in range(passive.shape[0]):
            square += jac[i, passive[j]] * jac[i, passive[j]]
        squares[i] = square
        whole += square
    for i in range(squares.shape[0]):
        needed[i] |= not squares[i] <= DUST * DUST * whole


@merged
def _factor_one(high, count, kept, columns, jac, rates, a, beta, order, lengths):  # type: ignore[no-untyped-def]
    """Factor one sample's rows, with the right-hand side along; returns the rank."""
    p = columns.shape[0]
    for r in range(high):
        for j in range(p + 1):
            a[r, j] = 0.0
    for r in range(count):
        for j in range(p):
            a[r, j] = jac[kept[r], columns[j]]
        a[r, p] = -rates[kept[r]]
    found = factor(a[:high], beta, order, lengths)
    solve_beside(a, p, found)
    return found


@merged
def _factor_group(size, high, count, kept, columns, jac, rates, many):  # type: ignore[no-untyped-def]
    """Factor *size* samples at once and solve for their right-hand sides; whether they agree and have full rank."""
    p, lanes = columns.shape[0], many.sums.shape[0]
    for n in range(lanes):
        s = min(n, size - 1)  # the last sample stands for those that a short group lacks
        for r in range(count):
            for j in range(p):
                many.a[r * (p + 1) + j, n] = jac[s, kept[r], columns[j]]
            many.a[r * (p + 1) + p, n] = -rates[s, kept[r]]
        for r in range(count * (p + 1), high * (p + 1)):
            many.a[r, n] = 0.0
    agree = factor_many(high, many)
    if agree:
        solve_many(many)
    return agree


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
    res, many, multipliers, carried = room.residual, room.many, room.multipliers, room.carried
    a, beta, perm, lengths = room.a, room.beta, room.order, room.lengths
    columns, pivots, kept = room.columns[0], room.columns[1], room.kept
    for j in range(p):
        columns[j] = passive[j]
    samples, start, alone, patience = qpos.shape[0], 0, 0, 1
    while start < samples:
        size = 1 if alone else min(room.force.shape[0], samples - start)
        for i in range(m):
            room.needed[i] = False
        for n in range(size):
            s, jac, rates, v, acc = start + n, room.jacobian[n], room.rates[n], room.velocity[n], room.acceleration[n]
            constraint_rows(
                closures, joints, qpos[s], cdof[s], com[s], site_xpos[s], site_xquat[s], anchors[s], jac, res
            )
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
            acceleration_rows(
                closures, joints, qpos[s], com[s], site_xpos[s], anchors[s], qvel[s], qacc[s], v, acc, rates
            )
            _need_rows(jac, passive, room.squares, room.needed)
        count = 0
        for i in range(m):
            kept[count] = i
            count += room.needed[i]
        high, found = max(count, p), p
        if size == 1:
            found = _factor_one(high, count, kept, columns, room.jacobian[0], room.rates[0], a, beta, perm, lengths)
            for k in range(p):
                pivots[k] = columns[perm[k]]
        elif _factor_group(size, high, count, kept, columns, room.jacobian, room.rates, many):
            patience = 1
            for k in range(p):
                pivots[k] = columns[many.order[k]]
        else:  # by themselves, and the longer, the more often it comes to that
            alone = patience * size
            patience *= 2
            continue
        for n in range(size):
            s, rates, v, acc, force = start + n, room.rates[n], room.velocity[n], room.acceleration[n], room.force[n]
            rank[s], condition[s], weakest[s] = found, 1.0, actuated[0]
            if p:  # else an open chain: nothing to solve for
                last = (p - 1) * (p + 2)
                one, least = (a[0, 0], a[p - 1, p - 1]) if size == 1 else (many.a[0, n], many.a[last, n])
                condition[s] = abs(one / least) if found == p else math.inf
                weakest[s] = pivots[min(found, p - 1)]
            for k in range(p):
                qacc[s, pivots[k]] += a[k, p] if size == 1 else many.x[k, n]
            body_accelerations(bodies, cdof[s], cdof_dot[s], qvel[s], qacc[s], acc)
            acceleration_rows(
                closures, joints, qpos[s], com[s], site_xpos[s], anchors[s], qvel[s], qacc[s], v, acc, rates
            )
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
            _subtract_applied(
                cdof[s], com[s, root[body]], site_xpos[s, site], moving, depth[body], body, applied[s], force
            )
        # J_passive^T lambda = force at the passive freedoms; the rest of the balance is at the actuators
        if size == 1:
            for j in range(p):
                room.one[j] = room.force[0, columns[j]]
            solve_transposed(a[:high], beta, perm, found, room.one[:p], room.other[:high])
        else:
            for k in range(p):
                for n in range(many.sums.shape[0]):
                    many.x[k, n] = room.force[min(n, size - 1), pivots[k]]
            solve_transposed_many(high, many)
        for j in range(p):
            columns[j] = pivots[j]
        for n in range(size):
            s, jac, v, acc, force = start + n, room.jacobian[n], room.velocity[n], room.acceleration[n], room.force[n]
            for i in range(m):
                multipliers[i] = 0.0
            for r in range(count):
                multipliers[kept[r]] = room.other[r] if size == 1 else many.x[r, n]
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
                blocks, block_rows, bodies, masses, gravity, base_rotation, body, com[s], body_com[s], v, acc,
                multipliers, applied[s], carried, reactions, first + s,
            )  # fmt: skip
        start += size
        alone = max(0, alone - size)


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
