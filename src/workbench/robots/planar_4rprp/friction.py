"""Viscous friction in the passive joints of the 4-RPRP robot, by virtual work.

Each joint with coefficient c and relative rate w adds c w dw to the virtual work, dw being its virtual turn or shift.
Frame: the paper's, y up. Derivation: docs/friction.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.compiled import compiled
from workbench.robots.friction import DriveFriction

JOINTS = ("q1", "q2", "q3")


class Friction:
    """All friction of one robot, and its rotors."""

    def __init__(self, p: Any) -> None:
        """Collect the coefficients from `workbench.robots.planar_4rprp.parameters.Parameters`."""
        self.drives = DriveFriction.of(p, JOINTS)
        # rods do not turn, so both hinges of a limb turn at the same rate
        self._coefficients = np.array([p.damping_A + p.damping_B, p.damping_q4, p.damping_slide])
        self._lengths = np.array([p.a, p.b, p.h])

    def __bool__(self) -> bool:
        """Tell whether any coefficient is not zero."""
        return bool(self.drives) or bool(self._coefficients.any())

    def torques(
        self, qd: FloatArray, qdd: FloatArray, x: FloatArray, xd: FloatArray, jacobian: FloatArray
    ) -> FloatArray:
        """What the actuators must supply for friction and rotors, ``(n, 3)`` in N.

        Parameters
        ----------
        qd, qdd, x, xd
            Actuated and platform motion, each ``(n, 3)``, SI, paper frame.
        jacobian
            ``(n, 3, 3)`` with xd = J qd.
        """
        tau = self.drives.torques(qd, qdd)
        if self._coefficients.any():
            add_passive(self._coefficients, self._lengths, x, xd, jacobian, tau)
        return tau


@compiled
def _limb(hinges, slide, s, y, sd, yd):  # type: ignore[no-untyped-def]
    """Force (along s, along y) at B that friction in a limb with B - A = (s, y) needs."""
    squared = s * s + y * y
    # the limb turns by (s dy - y ds)/q^2 and lengthens by (s ds + y dy)/q
    across = hinges * (s * yd - y * sd) / (squared * squared)
    along = slide * (s * sd + y * yd) / squared
    return along * s - across * y, along * y + across * s


@compiled
def add_passive(c, lengths, x, xd, jacobian, tau):  # type: ignore[no-untyped-def]
    """Add to tau ``(n, 3)`` what friction in the passive joints costs."""
    a, b, h = lengths
    for i in range(x.shape[0]):
        px, py, pz = x[i]
        vx, vy, vz = xd[i]
        z1, y1 = _limb(c[0], 0.0, pz, py, vz, vy)
        x2, y2 = _limb(c[0], 0.0, px, py - h, vx, vy)
        z3, y3 = _limb(c[0], 0.0, pz - b, py, vz, vy)
        x4, y4 = _limb(c[0], c[1], px - a, py - h, vx, vy)
        # the platform slides along rod 1-3 by Px and along rod 2-4 by Pz
        fx, fy, fz = x2 + x4 + c[2] * vx, y1 + y2 + y3 + y4, z1 + z3 + c[2] * vz
        for joint in range(3):
            tau[i, joint] += jacobian[i, 0, joint] * fx + jacobian[i, 1, joint] * fy + jacobian[i, 2, joint] * fz
