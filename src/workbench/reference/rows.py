"""Constraint rows of one sample, compiled: residuals, Jacobian, second derivatives.

All kinematics come from MuJoCo. Motion vectors follow its com-based convention: (angular, linear) about the centre of
mass of the kinematic tree.
"""

from __future__ import annotations

import numpy as np

from workbench.compiled import borrowing, inlined
from workbench.reference.kinds import CONNECT, JOINT, SPIN, TENDON, WELD


@inlined
def point_rows(cdof, com, moving, depth, body, point, sign, row, jac):  # type: ignore[no-untyped-def]
    """Add sign times the translational Jacobian ``(3, nv)`` of a body's point to rows row..row+2."""
    rx, ry, rz = point[0] - com[0], point[1] - com[1], point[2] - com[2]
    one, two, three = np.uint64(row), np.uint64(row + 1), np.uint64(row + 2)
    for k in range(depth[body]):
        d = np.uint64(moving[body, k])
        wx, wy, wz = cdof[d, 0], cdof[d, 1], cdof[d, 2]
        jac[one, d] += sign * (cdof[d, 3] + wy * rz - wz * ry)
        jac[two, d] += sign * (cdof[d, 4] + wz * rx - wx * rz)
        jac[three, d] += sign * (cdof[d, 5] + wx * ry - wy * rx)


@inlined
def _turn_rows(cdof, moving, depth, body, sign, row, jac):  # type: ignore[no-untyped-def]
    """Add sign times the rotational Jacobian ``(3, nv)`` of a body to rows row..row+2."""
    one, two, three = np.uint64(row), np.uint64(row + 1), np.uint64(row + 2)
    for k in range(depth[body]):
        d = np.uint64(moving[body, k])
        jac[one, d] += sign * cdof[d, 0]
        jac[two, d] += sign * cdof[d, 1]
        jac[three, d] += sign * cdof[d, 2]


@inlined
def _relative_turn(qa, qb, out, row):  # type: ignore[no-untyped-def]
    """Small rotation vector, world frame, from orientation b to orientation a (unit quaternions w, x, y, z)."""
    w = qa[0] * qb[0] + qa[1] * qb[1] + qa[2] * qb[2] + qa[3] * qb[3]
    x = -qa[0] * qb[1] + qa[1] * qb[0] - qa[2] * qb[3] + qa[3] * qb[2]
    y = -qa[0] * qb[2] + qa[1] * qb[3] + qa[2] * qb[0] - qa[3] * qb[1]
    z = -qa[0] * qb[3] - qa[1] * qb[2] + qa[2] * qb[1] + qa[3] * qb[0]
    sign = 2.0 if w >= 0.0 else -2.0
    out[row], out[row + 1], out[row + 2] = sign * x, sign * y, sign * z


@inlined
def _end(site_xpos, anchors, point, i):  # type: ignore[no-untyped-def]
    """Coordinate i of a rod's end: a site or frame, or the anchor of a joint."""
    return site_xpos[point, i] if point >= 0 else anchors[-1 - point, i]


@borrowing
def residuals(closures, joints, qpos, site_xpos, site_xquat, res):  # type: ignore[no-untyped-def]
    """Fill the residual ``(m,)`` of one sample: how far its loops are open, m and rad."""
    blocks, block_rows, polynomials, tendons = (
        closures.blocks, closures.block_rows, closures.polynomials, closures.tendons
    )  # fmt: skip
    _kinds, qpos_of, _dof_of = joints
    for k in range(blocks.shape[0]):
        kind, s1, s2, row = blocks[k, 0], blocks[k, 3], blocks[k, 4], block_rows[k]
        if kind in (CONNECT, WELD):
            for i in range(3):
                res[row + i] = site_xpos[s1, i] - site_xpos[s2, i]
            if kind == WELD:
                _relative_turn(site_xquat[s1], site_xquat[s2], res, row + 3)
        elif kind == JOINT:
            y = qpos[qpos_of[s2]] if s2 >= 0 else 0.0
            res[row] = qpos[qpos_of[s1]] - _polynomial(polynomials[k], y)
        elif kind == SPIN:
            res[row] = 0.0
        elif kind == TENDON:
            y, z = 0.0, 0.0
            for j in range(tendons.shape[1]):
                if tendons[s1, j] != 0.0:
                    z += tendons[s1, j] * qpos[qpos_of[j]]
                if s2 >= 0 and tendons[s2, j] != 0.0:
                    y += tendons[s2, j] * qpos[qpos_of[j]]
            res[row] = z - _polynomial(polynomials[k], y)


@inlined
def _polynomial(c, y):  # type: ignore[no-untyped-def]
    return c[0] + y * (c[1] + y * (c[2] + y * (c[3] + y * c[4])))


@inlined
def _slope(c, y):  # type: ignore[no-untyped-def]
    return c[1] + y * (2.0 * c[2] + y * (3.0 * c[3] + y * 4.0 * c[4]))


@borrowing
def jacobian_rows(closures, joints, qpos, cdof, com, site_xpos, anchors, jac):  # type: ignore[no-untyped-def]
    """Fill the constraint Jacobian ``(m, nv)`` of one sample."""
    blocks, block_rows, polynomials = closures.blocks, closures.block_rows, closures.polynomials
    root, moving, depth, tendons = closures.root, closures.moving, closures.depth, closures.tendons
    _kinds, qpos_of, dof_of = joints
    for i in range(jac.shape[0]):
        for d in range(jac.shape[1]):
            jac[i, d] = 0.0
    for k in range(blocks.shape[0]):
        kind, b1, b2, s1, s2 = blocks[k, 0], blocks[k, 1], blocks[k, 2], blocks[k, 3], blocks[k, 4]
        row = block_rows[k]
        if kind in (CONNECT, WELD):
            point_rows(cdof, com[root[b1]], moving, depth, b1, site_xpos[s1], 1.0, row, jac)
            point_rows(cdof, com[root[b2]], moving, depth, b2, site_xpos[s2], -1.0, row, jac)
            if kind == WELD:
                _turn_rows(cdof, moving, depth, b1, 1.0, row + 3, jac)
                _turn_rows(cdof, moving, depth, b2, -1.0, row + 3, jac)
        elif kind == JOINT:
            jac[row, dof_of[s1]] = 1.0
            if s2 >= 0:
                jac[row, dof_of[s2]] = -_slope(polynomials[k], qpos[qpos_of[s2]])
        elif kind == SPIN:
            # the rod's axis runs from its near end to its far end; scaled by the length, so that rows are metres
            for j in range(depth[b1]):
                d = moving[b1, j]
                s = 0.0
                for i in range(3):
                    s += cdof[d, i] * (_end(site_xpos, anchors, s1, i) - _end(site_xpos, anchors, s2, i))
                jac[row, d] = s
        elif kind == TENDON:
            y = 0.0
            if s2 >= 0:
                for j in range(tendons.shape[1]):
                    if tendons[s2, j] != 0.0:
                        y += tendons[s2, j] * qpos[qpos_of[j]]
            slope = _slope(polynomials[k], y)
            for j in range(tendons.shape[1]):
                if tendons[s1, j] != 0.0:
                    jac[row, dof_of[j]] += tendons[s1, j]
                if s2 >= 0 and tendons[s2, j] != 0.0:
                    jac[row, dof_of[j]] -= slope * tendons[s2, j]


@borrowing
def constraint_rows(closures, joints, qpos, cdof, com, site_xpos, site_xquat, anchors, jac, res):  # type: ignore[no-untyped-def]
    """Fill the constraint Jacobian ``(m, nv)`` and residual ``(m,)`` of one sample."""
    residuals(closures, joints, qpos, site_xpos, site_xquat, res)
    jacobian_rows(closures, joints, qpos, cdof, com, site_xpos, anchors, jac)


@inlined
def body_velocities(bodies, cdof, qvel, v):  # type: ignore[no-untyped-def]
    """Spatial velocities ``(nbody, 6)`` about the centre of mass of each tree."""
    parent, root, first, number = bodies
    for b in range(parent.shape[0]):
        p = parent[b]
        # sums are kept in six numbers, since what is written into an array may be what is read next
        v0, v1, v2, v3, v4, v5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if b > 0 and root[p] == root[b]:
            v0, v1, v2, v3, v4, v5 = v[p, 0], v[p, 1], v[p, 2], v[p, 3], v[p, 4], v[p, 5]
        for d in range(first[b], first[b] + number[b]):
            rate = qvel[d]
            v0 += cdof[d, 0] * rate
            v1 += cdof[d, 1] * rate
            v2 += cdof[d, 2] * rate
            v3 += cdof[d, 3] * rate
            v4 += cdof[d, 4] * rate
            v5 += cdof[d, 5] * rate
        v[b, 0], v[b, 1], v[b, 2], v[b, 3], v[b, 4], v[b, 5] = v0, v1, v2, v3, v4, v5


@inlined
def body_accelerations(bodies, cdof, cdof_dot, qvel, qacc, a):  # type: ignore[no-untyped-def]
    """Spatial accelerations ``(nbody, 6)`` about the centre of mass of each tree, without gravity."""
    parent, root, first, number = bodies
    for b in range(parent.shape[0]):
        p = parent[b]
        a0, a1, a2, a3, a4, a5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if b > 0 and root[p] == root[b]:
            a0, a1, a2, a3, a4, a5 = a[p, 0], a[p, 1], a[p, 2], a[p, 3], a[p, 4], a[p, 5]
        for d in range(first[b], first[b] + number[b]):
            rate, rise = qvel[d], qacc[d]
            a0 += cdof_dot[d, 0] * rate + cdof[d, 0] * rise
            a1 += cdof_dot[d, 1] * rate + cdof[d, 1] * rise
            a2 += cdof_dot[d, 2] * rate + cdof[d, 2] * rise
            a3 += cdof_dot[d, 3] * rate + cdof[d, 3] * rise
            a4 += cdof_dot[d, 4] * rate + cdof[d, 4] * rise
            a5 += cdof_dot[d, 5] * rate + cdof[d, 5] * rise
        a[b, 0], a[b, 1], a[b, 2], a[b, 3], a[b, 4], a[b, 5] = a0, a1, a2, a3, a4, a5


@inlined
def point_motion(v, a, com, point):  # type: ignore[no-untyped-def]
    """Velocity and acceleration of the material point of a body, from its spatial vectors about ``com``."""
    rx, ry, rz = point[0] - com[0], point[1] - com[1], point[2] - com[2]
    vx = v[3] + v[1] * rz - v[2] * ry
    vy = v[4] + v[2] * rx - v[0] * rz
    vz = v[5] + v[0] * ry - v[1] * rx
    ax = a[3] + a[1] * rz - a[2] * ry + v[1] * vz - v[2] * vy
    ay = a[4] + a[2] * rx - a[0] * rz + v[2] * vx - v[0] * vz
    az = a[5] + a[0] * ry - a[1] * rx + v[0] * vy - v[1] * vx
    return vx, vy, vz, ax, ay, az


@borrowing
def acceleration_rows(closures, joints, qpos, com, site_xpos, anchors, qvel, qacc, v, a, out):  # type: ignore[no-untyped-def]
    """Second time derivative of every constraint, ``(m,)``: J qacc + Jdot qvel, from the bodies' motion."""
    blocks, block_rows, polynomials = closures.blocks, closures.block_rows, closures.polynomials
    root, tendons = closures.root, closures.tendons
    _kinds, qpos_of, dof_of = joints
    for k in range(blocks.shape[0]):
        kind, b1, b2, s1, s2 = blocks[k, 0], blocks[k, 1], blocks[k, 2], blocks[k, 3], blocks[k, 4]
        row = block_rows[k]
        if kind in (CONNECT, WELD):
            _, _, _, x1, y1, z1 = point_motion(v[b1], a[b1], com[root[b1]], site_xpos[s1])
            _, _, _, x2, y2, z2 = point_motion(v[b2], a[b2], com[root[b2]], site_xpos[s2])
            out[row], out[row + 1], out[row + 2] = x1 - x2, y1 - y2, z1 - z2
            if kind == WELD:
                for i in range(3):
                    out[row + 3 + i] = a[b1, i] - a[b2, i]
        elif kind == JOINT:
            c = polynomials[k]
            out[row] = qacc[dof_of[s1]]
            if s2 >= 0:
                y, d = qpos[qpos_of[s2]], dof_of[s2]
                first = c[1] + y * (2.0 * c[2] + y * (3.0 * c[3] + y * 4.0 * c[4]))
                second = 2.0 * c[2] + y * (6.0 * c[3] + y * 12.0 * c[4])
                out[row] -= first * qacc[d] + second * qvel[d] ** 2
        elif kind == SPIN:
            # omega . axis = 0 at all times; the axis turns with the body, so its own rate drops out
            s = 0.0
            for i in range(3):
                s += a[b1, i] * (_end(site_xpos, anchors, s1, i) - _end(site_xpos, anchors, s2, i))
            out[row] = s
        elif kind == TENDON:
            c = polynomials[k]
            y, yd, ydd = 0.0, 0.0, 0.0
            out[row] = 0.0
            for j in range(tendons.shape[1]):
                if tendons[s1, j] != 0.0:
                    out[row] += tendons[s1, j] * qacc[dof_of[j]]
                if s2 >= 0 and tendons[s2, j] != 0.0:
                    y += tendons[s2, j] * qpos[qpos_of[j]]
                    yd += tendons[s2, j] * qvel[dof_of[j]]
                    ydd += tendons[s2, j] * qacc[dof_of[j]]
            first = c[1] + y * (2.0 * c[2] + y * (3.0 * c[3] + y * 4.0 * c[4]))
            second = 2.0 * c[2] + y * (6.0 * c[3] + y * 12.0 * c[4])
            out[row] -= first * ydd + second * yd**2
