"""Compiled per-sample arithmetic of the reference: constraint rows, closure steps, projection, joint reactions.

All kinematics, inertia and bias terms come from MuJoCo; what stands here is the algebra of the closed loops. Motion
vectors follow MuJoCo's com-based convention: (angular, linear) about the centre of mass of the kinematic tree.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from workbench.reference.linear import factor, solve, solve_transposed
from workbench.reference.structure import CONNECT, JOINT, SPIN, WELD


@njit(cache=True, error_model="numpy")
def _point_row(cdof, com, moves, body, point, sign, row, jac):  # type: ignore[no-untyped-def]
    """Add sign times the translational Jacobian ``(3, nv)`` of a body's point to rows row..row+2."""
    rx, ry, rz = point[0] - com[0], point[1] - com[1], point[2] - com[2]
    for d in range(cdof.shape[0]):
        if moves[body, d]:
            wx, wy, wz = cdof[d, 0], cdof[d, 1], cdof[d, 2]
            jac[row, d] += sign * (cdof[d, 3] + wy * rz - wz * ry)
            jac[row + 1, d] += sign * (cdof[d, 4] + wz * rx - wx * rz)
            jac[row + 2, d] += sign * (cdof[d, 5] + wx * ry - wy * rx)


@njit(cache=True, error_model="numpy")
def _turn_row(cdof, moves, body, sign, row, jac):  # type: ignore[no-untyped-def]
    """Add sign times the rotational Jacobian ``(3, nv)`` of a body to rows row..row+2."""
    for d in range(cdof.shape[0]):
        if moves[body, d]:
            for i in range(3):
                jac[row + i, d] += sign * cdof[d, i]


@njit(cache=True, error_model="numpy")
def _relative_turn(qa, qb, out):  # type: ignore[no-untyped-def]
    """Small rotation vector, world frame, from orientation b to orientation a (unit quaternions w, x, y, z)."""
    w = qa[0] * qb[0] + qa[1] * qb[1] + qa[2] * qb[2] + qa[3] * qb[3]
    x = -qa[0] * qb[1] + qa[1] * qb[0] - qa[2] * qb[3] + qa[3] * qb[2]
    y = -qa[0] * qb[2] + qa[1] * qb[3] + qa[2] * qb[0] - qa[3] * qb[1]
    z = -qa[0] * qb[3] - qa[1] * qb[2] + qa[2] * qb[1] + qa[3] * qb[0]
    sign = 2.0 if w >= 0.0 else -2.0
    out[0], out[1], out[2] = sign * x, sign * y, sign * z


@njit(cache=True, error_model="numpy")
def rows_sample(  # type: ignore[no-untyped-def]
    cdof, com, moves, root, blocks, block_rows, polynomials, site_xpos, site_xquat, xanchor, joint_q, dof_of, jac, res
):
    """Fill the constraint Jacobian ``(m, nv)`` and residual ``(m,)`` of one sample."""
    jac[:] = 0.0
    res[:] = 0.0
    for k in range(blocks.shape[0]):
        kind, b1, b2, s1, s2 = blocks[k, 0], blocks[k, 1], blocks[k, 2], blocks[k, 3], blocks[k, 4]
        row = block_rows[k]
        if kind in (CONNECT, WELD):
            _point_row(cdof, com[root[b1]], moves, b1, site_xpos[s1], 1.0, row, jac)
            _point_row(cdof, com[root[b2]], moves, b2, site_xpos[s2], -1.0, row, jac)
            for i in range(3):
                res[row + i] = site_xpos[s1, i] - site_xpos[s2, i]
            if kind == WELD:
                _turn_row(cdof, moves, b1, 1.0, row + 3, jac)
                _turn_row(cdof, moves, b2, -1.0, row + 3, jac)
                _relative_turn(site_xquat[s1], site_xquat[s2], res[row + 3 :])
        elif kind == JOINT:
            c = polynomials[k]
            y = joint_q[s2] if s2 >= 0 else 0.0
            jac[row, dof_of[s1]] = 1.0
            res[row] = joint_q[s1] - (c[0] + y * (c[1] + y * (c[2] + y * (c[3] + y * c[4]))))
            if s2 >= 0:
                jac[row, dof_of[s2]] = -(c[1] + y * (2.0 * c[2] + y * (3.0 * c[3] + y * 4.0 * c[4])))
        elif kind == SPIN:
            # the rod's axis runs from its ball joint to its far end; scaled by the length, so that rows are metres
            for d in range(cdof.shape[0]):
                if moves[b1, d]:
                    s = 0.0
                    for i in range(3):
                        s += cdof[d, i] * (site_xpos[s1, i] - xanchor[s2, i])
                    jac[row, d] = s


@njit(cache=True, error_model="numpy")
def _body_acceleration(cdof, cdof_dot, qvel, qacc, moves, body, v, a):  # type: ignore[no-untyped-def]
    """Spatial velocity and acceleration ``(6,)`` of a body about the tree's centre of mass, without gravity."""
    v[:] = 0.0
    a[:] = 0.0
    for d in range(cdof.shape[0]):
        if moves[body, d]:
            for i in range(6):
                v[i] += cdof[d, i] * qvel[d]
                a[i] += cdof_dot[d, i] * qvel[d] + cdof[d, i] * qacc[d]


@njit(cache=True, error_model="numpy")
def _point_acceleration(v, a, com, point, vp, ap):  # type: ignore[no-untyped-def]
    """Velocity and acceleration of the material point of a body, from its spatial vectors about ``com``."""
    rx, ry, rz = point[0] - com[0], point[1] - com[1], point[2] - com[2]
    vp[0] = v[3] + v[1] * rz - v[2] * ry
    vp[1] = v[4] + v[2] * rx - v[0] * rz
    vp[2] = v[5] + v[0] * ry - v[1] * rx
    ap[0] = a[3] + a[1] * rz - a[2] * ry + v[1] * vp[2] - v[2] * vp[1]
    ap[1] = a[4] + a[2] * rx - a[0] * rz + v[2] * vp[0] - v[0] * vp[2]
    ap[2] = a[5] + a[0] * ry - a[1] * rx + v[0] * vp[1] - v[1] * vp[0]


@njit(cache=True, error_model="numpy")
def acceleration_rows(  # type: ignore[no-untyped-def]
    cdof, cdof_dot, com, moves, root, blocks, block_rows, polynomials, site_xpos, xanchor, joint_q, dof_of,
    qvel, qacc, out,
):  # fmt: skip
    """Second time derivative of every constraint, ``(m,)``: J qacc + Jdot qvel."""
    v1, a1, v2, a2 = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    p1, p2, dummy = np.empty(3), np.empty(3), np.empty(3)
    for k in range(blocks.shape[0]):
        kind, b1, b2, s1, s2 = blocks[k, 0], blocks[k, 1], blocks[k, 2], blocks[k, 3], blocks[k, 4]
        row = block_rows[k]
        if kind in (CONNECT, WELD):
            _body_acceleration(cdof, cdof_dot, qvel, qacc, moves, b1, v1, a1)
            _body_acceleration(cdof, cdof_dot, qvel, qacc, moves, b2, v2, a2)
            _point_acceleration(v1, a1, com[root[b1]], site_xpos[s1], dummy, p1)
            _point_acceleration(v2, a2, com[root[b2]], site_xpos[s2], dummy, p2)
            for i in range(3):
                out[row + i] = p1[i] - p2[i]
            if kind == WELD:
                for i in range(3):
                    out[row + 3 + i] = a1[i] - a2[i]
        elif kind == JOINT:
            c = polynomials[k]
            out[row] = qacc[dof_of[s1]]
            if s2 >= 0:
                y, d = joint_q[s2], dof_of[s2]
                first = c[1] + y * (2.0 * c[2] + y * (3.0 * c[3] + y * 4.0 * c[4]))
                second = 2.0 * c[2] + y * (6.0 * c[3] + y * 12.0 * c[4])
                out[row] -= first * qacc[d] + second * qvel[d] ** 2
        elif kind == SPIN:
            # omega . axis = 0 at all times; the axis turns with the body, so its own rate drops out
            _body_acceleration(cdof, cdof_dot, qvel, qacc, moves, b1, v1, a1)
            s = 0.0
            for i in range(3):
                s += a1[i] * (site_xpos[s1, i] - xanchor[s2, i])
            out[row] = s


@njit(cache=True, error_model="numpy")
def integrate(qpos, velocity, kinds, qpos_of, dof_of, out):  # type: ignore[no-untyped-def]
    """Move one configuration along a velocity (hinge, slide, ball), for unit time."""
    for j in range(kinds.shape[0]):
        a, d = qpos_of[j], dof_of[j]
        if kinds[j] == 1:  # ball
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


@njit(cache=True, error_model="numpy")
def closure_steps(  # type: ignore[no-untyped-def]
    ids, cdof, com, moves, root, blocks, block_rows, polynomials, site_xpos, site_xquat, anchors, qpos,
    joints, passive, actuated, change, steps, residuals, ranks,
):  # fmt: skip
    """One linearised closure step for the listed samples.

    For each sample: passive velocities that, with the actuated ones in ``change (n, na)``, bring the residual to zero
    to first order. Fills ``steps (n, nv)``, ``residuals (n,)`` (largest entry, before the step) and ``ranks (n,)``.
    """
    kinds, qpos_of, dof_of = joints
    m, nv, p = block_rows[-1], cdof.shape[1], passive.shape[0]
    jac, res = np.empty((m, nv)), np.empty(m)
    a, beta, perm, x = np.empty((m, p)), np.empty(p), np.empty(p, dtype=np.int64), np.empty(p)
    joint_q = np.empty(kinds.shape[0])
    for n in range(ids.shape[0]):
        s = ids[n]
        for j in range(kinds.shape[0]):
            joint_q[j] = qpos[s, qpos_of[j]]
        rows_sample(
            cdof[s], com[s], moves, root, blocks, block_rows, polynomials, site_xpos[s], site_xquat[s],
            anchors[s], joint_q, dof_of, jac, res,
        )  # fmt: skip
        worst = 0.0
        for i in range(m):
            worst = max(worst, abs(res[i]))
            if math.isnan(res[i]):
                worst = math.inf
            for j in range(p):
                a[i, j] = jac[i, passive[j]]
            res[i] = -res[i]
            for j in range(actuated.shape[0]):
                res[i] -= jac[i, actuated[j]] * change[s, j]
        residuals[s] = worst
        ranks[s] = factor(a, beta, perm)
        solve(a, beta, perm, ranks[s], res, x)
        for d in range(nv):
            steps[s, d] = 0.0
        for j in range(p):
            steps[s, passive[j]] = x[j]
        for j in range(actuated.shape[0]):
            steps[s, actuated[j]] = change[s, j]


@njit(cache=True, error_model="numpy")
def velocities(  # type: ignore[no-untyped-def]
    cdof, com, moves, root, blocks, block_rows, polynomials, site_xpos, site_xquat, anchors, qpos,
    joints, passive, actuated, qd, qvel, residual, rank, condition, weakest,
):  # fmt: skip
    """Full velocities ``(n, nv)`` from actuated ones, with the velocity residual, rank and condition estimate."""
    kinds, qpos_of, dof_of = joints
    m, nv, p = block_rows[-1], cdof.shape[1], passive.shape[0]
    jac, res = np.empty((m, nv)), np.empty(m)
    a, beta, perm, x = np.empty((m, p)), np.empty(p), np.empty(p, dtype=np.int64), np.empty(p)
    joint_q = np.empty(kinds.shape[0])
    for s in range(cdof.shape[0]):
        for j in range(kinds.shape[0]):
            joint_q[j] = qpos[s, qpos_of[j]]
        rows_sample(
            cdof[s], com[s], moves, root, blocks, block_rows, polynomials, site_xpos[s], site_xquat[s],
            anchors[s], joint_q, dof_of, jac, res,
        )  # fmt: skip
        for i in range(m):
            res[i] = 0.0
            for j in range(actuated.shape[0]):
                res[i] -= jac[i, actuated[j]] * qd[s, j]
            for j in range(p):
                a[i, j] = jac[i, passive[j]]
        rank[s] = factor(a, beta, perm)
        solve(a, beta, perm, rank[s], res, x)
        if p == 0:  # an open chain: nothing to solve for, and no entry to look at
            condition[s], weakest[s] = 1.0, actuated[0]
        else:
            condition[s] = abs(a[0, 0] / a[p - 1, p - 1]) if rank[s] == p else math.inf
            weakest[s] = passive[perm[min(rank[s], p - 1)]]
        for j in range(p):
            qvel[s, passive[j]] = x[j]
        for j in range(actuated.shape[0]):
            qvel[s, actuated[j]] = qd[s, j]
        worst = 0.0
        for i in range(m):
            value = 0.0
            for d in range(nv):
                value += jac[i, d] * qvel[s, d]
            worst = max(worst, abs(value))
        residual[s] = worst


@njit(cache=True, error_model="numpy")
def projection(  # type: ignore[no-untyped-def]
    cdof, cdof_dot, com, moves, root, blocks, block_rows, polynomials, site_xpos, site_xquat, anchors, qpos,
    joints, passive, actuated, qvel, qdd, mass, mass_row, mass_col, bias, applied_body, applied_point, applied,
    qacc, tau, multipliers, residual,
):  # fmt: skip
    """Accelerations, actuator torques and least-norm multipliers.

    With W the velocities per unit actuated velocity (J W = 0), tau = W^T (M qacc + bias - applied): the constraint
    forces do no work along W. ``mass (n, nM)`` holds M's lower triangle in the sparse layout of the model.
    """
    kinds, qpos_of, dof_of = joints
    m, nv, p, na = block_rows[-1], cdof.shape[1], passive.shape[0], actuated.shape[0]
    jac, res, rates = np.empty((m, nv)), np.empty(m), np.empty(m)
    a, beta, perm, x = np.empty((m, p)), np.empty(p), np.empty(p, dtype=np.int64), np.empty(p)
    joint_q, force, point_jac = np.empty(kinds.shape[0]), np.empty(nv), np.empty((3, nv))
    passive_force = np.empty(p)
    for s in range(cdof.shape[0]):
        for j in range(kinds.shape[0]):
            joint_q[j] = qpos[s, qpos_of[j]]
        rows_sample(
            cdof[s], com[s], moves, root, blocks, block_rows, polynomials, site_xpos[s], site_xquat[s],
            anchors[s], joint_q, dof_of, jac, res,
        )  # fmt: skip
        for d in range(nv):
            qacc[s, d] = 0.0
        for j in range(na):
            qacc[s, actuated[j]] = qdd[s, j]
        acceleration_rows(
            cdof[s], cdof_dot[s], com[s], moves, root, blocks, block_rows, polynomials, site_xpos[s], anchors[s],
            joint_q, dof_of, qvel[s], qacc[s], rates,
        )  # fmt: skip
        for i in range(m):
            res[i] = -rates[i]
            for j in range(p):
                a[i, j] = jac[i, passive[j]]
        rank = factor(a, beta, perm)
        solve(a, beta, perm, rank, res, x)
        for j in range(p):
            qacc[s, passive[j]] = x[j]
        acceleration_rows(
            cdof[s], cdof_dot[s], com[s], moves, root, blocks, block_rows, polynomials, site_xpos[s], anchors[s],
            joint_q, dof_of, qvel[s], qacc[s], rates,
        )  # fmt: skip
        worst = 0.0
        for i in range(m):
            worst = max(worst, abs(rates[i]))
        residual[s] = worst
        # generalized force of the motion
        for d in range(nv):
            force[d] = bias[s, d]
        for e in range(mass.shape[1]):
            i, j = mass_row[e], mass_col[e]
            force[i] += mass[s, e] * qacc[s, j]
            if i != j:
                force[j] += mass[s, e] * qacc[s, i]
        point_jac[:] = 0.0
        _point_row(cdof[s], com[s, root[applied_body]], moves, applied_body, applied_point[s], 1.0, 0, point_jac)
        for d in range(nv):
            for i in range(3):
                force[d] -= point_jac[i, d] * applied[s, i]
        # J_passive^T lambda = force at the passive freedoms; the rest of the balance is at the actuators
        for j in range(p):
            passive_force[j] = force[passive[j]]
        solve_transposed(a, beta, perm, rank, passive_force, multipliers[s])
        for j in range(na):
            value = force[actuated[j]]
            for i in range(m):
                value -= jac[i, actuated[j]] * multipliers[s, i]
            tau[s, j] = value
