"""Inverse dynamics of Bricard's six-bar from its one closed-form relation between hinges; derivation in README.md."""

import numpy as np

import workbench

AXES = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
RODS = np.array([[1, 0, 0], [0, -1, 0], [0, 0, 1], [-1, 0, 0], [0, 1, 0]], dtype=float)


def turned(axis, angle, vectors):
    """Turn vectors ``(n, k, 3)`` about unit axes ``(n, 3)`` by angles ``(n,)``."""
    cos, sin, axis = np.cos(angle)[:, None, None], np.sin(angle)[:, None, None], axis[:, None]
    along = (vectors * axis).sum(axis=2, keepdims=True) * axis
    return cos * vectors + sin * np.cross(axis, vectors) + (1 - cos) * along


@workbench.candidate("threefold", bound=1e-10, source="examples/bricard/README.md")
def threefold(p, q, qd, qdd):
    """Every second hinge turns alike; sin a + sin b + sin a sin b = 0 joins the two kinds."""
    q, qd, qdd = q[:, 0], qd[:, 0], qdd[:, 0]
    s, c = np.sin(q), np.cos(q)
    ratio, first = s / (1 + s), 1 / (1 + s) ** 2
    root = np.sqrt(1 - ratio**2)
    slope = -first * c / root
    second = -((-2 * first / (1 + s) * c**2 - first * s) / root + ratio * (first * c) ** 2 / root**3)
    angles = (q, -np.arcsin(ratio))
    rates = (np.ones_like(q), slope)
    adds = (qdd, slope * qdd + second * qd**2)
    frame = np.broadcast_to(np.concatenate([AXES, RODS]), (len(q), 10, 3))
    zero = np.zeros((len(q), 3))
    turn, spin, swing, rate, add, tau = zero, zero, zero, zero, zero, 0.0
    up = p.g * np.array([0.0, 1.0, 0.0])
    for i in range(5):
        axis, j = frame[:, i], i % 2
        frame = turned(axis, angles[j], frame)
        step, pace = rates[j][:, None] * axis, (rates[j] * qd)[:, None] * axis
        swing = swing + adds[j][:, None] * axis + np.cross(spin, pace)
        turn, spin = turn + step, spin + pace
        half = 0.5 * p.l * frame[:, 5 + i]
        for part in (0, 1):  # to the mass centre, then to the far end
            rate = rate + np.cross(turn, half)
            add = add + np.cross(swing, half) + np.cross(spin, np.cross(spin, half))
            if part == 0:
                along = frame[:, 5 + i]
                inertia = p.I * swing + (p.J - p.I) * (swing * along).sum(axis=1, keepdims=True) * along
                momentum = p.I * spin + (p.J - p.I) * (spin * along).sum(axis=1, keepdims=True) * along
                tau = tau + (p.m * rate * (add + up)).sum(axis=1)
                tau = tau + (turn * (inertia + np.cross(spin, momentum))).sum(axis=1)
    return tau[:, None]
