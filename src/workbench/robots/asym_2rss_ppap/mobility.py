"""Mobility of the 2RSS+PPaP robot on paper: Gogu's count, its dimensions from ranks of screws at one pose.

[Almeida2010] states three freedoms without a count; the formula is the one of [GarciaMurillo2016] eq. (1)-(8).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.robots import screws

POSE = (0.03, 0.7, 0.9)
"""q1 in metres, q2 and q3 in radians: a pose without any symmetry that could hide a freedom or add one."""

X1, X3 = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


ANGLES, APART = 48, 0.2
"""Arm angles that are tried for a robot of other lengths; those of the two arms differ by so much, rad."""


def generic_poses(parameters: Any) -> Iterator[FloatArray]:
    """Actuated coordinates ``(3,)`` without symmetry: `POSE`, then others for robots that do not reach it."""
    yield np.array(POSE)
    shift = 0.1 * min(parameters.a2_left, parameters.a2_right)
    for angle in np.linspace(-np.pi, np.pi, ANGLES, endpoint=False) + 0.013:
        yield np.array([shift, angle, angle + APART])


def gogu_mobility(parameters: Any, x: FloatArray, q: FloatArray) -> dict[str, int]:
    """Count freedoms at the pose with platform position *x* ``(3,)`` in metres and coordinates *q* ``(3,)``.

    Returns
    -------
    dict
        Joint freedoms, parameters lost in closing the loops, freedoms, idle spins of the rods, and what is left.
    """
    p = parameters
    arms = [_rss(p, x, q[1], "left"), _rss(p, x, q[2], "right")]
    # the parallelogram: both bars carry the coupler, each by two hinges along x1
    depth = np.sqrt(p.a5**2 - x[1] ** 2)
    bars = []
    for side in (-0.5, 0.5):
        foot = np.array([q[0], side * p.a6, 0.0])
        bars.append(np.stack([screws.line(X1, foot), screws.line(X1, foot + np.array([0.0, x[1], depth]))]))
    bar_spaces = [screws.span(bar) for bar in bars]
    swing = screws.intersection(bar_spaces[0], bar_spaces[1])
    lost_inside = sum(space.shape[1] for space in bar_spaces) - swing.shape[1]
    central = screws.span(np.vstack([screws.translation(X1), swing.T, screws.translation(X3)]))
    spaces = [central, *(screws.span(arm) for arm in arms)]
    platform = screws.intersection(screws.intersection(spaces[0], spaces[1]), spaces[2])
    freedoms = sum(len(arm) for arm in arms) + sum(len(bar) for bar in bars) + 2
    lost = sum(space.shape[1] for space in spaces) - platform.shape[1] + lost_inside
    idle = sum(len(arm) - space.shape[1] for arm, space in zip(arms, spaces[1:], strict=True))
    return {
        "joint freedoms": freedoms,
        "lost joint parameters r": lost,
        "freedoms with idle spins": freedoms - lost,
        "idle spins of rods": idle,
        "mobility M": freedoms - lost - idle,
    }


def _rss(p: Any, x: FloatArray, angle: float, side: str) -> FloatArray:
    """Screws ``(7, 6)`` of a limb: its motor, and three for each spherical joint."""
    outward = -1.0 if side == "left" else 1.0
    base = np.array([0.0, outward * getattr(p, f"L_{side}"), 0.0])
    elbow = base + getattr(p, f"a1_{side}") * np.array([0.0, outward * np.cos(angle), np.sin(angle)])
    end = x + np.array([0.0, outward * getattr(p, f"l_{side}"), 0.0])
    spherical = [screws.line(axis, point) for point in (elbow, end) for axis in np.eye(3)]
    return np.stack([screws.line(X1, base), *spherical])
