"""Inverse dynamics of Tsai's 3-UPU, legs exact and without inertia; derivation in README.md."""

import numpy as np

import workbench
from workbench.robots.limbs import UP, direction, telescope, universal_spin

TURN = 2 * np.pi * np.arange(3) / 3
OUT = np.stack([np.cos(TURN), np.sin(TURN), 0 * TURN], axis=1)
FIRST = np.stack([-np.sin(TURN), np.cos(TURN), 0 * TURN], axis=1)
"""Outer axes of the universal joints, along the sides of base and platform."""


def place(p, q):
    """Platform above three spheres of radius q_i about points on a circle of radius R - r, in closed form."""
    square, distance = q**2, p.R - p.r
    # |x|^2 - 2 d u_i . x + d^2 = q_i^2, and the u_i sum to zero
    level = (distance**2 - square) / (2 * distance)
    flat = 2 / 3 * (level - level.mean(axis=1, keepdims=True)) @ OUT
    height = np.sqrt(square.mean(axis=1) - distance**2 - (flat**2).sum(axis=1))
    return flat + height[:, None] * UP


def legs(p, x):
    """Legs from foot to end, (n, 3, 3)."""
    return x[:, None] - (p.R - p.r) * OUT


def forces(p, q, qd, qdd, force, cylinder, piston, axial, fork):
    """Virtual work with legs of the given masses and inertias."""
    leg = legs(p, place(p, q))
    J = np.linalg.inv(leg / q[..., None])
    rate = np.broadcast_to((J @ qd[..., None])[:, None, :, 0], leg.shape)
    turn = direction(leg, rate, 0 * leg)[4]
    xdd = (J @ (qdd - q * (turn**2).sum(axis=2))[..., None])[..., 0]
    add = np.broadcast_to(xdd[:, None], leg.shape)
    end = telescope(leg, rate, add, cylinder, piston, p.g) + universal_spin(leg, rate, add, FIRST, axial, fork)
    total = end.sum(axis=1) + (p.mp + 3 * p.mc) * (xdd + p.g * UP) - force
    return (total[:, None] @ J)[:, 0]


@workbench.candidate("exact", bound=1e-10, source="examples/upu/README.md")
def exact(p, q, qd, qdd, force):
    """Cylinders, pistons and crosses as rigid bodies."""
    return forces(p, q, qd, qdd, force, (p.m1, p.c1, p.I1), (p.m2, p.c2, p.I2), p.J1 + p.J2, p.Ic)


@workbench.candidate("no_spin", source="examples/upu/README.md")
def no_spin(p, q, qd, qdd, force):
    """Legs that do not turn about themselves, and crosses that do not turn."""
    return forces(p, q, qd, qdd, force, (p.m1, p.c1, p.I1), (p.m2, p.c2, p.I2), 0.0, 0.0)


@workbench.candidate("massless_legs", source="examples/upu/README.md")
def massless_legs(p, q, qd, qdd, force):
    """Platform and crosses alone."""
    return forces(p, q, qd, qdd, force, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, 0.0)


@workbench.forward_kinematics
def forward(p, q):
    """Three spheres, in closed form."""
    return place(p, q)


@workbench.inverse_kinematics
def inverse(p, x):
    """Lengths of the legs."""
    return np.linalg.norm(legs(p, x), axis=2)


@workbench.jacobian
def jacobian(p, q):
    """Rates of (x, y, z): xd = J qd."""
    return np.linalg.inv(legs(p, place(p, q)) / q[..., None])
