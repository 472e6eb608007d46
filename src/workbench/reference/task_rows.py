"""Task coordinates of the platform over samples, compiled: values, Jacobian rows, and what moves them at second order.

The convention (which number a rotation has) is that of `workbench.reference.task`; all kinematics come from MuJoCo.
"""

from __future__ import annotations

import math

import numpy as np

from workbench.compiled import compiled, inlined
from workbench.reference.rows import point_motion, point_rows

SERIES = 0.5
"""rad: below this angle the coefficients of the rotation vector's rates are summed as series, which lose no digit."""

TURNED_OVER = 1e-8
"""Squared cosine of half the lean; below it the lean is half a turn, and the angle about an axis has no value (NaN)."""


@compiled
def turn_coordinates(axes, quaternion, aim, omega, values, rates, rise):  # type: ignore[no-untyped-def]
    """Rotation coordinates about the base axes ``axes (k,)`` of an orientation (unit quaternion, base frame).

    ``values (k,)`` receives the coordinates, of all that stand for this orientation those nearest to ``aim (k,)``;
    ``rates (k, 3)`` the matrix G with d/dt values = G omega; ``rise (k,)`` its share of the second derivative,
    dG/dt omega, at angular velocity ``omega (3,)``, base frame.
    """
    if axes.shape[0] == 1:
        _twist(axes[0], quaternion, aim, omega, values, rates, rise)
    elif axes.shape[0] > 1:
        _rotation_vector(axes, quaternion, aim, omega, values, rates, rise)


@inlined
def _twist(i, quaternion, aim, omega, values, rates, rise):  # type: ignore[no-untyped-def]
    """The angle about base axis i: of the quaternion (w, v), 2 atan2(v_i, w).

    With vd = (w omega + omega x v)/2 and wd = -omega.v/2 its rate is N.omega/D, N = w^2 e_i + w v x e_i + v_i v and
    D = w^2 + v_i^2.
    """
    j, k = (i + 1) % 3, (i + 2) % 3
    w, vi, vj, vk = quaternion[0], quaternion[1 + i], quaternion[1 + j], quaternion[1 + k]
    oi, oj, ok = omega[i], omega[j], omega[k]
    turn = 2.0 * math.pi
    angle = 2.0 * math.atan2(vi, w)
    values[0] = angle + turn * math.floor((aim[0] - angle) / turn + 0.5)
    d = w * w + vi * vi
    if d < TURNED_OVER:
        values[0] = rise[0] = math.nan
        rates[0, i], rates[0, j], rates[0, k] = math.nan, math.nan, math.nan
        return
    ni, nj, nk = d, w * vk + vi * vj, vi * vk - w * vj
    rates[0, i], rates[0, j], rates[0, k] = 1.0, nj / d, nk / d
    wd = -0.5 * (oi * vi + oj * vj + ok * vk)
    vid = 0.5 * (w * oi + oj * vk - ok * vj)
    vjd = 0.5 * (w * oj + ok * vi - oi * vk)
    vkd = 0.5 * (w * ok + oi * vj - oj * vi)
    nid = 2.0 * (w * wd + vi * vid)
    njd = wd * vk + w * vkd + vid * vj + vi * vjd
    nkd = vid * vk + vi * vkd - wd * vj - w * vjd
    along = ni * oi + nj * oj + nk * ok
    rise[0] = (nid * oi + njd * oj + nkd * ok) / d - along * nid / (d * d)


@compiled
def _rotation_vector(axes, quaternion, aim, omega, values, rates, rise):  # type: ignore[no-untyped-def]
    """Components of the rotation vector r, R = exp [r]x: rd = (1 - [r]x/2 + c [r]x^2) omega."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    size = math.sqrt(x * x + y * y + z * z)
    principal = 2.0 * math.atan2(size, w)
    v, r = np.empty(3), np.empty(3)
    v[0], v[1], v[2] = x, y, z
    # r and r (1 +- 2 pi / |r|) are one orientation; of no rotation at all only the zero vector is a smooth reading
    best, angle, factor = math.inf, principal, 2.0
    if size > 1e-12:
        for n in range(-1, 2):
            other = (principal + 2.0 * math.pi * n) / size
            off = 0.0
            for k in range(axes.shape[0]):
                off += (other * v[axes[k]] - aim[k]) ** 2
            if off < best:
                best, angle, factor = off, principal + 2.0 * math.pi * n, other
    for k in range(3):
        r[k] = factor * v[k]
    c, slope = _coefficients(angle)
    dot = r[0] * omega[0] + r[1] * omega[1] + r[2] * omega[2]
    square = angle * angle
    rd = np.empty(3)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        cross = r[j] * omega[k] - r[k] * omega[j]
        rd[i] = omega[i] - 0.5 * cross + c * (r[i] * dot - square * omega[i])
    along = r[0] * rd[0] + r[1] * rd[1] + r[2] * rd[2]
    turning = rd[0] * omega[0] + rd[1] * omega[1] + rd[2] * omega[2]
    for row in range(axes.shape[0]):
        i = axes[row]
        j, k = (i + 1) % 3, (i + 2) % 3
        values[row] = r[i]
        rates[row, i] = 1.0 + c * (r[i] * r[i] - square)
        rates[row, j] = c * r[i] * r[j] + 0.5 * r[k]
        rates[row, k] = c * r[i] * r[k] - 0.5 * r[j]
        rise[row] = (
            -0.5 * (rd[j] * omega[k] - rd[k] * omega[j])
            + slope * along * (r[i] * dot - square * omega[i])
            + c * (rd[i] * dot + r[i] * turning - 2.0 * along * omega[i])
        )


@inlined
def _coefficients(angle):  # type: ignore[no-untyped-def]
    """Of an angle a: c = (1 - a/2 cot a/2) / a^2, and c'/a."""
    s = angle * angle
    if s < SERIES * SERIES:
        c = 1 / 12 + s * (1 / 720 + s * (1 / 30240 + s * (1 / 1209600 + s * (1 / 47900160 + s * 691 / 1307674368000))))
        slope = 1 / 360 + s * (1 / 7560 + s * (1 / 201600 + s * (8 / 47900160 + s * 691 / 130767436800)))
        return c, slope
    cot = math.cos(0.5 * angle) / math.sin(0.5 * angle)
    rest = 1.0 - 0.5 * angle * cot
    change = 0.5 * cot - 0.25 * angle * (1.0 + cot * cot)
    return rest / s, (-change * angle - 2.0 * rest) / (s * s)


@compiled
def task_rows(task, base, moving, depth, root, cdof, com, site_xpos, site_xquat, aim, omega, row, jac, values, rise):  # type: ignore[no-untyped-def]
    """Fill rows row..row+m-1 of ``jac`` with the task coordinates' Jacobian, their ``values (m,)`` and ``rise (m,)``.

    ``rise`` is what the rotations' second derivatives have besides G alpha; zero for positions. ``omega (3,)`` is in
    the base's frame, ``aim (m,)`` says which of equal rotations is meant.
    """
    body, site, slide_at, slides, turn_at, turns = task
    base_rotation, base_position, base_quaternion = base
    nv = cdof.shape[0]
    raw = np.zeros((6, nv))
    point_rows(cdof, com[root[body]], moving, depth, body, site_xpos[site], 1.0, 0, raw)
    for k in range(depth[body]):
        d = moving[body, k]
        for i in range(3):
            raw[3 + i, d] = cdof[d, i]
    for n in range(slides.shape[0]):
        axis, at = slides[n], slide_at[n]
        value = 0.0
        for i in range(3):
            value += base_rotation[i, axis] * (site_xpos[site, i] - base_position[i])
        values[at], rise[at] = value, 0.0
        for d in range(nv):
            jac[row + at, d] = (
                base_rotation[0, axis] * raw[0, d]
                + base_rotation[1, axis] * raw[1, d]
                + base_rotation[2, axis] * raw[2, d]
            )
    count = turns.shape[0]
    if count:
        quaternion, wanted, found, change, rates = (
            np.empty(4),
            np.empty(count),
            np.empty(count),
            np.empty(count),
            np.empty((count, 3)),
        )
        relative(base_quaternion, site_xquat[site], quaternion)
        for n in range(count):
            wanted[n] = aim[turn_at[n]]
        turn_coordinates(turns, quaternion, wanted, omega, found, rates, change)
        for n in range(count):
            at = turn_at[n]
            values[at], rise[at] = found[n], change[n]
            for d in range(nv):
                value = 0.0
                for i in range(3):
                    share = 0.0
                    for k in range(3):
                        share += base_rotation[i, k] * rates[n, k]
                    value += share * raw[3 + i, d]
                jac[row + at, d] = value


@inlined
def relative(base, quaternion, out):  # type: ignore[no-untyped-def]
    """Orientation (unit quaternions w, x, y, z) seen from the base: conj(base) * quaternion."""
    a, b, c, d = base[0], -base[1], -base[2], -base[3]
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    out[0] = a * w - b * x - c * y - d * z
    out[1] = a * x + b * w + c * z - d * y
    out[2] = a * y - b * z + c * w + d * x
    out[3] = a * z + b * y - c * x + d * w


@compiled
def task_acceleration(task, base, quaternion, aim, com, point, v, a, out):  # type: ignore[no-untyped-def]
    """Second time derivative ``(m,)`` of the task coordinates, from the platform's spatial velocity and acceleration.

    ``quaternion`` is the site's, world frame; ``v`` and ``a`` are about ``com``.
    """
    _body, _site, slide_at, slides, turn_at, turns = task
    base_rotation, _base_position, base_quaternion = base
    _, _, _, ax, ay, az = point_motion(v, a, com, point)
    for n in range(slides.shape[0]):
        axis = slides[n]
        out[slide_at[n]] = base_rotation[0, axis] * ax + base_rotation[1, axis] * ay + base_rotation[2, axis] * az
    count = turns.shape[0]
    if count:
        seen, wanted, found, change, rates = (
            np.empty(4),
            np.empty(count),
            np.empty(count),
            np.empty(count),
            np.empty((count, 3)),
        )
        omega, alpha = np.empty(3), np.empty(3)
        for k in range(3):
            omega[k] = base_rotation[0, k] * v[0] + base_rotation[1, k] * v[1] + base_rotation[2, k] * v[2]
            alpha[k] = base_rotation[0, k] * a[0] + base_rotation[1, k] * a[1] + base_rotation[2, k] * a[2]
        relative(base_quaternion, quaternion, seen)
        for n in range(count):
            wanted[n] = aim[turn_at[n]]
        turn_coordinates(turns, seen, wanted, omega, found, rates, change)
        for n in range(count):
            value = change[n]
            for k in range(3):
                value += rates[n, k] * alpha[k]
            out[turn_at[n]] = value


@compiled
def turn_motion(axes, quaternions, aims, omega, alpha, values, first, second):  # type: ignore[no-untyped-def]
    """Rotation coordinates of n orientations with their first and second derivatives, each ``(n, k)``."""
    count = axes.shape[0]
    rates, change = np.empty((count, 3)), np.empty(count)
    for s in range(quaternions.shape[0]):
        turn_coordinates(axes, quaternions[s], aims[s], omega[s], values[s], rates, change)
        for n in range(count):
            first[s, n], second[s, n] = 0.0, change[n]
            for k in range(3):
                first[s, n] += rates[n, k] * omega[s, k]
                second[s, n] += rates[n, k] * alpha[s, k]
