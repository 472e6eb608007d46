"""The 4-RPRP robot by screws as [GarciaMurillo2016] prints it: the moment of a revolute reads u x A in place of A x u.

Pole: the origin. Screws of a limb: revolute u, virtual revolutes w and v at A_i, prismatic w, revolute u at B_i,
prismatic u of the rod in the platform.
"""

import numpy as np

import workbench

AXES = {1: (1.0, 0.0, 0.0), 2: (0.0, 0.0, 1.0), 3: (1.0, 0.0, 0.0), 4: (0.0, 0.0, 1.0)}
CYLINDER, PISTON, ROD, PLATFORM = 3, 4, 5, 6


def line(u, A):
    """Screw of a revolute joint along u through A."""
    return np.concatenate([u, np.cross(u, A)], axis=-1)


def translation(u):
    """Screw of a prismatic joint along u."""
    return np.concatenate([0 * u, u], axis=-1)


def klein(one, two):
    """Klein form of two screws."""
    return (one[..., :3] * two[..., 3:] + one[..., 3:] * two[..., :3]).sum(axis=-1)


def lie(one, two):
    """Lie product of two screws."""
    moment = np.cross(one[..., :3], two[..., 3:]) - np.cross(two[..., :3], one[..., 3:])
    return np.concatenate([np.cross(one[..., :3], two[..., :3]), moment], axis=-1)


def moved(screw, shift):
    """The same screw about a pole moved by shift."""
    return np.concatenate([screw[..., :3], screw[..., 3:] + np.cross(screw[..., :3], shift)], axis=-1)


def position(p, q):
    """P from the three limb lengths, eq. (7) to (9)."""
    Pz = (p.b**2 + q[:, 0] ** 2 - q[:, 2] ** 2) / (2 * p.b)
    Py = np.sqrt(q[:, 0] ** 2 - Pz**2)
    Px = np.sqrt(q[:, 1] ** 2 - (Py - p.h) ** 2)
    return np.stack([Px, Py, Pz], axis=1)


def limbs(p, x):
    """Screws, pivot, tip and direction of each limb."""
    found = {}
    for i, A in {1: (0, 0, 0), 2: (0, 0, p.b), 3: (p.a, 0, p.b), 4: (p.a, 0, 0)}.items():
        A = np.array(A, dtype=float) + 0 * x
        B = np.stack([A[:, 0], x[:, 1], x[:, 2]] if i in (1, 3) else [x[:, 0], x[:, 1] - p.h, A[:, 2]], axis=1)
        u = np.array(AXES[i]) + 0 * x
        w = (B - A) / np.linalg.norm(B - A, axis=1, keepdims=True)
        v = np.cross(u, w)
        screws = [line(u, A), line(w, A), line(v, A), translation(w), line(u, B), translation(u)]
        found[i] = np.stack(screws, axis=1), A, B, w, u
    return found


def lie_sum(screws, rates, bodies):
    """Lie screw of the first few joints."""
    moving, total = screws * rates[:, :, None], 0.0
    for j in range(bodies - 1):
        total = total + lie(moving[:, j], moving[:, j + 1 : bodies].sum(axis=1))
    return total


def solve(matrix, vector):
    """Solve for one vector a sample."""
    return np.linalg.solve(matrix, vector[:, :, None])[:, :, 0]


@workbench.candidate("printed-screws", bound=1e-9, source="[GarciaMurillo2016] sections 5 and 6")
def torques(p, q, qd, qdd, force):
    """Driving forces by partial screws and virtual work, to eq. (32)."""
    x = position(p, q)
    chain = limbs(p, x)
    units = translation(np.eye(3))
    Jr = np.stack([klein(chain[i][0][:, None, 1, :], units[None]) for i in (1, 2, 3)], axis=1)
    xd = solve(Jr, qd)
    rates = {i: solve(c[0].swapaxes(1, 2), translation(xd)) for i, c in chain.items()}
    lies = {i: lie_sum(c[0], rates[i], PLATFORM) for i, c in chain.items()}
    xdd = solve(Jr, qdd + np.stack([klein(chain[i][0][:, 1], lies[i]) for i in (1, 2, 3)], axis=1))
    adds = {i: solve(c[0].swapaxes(1, 2), translation(xdd) - lies[i]) for i, c in chain.items()}
    inverse = np.linalg.inv(Jr)
    states = np.concatenate([0 * inverse, inverse], axis=1)
    weight = np.array([0.0, -p.g, 0.0])
    tau = 0.0
    for i, (screws, A, B, w, u) in chain.items():
        influence = np.linalg.solve(screws.swapaxes(1, 2), states)
        across = np.array([p.I2x, p.I3x] if i in (1, 3) else [p.I2z, p.I3z])
        bodies = [(CYLINDER, p.m2, A + p.c2 * w, across[0]), (PISTON, p.m3, B - p.c3 * w, across[1])]
        if i in (1, 2):
            bodies.append((ROD, p.m4, B, 0.0))
        if i == 1:
            bodies.append((PLATFORM, p.m6, x, 0.0))
        for body, mass, centre, inertia in bodies:
            below, rate, add = screws[:, :body], rates[i][:, :body], adds[i][:, :body]
            velocity = moved((rate[:, :, None] * below).sum(axis=1), centre)
            reduced = (add[:, :, None] * below).sum(axis=1) + lie_sum(screws, rates[i], body)
            reduced = moved(reduced, centre)
            acceleration = reduced[:, 3:] + np.cross(velocity[:, :3], velocity[:, 3:])
            push = mass * (weight - acceleration) + (force if body == PLATFORM else 0.0)
            moment = -inertia * (reduced[:, :3] * u).sum(axis=1, keepdims=True) * u
            wrench = np.concatenate([push, moment], axis=1)
            partial = np.einsum("nkm,nkc->nmc", influence[:, :body], below)
            tau = tau - klein(wrench[:, None], moved(partial, centre[:, None]))
    return tau
