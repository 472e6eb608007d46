"""Viscous friction in the passive joints of the 2RSS+PPaP robot, by virtual work.

Each joint with coefficient c and relative rate w adds c w . dw to the virtual work, dw being its virtual turn or shift.
Rods do not spin about their axes. Frame: the paper's, x3 down. Derivation: docs/friction.md.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import compiled
from workbench.robots.friction import DriveFriction

JOINTS = ("q1", "q2", "q3")

PARALLELOGRAM_HINGES = 3
"""Hinges that the MJCF has as joints: both at the slider and one of the coupler's; the other one closes the loop."""


class Friction:
    """All friction of one robot, and its rotors."""

    def __init__(self, p: Any) -> None:
        """Collect the coefficients from `workbench.robots.asym_2rss_ppap.parameters.Parameters`."""
        self.drives = DriveFriction.of(p, JOINTS)
        # sign of the arm's angular velocity along x1, base minus platform half-width, arm, squared rod, ball joint
        self._limbs = np.array(
            [
                [-1.0, p.L_left - p.l_left, p.a1_left, p.a2_left**2, p.damping_ball_left],
                [1.0, p.L_right - p.l_right, p.a1_right, p.a2_right**2, p.damping_ball_right],
            ]
        )
        self._central = np.array([p.a5**2, PARALLELOGRAM_HINGES * p.damping_parallelogram, p.damping_slide])
        self._passive = bool(self._limbs[:, 4].any() or self._central[1:].any())

    def __bool__(self) -> bool:
        """Tell whether any coefficient is not zero."""
        return bool(self.drives) or self._passive

    def torques(
        self, q: FloatArray, qd: FloatArray, qdd: FloatArray, x: FloatArray, xd: FloatArray, jacobian: FloatArray
    ) -> FloatArray:
        """What the actuators must supply for friction and rotors, ``(n, 3)``: N, N m, N m.

        Parameters
        ----------
        q, qd, qdd, x, xd
            Actuated and platform motion, each ``(n, 3)``, SI, paper frame.
        jacobian
            ``(n, 3, 3)`` with xd = J qd.
        """
        tau = self.drives.torques(qd, qdd)
        if self._passive:
            add_passive(self._limbs, self._central, q, qd, x, xd, jacobian, tau)
        return tau


@compiled
def add_passive(limbs, central, q, qd, x, xd, jacobian, tau):  # type: ignore[no-untyped-def]
    """Add to tau ``(n, 3)`` what friction in the passive joints costs."""
    for i in range(q.shape[0]):
        x2, xd2, xd3 = x[i, 1], xd[i, 1], xd[i, 2]
        # the bars' angle follows x2 = a5 sin(angle): its rate is xd2/z; the coupler is at height z in the slider
        z = math.sqrt(central[0] - x2 * x2)
        slope = -x2 / z
        sliding = central[2] * (xd3 - slope * xd2)
        p1, p2, p3 = 0.0, central[1] * xd2 / (z * z) - slope * sliding, sliding
        for limb in range(2):
            side, base, a1, rod_squared, ball = limbs[limb]
            rate = qd[i, 1 + limb]
            sine, cosine = math.sin(q[i, 1 + limb]), math.cos(q[i, 1 + limb])
            # the rod, distal less proximal end, and its rate; the proximal end moves along (0, ty, tz)
            u1, u2, u3 = x[i, 0], x2 - side * (base + a1 * cosine), x[i, 2] - a1 * sine
            ty, tz = -side * a1 * sine, a1 * cosine
            r1, r2, r3 = xd[i, 0], xd2 - ty * rate, xd3 - tz * rate
            # moment of the ball joint's friction: c (u x r / a2^2 - the arm's angular velocity)
            m1 = ball * ((u2 * r3 - u3 * r2) / rod_squared - side * rate)
            m2 = ball * (u3 * r1 - u1 * r3) / rod_squared
            m3 = ball * (u1 * r2 - u2 * r1) / rod_squared
            # the same as a pair of forces at the rod's ends, m x u / a2^2, and a moment on the arm
            f1 = (m2 * u3 - m3 * u2) / rod_squared
            f2 = (m3 * u1 - m1 * u3) / rod_squared
            f3 = (m1 * u2 - m2 * u1) / rod_squared
            p1 += f1
            p2 += f2
            p3 += f3
            tau[i, 1 + limb] -= f2 * ty + f3 * tz + side * m1
        for joint in range(3):
            tau[i, joint] += jacobian[i, 0, joint] * p1 + jacobian[i, 1, joint] * p2 + jacobian[i, 2, joint] * p3
