"""Inverse dynamics of a 6-UPS platform, legs exact and without inertia; derivation in README.md."""

import numpy as np

import workbench
from workbench.robots.limbs import UP, direction, telescope, universal_spin
from workbench.robots.turning import exponential, logarithm, rotation_vector_rates

LEGS = range(1, 7)
OUT = np.radians([-12.0, 12.0, 108.0, 132.0, 228.0, 252.0])
FIRST = np.stack([np.cos(OUT), np.sin(OUT), 0 * OUT], axis=1)
"""First axes of the universal joints; as the directions of the rails of `prr` they are no parameters."""


def feet(p):
    """Feet of the legs (6, 3)."""
    return np.array([[getattr(p, f"b{i}x"), getattr(p, f"b{i}y"), 0.0] for i in LEGS])


def corners(p):
    """Ball joints of the platform from its site, in its own frame (6, 3)."""
    return np.array([[getattr(p, f"p{i}x"), getattr(p, f"p{i}y"), 0.0] for i in LEGS])


def rows(leg, arm):
    """A of A (x', omega) = q': unit vectors along the legs and their moments about the site, (n, 6, 6)."""
    along = leg / np.linalg.norm(leg, axis=2, keepdims=True)
    return np.concatenate([along, np.cross(arm, along)], axis=2)


def pose(p, q):
    """Site and attitude of the platform: Newton's method from the height h, level."""
    x = np.tile([0.0, 0.0, p.h], (len(q), 1))
    attitude = np.tile(np.eye(3), (len(q), 1, 1))
    for _ in range(40):
        arm = corners(p) @ attitude.transpose(0, 2, 1)
        leg = x[:, None] + arm - feet(p)
        step = np.linalg.solve(rows(leg, arm), (np.linalg.norm(leg, axis=2) - q)[..., None])[..., 0]
        x = x - step[:, :3]
        attitude = exponential(-step[:, 3:]) @ attitude
        if np.abs(step).max() < 1e-15:
            break
    return x, attitude


def forces(p, q, qd, qdd, force, cylinder, piston, axial):
    """Virtual work with legs of the given masses and inertias."""
    x, attitude = pose(p, q)
    arm = corners(p) @ attitude.transpose(0, 2, 1)
    leg = x[:, None] + arm - feet(p)
    matrix = rows(leg, arm)
    twist = np.linalg.solve(matrix, qd[..., None])[..., 0]
    spin = twist[:, None, 3:]
    rate = twist[:, None, :3] + np.cross(spin, arm)
    inward = np.cross(spin, np.cross(spin, arm))
    turn = direction(leg, rate, 0 * leg)[4]
    side = qdd - q * (turn**2).sum(axis=2) - (matrix[..., :3] * inward).sum(axis=2)
    add = np.linalg.solve(matrix, side[..., None])[..., 0]
    alpha = add[:, None, 3:]
    end_add = add[:, None, :3] + np.cross(alpha, arm) + inward
    end = telescope(leg, rate, end_add, cylinder, piston, p.g) + universal_spin(leg, rate, end_add, FIRST, axial)
    centre = attitude @ np.array([p.cx, p.cy, p.cz])
    spin, alpha = twist[:, 3:], add[:, 3:]
    carried = add[:, :3] + np.cross(alpha, centre) + np.cross(spin, np.cross(spin, centre)) + p.g * UP
    inertia = attitude @ np.diag([p.Ix, p.Iy, p.Iz]) @ attitude.transpose(0, 2, 1)
    momentum = (inertia @ spin[..., None])[..., 0]
    moment = (inertia @ alpha[..., None])[..., 0] + np.cross(spin, momentum) + np.cross(centre, p.mp * carried)
    wrench = np.concatenate([end.sum(axis=1) + p.mp * carried - force, np.cross(arm, end).sum(axis=1) + moment], axis=1)
    return np.linalg.solve(matrix.transpose(0, 2, 1), wrench[..., None])[..., 0]


@workbench.candidate("exact", bound=1e-10, source="examples/stewart/README.md")
def exact(p, q, qd, qdd, force):
    """Cylinders and pistons as rigid bodies on universal joints."""
    return forces(p, q, qd, qdd, force, (p.m1, p.c1, p.I1), (p.m2, p.c2, p.I2), p.J1 + p.J2)


@workbench.candidate("no_spin", source="examples/stewart/README.md")
def no_spin(p, q, qd, qdd, force):
    """Legs that do not turn about themselves, the usual simplification."""
    return forces(p, q, qd, qdd, force, (p.m1, p.c1, p.I1), (p.m2, p.c2, p.I2), 0.0)


@workbench.candidate("massless_legs", source="examples/stewart/README.md")
def massless_legs(p, q, qd, qdd, force):
    """The platform alone."""
    return forces(p, q, qd, qdd, force, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)


@workbench.forward_kinematics
def forward(p, q):
    """Site of the platform, and its rotation vector."""
    x, attitude = pose(p, q)
    return np.concatenate([x, logarithm(attitude)], axis=1)


@workbench.inverse_kinematics
def inverse(p, x):
    """Lengths of the legs."""
    arm = corners(p) @ exponential(x[:, 3:]).transpose(0, 2, 1)
    return np.linalg.norm(x[:, None, :3] + arm - feet(p), axis=2)


@workbench.jacobian
def jacobian(p, q):
    """Rates of position and rotation vector: xd = J qd."""
    x, attitude = pose(p, q)
    arm = corners(p) @ attitude.transpose(0, 2, 1)
    twist = np.linalg.inv(rows(x[:, None] + arm - feet(p), arm))
    return np.concatenate([twist[:, :3], rotation_vector_rates(logarithm(attitude)) @ twist[:, 3:]], axis=1)
