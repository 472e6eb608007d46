"""Random robots and motions that several tests share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

import workbench as wb
from workbench.capabilities.robot import Robot
from workbench.errors import MotionError

MODEL = Path(__file__).resolve().parents[1] / "models" / "asym_2rss_ppap.xml"
NOMINAL = {"L": 0.2, "l": 0.1, "a1": 0.2, "a2": 0.3, "a5": 0.25, "m1": 0.2, "m2": 0.3, "m3": 0.45, "m4": 0.1,
           "m5": 0.5, "m6": 0.1}  # fmt: skip
SIDED = ("L", "l", "a1", "a2", "m1", "m2")
POSE = np.array([0.0, np.pi / 4, np.pi / 4])
AMPLITUDE = np.array([0.1, 0.3, 0.3])

Motion = tuple[np.ndarray, np.ndarray, np.ndarray]


def random_changes(rng: np.random.Generator) -> dict[str, float]:
    """Lengths +-30 %, masses x 0.3 to 3, payload to 2 kg, limbs that differ, mass centres and inertias of their own."""
    values: dict[str, float] = {}
    for name, nominal in NOMINAL.items():
        for key in (f"{name}_left", f"{name}_right") if name in SIDED else (name,):
            factor = np.exp(rng.uniform(np.log(0.3), np.log(3.0))) if name.startswith("m") else rng.uniform(0.7, 1.3)
            values[key] = nominal * float(factor)
    values["payload"] = float(rng.uniform(0.0, 2.0))
    for bar in ("1_left", "1_right", "2_left", "2_right", "5"):
        values[f"k{bar}"] = float(rng.uniform(0.2, 0.8))
        values[f"I{bar}"] = values[f"m{bar}"] * values[f"a{bar}"] ** 2 / 12 * float(rng.uniform(0.5, 2.0))
    return values


def sine_sum(rng: np.random.Generator, t: np.ndarray, scale: float = 1.0) -> Motion:
    """Two sines per joint about a pose near the paper's: q, qd, qdd ``(n, 3)``."""
    offset = POSE + scale * rng.uniform(-0.5, 0.5, 3) * AMPLITUDE
    q, qd, qdd = np.tile(offset, (len(t), 1)), np.zeros((len(t), 3)), np.zeros((len(t), 3))
    for joint in range(3):
        for part in (0.6, 0.4):
            size = scale * AMPLITUDE[joint] * part * rng.uniform(0.3, 1.0)
            rate, phase = rng.uniform(2.0, 25.0), rng.uniform(0.0, 2 * np.pi)
            q[:, joint] += size * np.sin(rate * t + phase)
            qd[:, joint] += size * rate * np.cos(rate * t + phase)
            qdd[:, joint] -= size * rate**2 * np.sin(rate * t + phase)
    return q, qd, qdd


def motion_inside(
    mech: Robot, rng: np.random.Generator, t: np.ndarray, tries: int = 20, away: float = 0.0
) -> tuple[Motion | None, int]:
    """A random motion that the closed-form kinematics accept, and how many were refused before it.

    *away* is the least value that every singularity measure keeps.
    """
    for refused in range(tries):
        motion = sine_sum(rng, t)
        try:
            measures = mech.singularity_measures(motion[0])
        except MotionError:
            continue
        if min(np.abs(value).min() for value in measures.values()) < away:
            continue
        return motion, refused
    return None, tries


def table_1() -> Robot:
    """The robot of the bundled model."""
    return wb.load_mechanism(MODEL)


def peak_error(candidate: np.ndarray, reference: np.ndarray) -> float:
    """Largest difference, per column over that column's peak."""
    return float((np.abs(candidate - reference).max(axis=0) / np.abs(reference).max(axis=0)).max())


def write_model(
    folder: Path,
    bodies: str,
    equality: str = "",
    motors: tuple[str, ...] = ("q",),
    home: str = "",
    base: str = "",
    gravity: str = "0 0 -9.81",
    extra: str = "",
) -> Path:
    """Write a tiny MJCF: *bodies* inside the base body, one of them with a site named P, the platform."""
    path = folder / "tiny.xml"
    key = f'<keyframe><key name="home" qpos="{home}"/></keyframe>' if home else ""
    path.write_text(
        f"""<mujoco><compiler angle="radian"/><option gravity="{gravity}"/>
        <custom><text name="base_body" data="base"/><text name="platform_site" data="P"/>{extra}</custom>
        <worldbody><body name="base" {base}><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        {bodies}</body></worldbody>
        <equality>{equality}</equality>
        <actuator>{"".join(f'<motor joint="{joint}"/>' for joint in motors)}</actuator>{key}</mujoco>"""
    )
    return path


class FourBar:
    """A crank-rocker in the (x, z) plane, its ground along x; lengths in metres, angles from x towards z.

    *branch* is +1 or -1; ``angles(q)`` are those of coupler and rocker, from the law of cosines.
    """

    ground, crank, coupler, rocker = 0.3, 0.1, 0.25, 0.2
    mass = np.array([0.5, 0.8, 0.6])
    inertia = np.array([0.001, 0.004, 0.003])
    centre = np.array([[0.04, 0.0], [0.12, 0.03], [0.11, -0.02]])
    point = np.array([0.15, 0.05])

    def __init__(self, branch: int = 1) -> None:
        self.branch = branch

    def angles(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        wx, wz = self.ground - self.crank * np.cos(q), -self.crank * np.sin(q)
        cosine = (self.coupler**2 + wx**2 + wz**2 - self.rocker**2) / (2 * self.coupler * np.hypot(wx, wz))
        phi = np.arctan2(wz, wx) + self.branch * np.arccos(cosine)
        return phi, np.arctan2(self.coupler * np.sin(phi) - wz, self.coupler * np.cos(phi) - wx)

    def poses(self, q: np.ndarray) -> np.ndarray:
        """Mass centre x, z and angle of crank, coupler, rocker, then of the coupler's point: ``(n, 4, 3)``."""
        phi, psi = self.angles(q)
        tip = self.crank * np.stack([np.cos(q), np.sin(q)], axis=1)
        pivot = np.tile([self.ground, 0.0], (len(q), 1))
        parts = zip((0 * tip, tip, pivot, tip), (q, phi, psi, phi), (*self.centre, self.point), strict=True)
        return np.stack([_placed(origin, angle, local) for origin, angle, local in parts], axis=1)

    def bodies(self) -> str:
        """MJCF of the three bars; sites ``coupler_tip`` and ``rocker_tip`` wait to be joined."""
        parts = [
            f'<inertial pos="{c[0]} 0 {c[1]}" mass="{m}" diaginertia="{i} {i} {i}"/>'
            for c, m, i in zip(self.centre, self.mass, self.inertia, strict=True)
        ]
        return f"""<body name="crank"><joint name="q" axis="0 -1 0"/>{parts[0]}
          <body name="coupler" pos="{self.crank} 0 0"><joint name="q_coupler" axis="0 -1 0"/>{parts[1]}
            <site name="P" pos="{self.point[0]} 0 {self.point[1]}"/><site name="coupler_tip" pos="{self.coupler} 0 0"/>
          </body></body>
          <body name="rocker" pos="{self.ground} 0 0"><joint name="q_rocker" axis="0 -1 0"/>{parts[2]}
            <site name="rocker_tip" pos="{self.rocker} 0 0"/></body>"""

    def home(self, q: float = 0.9) -> str:
        phi, psi = self.angles(np.array([q]))
        return f"{q} {phi[0] - q} {psi[0]}"


def _placed(origin: np.ndarray, angle: np.ndarray, local: np.ndarray) -> np.ndarray:
    cos, sin = np.cos(angle), np.sin(angle)
    x, z = local[0] * cos - local[1] * sin, local[0] * sin + local[1] * cos
    return np.stack([origin[:, 0] + x, origin[:, 1] + z, angle], axis=1)


CENTRAL = ((1, 4 / 5), (2, -1 / 5), (3, 4 / 105), (4, -1 / 280))


def slope(function: Callable[[float], np.ndarray], h: float) -> np.ndarray:
    """Derivative at 0 by eighth-order central differences."""
    return np.sum([w * (function(i * h) - function(-i * h)) / h for i, w in CENTRAL], axis=0)
