"""Machines with known answers for control: a pendulum and a four-bar, and their motion under held torques by scipy.

The equations here are written down from the geometry: nothing of the package and nothing of MuJoCo is in them.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference

HEAD = '<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81"><flag contact="disable"/></option>'

PENDULUM = f"""{HEAD}
<worldbody>
 <body name="bar"><joint name="swing" axis="0 -1 0"/>
  <inertial pos="0.25 0 0" mass="0.8" diaginertia="1e-4 0.011 0.011"/><site name="tip" pos="0.5 0 0"/>
 </body>
</worldbody></mujoco>
"""

FOURBAR = f"""{HEAD}
<worldbody>
 <site name="ground" pos="0.5 0 0"/>
 <body name="crank"><joint name="crank" axis="0 -1 0"/>
  <inertial pos="0.08 0 0" mass="0.3" diaginertia="1e-4 0.0009 0.0009"/>
  <body name="coupler" pos="0.15 0 0"><joint name="elbow" axis="0 -1 0"/>
   <inertial pos="0.2 0 0.03" mass="0.8" diaginertia="1e-4 0.014 0.014"/><site name="middle" pos="0.2 0 0.05"/>
   <body name="rocker" pos="0.45 0 0"><joint name="wrist" axis="0 -1 0"/>
    <inertial pos="0.14 0 0" mass="0.5" diaginertia="1e-4 0.004 0.004"/><site name="tip" pos="0.3 0 0"/>
   </body>
  </body>
 </body>
</worldbody>
<equality><connect name="loop" site1="tip" site2="ground"/></equality></mujoco>
"""

Acceleration = Callable[[float, float, float], float]
"""angle, rate, torque -> angular acceleration"""


def reference_of(folder: Path, text: str, joint: str, site: str, **initial: float) -> MujocoReference:
    path = folder / "machine.xml"
    path.write_text(text)
    return MujocoReference(path, setup=Setup(actuated=(joint,), platform_site=site, initial=tuple(initial.items())))


def pendulum(q: float, qd: float, tau: float, gravity: float = 9.81) -> float:
    """(I + m d^2) q'' + m g d cos q = tau."""
    del qd
    return (tau - 0.8 * gravity * 0.25 * np.cos(q)) / (0.011 + 0.8 * 0.25**2)


def fourbar_points(q: complex) -> tuple[list[tuple[complex, complex]], list[complex]]:
    """Mass centres (x, z) and angles of the three bars; analytic in q, for a complex step."""
    a, b, c, d = 0.15, 0.45, 0.3, 0.5
    px, pz = a * np.cos(q), a * np.sin(q)
    # the coupler's end: at b from the crank's end and at c from the ground, on the side of the home pose (above)
    dx, dz = d - px, -pz
    length2 = dx * dx + dz * dz
    along = (b * b - c * c + length2) / (2.0 * length2)
    across = np.sqrt(b * b / length2 - along * along)
    ex, ez = along * dx - across * dz, along * dz + across * dx
    coupler = np.arctan(ez / ex)
    rx, rz = d - (px + ex), -(pz + ez)
    cosine, sine = rx / c, rz / c
    centres = [
        (0.08 * np.cos(q), 0.08 * np.sin(q)),
        (px + (0.2 * ex - 0.03 * ez) / b, pz + (0.2 * ez + 0.03 * ex) / b),
        (px + ex + 0.14 * cosine, pz + ez + 0.14 * sine),
    ]
    return centres, [q, coupler, np.arctan(sine / cosine)]


def fourbar(q: float, qd: float, tau: float, gravity: float = 9.81) -> float:
    """M(q) q'' + M'(q) q'^2 / 2 + V'(q) = tau, by complex steps and a central difference of M."""
    h = 1e-30

    def mass(angle: float) -> float:
        centres, angles = fourbar_points(angle + 1j * h)
        total = 0.0
        for (x, z), turn, m, inertia in zip(centres, angles, (0.3, 0.8, 0.5), (0.0009, 0.014, 0.004), strict=True):
            total += m * ((x.imag / h) ** 2 + (z.imag / h) ** 2) + inertia * (turn.imag / h) ** 2
        return total

    centres, _ = fourbar_points(q + 1j * h)
    weight = gravity * sum(m * z.imag / h for (_, z), m in zip(centres, (0.3, 0.8, 0.5), strict=True))
    step = 1e-4
    near, far = mass(q + step) - mass(q - step), mass(q + 2 * step) - mass(q - 2 * step)
    slope = (8.0 * near - far) / (12.0 * step)
    return (tau - weight - 0.5 * slope * qd**2) / mass(q)


def tracked(
    acceleration: Acceleration,
    law: Callable[[int, float, float], float],
    start: tuple[float, float],
    ticks: int,
    rate: float,
) -> np.ndarray:
    """Angles at the ticks ``(ticks,)`` under a law whose torques are held; DOP853 to 1e-12 between ticks."""
    state, found = np.array(start), []
    for k in range(ticks):
        found.append(state[0])
        tau = law(k, state[0], state[1])
        solved = solve_ivp(
            lambda _, y, tau=tau: (y[1], acceleration(y[0], y[1], tau)),
            (0.0, 1.0 / rate),
            state,
            "DOP853",
            rtol=1e-12,
            atol=1e-14,
        )
        state = solved.y[:, -1]
    return np.array(found)
