"""Inverse dynamics of the 3-RPS, legs exact and without inertia; derivation in README.md."""

import numpy as np

import workbench
from workbench.robots.limbs import UP, telescope
from workbench.robots.turning import exponential, logarithm, rotation_vector_rates, unskew

TURN = 2 * np.pi * np.arange(3) / 3
OUT = np.stack([np.cos(TURN), np.sin(TURN), 0 * TURN], axis=1)
NEXT = np.roll(np.arange(3), -1)


def legs(swing):
    """Unit vectors along the legs and their derivatives by the swing, (n, 3, 3)."""
    sin, cos = np.sin(swing)[..., None], np.cos(swing)[..., None]
    return sin * OUT + cos * UP, cos * OUT - sin * UP


def sides(end):
    """Sides of the triangle of ends, end i less end i + 1."""
    return end - end[:, NEXT]


def pairs(side, vector):
    """Matrix (n, 3, 3): side i times vector i in column i, and less vector i + 1 in column i + 1."""
    own = (side * vector).sum(axis=2)[..., None] * np.eye(3)
    other = (side * vector[:, NEXT]).sum(axis=2)[..., None] * np.eye(3)[NEXT]
    return own - other


def swings(p, q):
    """Angles of the legs: the ball joints are sqrt(3) r apart; Newton's method from a level platform."""
    swing = np.arcsin((p.r - p.R) / q)
    for _ in range(40):
        along, ahead = legs(swing)
        side = sides(p.R * OUT + q[..., None] * along)
        gap = ((side**2).sum(axis=2) - 3 * p.r**2) / 2
        step = np.linalg.solve(pairs(side, q[..., None] * ahead), gap[..., None])[..., 0]
        swing = swing - step
        if np.abs(step).max() < 1e-15:
            break
    return swing


def frame(vectors):
    """Two sides and their normal as columns, of the ends (n, 3, 3)."""
    one, two = vectors[:, 1] - vectors[:, 0], vectors[:, 2] - vectors[:, 0]
    return one, two, np.stack([one, two, np.cross(one, two)], axis=2)


def motion(p, q):
    """Ends, their Jacobian (n, end, 3, joint), the platform's attitude and its angular Jacobian (n, 3, joint)."""
    swing = swings(p, q)
    along, ahead = legs(swing)
    end = p.R * OUT + q[..., None] * along
    side = sides(end)
    by_joint = -np.linalg.solve(pairs(side, q[..., None] * ahead), pairs(side, along))
    ends = along[..., None] * np.eye(3)[:, None] + (q[..., None] * ahead)[..., None] * by_joint[:, :, None]
    one, two, drawn = frame(end)
    inverse = np.linalg.inv(drawn)
    attitude = frame(p.r * OUT[None, :])[2]
    attitude = drawn @ np.linalg.inv(attitude)
    turning = np.stack([unskew(rates(one, two, ends[..., k]) @ inverse) for k in range(3)], axis=2)
    return swing, end, ends, by_joint, attitude, inverse, turning


def rates(one, two, velocity):
    """Derivative of the frame of two sides and their normal, with velocities of the ends (n, 3, 3)."""
    first, second = velocity[:, 1] - velocity[:, 0], velocity[:, 2] - velocity[:, 0]
    return np.stack([first, second, np.cross(first, two) + np.cross(one, second)], axis=2)


def forces(p, q, qd, qdd, force, cylinder, piston):
    """Virtual work with legs of the given masses and inertias."""
    swing, end, ends, by_joint, attitude, inverse, turning = motion(p, q)
    along, ahead = legs(swing)
    length, rate, swing_rate = q[..., None], qd[..., None], (by_joint @ qd[..., None])
    velocity = along * rate + length * ahead * swing_rate
    side, fall = sides(end), sides(velocity)
    known = along * qdd[..., None] + 2 * ahead * rate * swing_rate - length * along * swing_rate**2
    gap = (side * sides(known)).sum(axis=2) + (fall**2).sum(axis=2)
    swing_add = -np.linalg.solve(pairs(side, length * ahead), gap[..., None])
    acceleration = known + length * ahead * swing_add
    leg_force = telescope(length * along, velocity, acceleration, cylinder, piston, p.g)
    one, two, _ = frame(end)
    first, second = velocity[:, 1] - velocity[:, 0], velocity[:, 2] - velocity[:, 0]
    spinning = rates(one, two, velocity) @ inverse
    twice = rates(one, two, acceleration)
    twice[..., 2] += 2 * np.cross(first, second)
    omega, alpha = unskew(spinning), unskew(twice @ inverse - spinning @ spinning)
    centre = (attitude @ np.array([p.cx, p.cy, p.cz])) + 0 * omega
    middle = acceleration.mean(axis=1) + np.cross(alpha, centre) + np.cross(omega, np.cross(omega, centre))
    carried = p.mp * (middle + p.g * UP)
    tensor = attitude @ np.diag([p.Ix, p.Iy, p.Iz]) @ attitude.transpose(0, 2, 1)
    moment = (tensor @ alpha[..., None])[..., 0] + np.cross(omega, (tensor @ omega[..., None])[..., 0])
    moment = moment + np.cross(centre, carried)
    site = ends.mean(axis=1)
    total = (carried - force)[:, None] @ site + moment[:, None] @ turning
    return total[:, 0] + np.einsum("nic,nick->nk", leg_force, ends)


@workbench.candidate("exact", bound=1e-10, source="examples/rps/README.md")
def exact(p, q, qd, qdd, force):
    """Cylinders and pistons as rigid bodies."""
    return forces(p, q, qd, qdd, force, (p.m1, p.c1, p.I1), (p.m2, p.c2, p.I2))


@workbench.candidate("massless_legs", source="examples/rps/README.md")
def massless_legs(p, q, qd, qdd, force):
    """The platform alone."""
    return forces(p, q, qd, qdd, force, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@workbench.forward_kinematics
def forward(p, q):
    """Height of the site, and the first two components of the platform's rotation vector."""
    _, end, _, _, attitude, _, _ = motion(p, q)
    return np.column_stack([end.mean(axis=1)[:, 2], logarithm(attitude)[:, :2]])


@workbench.jacobian
def jacobian(p, q):
    """Rates of (z, rx, ry): xd = J qd."""
    _, _, ends, _, attitude, _, turning = motion(p, q)
    return np.concatenate(
        [ends.mean(axis=1)[:, 2:], (rotation_vector_rates(logarithm(attitude)) @ turning)[:, :2]], axis=1
    )


@workbench.inverse_kinematics
def inverse(p, x):
    """Legs of a platform at the height z turned by (rx, ry, 0): it does not twist, but it shifts."""
    attitude = exponential(np.column_stack([x[:, 1:], np.zeros(len(x))]))
    shift = p.r * np.column_stack([(attitude[:, 0, 0] - attitude[:, 1, 1]) / 2, -attitude[:, 0, 1]])
    site = np.column_stack([shift, x[:, 0]])
    return np.linalg.norm(site[:, None] + p.r * OUT @ attitude.transpose(0, 2, 1) - p.R * OUT, axis=2)
