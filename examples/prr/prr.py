"""Planar 3-PRR: inverse dynamics by virtual work, bars exact and as two points; derivation in README.md."""

import numpy as np

import workbench

RAIL = np.exp(2j * np.pi * np.arange(3) / 3)


def drive(p, q):
    """Sliders, and the two factors of their acceleration: tangent qdd + normal qd^2."""
    start = np.array([p.b1x + 1j * p.b1z, p.b2x + 1j * p.b2z, p.b3x + 1j * p.b3z])
    return start + q * RAIL, RAIL + 0 * q, 0 * q


def driven(p, q, qdd):
    """Forces of the sliders alone."""
    return p.m1 * (qdd + p.g * RAIL.imag)


def dot(one, two):
    """Scalar product of vectors in the plane, as complex numbers."""
    return (np.conj(one) * two).real


def points(p):
    """The platform's three joints, from its site, at attitude zero."""
    return np.array([0.0, p.p2x + 1j * p.p2z, p.p3x + 1j * p.p3z]) - (p.cx + 1j * p.cz)


def pose(p, elbow):
    """Platform position, its joints from there, and its angle from x to z: Newton's method from the home pose."""
    x = np.zeros((len(elbow), 3))
    x[:, 0], x[:, 1] = p.hx, p.hz
    for _ in range(30):
        arm = np.exp(1j * x[:, 2:]) * points(p)
        leg = (x[:, 0] + 1j * x[:, 1])[:, None] + arm - elbow
        step = np.linalg.solve(rows(leg, arm), ((np.abs(leg) ** 2 - p.l2**2) / 2)[..., None])[..., 0]
        x = x - step
        if np.abs(step).max() < 1e-15:
            break
    return x[:, 0] + 1j * x[:, 1], np.exp(1j * x[:, 2:]) * points(p), x[:, 2]


def rows(leg, arm):
    """A of A (x', z', phi') = B q'."""
    return np.stack([leg.real, leg.imag, dot(leg, 1j * arm)], axis=-1)


def joint_to_pose(p, q):
    """The matrix from q' to (x', z', phi')."""
    elbow, tangent, _ = drive(p, q)
    place, arm, _ = pose(p, elbow)
    leg = place[:, None] + arm - elbow
    return np.linalg.solve(rows(leg, arm), dot(leg, tangent)[..., None] * np.eye(3))


def torques(p, q, qd, qdd, force, near, cross):
    """Virtual work; a distal bar has the mass *near* at either end and the coupling *cross* of their motions."""
    elbow, tangent, normal = drive(p, q)
    place, arm, angle = pose(p, elbow)
    leg = place[:, None] + arm - elbow
    matrix = rows(leg, arm)
    J = np.linalg.solve(matrix, dot(leg, tangent)[..., None] * np.eye(3))
    xd = (J @ qd[..., None])[..., 0]
    turn = xd[:, 2:]
    relative = (xd[:, 0] + 1j * xd[:, 1])[:, None] + 1j * turn * arm - tangent * qd
    moved = tangent * qdd + normal * qd**2
    side = dot(leg, moved) - np.abs(relative) ** 2 + turn**2 * dot(leg, arm)
    xdd = np.linalg.solve(matrix, side[..., None])[..., 0]
    shift, spin = (xdd[:, 0] + 1j * xdd[:, 1])[:, None], xdd[:, 2:]
    joint = shift + (1j * spin - turn**2) * arm
    weight = 1j * p.g
    at_elbow = near * moved + cross * joint + (near + cross) * weight
    at_joint = near * joint + cross * moved + (near + cross) * weight
    centre = np.exp(1j * angle)[:, None] * (p.sx - p.cx + 1j * (p.sz - p.cz))
    carried = p.m3 * (shift + (1j * spin - turn**2) * centre + weight)
    total = at_joint.sum(axis=1) + carried[:, 0] - (force[:, 0] + 1j * force[:, 2])
    moment = dot(1j * arm, at_joint).sum(axis=1) + dot(1j * centre, carried)[:, 0] + p.I3 * spin[:, 0]
    wrench = np.stack([total.real, total.imag, moment], axis=1)
    return driven(p, q, qdd) + dot(tangent, at_elbow) + (wrench[:, None] @ J)[:, 0]


@workbench.candidate("exact", bound=1e-10, source="examples/prr/README.md")
def exact(p, q, qd, qdd, force):
    """Distal bars as rigid bodies, by the mass matrix of their ends."""
    return torques(p, q, qd, qdd, force, p.m2 / 4 + p.I2 / p.l2**2, p.m2 / 4 - p.I2 / p.l2**2)


@workbench.candidate("two_points", source="examples/prr/README.md")
def two_points(p, q, qd, qdd, force):
    """Half of a distal bar's mass at either end, no rotational inertia."""
    return torques(p, q, qd, qdd, force, p.m2 / 2, 0.0)


@workbench.forward_kinematics
def forward(p, q):
    """Platform by Newton's method from home; ry turns from z to x, phi from x to z."""
    place, _, angle = pose(p, drive(p, q)[0])
    return np.column_stack([place.real, place.imag, -angle])


@workbench.inverse_kinematics
def inverse(p, x):
    """A circle and a rail for each limb, the slider ahead of the platform's joint."""
    joint = (x[:, 0] + 1j * x[:, 1])[:, None] + np.exp(-1j * x[:, 2:]) * points(p)
    way = joint - np.array([p.b1x + 1j * p.b1z, p.b2x + 1j * p.b2z, p.b3x + 1j * p.b3z])
    return dot(RAIL, way) + np.sqrt(p.l2**2 - dot(1j * RAIL, way) ** 2)


@workbench.jacobian
def jacobian(p, q):
    """Rates of (x, z, ry): xd = J qd."""
    return joint_to_pose(p, q) * np.array([1.0, 1.0, -1.0])[:, None]
