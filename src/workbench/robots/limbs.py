"""What limbs of parallel robots need at their ends, in closed form; formulas of the library share it.

Vectors have the shape ``(n, k, 3)``: samples, limbs, components in the frame of the base; SI. Each function returns
the force that a limb's inertia and weight take at its moving end, so that virtual work of a whole robot is
``tau = J^T (forces at the ends, and the platform's own)``. Derivation: docs/derivations/limbs.md.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray

UP = np.array([0.0, 0.0, 1.0])


def dot(one: ArrayLike, two: ArrayLike) -> FloatArray:
    """Scalar product along the last axis, which stays, ``(..., 1)``."""
    return np.asarray((np.asarray(one) * np.asarray(two)).sum(axis=-1, keepdims=True))


def direction(s: FloatArray, sd: FloatArray, sdd: FloatArray) -> tuple[FloatArray, ...]:
    """Length and direction of a leg with their derivatives.

    Parameters
    ----------
    s, sd, sdd
        Leg from its foot to its end, and derivatives, ``(n, k, 3)``, m, s.

    Returns
    -------
    tuple
        Length and its two derivatives ``(n, k, 1)``; unit vector, its rate, and the part of its second derivative
        across the leg, ``(n, k, 3)``.
    """
    length = np.sqrt(dot(s, s))
    n = s / length
    rate = dot(n, sd)
    turn = (sd - rate * n) / length
    speed = dot(n, sdd) + length * dot(turn, turn)
    across = (sdd - dot(n, sdd) * n - 2 * rate * turn) / length
    return length, rate, speed, n, turn, across


def telescope(
    s: FloatArray,
    sd: FloatArray,
    sdd: FloatArray,
    cylinder: tuple[float, float, float],
    piston: tuple[float, float, float],
    g: float,
) -> FloatArray:
    """Force ``(n, k, 3)`` in newtons at the end of telescopic legs that do not spin, gravity along -z.

    Parameters
    ----------
    s, sd, sdd
        Legs as in `direction`.
    cylinder
        Mass, distance of its mass centre from the foot, transverse inertia about the mass centre; kg, m, kg m^2.
    piston
        Mass, distance of its mass centre back from the end, transverse inertia; likewise.
    g
        Gravity, m/s^2.
    """
    (m1, c1, i1), (m2, c2, i2) = cylinder, piston
    length, rate, speed, n, turn, across = direction(s, sd, sdd)
    arm = length - c2
    inertia = i1 + m1 * c1**2 + i2 + m2 * arm**2
    weight = g * UP
    along = m2 * (speed - arm * dot(turn, turn) + dot(n, weight))
    moment = inertia * across + 2 * m2 * arm * rate * turn + (m1 * c1 + m2 * arm) * (weight - dot(n, weight) * n)
    return np.asarray(along * n + moment / length)


def universal_spin(
    s: FloatArray, sd: FloatArray, sdd: FloatArray, axis: ArrayLike, axial: float, fork: float = 0.0
) -> FloatArray:
    """Force ``(n, k, 3)`` at the end of legs on universal joints, from what turns about the first axis.

    A universal joint does not let its leg spin freely: the leg's rate has the component a' sin b along the leg, a about
    the first axis, b out of the plane across it.

    Parameters
    ----------
    s, sd, sdd
        Legs as in `direction`; of constant length too.
    axis
        First axis of each universal joint, unit vectors ``(k, 3)``.
    axial
        Inertia of all that turns with the leg, about the leg; kg m^2.
    fork
        Inertia about the first axis of all that turns with a alone.
    """
    length, _, _, n, turn, across = direction(s, sd, sdd)
    e = np.asarray(axis, dtype=float)
    sin = dot(n, e)
    flat = n - sin * e
    cos = np.sqrt(dot(flat, flat))
    ahead = flat / cos
    side = np.cross(np.broadcast_to(e, ahead.shape), ahead)
    tilted = cos * e - sin * ahead
    swing, lean = dot(turn, side) / cos, dot(turn, tilted)
    swing_rate = (dot(across, side) + 2 * swing * lean * sin) / cos
    inertia, slope = axial * sin**2 + fork, 2 * axial * sin * cos
    about = inertia * swing_rate + slope * swing * lean
    return np.asarray((about / cos * side - slope * swing**2 / 2 * tilted) / length)
