"""Inverse dynamics of the 3-RRC robot, distal bars exact and as two points; derivation in README.md."""

import numpy as np

import workbench

UP = np.array([0.0, 0.0, 1.0])


def plane(vector):
    """Components of a vector (n, 3) across the three axes, as complex numbers: limb i turns about axis i."""
    return np.roll(vector, -1, axis=1) + 1j * np.roll(vector, -2, axis=1)


def space(across):
    """The way back: for forces (n, 3) in the limbs' planes their sum as a vector (n, 3)."""
    return np.roll(across.real, 1, axis=1) + np.roll(across.imag, 2, axis=1)


def dot(one, two):
    """Scalar product of vectors in a limb's plane."""
    return (np.conj(one) * two).real


def rows(leg):
    """Matrix (n, 3, 3) whose row i is the distal bar of limb i as a vector in space."""
    return np.roll(leg.real[..., None] * np.eye(3), 1, axis=2) + np.roll(leg.imag[..., None] * np.eye(3), 2, axis=2)


def drive(p, q):
    """Elbows from the feet, and the two factors of their acceleration: tangent qdd + normal qd^2."""
    crank = p.a * np.exp(1j * q)
    return crank, 1j * crank, -crank


def driven(p, qdd, tangent, weight):
    """Torques of the cranks alone."""
    return (p.I1 + p.m1 * p.a**2 / 4) * qdd + p.m1 / 2 * dot(tangent, weight)


def place(p, elbow):
    """Platform on three cylinders of radius b: Newton's method from the middle."""
    x = np.zeros(elbow.shape)
    for _ in range(30):
        leg = plane(x) - (p.A + 1j * p.B) - elbow
        step = np.linalg.solve(rows(leg), ((np.abs(leg) ** 2 - p.b**2) / 2)[..., None])[..., 0]
        x = x - step
        if np.abs(step).max() < 1e-15:
            break
    return x


def forces(p, q, qd, qdd, force, near, cross):
    """Virtual work; a distal bar has the mass *near* at either end and the coupling *cross* of their motions."""
    elbow, tangent, normal = drive(p, q)
    leg = plane(place(p, elbow)) - (p.A + 1j * p.B) - elbow
    matrix = rows(leg)
    J = np.linalg.solve(matrix, dot(leg, tangent)[..., None] * np.eye(3))
    relative = plane((J @ qd[..., None])[..., 0]) - tangent * qd
    moved = tangent * qdd + normal * qd**2
    xdd = np.linalg.solve(matrix, (dot(leg, moved) - np.abs(relative) ** 2)[..., None])[..., 0]
    add, weight = plane(xdd), plane(p.g * UP[None, :])
    at_elbow = near * moved + cross * add + (near + cross) * weight
    at_wrist = near * add + cross * moved + (near + cross) * weight
    total = space(at_wrist) + (p.mp + 3 * p.mc) * (xdd + p.g * UP) - force
    return driven(p, qdd, tangent, weight) + dot(tangent, at_elbow) + (total[:, None] @ J)[:, 0]


@workbench.candidate("exact", bound=1e-10, source="examples/rrc/README.md")
def exact(p, q, qd, qdd, force):
    """Distal bars as rigid bodies that turn with their collars."""
    spread = (p.I2 + p.Ic) / p.b**2
    return forces(p, q, qd, qdd, force, p.m2 / 4 + spread, p.m2 / 4 - spread)


@workbench.candidate("two_points", source="examples/rrc/README.md")
def two_points(p, q, qd, qdd, force):
    """Half of each distal bar's mass at either end, no rotational inertia."""
    return forces(p, q, qd, qdd, force, p.m2 / 2, 0.0)


@workbench.forward_kinematics
def forward(p, q):
    """Platform by Newton's method from the middle."""
    return place(p, drive(p, q)[0])


@workbench.inverse_kinematics
def inverse(p, x):
    """Two circles for each limb, the elbow to the right of the way from foot to platform."""
    way = plane(x) - (p.A + 1j * p.B)
    reach = np.abs(way)
    return np.angle(way * np.exp(-1j * np.arccos((p.a**2 + reach**2 - p.b**2) / (2 * p.a * reach))))


@workbench.jacobian
def jacobian(p, q):
    """Rates of (x, y, z): xd = J qd."""
    elbow, tangent, _ = drive(p, q)
    leg = plane(place(p, elbow)) - (p.A + 1j * p.B) - elbow
    return np.linalg.solve(rows(leg), dot(leg, tangent)[..., None] * np.eye(3))
