"""Inverse dynamics of the Orthoglide, legs with their whole inertia or as two point masses; derivation in README.md."""

import numpy as np

import workbench

SLIDE = np.eye(3)
HINGE = np.roll(SLIDE, 1, axis=1)
UP = np.array([0.0, 0.0, 1.0])


def dot(one, two):
    """Scalar product along the last axis, which stays."""
    return (one * two).sum(axis=-1, keepdims=True)


def platform(p, q):
    """The platform's centre: on three spheres of radius L about points on three axes."""
    centre = q - p.s + p.w
    inverse = (1 / centre**2).sum(axis=1, keepdims=True)
    rest = (centre**2).sum(axis=1, keepdims=True) / 4 - p.L**2
    half = -(1 + np.sqrt(1 - 4 * inverse * rest)) / (2 * inverse)
    return centre / 2 + half / centre


def turning(p, leg, leg_rate, leg_acceleration, bars, ends):
    """Force that a leg's turning about its hinges needs at the platform's end, its opposite at the slider's."""
    sin = dot(leg, HINGE) / p.L
    cos = np.sqrt(1 - sin**2)
    along = (leg - p.L * sin * HINGE) / (p.L * cos)
    across = np.cross(along, HINGE)
    tilted = cos * HINGE - sin * along
    swing, shear = dot(leg_rate, across) / (p.L * cos), dot(leg_rate, tilted) / p.L
    add = (dot(leg_acceleration, across) / p.L + 2 * sin * swing * shear) / cos
    inertia, slope = ends + bars * sin**2, 2 * bars * sin * cos
    about_hinge = inertia * add + slope * shear * swing
    return about_hinge * across / (p.L * cos) - slope * swing**2 / 2 * tilted / p.L


def forces(p, q, qd, qdd, force, masses, bars, ends):
    """Slider forces; masses at the legs' ends and their coupling, inertias that turn with a leg."""
    near, far, cross = masses
    leg = platform(p, q)[:, None] - (q - p.s + p.w)[:, :, None] * SLIDE
    jacobian = np.linalg.solve(leg, dot(leg, SLIDE) * np.eye(3))
    xd = (jacobian @ qd[:, :, None])[:, None, :, 0]
    leg_rate = xd - qd[:, :, None] * SLIDE
    slider = qdd[:, :, None] * SLIDE
    xdd = np.linalg.solve(leg, dot(leg, slider) - dot(leg_rate, leg_rate))[:, None, :, 0]
    weight = p.g * UP
    spin = turning(p, leg, leg_rate, xdd - slider, bars, ends)
    at_slider = near * slider + cross * xdd + (near + cross) * weight - spin
    at_platform = far * xdd + cross * slider + (far + cross) * weight + spin
    moved = (p.mp + 3 * p.my) * (xdd[:, 0] + weight) + at_platform.sum(axis=1) - force
    at_slider = at_slider + (p.ms + p.mf) * (slider + weight)
    return dot(at_slider, SLIDE)[:, :, 0] + (moved[:, None] @ jacobian)[:, 0]


@workbench.candidate("exact", bound=1e-10, source="examples/orthoglide/README.md")
def exact(p, q, qd, qdd, force):
    """Bars, forks and yokes as rigid bodies."""
    k, turn = p.cb / p.L, p.Ib / p.L**2
    masses = 2 * p.mb * (1 - k) ** 2 + 2 * turn, 2 * p.mb * k**2 + 2 * turn, 2 * p.mb * k * (1 - k) - 2 * turn
    return forces(p, q, qd, qdd, force, masses, 2 * p.Jb, p.If + p.Iy)


@workbench.candidate("two_points", source="examples/orthoglide/README.md")
def two_points(p, q, qd, qdd, force):
    """Half of a leg's mass at the slider, half at the platform, nothing that turns."""
    return forces(p, q, qd, qdd, force, (p.mb, p.mb, 0.0), 0.0, 0.0)


@workbench.forward_kinematics
def forward(p, q):
    """Three spheres, in closed form."""
    return platform(p, q)


@workbench.inverse_kinematics
def inverse(p, x):
    """A sphere and a slide for each leg, the slider behind the platform."""
    return x + p.s - p.w - np.sqrt(p.L**2 - ((x**2).sum(axis=1, keepdims=True) - x**2))


@workbench.jacobian
def jacobian(p, q):
    """Rates of (x, y, z): xd = J qd."""
    leg = platform(p, q)[:, None] - (q - p.s + p.w)[:, :, None] * SLIDE
    return np.linalg.inv(leg) * dot(leg, SLIDE).transpose(0, 2, 1)
