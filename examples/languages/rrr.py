"""Planar 3-RRR: inverse dynamics by virtual work in platform coordinates."""

import numpy as np

import workbench


def e(a):
    """Unit vectors along angles."""
    return np.stack([np.cos(a), np.sin(a)], -1)


def n(a):
    """Unit vectors across them."""
    return np.stack([-np.sin(a), np.cos(a)], -1)


def kinematics(p, q):
    """Newton on (x, z, phi) of the platform: the joints are given, the pose is not."""
    B = np.array([[p.b1x, p.b1z], [p.b2x, p.b2z], [p.b3x, p.b3z]])
    P = np.array([[0, 0], [p.p2x, 0], [p.p3x, p.p3z]]) - [p.cx, p.cz]
    E = B + p.l1 * e(q)
    x = np.zeros((len(q), 3))
    for _ in range(50):
        c, s = np.cos(x[:, 2]), np.sin(x[:, 2])
        r = np.stack([c[:, None] * P[:, 0] - s[:, None] * P[:, 1], s[:, None] * P[:, 0] + c[:, None] * P[:, 1]], -1)
        d = x[:, None, :2] + r - E
        Sr = np.stack([-r[..., 1], r[..., 0]], -1)
        f = (d**2).sum(-1) - p.l2**2
        Jf = np.concatenate([2 * d, 2 * (d * Sr).sum(-1, keepdims=True)], -1)
        dx = np.linalg.solve(Jf, -f[..., None])[..., 0]
        x = x + dx
        if np.abs(dx).max() < 1e-15:
            break
    u = np.arctan2(d[..., 1], d[..., 0])
    return x, r, Sr, u


def dot(a, b):
    """Products of vectors in the last axis."""
    return (a * b).sum(-1)


@workbench.candidate("rrr-python", bound=1e-10)
def virtual_work(p, q, qd, qdd):
    """Cranks, distal bars and platform, each by the virtual work of its inertia and weight."""
    _, r, Sr, u = kinematics(p, q)
    t, nu, nq, eq = e(u), n(u), n(q), e(q)
    A = np.concatenate([t, dot(t, Sr)[..., None]], -1)
    Bq = p.l1 * dot(t, nq)
    J = np.linalg.solve(A, Bq[:, :, None] * np.eye(3))
    xd = (J @ qd[..., None])[..., 0]
    N = np.concatenate([nu, dot(nu, Sr)[..., None]], -1)
    U = (N @ J - (p.l1 * dot(nu, nq))[:, :, None] * np.eye(3)) / p.l2
    ud = (U @ qd[..., None])[..., 0]
    w2 = xd[:, 2:3] ** 2
    rhs = Bq * qdd - p.l1 * qd**2 * dot(t, eq) - p.l2 * ud**2 + w2 * dot(t, r)
    xdd = np.linalg.solve(A, rhs[..., None])[..., 0]
    aP = xdd[:, None, :2] + xdd[:, None, 2:3] * Sr - w2[..., None] * r
    aE = p.l1 * (qdd[..., None] * nq - qd[..., None] ** 2 * eq)
    udd = dot(nu, aP - aE) / p.l2
    up = np.array([0, p.g])
    aD = aE + p.l2 / 2 * (udd[..., None] * nu - ud[..., None] ** 2 * t)
    tau = (p.I1 + p.m1 * p.l1**2 / 4) * qdd + p.m1 * p.g * p.l1 / 2 * np.cos(q)
    # distal bars: virtual displacement of the mass centre is l1 n(q) dq + l2/2 n(u) du
    tau = tau + p.m2 * p.l1 * dot(nq, aD + up)
    f = p.m2 * p.l2 / 2 * dot(nu, aD) + p.m2 * p.l2 / 2 * dot(nu, up * np.ones_like(nu)) + p.I2 * udd
    tau = tau + np.einsum("nij,ni->nj", U, f)
    F = np.concatenate([p.m3 * (xdd[:, :2] + up), p.I3 * xdd[:, 2:3]], -1)
    return tau + np.einsum("nij,ni->nj", J, F)
