"""Inverse dynamics of the 3-RPC robot, legs exact and without inertia; derivation in README.md."""

import numpy as np

import workbench
from workbench.robots.limbs import UP, direction, telescope

ACROSS = 1.0 - np.eye(3)
"""Row i takes the component along axis i from a vector: a leg's C joint slides there."""


def feet(p):
    """Feet of the legs, each in the plane across its axis."""
    return np.array([[0.0, p.A, p.B], [p.B, 0.0, p.A], [p.A, p.B, 0.0]])


def place(p, q):
    """Platform on three cylinders of radius q_i: Newton's method from the middle."""
    x = np.zeros_like(q)
    for _ in range(30):
        leg = x[:, None] * ACROSS - feet(p)
        step = np.linalg.solve(leg, (((leg**2).sum(axis=2) - q**2) / 2)[..., None])[..., 0]
        x = x - step
        if np.abs(step).max() < 1e-15:
            break
    return x


def forces(p, q, qd, qdd, force, m1, m2, turning):
    """Virtual work with legs of the given masses and inertias (cylinder, piston, collar about the hinge)."""
    leg = place(p, q)[:, None] * ACROSS - feet(p)
    J = np.linalg.inv(leg / q[..., None])
    rate = (J @ qd[..., None])[:, None, :, 0] * ACROSS
    turn = direction(leg, rate, 0 * leg)[4]
    xdd = (J @ (qdd - q * (turn**2).sum(axis=2))[..., None])[..., 0]
    end = telescope(leg, rate, xdd[:, None] * ACROSS, (m1, p.c1, turning[0] + turning[2]), (m2, p.c2, turning[1]), p.g)
    # the weight of a leg along its own axis is the foot's business
    total = (end * ACROSS).sum(axis=1) + (p.mp + 3 * p.mc) * (xdd + p.g * UP) - force
    return (total[:, None] @ J)[:, 0]


@workbench.candidate("exact", bound=1e-10, source="examples/rpc/README.md")
def exact(p, q, qd, qdd, force):
    """Cylinders, pistons and collars as rigid bodies."""
    return forces(p, q, qd, qdd, force, p.m1, p.m2, (p.I1, p.I2, p.Ic))


@workbench.candidate("massless_legs", source="examples/rpc/README.md")
def massless_legs(p, q, qd, qdd, force):
    """Platform and collars alone."""
    return forces(p, q, qd, qdd, force, 0.0, 0.0, (0.0, 0.0, 0.0))


@workbench.forward_kinematics
def forward(p, q):
    """Platform by Newton's method from the middle."""
    return place(p, q)


@workbench.inverse_kinematics
def inverse(p, x):
    """Lengths of the legs."""
    return np.linalg.norm(x[:, None] * ACROSS - feet(p), axis=2)


@workbench.jacobian
def jacobian(p, q):
    """Rates of (x, y, z): xd = J qd."""
    return np.linalg.inv((place(p, q)[:, None] * ACROSS - feet(p)) / q[..., None])
