"""Inverse dynamics of the planar 2-PRR+RPR, bars exact and as two points; derivation in README.md."""

import numpy as np

import workbench
from workbench.robots.limbs import telescope

SIDE = np.array([-1.0, 0.0, 1.0])
"""Pins of the limbs on the platform, in its half length."""
RAIL = np.array([1.0, 0.0, 1.0])
"""Limbs whose foot runs along x."""


def dot(one, two):
    """Scalar product of vectors in the plane, as complex numbers."""
    return (np.conj(one) * two).real


def legs(p, q, place, angle):
    """Arms from the platform's middle to its pins, and legs from slider or pivot to pin, (n, 3)."""
    arm = p.E * SIDE * np.exp(1j * angle)[:, None]
    return arm, place[:, None] + arm - RAIL * q - (1 - RAIL) * p.x0


def rows(leg, arm):
    """A of A (x', z', phi') = B q'."""
    return np.stack([leg.real, leg.imag, dot(leg, 1j * arm)], axis=-1)


def pose(p, q):
    """Middle of the platform and its angle from x to z: Newton's method from the home pose."""
    x = np.tile([p.hx, p.hz, 0.0], (len(q), 1))
    length = np.where(RAIL == 1, p.L, q)
    for _ in range(40):
        arm, leg = legs(p, q, x[:, 0] + 1j * x[:, 1], x[:, 2])
        step = np.linalg.solve(rows(leg, arm), ((np.abs(leg) ** 2 - length**2) / 2)[..., None])[..., 0]
        x = x - step
        if np.abs(step).max() < 1e-15:
            break
    return x[:, 0] + 1j * x[:, 1], x[:, 2]


def driving(p, q, leg):
    """Diagonal of B: a slider pushes along its rail, the bar of limb 2 along itself."""
    return np.where(RAIL == 1, leg.real, q)


def joint_to_pose(p, q):
    """The matrix from q' to (x', z', phi')."""
    arm, leg = legs(p, q, *pose(p, q))
    return np.linalg.solve(rows(leg, arm), driving(p, q, leg)[..., None] * np.eye(3))


def space(flat):
    """Vectors of the plane as vectors in space, (n, 1, 3)."""
    return np.stack([flat.real, 0 * flat.real, flat.imag], axis=-1)[:, None]


def forces(p, q, qd, qdd, force, near, cross):
    """Virtual work; bars 1 and 3 have the mass *near* at either end and the coupling *cross* of their motions."""
    place, angle = pose(p, q)
    arm, leg = legs(p, q, place, angle)
    matrix = rows(leg, arm)
    J = np.linalg.solve(matrix, driving(p, q, leg)[..., None] * np.eye(3))
    xd = (J @ qd[..., None])[..., 0]
    rate, turn = (xd[:, 0] + 1j * xd[:, 1])[:, None], xd[:, 2:]
    pin_rate = rate + 1j * turn * arm
    relative = pin_rate - RAIL * qd
    own = np.where(RAIL == 1, leg.real * qdd, q * qdd + qd**2)
    side = own - np.abs(relative) ** 2 + turn**2 * dot(leg, arm)
    xdd = np.linalg.solve(matrix, side[..., None])[..., 0]
    add, spin = (xdd[:, 0] + 1j * xdd[:, 1])[:, None], xdd[:, 2:]
    pin_add = add + (1j * spin - turn**2) * arm
    weight = 1j * p.g
    at_slider = RAIL * (near * qdd + cross * pin_add + (near + cross) * weight)
    at_pin = RAIL * (near * pin_add + cross * qdd + (near + cross) * weight)
    two = telescope(
        space(leg[:, 1]), space(pin_rate[:, 1]), space(pin_add[:, 1]), (0.0, 0.0, p.Is), (p.m2, p.c2, p.I2), p.g
    )[:, 0]
    total = at_pin.sum(axis=1) + two[:, 0] + 1j * two[:, 2] + p.mp * (add[:, 0] + weight)
    total = total - (force[:, 0] + 1j * force[:, 2])
    moment = dot(1j * arm, at_pin).sum(axis=1) + p.Ip * spin[:, 0]
    wrench = np.stack([total.real, total.imag, moment], axis=1)
    return RAIL * p.ms * qdd + at_slider.real + (wrench[:, None] @ J)[:, 0]


@workbench.candidate("exact", bound=1e-10, source="examples/prr_rpr/README.md")
def exact(p, q, qd, qdd, force):
    """Bars as rigid bodies, by the mass matrix of their ends; bar 2 with its swivel."""
    turning = p.Ib / p.L**2
    return forces(p, q, qd, qdd, force, p.mb / 4 + turning, p.mb / 4 - turning)


@workbench.candidate("two_points", source="examples/prr_rpr/README.md")
def two_points(p, q, qd, qdd, force):
    """Half of the mass of bars 1 and 3 at either end, no rotational inertia."""
    return forces(p, q, qd, qdd, force, p.mb / 2, 0.0)


@workbench.forward_kinematics
def forward(p, q):
    """Platform by Newton's method from home; ry turns from z to x, phi from x to z."""
    place, angle = pose(p, q)
    return np.column_stack([place.real, place.imag, -angle])


@workbench.inverse_kinematics
def inverse(p, x):
    """A circle and a rail for limbs 1 and 3, sliders inside of the pins; for limb 2 the distance from its pivot."""
    place = x[:, 0] + 1j * x[:, 1]
    arm = p.E * SIDE * np.exp(-1j * x[:, 2])[:, None]
    pin = place[:, None] + arm
    lengths = pin.real - SIDE * np.sqrt(p.L**2 - pin.imag**2)
    lengths[:, 1] = np.abs(place - p.x0)
    return lengths


@workbench.jacobian
def jacobian(p, q):
    """Rates of (x, z, ry): xd = J qd."""
    return joint_to_pose(p, q) * np.array([1.0, 1.0, -1.0])[:, None]
