"""Compiled arithmetic of the platform's side over a block of samples: Newton with the platform held, accelerations.

The twin of `workbench.reference.kernels`: there the actuated coordinates are given, here task coordinates are, as rows
below those of the loops, and every freedom is solved for.
"""

from __future__ import annotations

import math

import numpy as np

from workbench.compiled import compiled
from workbench.reference.kernels import integrate, keep_if_better
from workbench.reference.linear import Elimination, factor, solve
from workbench.reference.rows import acceleration_rows, body_accelerations, body_velocities, constraint_rows
from workbench.reference.sides import UNKNOWN, side_of
from workbench.reference.task_rows import task_acceleration, task_rows


@compiled
def platform_newton(  # type: ignore[no-untyped-def]
    ids, closures, joints, task, base, table, poses, limits, aim, qpos, kept, best, tangent, rank, condition, weakest,
    side, room,
):  # fmt: skip
    """One Newton step on all joints of the listed samples, the task coordinates at ``aim``; returns the unfinished.

    As `newton_step`, whose results and limits these are; ``tangent (n, nv, m)`` holds velocities per unit velocity of
    the task coordinates. ``room`` is that of `workbench.reference.linear.room_to_factor`.
    """
    cdof, com, site_xpos, site_xquat, anchors = poses
    block_rows, root, moving, depth = closures.block_rows, closures.root, closures.moving, closures.depth
    loops, nv, given = block_rows[-1], cdof.shape[1], aim.shape[1]
    m = loops + given
    jac, res, rhs = np.empty((m, nv)), np.empty(m), np.empty(m)
    values, rise, still = np.empty(given), np.empty(given), np.zeros(3)
    x = np.empty(nv)
    a, beta, perm, lengths = room
    work = Elimination(np.empty((nv, nv)), np.empty(nv, dtype=np.int64))
    active = np.empty_like(ids)
    more = 0
    for n in range(ids.shape[0]):
        s = ids[n]
        constraint_rows(closures, joints, qpos[s], cdof[s], com[s], site_xpos[s], site_xquat[s], anchors[s], jac, res)
        task_rows(
            task, base, moving, depth, root, cdof[s], com[s], site_xpos[s], site_xquat[s], aim[s], still, loops, jac,
            values, rise,
        )  # fmt: skip
        for i in range(given):
            res[loops + i] = values[i] - aim[s, i]
        again, good = keep_if_better(res, limits, qpos[s], kept[s], best, s)
        if not (again or good):
            continue
        for i in range(m):
            for j in range(nv):
                a[i, j] = jac[i, j]
        found = factor(a, beta, perm, lengths)
        if good:
            for j in range(given):
                for i in range(m):
                    rhs[i] = 0.0
                rhs[loops + j] = 1.0
                solve(a, beta, perm, found, rhs, x)
                for k in range(nv):
                    tangent[s, k, j] = x[k]
            rank[s] = found
            condition[s] = abs(a[0, 0] / a[nv - 1, nv - 1]) if found == nv else math.inf
            weakest[s] = perm[min(found, nv - 1)]
            if side[s] == UNKNOWN or limits[3]:  # the step to rounding does not change it
                side[s] = side_of(jac, found, table, work)
        if again:
            for i in range(m):
                rhs[i] = -res[i]
            solve(a, beta, perm, found, rhs, x)
            integrate(qpos[s], x, joints, qpos[s])
            active[more] = s
            more += 1
    return active[:more]


@compiled
def platform_accelerations(  # type: ignore[no-untyped-def]
    closures, joints, bodies, task, base, poses, cdof_dot, aim, xd, xdd, tangent, qpos, qvel, qacc, velocity_residual,
    acceleration_residual, room,
):  # fmt: skip
    """Fill accelerations ``qacc (n, nv)`` of all freedoms from those of the task coordinates, and what is left open.

    ``qvel`` is the tangent times ``xd``; what is open counts loops and task coordinates alike. ``room`` as
    there.
    """
    cdof, com, site_xpos, site_xquat, anchors = poses
    block_rows, root, moving, depth = closures.block_rows, closures.root, closures.moving, closures.depth
    body, site = task[0], task[1]
    loops, nv, given = block_rows[-1], cdof.shape[1], aim.shape[1]
    m, nbody = loops + given, root.shape[0]
    jac, res, rates = np.empty((m, nv)), np.empty(m), np.empty(m)
    values, rise, still = np.empty(given), np.empty(given), np.zeros(3)
    x = np.empty(nv)
    a, beta, perm, lengths = room
    v, acc = np.empty((nbody, 6)), np.empty((nbody, 6))
    for s in range(aim.shape[0]):
        constraint_rows(closures, joints, qpos[s], cdof[s], com[s], site_xpos[s], site_xquat[s], anchors[s], jac, res)
        task_rows(
            task, base, moving, depth, root, cdof[s], com[s], site_xpos[s], site_xquat[s], aim[s], still, loops, jac,
            values, rise,
        )  # fmt: skip
        worst = 0.0
        for i in range(m):
            value = 0.0
            for d in range(nv):
                value += jac[i, d] * qvel[s, d]
            if i >= loops:
                value -= xd[s, i - loops]
            worst = max(worst, abs(value))
            if math.isnan(value):
                worst = math.inf
            for d in range(nv):
                a[i, d] = jac[i, d]
        velocity_residual[s] = worst
        rank = factor(a, beta, perm, lengths)
        for d in range(nv):
            value = 0.0
            for j in range(given):
                value += tangent[s, d, j] * xdd[s, j]
            qacc[s, d] = value
        body_velocities(bodies, cdof[s], qvel[s], v)
        for turn in range(2):
            body_accelerations(bodies, cdof[s], cdof_dot[s], qvel[s], qacc[s], acc)
            acceleration_rows(
                closures, joints, qpos[s], com[s], site_xpos[s], anchors[s], qvel[s], qacc[s], v, acc, rates
            )
            task_acceleration(
                task, base, site_xquat[s, site], aim[s], com[s, root[body]], site_xpos[s, site], v[body], acc[body],
                rates[loops:],
            )  # fmt: skip
            worst = 0.0
            for i in range(m):
                if i >= loops:
                    rates[i] -= xdd[s, i - loops]
                worst = max(worst, abs(rates[i]))
                res[i] = -rates[i]
            if turn == 0:
                solve(a, beta, perm, rank, res, x)
                for d in range(nv):
                    qacc[s, d] += x[d]
        acceleration_residual[s] = worst


@compiled
def platform_jacobian(task, base, closures, poses, aim, rows, values):  # type: ignore[no-untyped-def]
    """Fill ``rows (n, m, nv)``, the task coordinates' Jacobian, and their ``values (n, m)`` nearest to ``aim``."""
    cdof, com, site_xpos, site_xquat, _anchors = poses
    root, moving, depth = closures.root, closures.moving, closures.depth
    rise, still = np.empty(aim.shape[1]), np.zeros(3)
    for s in range(aim.shape[0]):
        task_rows(
            task, base, moving, depth, root, cdof[s], com[s], site_xpos[s], site_xquat[s], aim[s], still, 0, rows[s],
            values[s], rise,
        )  # fmt: skip
