"""Inverse dynamics of the 3-PUU Orthoglide, rods exact and as two points; derivation in README.md."""

import numpy as np

import workbench
from workbench.robots.limbs import UP, dot, universal_spin

SLIDE = np.eye(3)
HINGE = np.roll(SLIDE, 1, axis=1)
"""Outer axes of the universal joints."""


def place(p, q):
    """The platform's centre: on three spheres of radius L about points on three axes."""
    centre = q - p.s + p.w
    inverse = (1 / centre**2).sum(axis=1, keepdims=True)
    rest = (centre**2).sum(axis=1, keepdims=True) / 4 - p.L**2
    half = -(1 + np.sqrt(1 - 4 * inverse * rest)) / (2 * inverse)
    return centre / 2 + half / centre


def legs(p, q, x):
    """Rods from slider to platform, (n, 3, 3)."""
    return x[:, None] - (q - p.s + p.w)[..., None] * SLIDE


def forces(p, q, qd, qdd, force, masses, axial, cross_inertia):
    """Slider forces; masses at the rods' ends and their coupling, inertias that turn with a rod."""
    near, far, both = masses
    leg = legs(p, q, place(p, q))
    J = np.linalg.solve(leg, dot(leg, SLIDE) * np.eye(3))
    rate = (J @ qd[..., None])[:, None, :, 0] - qd[..., None] * SLIDE
    slider = qdd[..., None] * SLIDE
    xdd = np.linalg.solve(leg, dot(leg, slider) - dot(rate, rate))[:, None, :, 0]
    weight = p.g * UP
    spin = universal_spin(leg, rate, xdd - slider, HINGE, axial, cross_inertia)
    at_slider = near * slider + both * xdd + (near + both) * weight - spin + p.ms * (slider + weight)
    at_platform = far * xdd + both * slider + (far + both) * weight + spin
    total = at_platform.sum(axis=1) + (p.mp + 3 * p.mc) * (xdd[:, 0] + weight) - force
    return dot(at_slider, SLIDE)[..., 0] + (total[:, None] @ J)[:, 0]


@workbench.candidate("exact", bound=1e-10, source="examples/puu/README.md")
def exact(p, q, qd, qdd, force):
    """Rods and crosses as rigid bodies."""
    k, turn = p.cr / p.L, p.Ir / p.L**2
    masses = p.mr * (1 - k) ** 2 + turn, p.mr * k**2 + turn, p.mr * k * (1 - k) - turn
    return forces(p, q, qd, qdd, force, masses, p.Jr, p.Ic)


@workbench.candidate("two_points", source="examples/puu/README.md")
def two_points(p, q, qd, qdd, force):
    """Half of a rod's mass at the slider, half at the platform, nothing that turns."""
    return forces(p, q, qd, qdd, force, (p.mr / 2, p.mr / 2, 0.0), 0.0, 0.0)


@workbench.forward_kinematics
def forward(p, q):
    """Three spheres, in closed form."""
    return place(p, q)


@workbench.inverse_kinematics
def inverse(p, x):
    """A sphere and a slide for each limb, the slider behind the platform."""
    return x + p.s - p.w - np.sqrt(p.L**2 - ((x**2).sum(axis=1, keepdims=True) - x**2))


@workbench.jacobian
def jacobian(p, q):
    """Rates of (x, y, z): xd = J qd."""
    leg = legs(p, q, place(p, q))
    return np.linalg.solve(leg, dot(leg, SLIDE) * np.eye(3))
