"""Eq. (4) of [Almeida2010], the sum of virtual works, as it is printed: two weights are missing, two signs of print.

As in the appendix the Jacobian's third entry has lost a sign, and the parallelogram's mass counts twice.
"""

import numpy as np

import workbench


def platform(p, q):
    """The platform's position: where the circles of both rods meet, the lower of the two points."""
    b = p.L - p.l
    y2, z2 = -b - p.a1 * np.cos(q[:, 1]), p.a1 * np.sin(q[:, 1])
    y3, z3 = b + p.a1 * np.cos(q[:, 2]), p.a1 * np.sin(q[:, 2])
    dy, dz = (y3 - y2) / 2, (z3 - z2) / 2
    away = np.sqrt((p.a2**2 - q[:, 0] ** 2) / (dy**2 + dz**2) - 1)
    x = np.stack([q[:, 0], (y2 + y3) / 2 - away * dz, (z2 + z3) / 2 + away * dy], axis=1)
    zero = 0 * y2
    return x, x - np.stack([zero, y2, z2], axis=1), x - np.stack([zero, y3, z3], axis=1)


def column(vector, joint):
    """A matrix that is zero but for one column."""
    matrix = np.zeros((len(vector), 3, 3))
    matrix[:, :, joint] = vector
    return matrix


def work(force, displacement):
    """Coefficients of dq1, dq2, dq3 in force . d(point)."""
    return np.einsum("ni,nij->nj", force, displacement)


@workbench.candidate("printed-equation4", reference="lumped", bound=1e-10, source="[Almeida2010] eq. (3)-(6)")
def equation4(p, q, qd, qdd, force):
    """Virtual work of every mass, as printed."""
    x, u, w = platform(p, q)
    zero, one, a1 = 0 * q[:, 0], 1 + 0 * q[:, 0], p.a1
    s2, c2, s3, c3 = np.sin(q[:, 1]), np.cos(q[:, 1]), np.sin(q[:, 2]), np.cos(q[:, 2])
    dC, dD = a1 * np.stack([zero, s2, c2], axis=1), a1 * np.stack([zero, -s3, c3], axis=1)
    ddC, ddD = a1 * np.stack([zero, c2, -s2], axis=1), a1 * np.stack([zero, -c3, -s3], axis=1)
    rows = np.stack([np.stack([one, zero, zero], axis=1), u, w], axis=1)
    # motion of the platform, from the lengths of the rods
    vC, vD = dC * qd[:, 1:2], dD * qd[:, 2:3]
    aC = dC * qdd[:, 1:2] + ddC * qd[:, 1:2] ** 2
    aD = dD * qdd[:, 2:3] + ddD * qd[:, 2:3] ** 2
    speed = np.stack([qd[:, 0], (u * vC).sum(axis=1), (w * vD).sum(axis=1)], axis=1)
    xd = np.linalg.solve(rows, speed[:, :, None])[:, :, 0]
    side2 = (u * aC).sum(axis=1) - ((xd - vC) ** 2).sum(axis=1)
    side3 = (w * aD).sum(axis=1) - ((xd - vD) ** 2).sum(axis=1)
    xdd = np.linalg.solve(rows, np.stack([qdd[:, 0], side2, side3], axis=1)[:, :, None])[:, :, 0]
    # eq. (2) and (5): virtual displacements
    Jq22 = u[:, 1] * a1 * s2 + u[:, 2] * a1 * c2
    Jq33 = w[:, 1] * a1 * s3 + w[:, 2] * a1 * c3
    Jq = np.stack([one, zero, zero, zero, Jq22, zero, zero, zero, Jq33], axis=1).reshape(-1, 3, 3)
    ofx = np.linalg.solve(rows, Jq)
    ofC, ofD = column(dC, 1), column(dD, 2)
    ofH = column(np.stack([one, zero, zero], axis=1), 0)
    x2, xd2, xdd2 = x[:, 1], xd[:, 1], xdd[:, 1]
    drop = np.sqrt(p.a5**2 - x2**2)
    fall = -(xd2**2 + x2 * xdd2) / drop - (x2 * xd2) ** 2 / drop**3
    aH = np.stack([qdd[:, 0], zero, zero], axis=1)
    aI = np.stack([qdd[:, 0], xdd2, fall], axis=1)
    ofI = np.stack([ofH[:, 0, :], ofx[:, 1, :], (-x2 / drop)[:, None] * ofx[:, 1, :]], axis=1)
    gravity = np.array([0.0, 0.0, 1.0]) * p.g + 0 * x
    # eq. (4)
    tau = work(p.m1 * aC / 2, ofC / 2) + work(p.m1 * aD / 2, ofD / 2)
    tau = tau + work(p.m2 * (aC + xdd) / 2, (ofC + ofx) / 2) + work(p.m2 * (aD + xdd) / 2, (ofD + ofx) / 2)
    tau = tau + work((p.m3 + p.payload) * xdd, ofx) + work(p.m4 * aH, ofH)
    tau = tau + work(2 * p.m5 * (aH + aI) / 2, (ofH + ofI) / 2) + work(p.m6 * aI, ofI)
    tau = tau - work(p.m1 * gravity, ofC / 2)
    tau = tau - work(p.m2 * gravity, (ofC + ofx) / 2) - work(p.m2 * gravity, (ofD + ofx) / 2)
    tau = tau - work(p.m5 * gravity, ofI / 2) - work(p.m6 * gravity, ofI)
    return tau - work(force, ofx)
