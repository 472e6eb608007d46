"""Inverse dynamics of a Delta with both bars of each forearm: exact, and with Codourey's split; see README.md."""

import numpy as np

import workbench
from workbench.robots.limbs import UP

TURN = 2 * np.pi * np.arange(3) / 3
OUT = np.stack([np.cos(TURN), np.sin(TURN), 0 * TURN], axis=1)


def elbows(p, q):
    """Elbows moved inwards by r, and the two factors of their acceleration: tangent qdd + normal qd^2."""
    sin, cos = np.sin(q)[..., None], np.cos(q)[..., None]
    outward, downward = cos * OUT - sin * UP, -sin * OUT - cos * UP
    return (p.R - p.r) * OUT + p.a * outward, p.a * downward, -p.a * outward


def place(p, elbow):
    """The platform's centre: the lower point on three spheres of radius l about the elbows moved inwards by r."""
    one, two = elbow[:, 1] - elbow[:, 0], elbow[:, 2] - elbow[:, 0]
    across = np.cross(one, two)
    square = (across**2).sum(axis=1, keepdims=True)
    a2, b2 = (one**2).sum(axis=1, keepdims=True), (two**2).sum(axis=1, keepdims=True)
    middle = (a2 * np.cross(two, across) + b2 * np.cross(across, one)) / (2 * square)
    depth = np.sqrt((p.l**2 - (middle**2).sum(axis=1, keepdims=True)) / square)
    return elbow[:, 0] + middle - depth * across * np.sign(across[:, 2:])


def forces(p, q, qd, qdd, force, near, far, cross):
    """Virtual work; forearms with the given masses at elbow and platform and the coupling of their motions."""
    elbow, tangent, normal = elbows(p, q)
    rod = place(p, elbow)[:, None] - elbow
    J = np.linalg.solve(rod, (rod * tangent).sum(axis=2)[..., None] * np.eye(3))
    relative = (J @ qd[..., None])[:, None, :, 0] - tangent * qd[..., None]
    moved = tangent * qdd[..., None] + normal * (qd**2)[..., None]
    side = (rod * moved).sum(axis=2) - (relative**2).sum(axis=2)
    xdd = np.linalg.solve(rod, side[..., None])[:, None, :, 0]
    weight = p.g * UP
    at_elbow = near * moved + cross * xdd + (near + cross) * weight
    at_platform = far * xdd + cross * moved + (far + cross) * weight
    total = at_platform.sum(axis=1) + p.mp * (xdd[:, 0] + weight) - force
    arm = (p.Ia + p.ma * p.ca**2) * qdd + p.ma * p.ca / p.a * (tangent @ weight)
    return arm + (tangent * at_elbow).sum(axis=2) + (total[:, None] @ J)[:, 0]


@workbench.candidate("exact", bound=1e-10, source="examples/delta_industrial/README.md")
def exact(p, q, qd, qdd, force):
    """Two bars for each forearm, with their own inertia, in the coordinates of their ends."""
    k, turn, m = p.cf / p.l, p.If / p.l**2, p.mf
    near, far, cross = m * (1 - k) ** 2 + turn, m * k**2 + turn, m * k * (1 - k) - turn
    return forces(p, q, qd, qdd, force, 2 * near, 2 * far, 2 * cross)


@workbench.candidate("codourey", source="[Codourey1998]")
def codourey(p, q, qd, qdd, force):
    """Two thirds of a forearm's mass at the elbow, one third at the platform, no rotational inertia."""
    return forces(p, q, qd, qdd, force, 4 / 3 * p.mf, 2 / 3 * p.mf, 0.0)


@workbench.candidate("halves", source="examples/delta_industrial/README.md")
def halves(p, q, qd, qdd, force):
    """Half of a forearm's mass at either end, no rotational inertia."""
    return forces(p, q, qd, qdd, force, p.mf, p.mf, 0.0)


@workbench.forward_kinematics
def forward(p, q):
    """Three spheres, in closed form."""
    return place(p, elbows(p, q)[0])


@workbench.inverse_kinematics
def inverse(p, x):
    """A sphere and a circle for each limb, the elbow outside."""
    out, height = x @ OUT.T - (p.R - p.r), x[:, 2:]
    across = (x**2).sum(axis=1, keepdims=True) - height**2 - (x @ OUT.T) ** 2
    # a^2 - 2 a (out cos q - height sin q) + out^2 + height^2 + across = l^2
    level = (p.a**2 + out**2 + height**2 + across - p.l**2) / (2 * p.a)
    return np.arctan2(-height, out) - np.arccos(level / np.hypot(out, height))


@workbench.jacobian
def jacobian(p, q):
    """Rates of (x, y, z): xd = J qd."""
    elbow, tangent, _ = elbows(p, q)
    rod = place(p, elbow)[:, None] - elbow
    return np.linalg.solve(rod, (rod * tangent).sum(axis=2)[..., None] * np.eye(3))
