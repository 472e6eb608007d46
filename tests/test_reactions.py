"""Joint reactions of the 2RSS+PPaP robot: Newton's and Euler's equations of single bars, written out by hand."""

import numpy as np
import pytest

import workbench as wb
from workbench.capabilities.robot import Robot

MODEL = "models/asym_2rss_ppap.xml"
FORCE = np.array([7.0, -4.0, 11.0])
TOLERANCE = 1e-10


def motion() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    t = np.linspace(0.0, 1.0, 60)[:, None]
    rate = np.array([5.0, 8.0, 11.0])
    amplitude = np.array([0.08, 0.2, 0.25])
    turn = rate * t + [0.1, 0.7, 1.9]
    q = np.array([0.0, 0.8, 0.7]) + amplitude * np.sin(turn)
    return q, amplitude * rate * np.cos(turn), -amplitude * rate**2 * np.sin(turn)


def arm_tip(mechanism: Robot, side: str, angle: np.ndarray, rate: np.ndarray, acceleration: np.ndarray) -> tuple:
    """Position and acceleration of C or D, paper frame, from the arm's angle."""
    p, outward = mechanism.parameters, -1.0 if side == "left" else 1.0
    a1, base = getattr(p, f"a1_{side}"), outward * getattr(p, f"L_{side}")
    zero = np.zeros_like(angle)
    along = np.stack([zero, outward * np.cos(angle), np.sin(angle)], axis=1)
    across = np.stack([zero, -outward * np.sin(angle), np.cos(angle)], axis=1)
    tip = a1 * along + [0.0, base, 0.0]
    return tip, a1 * (across * acceleration[:, None] - along * rate[:, None] ** 2)


@pytest.mark.parametrize(("side", "joint", "far", "column"), [("left", "C", "E", 1), ("right", "D", "F", 2)])
def test_forces_and_moments_on_a_rod_balance(side: str, joint: str, far: str, column: int) -> None:
    changes = {"payload": 0.8, "k2_left": 0.42, "k2_right": 0.6, "I2_left": 0.003, "a1_right": 0.21}
    mechanism, reference = wb.load_mechanism(MODEL, **changes), wb.MujocoReference(MODEL, **changes)
    q, qd, qdd = motion()
    reactions = reference.inverse_dynamics(q, qd, qdd, external_force=FORCE).reactions
    x, _, xdd = mechanism.platform_motion(q, qd, qdd)
    p, outward = mechanism.parameters, -1.0 if side == "left" else 1.0
    mass, inertia, fraction = (getattr(p, f"{name}_{side}") for name in ("m2", "I2", "k2"))
    near, near_acceleration = arm_tip(mechanism, side, q[:, column], qd[:, column], qdd[:, column])
    end = x + np.array([0.0, outward * getattr(p, f"l_{side}"), 0.0])
    rod = end - near
    centre_acceleration = (1 - fraction) * near_acceleration + fraction * xdd
    # the arm on the rod, and the platform on the rod
    at_near, at_end = reactions[f"spherical_{joint}"], reactions[f"spherical_{far}"]
    weight = mass * np.array([0.0, 0.0, p.g])
    unbalanced = at_near + at_end + weight - mass * centre_acceleration
    assert np.abs(unbalanced).max() < TOLERANCE * np.abs(at_near).max()
    # a rod that does not spin turns with alpha = rod x relative acceleration / length^2
    turning = np.cross(rod, xdd - near_acceleration) / np.sum(rod**2, axis=1)[:, None]
    moment = np.cross(-fraction * rod, at_near) + np.cross((1 - fraction) * rod, at_end)
    assert np.abs(moment - inertia * turning).max() < TOLERANCE * np.abs(moment).max()
    # twins: forgotten weight, forgotten inertia, the other end's sign
    assert np.abs(unbalanced - weight).max() > 1e-2
    assert np.abs(moment).max() > 1e-4
    assert np.abs(at_near - at_end + weight - mass * centre_acceleration).max() > 1e-2


def test_forces_on_the_platform_balance() -> None:
    mechanism, reference = wb.load_mechanism(MODEL, payload=0.8), wb.MujocoReference(MODEL, payload=0.8)
    q, qd, qdd = motion()
    reactions = reference.inverse_dynamics(q, qd, qdd, external_force=FORCE).reactions
    _, _, xdd = mechanism.platform_motion(q, qd, qdd)
    p = mechanism.parameters
    # the coupler on the platform through the slide, and the rods on the platform
    held = reactions["platform_slide"] - reactions["spherical_E"] - reactions["spherical_F"]
    carried = (p.m3 + p.payload) * (xdd - [0.0, 0.0, p.g])
    assert np.abs(held + FORCE - carried).max() < TOLERANCE * np.abs(held).max()
    assert np.abs(held - carried).max() > 1.0
    # the slide passes no force along x3
    assert np.abs(reactions["platform_slide"][:, 2]).max() < TOLERANCE * np.abs(held).max()
