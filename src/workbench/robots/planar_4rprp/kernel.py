"""The equations of the 4-RPRP robot, once: scalar code that numba compiles.

Each limb moves in one plane, so the pair (s, y) of B_i - A_i, s along z for limbs 1 and 3 and along x for limbs 2 and
4, describes it whole: r = (s, y) = q w, and its angle's rate is (w x rd)/q. The rods and the platform only translate.
Every mass model is nothing but other constants (`pack`); lumped masses have no rotational inertia. Frame: the paper's,
y up.
Derivation: docs/derivations/planar_4rprp.md.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import compiled, inlined
from workbench.robots.blocks import BLOCK, COLUMNS, finite, load, store

SINGULAR = 1e-6
"""A pose counts as singular when a measure is below this: forces there are a million times those that cause them."""


def pack(p: Any, bar_inertia: float = 1.0) -> FloatArray:
    """Return the kernel's constants from the parameters.

    Parameters
    ----------
    p
        Parameters of the robot, by name, SI.
    bar_inertia
        Factor on the rotational inertia of cylinders and pistons: 1 for distributed masses, 0 for lumped ones.
    """
    cylinder = p.m2 * p.c2**2
    across = p.m6 + p.m4  # along x only rod 2-4 travels with the platform, along z only rod 1-3
    constants = (
        p.a,
        p.b,
        p.h,
        # one limb: inertia about its pivot without the piston's mass (axis x, axis z), piston, weight
        cylinder + bar_inertia * (p.I2x + p.I3x),
        cylinder + bar_inertia * (p.I2z + p.I3z),
        p.m3,
        p.c3,
        p.g * p.m2 * p.c2,
        p.g * p.m3,
        # what translates: along x or z, along y, weight
        across,
        across + p.m4,
        p.g * (across + p.m4),
    )
    return np.array(constants, dtype=np.float64)


@inlined
def _position(c, q1, q2, q3):  # type: ignore[no-untyped-def]
    """Px, Py, Pz with Px > 0, Py > 0; NaN where the limbs cannot meet. [GarciaMurillo2016] eq. (14)-(16)."""
    b = c[1]
    z = 0.5 * (b + (q1 - q3) * (q1 + q3) / b)
    y = math.sqrt((q1 - z) * (q1 + z))
    low = y - c[2]
    x = math.sqrt((q2 - low) * (q2 + low))
    if q1 <= 0.0 or q2 <= 0.0 or q3 <= 0.0:
        x = y = z = math.nan
    return x, y, z


@inlined
def _rates(c, q1, q2, q3, x, y, z, qd1, qd2, qd3, qdd1, qdd2, qdd3):  # type: ignore[no-untyped-def]
    """Velocity and acceleration of P: eq. (9)-(11) differentiated twice, solved for z, then y, then x."""
    b, low = c[1], y - c[2]
    half1, half2, half3 = q1 * qd1, q2 * qd2, q3 * qd3  # d(q^2/2)/dt
    zd = (half1 - half3) / b
    yd = (half1 - z * zd) / y
    xd = (half2 - low * yd) / x
    half1 = q1 * qdd1 + qd1 * qd1
    half2 = q2 * qdd2 + qd2 * qd2
    half3 = q3 * qdd3 + qd3 * qd3
    zdd = (half1 - half3) / b
    ydd = (half1 - z * zdd - zd * zd - yd * yd) / y
    xdd = (half2 - low * ydd - yd * yd - xd * xd) / x
    return xd, yd, zd, xdd, ydd, zdd


@inlined
def _limb(c, inertia, s, y, sd, yd, sdd, ydd):  # type: ignore[no-untyped-def]
    """Force (along s, along y) that a limb with r = B - A = (s, y) needs at B to move and to be carried."""
    q = math.sqrt(s * s + y * y)
    ws, wy = s / q, y / q
    qd = ws * sd + wy * yd
    turn = (ws * yd - wy * sd) / q
    qdd = ws * sdd + wy * ydd + q * turn * turn
    turn_d = (ws * ydd - wy * sdd - 2.0 * qd * turn) / q
    m3, weight3 = c[5], c[8]
    arm = q - c[6]  # mass centre of the piston, from A
    along = m3 * (qdd - arm * turn * turn) + weight3 * wy
    moment = (inertia + m3 * arm * arm) * turn_d + 2.0 * m3 * arm * qd * turn + (c[7] + weight3 * arm) * ws
    across = moment / q
    return along * ws - across * wy, along * wy + across * ws


@inlined
def torques_sample(c, q1, q2, q3, qd1, qd2, qd3, qdd1, qdd2, qdd3, fx, fy, fz):  # type: ignore[no-untyped-def]
    """tau1, tau2, tau3 by virtual work in platform coordinates: J_r^T tau = force that the moving parts need at P."""
    x, y, z = _position(c, q1, q2, q3)
    xd, yd, zd, xdd, ydd, zdd = _rates(c, q1, q2, q3, x, y, z, qd1, qd2, qd3, qdd1, qdd2, qdd3)
    a, b, low = c[0], c[1], y - c[2]
    s1, y1 = _limb(c, c[3], z, y, zd, yd, zdd, ydd)
    s3, y3 = _limb(c, c[3], z - b, y, zd, yd, zdd, ydd)
    s2, y2 = _limb(c, c[4], x, low, xd, yd, xdd, ydd)
    s4, y4 = _limb(c, c[4], x - a, low, xd, yd, xdd, ydd)
    px = c[9] * xdd + s2 + s4 - fx
    py = c[10] * ydd + c[11] + y1 + y2 + y3 + y4 - fy
    pz = c[9] * zdd + s1 + s3 - fz
    # det J_r = b Px Py / (q1 q2 q3), and the passive limb's length q4
    far = (b * x * y > SINGULAR * q1 * q2 * q3) & ((x - a) * (x - a) + low * low > (SINGULAR * a) * (SINGULAR * a))
    # tau_i/q_i from the columns of J_r^T = [r_i / q_i]: x row, then y and z rows together
    d2 = px / x if far else math.nan
    both = (py - low * d2) / y
    d3 = (z * both - pz) / b
    return q1 * (both - d3), q2 * d2, q3 * d3


@compiled
def torques_batch(c, q, qd, qdd, force, tau):  # type: ignore[no-untyped-def]
    """Fill tau ``(n, 3)``; returns how many samples have no finite torques, those outside the workspace among them."""
    if q.shape[0] == 1:  # without a block, which takes longer to make and to touch than the sample
        tau[0, 0], tau[0, 1], tau[0, 2] = torques_sample(
            c, q[0, 0], q[0, 1], q[0, 2], qd[0, 0], qd[0, 1], qd[0, 2], qdd[0, 0], qdd[0, 1], qdd[0, 2],
            force[0, 0], force[0, 1], force[0, 2],
        )  # fmt: skip
        return 0 if finite(tau[0, 0], tau[0, 1], tau[0, 2]) else 1
    block, bad = np.empty(COLUMNS * BLOCK), 0
    for first in range(0, q.shape[0], BLOCK):
        count = min(BLOCK, q.shape[0] - first)
        load(block, q, qd, qdd, force, first, count)
        for i in range(count):
            block[12 * BLOCK + i], block[13 * BLOCK + i], block[14 * BLOCK + i] = torques_sample(
                c, block[i], block[BLOCK + i], block[2 * BLOCK + i],
                block[3 * BLOCK + i], block[4 * BLOCK + i], block[5 * BLOCK + i],
                block[6 * BLOCK + i], block[7 * BLOCK + i], block[8 * BLOCK + i],
                block[9 * BLOCK + i], block[10 * BLOCK + i], block[11 * BLOCK + i],
            )  # fmt: skip
        bad += store(block, tau, first, count)
    return bad


@compiled
def torques_single(c, q, qd, qdd, force, tau):  # type: ignore[no-untyped-def]
    """One sample, arrays ``(3,)``: fill tau; returns whether shapes are right and tau is finite."""
    if not (len(q) == len(qd) == len(qdd) == len(force) == len(tau) == 3):
        return False
    tau[0], tau[1], tau[2] = torques_sample(
        c, q[0], q[1], q[2], qd[0], qd[1], qd[2], qdd[0], qdd[1], qdd[2], force[0], force[1], force[2]
    )
    return finite(tau[0], tau[1], tau[2])


@compiled
def motion_batch(c, q, qd, qdd, x, xd, xdd):  # type: ignore[no-untyped-def]
    """Fill platform position, velocity and acceleration, each ``(n, 3)``; NaN outside the workspace."""
    for i in range(q.shape[0]):
        x[i, 0], x[i, 1], x[i, 2] = _position(c, q[i, 0], q[i, 1], q[i, 2])
        xd[i, 0], xd[i, 1], xd[i, 2], xdd[i, 0], xdd[i, 1], xdd[i, 2] = _rates(
            c, q[i, 0], q[i, 1], q[i, 2], x[i, 0], x[i, 1], x[i, 2],
            qd[i, 0], qd[i, 1], qd[i, 2], qdd[i, 0], qdd[i, 1], qdd[i, 2],
        )  # fmt: skip
