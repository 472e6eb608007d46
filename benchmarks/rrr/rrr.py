"""Planar 3-RRR: inverse dynamics by virtual work, written as a user would; the platform's pose by Newton's method."""

import numpy as np

import workbench


def along(a):
    return np.stack([np.cos(a), np.sin(a)], axis=-1)


def across(a):
    return np.stack([-np.sin(a), np.cos(a)], axis=-1)


def dot(a, b):
    return (a * b).sum(axis=-1)


def pose(p, q):
    """Arms of the platform, their derivatives by its angle, and the angles of the distal bars."""
    base = np.array([[p.b1x, p.b1z], [p.b2x, p.b2z], [p.b3x, p.b3z]])
    pins = np.array([[0, 0], [p.p2x, 0], [p.p3x, p.p3z]]) - [p.cx, p.cz]
    elbow = base + p.l1 * along(q)
    x = np.zeros((len(q), 3))
    for _ in range(50):
        c, s = np.cos(x[:, 2:]), np.sin(x[:, 2:])
        r = np.stack([c * pins[:, 0] - s * pins[:, 1], s * pins[:, 0] + c * pins[:, 1]], axis=-1)
        d = x[:, None, :2] + r - elbow
        Sr = np.stack([-r[..., 1], r[..., 0]], axis=-1)
        f = (d**2).sum(axis=-1) - p.l2**2
        Jf = np.concatenate([2 * d, 2 * dot(d, Sr)[..., None]], axis=-1)
        dx = np.linalg.solve(Jf, -f[..., None])[..., 0]
        x = x + dx
        if np.abs(dx).max() < 1e-15:
            break
    return r, Sr, np.arctan2(d[..., 1], d[..., 0])


@workbench.candidate("virtual-work", bound=1e-10)
def virtual_work(p, q, qd, qdd):
    r, Sr, u = pose(p, q)
    t, nu, nq, eq = along(u), across(u), across(q), along(q)
    A = np.concatenate([t, dot(t, Sr)[..., None]], axis=-1)
    Bq = p.l1 * dot(t, nq)
    J = np.linalg.solve(A, Bq[:, :, None] * np.eye(3))
    xd = (J @ qd[..., None])[..., 0]
    N = np.concatenate([nu, dot(nu, Sr)[..., None]], axis=-1)
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
    # distal bars: the virtual displacement of the mass centre is l1 n(q) dq + l2/2 n(u) du
    tau = tau + p.m2 * p.l1 * dot(nq, aD + up)
    f = p.m2 * p.l2 / 2 * dot(nu, aD + up) + p.I2 * udd
    tau = tau + np.einsum("nij,ni->nj", U, f)
    F = np.concatenate([p.m3 * (xdd[:, :2] + up), p.I3 * xdd[:, 2:3]], axis=-1)
    return tau + np.einsum("nij,ni->nj", J, F)
