"""The equations of the asymmetric 2RSS+PPaP robot, once: scalar code that numba compiles.

Every mass model, every batch size and the kinematics go through `_kinematics` and `_torques`; a mass model is nothing
but other constants (`pack`), because in end-point coordinates (proximal end, distal end) a straight bar that does not
spin about its axis has the constant mass matrix

    [[m (1-k)^2 + I/len^2,  m k (1-k) - I/len^2],
     [m k (1-k) - I/len^2,  m k^2 + I/len^2    ]]

with mass m, mass centre at the fraction k and transverse inertia I (docs/derivations/asym_2rss_ppap.md, section 4).
Lumped masses are I = 0; `mass_models` has more. Frame: the paper's, x3 down. Points A, C, E belong to the left limb, B,
D, F to the right one; u = E - C and w = F - D are the rods. Numbers follow docs/notation.md.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import compiled, inlined
from workbench.robots.blocks import BLOCK, COLUMNS, finite, load, store
from workbench.robots.mass_models import MASS_MODELS, Bar, MassModel
from workbench.robots.sine_cosine import sine_cosine

SINGULAR = 1e-6
"""A pose counts as singular when a determinant, divided by the lengths it is made of, is below this: torques there are
a million times the forces that cause them."""


def pack(p: Any, model: MassModel = MASS_MODELS["distributed"]) -> FloatArray:
    """Return the kernel's constants from the parameters.

    Parameters
    ----------
    p
        Parameters of the robot, by name, SI.
    model
        What every bar weighs at its ends.

    Raises
    ------
    ParameterError
        A bar that the mass model cannot represent.
    """
    arm_left = model.others(Bar(p.m1_left, p.I1_left, p.a1_left, p.k1_left))
    arm_right = model.others(Bar(p.m1_right, p.I1_right, p.a1_right, p.k1_right))
    rod_left = model.rods(Bar(p.m2_left, p.I2_left, p.a2_left, p.k2_left))
    rod_right = model.rods(Bar(p.m2_right, p.I2_right, p.a2_right, p.k2_right))
    swing = model.others(Bar(p.m5, p.I5, p.a5, p.k5))
    constants = (
        p.L_left - p.l_left,
        p.L_right - p.l_right,
        p.a1_left,
        p.a1_right,
        p.a2_left**2,
        p.a2_right**2,
        # left limb: C with C (arm and rod), C with E, E with E, weight at C
        arm_left.distal + rod_left.proximal,
        rod_left.coupling,
        rod_left.distal,
        p.g * (arm_left.weight_distal + rod_left.weight_proximal),
        # right limb: D with D, D with F, F with F, weight at D
        arm_right.distal + rod_right.proximal,
        rod_right.coupling,
        rod_right.distal,
        p.g * (arm_right.weight_distal + rod_right.weight_proximal),
        # platform with payload; all weight that hangs on the platform
        p.m3 + p.payload,
        p.g * (p.m3 + p.payload + rod_left.weight_distal + rod_right.weight_distal),
        # what travels along x1 only with q1: slider, parallelogram, coupler
        p.m4 + p.m5 + p.m6,
        # swing of the parallelogram: squared length, inertia at the coupler, weight at the coupler
        p.a5**2,
        swing.distal + p.m6,
        p.g * (swing.weight_distal + p.m6),
        # det J_x, J_q22 or J_q33 below these is a singular pose
        SINGULAR * p.a2_left * p.a2_right,
        SINGULAR * p.a1_left * p.a2_left,
        SINGULAR * p.a1_right * p.a2_right,
    )
    return np.array(constants, dtype=np.float64)


@inlined
def _kinematics(c, q1, q2, q3, qd1, qd2, qd3, qdd1, qdd2, qdd3):  # type: ignore[no-untyped-def]
    """Platform position, velocity, acceleration and the rods; NaN outside the workspace and at singular poses.

    [Almeida2010] eq. (1)-(2). The platform hangs: of the two meets of the circles that E and F allow, the larger x3.
    """
    a1l, a1r = c[2], c[3]
    s2, c2 = sine_cosine(q2)
    s3, c3 = sine_cosine(q3)
    # arm tips relative to the spherical joints' mounting points, so that both rods end in x
    cy, cz = -c[0] - a1l * c2, a1l * s2
    dy, dz = c[1] + a1r * c3, a1r * s3
    # two circles in the (x2, x3) plane
    ey, ez = dy - cy, dz - cz
    span = ey * ey + ez * ez
    rod_l = c[4] - q1 * q1
    rod_r = c[5] - q1 * q1
    along = 0.5 * (rod_l - rod_r + span) / span
    up = math.sqrt(rod_l / span - along * along)
    if ey < 0.0:
        up = -up
    x2 = cy + along * ey - up * ez
    x3 = cz + along * ez + up * ey
    u2, u3 = x2 - cy, x3 - cz
    w2, w3 = x2 - dy, x3 - dz
    # arm tip velocity per q2, q3; its derivative is the centripetal direction
    tcy, tcz = a1l * s2, a1l * c2
    tdy, tdz = -a1r * s3, a1r * c3
    jq2 = u2 * tcy + u3 * tcz
    jq3 = w2 * tdy + w3 * tdz
    det = u2 * w3 - u3 * w2
    regular = (abs(det) > c[20]) & (abs(jq2) > c[21]) & (abs(jq3) > c[22])
    inv = 1.0 / det if regular else math.nan
    r2 = jq2 * qd2 - q1 * qd1
    r3 = jq3 * qd3 - q1 * qd1
    xd2 = (w3 * r2 - u3 * r3) * inv
    xd3 = (u2 * r3 - w2 * r2) * inv
    # u.(xdd - Cdd) + |xd - Cd|^2 = 0, and the same for w
    cdy, cdz = tcy * qd2, tcz * qd2
    ddy, ddz = tdy * qd3, tdz * qd3
    cddy = tcy * qdd2 + a1l * c2 * qd2 * qd2
    cddz = tcz * qdd2 - a1l * s2 * qd2 * qd2
    dddy = tdy * qdd3 - a1r * c3 * qd3 * qd3
    dddz = tdz * qdd3 - a1r * s3 * qd3 * qd3
    common = q1 * qdd1 + qd1 * qd1
    r2 = u2 * cddy + u3 * cddz - common - (xd2 - cdy) ** 2 - (xd3 - cdz) ** 2
    r3 = w2 * dddy + w3 * dddz - common - (xd2 - ddy) ** 2 - (xd3 - ddz) ** 2
    xdd2 = (w3 * r2 - u3 * r3) * inv
    xdd3 = (u2 * r3 - w2 * r2) * inv
    return (
        x2, x3, xd2, xd3, xdd2, xdd3, u2, u3, w2, w3, inv, jq2, jq3,
        tcy, tcz, tdy, tdz, cddy, cddz, dddy, dddz,
    )  # fmt: skip


@inlined
def torques_sample(c, q1, q2, q3, qd1, qd2, qd3, qdd1, qdd2, qdd3, f1, f2, f3):  # type: ignore[no-untyped-def]
    """tau1, tau2, tau3 by virtual work; [Almeida2010] eq. (4)-(6) and (13)-(15) in end-point coordinates."""
    (
        x2, _x3, xd2, _xd3, xdd2, xdd3, u2, u3, w2, w3, inv, jq2, jq3,
        tcy, tcz, tdy, tdz, cddy, cddz, dddy, dddz,
    ) = _kinematics(c, q1, q2, q3, qd1, qd2, qd3, qdd1, qdd2, qdd3)  # fmt: skip
    # forces that the moving parts need at C, D and at the platform
    fcy = c[6] * cddy + c[7] * xdd2
    fcz = c[6] * cddz + c[7] * xdd3 - c[9]
    fdy = c[10] * dddy + c[11] * xdd2
    fdz = c[10] * dddz + c[11] * xdd3 - c[13]
    carried = c[8] + c[12] + c[14]
    px = carried * qdd1 - f1
    py = carried * xdd2 + c[7] * cddy + c[11] * dddy - f2
    pz = carried * xdd3 + c[7] * cddz + c[11] * dddz - c[15] - f3
    # C and D do not move along x1, but the rods' coupling terms act on the platform's x1 through E and F only
    # the parallelogram: its tip is at (x2, sqrt(a5^2 - x2^2)); slope and its rate follow
    inv_z = 1.0 / math.sqrt(c[17] - x2 * x2)
    slope = -x2 * inv_z
    zdd = slope * xdd2 - xd2 * xd2 * c[17] * inv_z * inv_z * inv_z
    py += c[18] * (xdd2 + slope * zdd) - c[19] * slope
    # J_x^T lambda = p: the rods' force densities, then tau = J_q^T lambda + what acts at the actuated joints directly
    lam2 = (w3 * py - w2 * pz) * inv
    lam3 = (u2 * pz - u3 * py) * inv
    tau1 = px - q1 * (lam2 + lam3) + c[16] * qdd1
    tau2 = jq2 * lam2 + fcy * tcy + fcz * tcz
    tau3 = jq3 * lam3 + fdy * tdy + fdz * tdz
    return tau1, tau2, tau3


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
def motion_batch(c, q, qd, qdd, x, xd, xdd, jacobian, determinants):  # type: ignore[no-untyped-def]
    """Fill platform motion, J = J_x^-1 J_q ``(n, 3, 3)`` and (det J_x, J_q22, J_q33) ``(n, 3)``."""
    for i in range(q.shape[0]):
        (
            x2, x3, xd2, xd3, xdd2, xdd3, u2, u3, w2, w3, inv, jq2, jq3,
            _tcy, _tcz, _tdy, _tdz, _cddy, _cddz, _dddy, _dddz,
        ) = _kinematics(
            c, q[i, 0], q[i, 1], q[i, 2], qd[i, 0], qd[i, 1], qd[i, 2], qdd[i, 0], qdd[i, 1], qdd[i, 2]
        )  # fmt: skip
        x[i, 0], x[i, 1], x[i, 2] = q[i, 0], x2, x3
        xd[i, 0], xd[i, 1], xd[i, 2] = qd[i, 0], xd2, xd3
        xdd[i, 0], xdd[i, 1], xdd[i, 2] = qdd[i, 0], xdd2, xdd3
        jacobian[i, 0, 0], jacobian[i, 0, 1], jacobian[i, 0, 2] = 1.0, 0.0, 0.0
        jacobian[i, 1, 0], jacobian[i, 2, 0] = q[i, 0] * (u3 - w3) * inv, q[i, 0] * (w2 - u2) * inv
        jacobian[i, 1, 1], jacobian[i, 2, 1] = w3 * jq2 * inv, -w2 * jq2 * inv
        jacobian[i, 1, 2], jacobian[i, 2, 2] = -u3 * jq3 * inv, u2 * jq3 * inv
        determinants[i, 0], determinants[i, 1], determinants[i, 2] = u2 * w3 - u3 * w2, jq2, jq3
