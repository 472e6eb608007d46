"""Inverse dynamics of the Delta robot: exact, and with Codourey's split of the forearms; derivation in README.md."""

import numpy as np

import workbench

TURN = 2 * np.pi * np.arange(3) / 3
OUT = np.stack([np.cos(TURN), np.sin(TURN), 0 * TURN], axis=1)
UP = np.array([0.0, 0.0, 1.0])


def place(p, q):
    """The platform's centre on three spheres of radius l about the elbows moved in by r, and their centres."""
    cos, sin = np.cos(q)[..., None], np.sin(q)[..., None]
    centre = (p.R - p.r + p.a * cos) * OUT - p.a * sin * UP
    one, two = centre[:, 1] - centre[:, 0], centre[:, 2] - centre[:, 0]
    across = np.cross(one, two)
    square = (across**2).sum(axis=1, keepdims=True)
    a2, b2 = (one**2).sum(axis=1, keepdims=True), (two**2).sum(axis=1, keepdims=True)
    middle = (a2 * np.cross(two, across) + b2 * np.cross(across, one)) / (2 * square)
    depth = np.sqrt((p.lz**2 - (middle**2).sum(axis=1, keepdims=True)) / square)
    return centre[:, 0] + middle - depth * across * np.sign(across[:, 2:]), centre


def kinematics(p, q, qd, qdd):
    """Elbow tangents, elbow and platform accelerations, and J with xd = J qd."""
    cos, sin = np.cos(q)[..., None], np.sin(q)[..., None]
    tangent = -p.a * sin * OUT - p.a * cos * UP
    normal = -p.a * cos * OUT + p.a * sin * UP
    x, centre = place(p, q)
    rod = x[:, None] - centre
    jacobian = np.linalg.solve(rod, (rod * tangent).sum(axis=2)[:, :, None] * np.eye(3))
    xd = (jacobian @ qd[:, :, None])[:, :, 0]
    relative = xd[:, None] - tangent * qd[..., None]
    elbow_acceleration = tangent * qdd[..., None] + normal * (qd**2)[..., None]
    side = (rod * elbow_acceleration).sum(axis=2) - (relative**2).sum(axis=2)
    return tangent, elbow_acceleration, np.linalg.solve(rod, side[:, :, None])[:, :, 0], jacobian


def torques(p, q, qd, qdd, near, far, cross):
    """Arms, platform, and forearms with the given masses at elbow and platform and the coupling of their motions."""
    tangent, elbow, x, jacobian = kinematics(p, q, qd, qdd)
    weight = p.g * UP
    at_elbow = near * elbow + cross * x[:, None] + (near + cross) * weight
    at_platform = far * x[:, None] + cross * elbow + (far + cross) * weight
    force = p.mp * (x + weight) + at_platform.sum(axis=1)
    arm = (p.Ia + p.ma * p.a**2 / 4) * qdd + p.ma / 2 * (tangent @ weight)
    return arm + (tangent * at_elbow).sum(axis=2) + (force[:, None] @ jacobian)[:, 0]


@workbench.candidate("exact", bound=1e-10, source="examples/delta/README.md")
def exact(p, q, qd, qdd):
    """Forearms as rods with their own inertia, in the coordinates of their ends."""
    k, turning = -p.cf / p.lz, p.If / p.lz**2
    near, far = p.mf * (1 - k) ** 2 + turning, p.mf * k**2 + turning
    return torques(p, q, qd, qdd, near, far, p.mf * k * (1 - k) - turning)


@workbench.candidate("codourey", source="[Codourey1998]")
def codourey(p, q, qd, qdd):
    """Two thirds of a forearm's mass at the elbow, one third at the platform, no rotational inertia."""
    return torques(p, q, qd, qdd, 2 / 3 * p.mf, 1 / 3 * p.mf, 0.0)


@workbench.forward_kinematics
def forward(p, q):
    """The lower of two points on three spheres."""
    return place(p, q)[0]


@workbench.inverse_kinematics
def inverse(p, x):
    """A sphere and a circle for each limb, the elbow outside."""
    out, height = x @ OUT.T - (p.R - p.r), x[:, 2:]
    across = (x**2).sum(axis=1, keepdims=True) - height**2 - (x @ OUT.T) ** 2
    # a^2 - 2 a (out cos q - height sin q) + out^2 + height^2 + across = l^2
    level = (p.a**2 + out**2 + height**2 + across - p.lz**2) / (2 * p.a)
    return np.arctan2(-height, out) - np.arccos(level / np.hypot(out, height))


@workbench.jacobian
def jacobian(p, q):
    """Rates of (x, y, z): xd = J qd."""
    return kinematics(p, q, 0 * q, 0 * q)[3]
