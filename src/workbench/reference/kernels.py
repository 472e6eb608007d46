"""Compiled arithmetic of the reference over a block of samples: closure steps.

All kinematics, inertia and bias terms come from MuJoCo; what stands here is the algebra of the closed loops.
"""

from __future__ import annotations

import math

import numpy as np

from workbench.compiled import borrowing, compiled, inlined
from workbench.reference.kinds import BALL, FREE
from workbench.reference.linear import Elimination, factor, solve
from workbench.reference.rows import constraint_rows
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
