"""The appendix of [Almeida2010] as it is printed, misprints and all: `workbench diagnose` finds them.

Lumped masses, equal limbs, homogeneous bars; x3 points down. The platform's motion comes from the two circles in the
(x2, x3) plane on which the rods' ends lie, not from the printed Jacobian. Three lines are wrong.
"""

import numpy as np

import workbench


def kinematics(p, q, qd, qdd):
    """The platform's position, velocity and acceleration."""
    b = p.L - p.l
    s2, c2, s3, c3 = np.sin(q[:, 1]), np.cos(q[:, 1]), np.sin(q[:, 2]), np.cos(q[:, 2])
    y2, z2, y3, z3 = -b - p.a1 * c2, p.a1 * s2, b + p.a1 * c3, p.a1 * s3
    dy, dz = (y3 - y2) / 2, (z3 - z2) / 2
    half = dy**2 + dz**2
    away = np.sqrt((p.a2**2 - q[:, 0] ** 2) / half - 1)
    x = np.stack([q[:, 0], (y2 + y3) / 2 - away * dz, (z2 + z3) / 2 + away * dy], axis=1)
    zero = 0 * s2
    u = x - np.stack([zero, y2, z2], axis=1)
    w = x - np.stack([zero, y3, z3], axis=1)
    moved2 = p.a1 * np.stack([zero, s2, c2], axis=1)
    moved3 = p.a1 * np.stack([zero, -s3, c3], axis=1)
    turned2 = p.a1 * np.stack([zero, c2, -s2], axis=1)
    turned3 = p.a1 * np.stack([zero, -c3, -s3], axis=1)
    rows = np.stack([np.broadcast_to([1.0, 0.0, 0.0], u.shape), u, w], axis=1)
    elbow2, elbow3 = moved2 * qd[:, 1:2], moved3 * qd[:, 2:3]
    right = np.stack([qd[:, 0], (u * elbow2).sum(axis=1), (w * elbow3).sum(axis=1)], axis=1)
    xd = np.linalg.solve(rows, right[:, :, None])[:, :, 0]
    pull2 = moved2 * qdd[:, 1:2] + turned2 * qd[:, 1:2] ** 2
    pull3 = moved3 * qdd[:, 2:3] + turned3 * qd[:, 2:3] ** 2
    side2 = (u * pull2).sum(axis=1) - ((xd - elbow2) ** 2).sum(axis=1)
    side3 = (w * pull3).sum(axis=1) - ((xd - elbow3) ** 2).sum(axis=1)
    xdd = np.linalg.solve(rows, np.stack([qdd[:, 0], side2, side3], axis=1)[:, :, None])[:, :, 0]
    return x, xd, xdd


@workbench.candidate("printed-appendix", reference="lumped", bound=1e-10, source="[Almeida2010] appendix")
def appendix(p, q, qd, qdd, force):
    """K1 to K6 and f1 to f3, as printed."""
    x, xd, xdd = kinematics(p, q, qd, qdd)
    x1, x2, x3 = x.T
    xd2, xdd2, xdd3 = xd[:, 1], xdd[:, 1], xdd[:, 2]
    q2, q3, qd2, qd3, qdd1, qdd2, qdd3 = q[:, 1], q[:, 2], qd[:, 1], qd[:, 2], qdd[:, 0], qdd[:, 1], qdd[:, 2]
    M, g, a1 = p.payload, p.g, p.a1
    # eq. (2)
    zero, one = 0 * q2, 1 + 0 * q2
    ce2, df2 = x2 - p.l + p.L + a1 * np.cos(q2), x2 + p.l - p.L - a1 * np.cos(q3)
    ce3, df3 = x3 - a1 * np.sin(q2), x3 - a1 * np.sin(q3)
    Jx = np.stack([one, zero, zero, x1, ce2, ce3, x1, df2, df3], axis=1).reshape(-1, 3, 3)
    Jq22 = ce2 * a1 * np.sin(q2) + ce3 * a1 * np.cos(q2)
    Jq33 = df2 * a1 * np.sin(q3) + df3 * a1 * np.cos(q3)
    Jq = np.stack([one, zero, zero, zero, Jq22, zero, zero, zero, Jq33], axis=1).reshape(-1, 3, 3)
    Jxq = np.linalg.solve(Jx, Jq)
    # appendix
    K1 = (p.m2 / 4 + p.m3 + p.m4 + p.m5 + p.m6 + M) * qdd1 - force[:, 0]
    K2 = (p.m1 + p.m2) * (a1**2 * qdd2 / 4 - g * a1 * np.cos(q2) / 2)
    K2 = K2 + p.m2 * a1 / 4 * (xdd2 * np.sin(q2) + xdd3 * np.cos(q2))
    K3 = (p.m1 + p.m2) * (a1**2 * qdd3 / 4 - g * a1 * np.cos(q3) / 2)
    K3 = K3 + p.m2 * a1 / 4 * (-xdd2 * np.sin(q3) + xdd3 * np.cos(q3))
    K4 = p.m2 * a1 / 4 * (qdd2 * np.sin(q2) + qd2**2 * np.cos(q2) - qdd3 * np.sin(q3) - qd3**2 * np.cos(q3))
    K4 = K4 + (p.m2 / 2 + p.m3 + p.m5 / 4 + p.m6 + M) * xdd2 - force[:, 1]
    drop = np.sqrt(p.a5**2 - x2**2)
    K5 = (p.m5 / 4 + p.m6) * ((xd2**2 + x2 * xdd2) / drop + (x2 * xd2) ** 2 / drop**3)
    K5 = (K5 + (p.m5 / 2 + p.m6) * g) * x2 / drop
    K6 = p.m2 * a1 / 4 * (qdd2 * np.cos(q2) - qd2**2 * np.sin(q2) + qdd3 * np.cos(q3) - qd3**2 * np.sin(q3))
    K6 = K6 + (p.m2 / 2 + p.m3 + M) * xdd3 - (p.m2 + p.m3 + M) * g - force[:, 2]
    f1 = -K1 - (K4 + K5) * Jxq[:, 1, 0] - K6 * Jxq[:, 2, 0]
    f2 = -K2 - (K4 + K5) * Jxq[:, 1, 1] - K6 * Jxq[:, 2, 2]
    f3 = -K3 - (K4 + K5) * Jxq[:, 1, 2] - K6 * Jxq[:, 2, 2]
    return -np.stack([f1, f2, f3], axis=1)
