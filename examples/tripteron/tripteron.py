"""Inverse dynamics of the Tripteron, limbs with their whole inertia or as point masses; derivation in README.md."""

import numpy as np

import workbench

UP = np.array([0.0, 0.0, 1.0])


def plane(vector):
    """Components of a vector (n, 3) across the three slides, as complex numbers: limb i turns about axis i."""
    return np.roll(vector, -1, axis=1) + 1j * np.roll(vector, -2, axis=1)


def dot(one, two):
    """Scalar product of vectors in a limb's plane."""
    return (np.conj(one) * two).real


def forces(p, q, qd, qdd, force, hinged, near, cross):
    """Slider forces; inertia of an upper bar about its hinge, masses at the ends of a lower one and their coupling."""
    wrist, rate, add, weight = plane(q) - (p.A + 1j * p.B), plane(qd), plane(qdd), plane(p.g * UP[None, :])
    reach = np.abs(wrist)
    opening = np.arccos((p.a**2 + reach**2 - p.b**2) / (2 * p.a * reach))
    upper = p.a * wrist / reach * np.exp(-1j * opening)
    lower = wrist - upper
    lever = dot(lower, 1j * upper)
    turn = dot(lower, rate) / lever
    fall = rate - 1j * upper * turn
    turning = (dot(lower, add) + np.abs(fall) ** 2 + turn**2 * dot(lower, upper)) / lever
    elbow = (1j * turning - turn**2) * upper
    at_elbow = near * elbow + cross * add + (near + cross) * weight
    at_wrist = near * add + cross * elbow + (near + cross) * weight
    about_hinge = hinged * turning + p.m1 / 2 * dot(1j * upper, weight) + dot(1j * upper, at_elbow)
    across = at_wrist + about_hinge / lever * lower
    along = (p.ms + p.m1 + p.m2) * (qdd + p.g * UP)
    return along + p.mp * (qdd + p.g * UP) - force + np.roll(across.real, 1, axis=1) + np.roll(across.imag, 2, axis=1)


@workbench.candidate("exact", bound=1e-10, source="examples/tripteron/README.md")
def exact(p, q, qd, qdd, force):
    """Upper and lower bars as rigid bodies."""
    spread = p.I2 / p.b**2
    return forces(p, q, qd, qdd, force, p.I1 + p.m1 * p.a**2 / 4, p.m2 / 4 + spread, p.m2 / 4 - spread)


@workbench.candidate("two_points", source="examples/tripteron/README.md")
def two_points(p, q, qd, qdd, force):
    """Half of each bar's mass at either end, no rotational inertia."""
    return forces(p, q, qd, qdd, force, p.m1 * p.a**2 / 2, p.m2 / 2, 0.0)


@workbench.forward_kinematics
def forward(p, q):
    """The robot is decoupled: x = q."""
    return q.copy()


@workbench.inverse_kinematics
def inverse(p, x):
    """The same the other way: q = x."""
    return x.copy()


@workbench.jacobian
def jacobian(p, q):
    """J = 1."""
    return np.tile(np.eye(3), (len(q), 1, 1))
