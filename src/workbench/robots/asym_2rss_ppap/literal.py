"""The 2RSS+PPaP robot's inverse dynamics as [Almeida2010] writes it, with every misprint on a switch.

Three functions, none of which shares code with the end-point form that the workbench uses by default:

- `lumped_appendix`: the appendix, K1..K6 and f1..f3;
- `lumped_equation4`: the virtual-work sum, eq. (4), from which the appendix follows;
- `distributed_rotation`: the appendix plus the rotation terms of section 3.2, eq. (7)-(15), with rotation matrices.

The paper has equal limbs, homogeneous bars and no external force. The forms here hold for any limbs; three replacements
lead from print to code, and every line that differs shows what it was:

- a mass centre in the middle becomes one at fraction k from the proximal end. A printed m/4 becomes m (1-k)^2 at the
  proximal end, m k^2 at the distal end, and m k (1-k) where it couples both; a printed weight m/2 becomes m (1-k) at
  the proximal and m k at the distal end; k = 1/2 gives the print back;
- "left" belongs to limb A-C-E, driven by q2, "right" to limb B-D-F, driven by q3; a printed sum over both rods, such as
  m2/2 = 2 m2/4, becomes a sum over the sides;
- an external force F on the platform does the virtual work F . dx, so it stands beside (m3 + M) with the opposite sign.

Arrays are float64, SI, batch first, in the paper's frame: x3 points **down**, gravity is (0, 0, +g). The derivation
and the effect of each misprint stand in docs/derivations/asym_2rss_ppap.md.
"""

from __future__ import annotations

from enum import Enum
from typing import Any

import numpy as np

from workbench.arrays import FloatArray


class Misprint(Enum):
    """One printed mistake of [Almeida2010]; the value says where it stands, what is printed and what holds."""

    JQ33_SIGN = "eq. (2), third entry of J_q: printed + before the first product; - holds"
    K1_M2_QUARTER = "appendix, K1: printed m2/4; m2/2 holds, for there are two rods"
    F2_JXQ33 = "appendix, f2: printed K6 J_xq33; K6 J_xq32 holds"
    TWO_M5 = "eq. (4): printed 2 m5 in the inertia term; m5 holds, for m5 is both bars together"
    BD_GRAVITY_MISSING = "eq. (4): the weight of arm BD is not printed; + m1 g dx_D/2 holds"
    PLATFORM_GRAVITY_MISSING = "eq. (4): the weight of platform and load is not printed; + (m3 + M) g dx holds"
    BD_ROTATION_Q2 = "section 3.2, bar BD: printed q2; q3 holds"


REPAIRED: frozenset[Misprint] = frozenset()
"""No misprint: the form that holds."""

APPENDIX_AS_PRINTED = frozenset({Misprint.JQ33_SIGN, Misprint.K1_M2_QUARTER, Misprint.F2_JXQ33})
"""The misprints that `lumped_appendix` meets."""

EQUATION4_AS_PRINTED = frozenset(
    {Misprint.JQ33_SIGN, Misprint.TWO_M5, Misprint.BD_GRAVITY_MISSING, Misprint.PLATFORM_GRAVITY_MISSING}
)
"""The misprints that `lumped_equation4` meets."""

DISTRIBUTED_AS_PRINTED = APPENDIX_AS_PRINTED | {Misprint.BD_ROTATION_Q2}
"""The misprints that `distributed_rotation` meets."""


def lumped_appendix(
    p: Any,
    q: FloatArray,
    qd: FloatArray,
    qdd: FloatArray,
    x: FloatArray,
    xd: FloatArray,
    xdd: FloatArray,
    external_force: FloatArray,
    misprints: frozenset[Misprint] = REPAIRED,
) -> FloatArray:
    """Actuator forces with lumped bar masses, from the expanded functions of [Almeida2010], appendix.

    Parameters
    ----------
    p
        Parameters, SI.
    q, qd, qdd
        Actuated motion ``(n, 3)``: m and rad, per second, per second squared.
    x, xd, xdd
        The platform motion that belongs to it, ``(n, 3)``, metres, paper frame (x3 down).
    external_force
        ``(n, 3)``, newtons, paper frame, acting on the platform.
    misprints
        Printed mistakes to keep; the default repairs all.

    Returns
    -------
    numpy.ndarray
        tau ``(n, 3)``: N, N m, N m. By eq. (6), tau_i = -f_i.

    Raises
    ------
    numpy.linalg.LinAlgError
        det J_x is exactly zero; kinematics refuse such a pose earlier.
    """
    q2, q3 = q[:, 1], q[:, 2]
    qd2, qd3 = qd[:, 1], qd[:, 2]
    qdd1, qdd2, qdd3 = qdd.T
    x2, xd2 = x[:, 1], xd[:, 1]
    xdd2, xdd3 = xdd[:, 1], xdd[:, 2]
    a1l, a1r, m2l, m2r, k2l, k2r = p.a1_left, p.a1_right, p.m2_left, p.m2_right, p.k2_left, p.k2_right
    sin2, cos2, sin3, cos3 = np.sin(q2), np.cos(q2), np.sin(q3), np.cos(q3)

    # What the printed fractions stand for; with equal limbs and k = 1/2:
    rods_at_platform = m2l * k2l**2 + m2r * k2r**2  # m2/2
    rod_coupling_left = m2l * k2l * (1 - k2l) * a1l  # m2 a1 / 4
    rod_coupling_right = m2r * k2r * (1 - k2r) * a1r  # m2 a1 / 4
    rods_weight_at_platform = m2l * k2l + m2r * k2r  # m2
    bars_at_coupler = p.m5 * p.k5**2  # m5/4
    bars_weight_at_coupler = p.m5 * p.k5  # m5/2

    rods_in_k1 = rods_at_platform / 2 if Misprint.K1_M2_QUARTER in misprints else rods_at_platform
    k1 = (rods_in_k1 + p.m3 + p.m4 + p.m5 + p.m6 + p.payload) * qdd1 - external_force[:, 0]
    # printed: (m1 + m2) (a1^2 qdd2 / 4 - g a1 cos q2 / 2)
    k2 = (
        (p.m1_left * p.k1_left**2 + m2l * (1 - k2l) ** 2) * a1l**2 * qdd2
        - (p.m1_left * p.k1_left + m2l * (1 - k2l)) * p.g * a1l * cos2
        + rod_coupling_left * (xdd2 * sin2 + xdd3 * cos2)
    )
    # printed under the name K2 a second time: q3's own
    k3 = (
        (p.m1_right * p.k1_right**2 + m2r * (1 - k2r) ** 2) * a1r**2 * qdd3
        - (p.m1_right * p.k1_right + m2r * (1 - k2r)) * p.g * a1r * cos3
        + rod_coupling_right * (-xdd2 * sin3 + xdd3 * cos3)
    )
    k4 = (
        rod_coupling_left * (qdd2 * sin2 + qd2**2 * cos2)
        - rod_coupling_right * (qdd3 * sin3 + qd3**2 * cos3)
        + (rods_at_platform + p.m3 + bars_at_coupler + p.m6 + p.payload) * xdd2
        - external_force[:, 1]
    )
    root = p.a5**2 - x2**2
    k5 = (
        (bars_at_coupler + p.m6) * ((xd2**2 + x2 * xdd2) * root**-0.5 + (x2 * xd2) ** 2 * root**-1.5)
        + (bars_weight_at_coupler + p.m6) * p.g
    ) * (x2 * root**-0.5)
    k6 = (
        rod_coupling_left * (qdd2 * cos2 - qd2**2 * sin2)
        + rod_coupling_right * (qdd3 * cos3 - qd3**2 * sin3)
        + (rods_at_platform + p.m3 + p.payload) * xdd3
        - (rods_weight_at_platform + p.m3 + p.payload) * p.g
        - external_force[:, 2]
    )

    jxq = _jxq(p, q, x, misprints)
    jxq_of_k6_in_f2 = jxq[:, 2, 2] if Misprint.F2_JXQ33 in misprints else jxq[:, 2, 1]
    f1 = -k1 - (k4 + k5) * jxq[:, 1, 0] - k6 * jxq[:, 2, 0]
    f2 = -k2 - (k4 + k5) * jxq[:, 1, 1] - k6 * jxq_of_k6_in_f2
    f3 = -k3 - (k4 + k5) * jxq[:, 1, 2] - k6 * jxq[:, 2, 2]
    return -np.stack([f1, f2, f3], axis=1)  # eq. (6): tau_i + f_i = 0


def lumped_equation4(
    p: Any,
    q: FloatArray,
    qd: FloatArray,
    qdd: FloatArray,
    x: FloatArray,
    xd: FloatArray,
    xdd: FloatArray,
    external_force: FloatArray,
    misprints: frozenset[Misprint] = REPAIRED,
) -> FloatArray:
    """Actuator forces with lumped bar masses, from the virtual-work sum [Almeida2010] eq. (3)-(6), not expanded.

    Arguments, result and errors as `lumped_appendix`.
    """
    zero, one = np.zeros(len(q)), np.ones(len(q))
    q2, q3 = q[:, 1], q[:, 2]
    x2, xd2, xdd2 = x[:, 1], xd[:, 1], xdd[:, 1]
    x_c_of_q2 = p.a1_left * np.stack([zero, np.sin(q2), np.cos(q2)], axis=1)
    x_d_of_q3 = p.a1_right * np.stack([zero, -np.sin(q3), np.cos(q3)], axis=1)
    acc_c = x_c_of_q2 * qdd[:, 1, None] + p.a1_left * _in_x2_x3(np.cos(q2), -np.sin(q2)) * qd[:, 1, None] ** 2
    acc_d = x_d_of_q3 * qdd[:, 2, None] + p.a1_right * _in_x2_x3(-np.cos(q3), -np.sin(q3)) * qd[:, 2, None] ** 2
    acc_h = np.stack([qdd[:, 0], zero, zero], axis=1)
    drop = np.sqrt(p.a5**2 - x2**2)  # I lies this far below H
    acc_drop = -(xd2**2 + x2 * xdd2) / drop - (x2 * xd2) ** 2 / drop**3
    acc_i = np.stack([qdd[:, 0], xdd2, acc_drop], axis=1)

    # Virtual displacements as matrices (n, 3, 3): d(point) = matrix dq
    of_x = _jxq(p, q, x, misprints)  # eq. (5a); eq. (5d) makes it that of E and F too
    of_c = _column(x_c_of_q2, 1)  # eq. (5b)
    of_d = _column(x_d_of_q3, 2)  # eq. (5c)
    of_h = _column(np.stack([one, zero, zero], axis=1), 0)  # eq. (5e)
    dx2 = of_x[:, 1, :]
    of_i = np.stack([of_h[:, 0, :], dx2, (-x2 / drop)[:, None] * dx2], axis=1)  # eq. (5f)

    gravity = np.broadcast_to(np.array([0.0, 0.0, p.g]), x.shape)
    k1l, k1r, k2l, k2r, k5 = p.k1_left, p.k1_right, p.k2_left, p.k2_right, p.k5  # printed: 1/2 each
    m5_inertia = 2 * p.m5 if Misprint.TWO_M5 in misprints else p.m5
    gravity_bd = 0.0 if Misprint.BD_GRAVITY_MISSING in misprints else p.m1_right
    gravity_platform = 0.0 if Misprint.PLATFORM_GRAVITY_MISSING in misprints else p.m3 + p.payload
    of_ce = (1 - k2l) * of_c + k2l * of_x  # eq. (3a)
    of_df = (1 - k2r) * of_d + k2r * of_x
    of_hi = (1 - k5) * of_h + k5 * of_i
    work = (  # eq. (4) without the actuators' part, in its order: these are f1, f2, f3
        _work(-p.m1_left * k1l * acc_c, k1l * of_c)
        + _work(-p.m2_left * ((1 - k2l) * acc_c + k2l * xdd), of_ce)  # eq. (3b)
        + _work(-(p.m3 + p.payload) * xdd, of_x)
        + _work(-p.m1_right * k1r * acc_d, k1r * of_d)
        + _work(-p.m2_right * ((1 - k2r) * acc_d + k2r * xdd), of_df)
        + _work(-p.m4 * acc_h, of_h)
        + _work(-m5_inertia * ((1 - k5) * acc_h + k5 * acc_i), of_hi)
        + _work(-p.m6 * acc_i, of_i)
        + _work(p.m1_left * gravity, k1l * of_c)
        + _work(p.m2_left * gravity, of_ce)
        + _work(p.m2_right * gravity, of_df)
        + _work(p.m5 * gravity, of_hi)  # printed: m5 g dx_I/2; the same, because H moves level
        + _work(p.m6 * gravity, of_i)
        + _work(gravity_bd * gravity, k1r * of_d)  # not printed
        + _work(gravity_platform * gravity, of_x)  # not printed
        + _work(external_force, of_x)  # not in the paper
    )
    return -work


def distributed_rotation(
    p: Any,
    q: FloatArray,
    qd: FloatArray,
    qdd: FloatArray,
    x: FloatArray,
    xd: FloatArray,
    xdd: FloatArray,
    external_force: FloatArray,
    misprints: frozenset[Misprint] = REPAIRED,
) -> FloatArray:
    """Actuator forces with distributed bar masses: the appendix plus [Almeida2010] section 3.2 and eq. (7)-(15).

    Arguments, result and errors as `lumped_appendix`.
    """
    rotation = np.zeros_like(q)
    rotation[:, 1] -= p.I1_left * qdd[:, 1]  # bar AC
    if Misprint.BD_ROTATION_Q2 in misprints:
        rotation[:, 1] -= p.I1_right * qdd[:, 1]
    else:
        rotation[:, 2] -= p.I1_right * qdd[:, 2]  # bar BD

    jxq = _jxq(p, q, x, misprints)
    # Parallelogram bars; theta_H is counted as q2 is, from -x2 towards +x3: x2 = -a5 cos(theta_H)
    a5_cos, a5_sin = -x[:, 1], np.sqrt(p.a5**2 - x[:, 1] ** 2)
    theta_d = xd[:, 1] / a5_sin
    theta_dd = (xdd[:, 1] - a5_cos * theta_d**2) / a5_sin
    rotation -= p.I5 * (theta_dd / a5_sin)[:, None] * jxq[:, 1, :]

    rotation += _torque_ce(p, q, qd, qdd, x, xd, xdd, jxq) + _torque_df(p, q, qd, qdd, x, xd, xdd, jxq)
    return lumped_appendix(p, q, qd, qdd, x, xd, xdd, external_force, misprints) - rotation


def _torque_ce(
    p: Any,
    q: FloatArray,
    qd: FloatArray,
    qdd: FloatArray,
    x: FloatArray,
    xd: FloatArray,
    xdd: FloatArray,
    jxq: FloatArray,
) -> FloatArray:
    """Rotation terms of rod CE in f1, f2, f3, shape ``(n, 3)``: eq. (7) and (10)-(15)."""
    a1, sin, cos, qd2 = p.a1_left, np.sin(q[:, 1]), np.cos(q[:, 1]), qd[:, 1]
    x1, x2, x3 = x.T
    xd1, xd2, xd3 = xd.T
    offset = x2 - p.l_left + p.L_left
    u = np.stack([x1, offset + a1 * cos, x3 - a1 * sin], axis=1)  # from C to E
    ud = np.stack([xd1, xd2 - a1 * sin * qd2, xd3 - a1 * cos * qd2], axis=1)
    # eq. (11), second column, and its derivative
    j_wq = np.stack([-offset * a1 * cos + x3 * a1 * sin - a1**2, a1 * x1 * cos, -a1 * x1 * sin], axis=1)
    j_wq_d = np.stack(
        [
            -xd2 * a1 * cos + offset * a1 * sin * qd2 + xd3 * a1 * sin + x3 * a1 * cos * qd2,
            a1 * (xd1 * cos - x1 * sin * qd2),
            -a1 * (xd1 * sin + x1 * cos * qd2),
        ],
        axis=1,
    )
    j_wq, j_wq_d = _column(j_wq, 1) / p.a2_left**2, _column(j_wq_d, 1) / p.a2_left**2
    j_wx, j_wx_d = _cross_matrix(u) / p.a2_left**2, _cross_matrix(ud) / p.a2_left**2  # eq. (12)
    omega = _apply(j_wq, qd) + _apply(j_wx, xd)  # eq. (10)
    omega_d = _apply(j_wq, qdd) + _apply(j_wq_d, qd) + _apply(j_wx, xdd) + _apply(j_wx_d, xd)
    return _rotation_torque(u / p.a2_left, p.I2_left, omega, omega_d, j_wq + j_wx @ jxq)


def _torque_df(
    p: Any,
    q: FloatArray,
    qd: FloatArray,
    qdd: FloatArray,
    x: FloatArray,
    xd: FloatArray,
    xdd: FloatArray,
    jxq: FloatArray,
) -> FloatArray:
    """Rotation terms of rod DF in f1, f2, f3, shape ``(n, 3)``: "the same strategy", eq. (8) and (10)-(15)."""
    a1, sin, cos, qd3 = p.a1_right, np.sin(q[:, 2]), np.cos(q[:, 2]), qd[:, 2]
    x1, x2, x3 = x.T
    xd1, xd2, xd3 = xd.T
    offset = x2 + p.l_right - p.L_right
    w = np.stack([x1, offset - a1 * cos, x3 - a1 * sin], axis=1)  # from D to F
    wd = np.stack([xd1, xd2 + a1 * sin * qd3, xd3 - a1 * cos * qd3], axis=1)
    j_wq = np.stack([-offset * a1 * cos - x3 * a1 * sin + a1**2, a1 * x1 * cos, a1 * x1 * sin], axis=1)
    j_wq_d = np.stack(
        [
            -xd2 * a1 * cos + offset * a1 * sin * qd3 - xd3 * a1 * sin - x3 * a1 * cos * qd3,
            a1 * (xd1 * cos - x1 * sin * qd3),
            a1 * (xd1 * sin + x1 * cos * qd3),
        ],
        axis=1,
    )
    j_wq, j_wq_d = _column(j_wq, 2) / p.a2_right**2, _column(j_wq_d, 2) / p.a2_right**2
    j_wx, j_wx_d = _cross_matrix(w) / p.a2_right**2, _cross_matrix(wd) / p.a2_right**2
    omega = _apply(j_wq, qd) + _apply(j_wx, xd)
    omega_d = _apply(j_wq, qdd) + _apply(j_wq_d, qd) + _apply(j_wx, xdd) + _apply(j_wx_d, xd)
    return _rotation_torque(w / p.a2_right, p.I2_right, omega, omega_d, j_wq + j_wx @ jxq)


def _rotation_torque(
    axis: FloatArray, transverse_inertia: float, omega: FloatArray, omega_d: FloatArray, turn_of_q: FloatArray
) -> FloatArray:
    """Eq. (15): (J_wq + J_wx J_xq)^T (-I omega_d - omega x (I omega)), shape ``(n, 3)``."""
    rotation = _rotation_with_third_axis(axis)
    # The rod does not turn about its own axis, so its axial moment of inertia never acts; a slender bar has none.
    principal = np.diag([transverse_inertia, transverse_inertia, 0.0])
    inertia = rotation @ principal @ rotation.transpose(0, 2, 1)  # eq. (7), (8)
    torque = -_apply(inertia, omega_d) - np.cross(omega, _apply(inertia, omega))
    return _work(torque, turn_of_q)


def _jxq(p: Any, q: FloatArray, x: FloatArray, misprints: frozenset[Misprint]) -> FloatArray:
    """J_xq = J_x^-1 J_q of eq. (2), shape ``(n, 3, 3)``."""
    zero, one = np.zeros(len(q)), np.ones(len(q))
    x1, x2, x3 = x.T
    a1l, a1r, sin2, cos2, sin3, cos3 = p.a1_left, p.a1_right, *_sin_cos(q[:, 1]), *_sin_cos(q[:, 2])
    ce2, ce3 = x2 - p.l_left + p.L_left + a1l * cos2, x3 - a1l * sin2
    df2, df3 = x2 + p.l_right - p.L_right - a1r * cos3, x3 - a1r * sin3
    j_x = np.stack([one, zero, zero, x1, ce2, ce3, x1, df2, df3], axis=1).reshape(-1, 3, 3)
    sign = 1.0 if Misprint.JQ33_SIGN in misprints else -1.0
    j_q22 = ce2 * (a1l * sin2) + ce3 * (a1l * cos2)
    j_q33 = sign * df2 * (a1r * sin3) + df3 * (a1r * cos3)
    j_q = np.stack([one, zero, zero, zero, j_q22, zero, zero, zero, j_q33], axis=1).reshape(-1, 3, 3)
    return np.linalg.solve(j_x, j_q)


def _sin_cos(angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.sin(angle), np.cos(angle)


def _in_x2_x3(second: FloatArray, third: FloatArray) -> FloatArray:
    return np.stack([np.zeros_like(second), second, third], axis=1)


def _column(values: FloatArray, column: int) -> FloatArray:
    """Matrices ``(n, 3, 3)``, zero but for one column."""
    matrix = np.zeros((len(values), 3, 3))
    matrix[:, :, column] = values
    return matrix


def _apply(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    result: FloatArray = np.einsum("nij,nj->ni", matrix, vector)
    return result


def _work(force: FloatArray, displacement_of_q: FloatArray) -> FloatArray:
    """Coefficients of dq1, dq2, dq3 in force . d(point), with d(point) = displacement_of_q dq."""
    work: FloatArray = np.einsum("ni,nij->nj", force, displacement_of_q)
    return work


def _cross_matrix(vector: FloatArray) -> FloatArray:
    """Matrix of ``vector x``, shape ``(n, 3, 3)``."""
    zero, (v1, v2, v3) = np.zeros(len(vector)), vector.T
    return np.stack([zero, -v3, v2, v3, zero, -v1, -v2, v1, zero], axis=1).reshape(-1, 3, 3)


def _rotation_with_third_axis(axis: FloatArray) -> FloatArray:
    """Rotation matrices R_CE, R_DF, third column the unit vector *axis* along the bar; no direction is singular.

    [Duff2017]; which way the other two columns point is free, because the two transverse moments of inertia are equal.
    """
    n1, n2, n3 = axis.T
    sign = np.copysign(1.0, n3)
    a = -1.0 / (sign + n3)
    b = n1 * n2 * a
    first = np.stack([1.0 + sign * n1**2 * a, sign * b, -sign * n1], axis=1)
    second = np.stack([b, sign + n2**2 * a, -n2], axis=1)
    return np.stack([first, second, axis], axis=2)
