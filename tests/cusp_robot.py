"""A planar 3-RPR and a motion of it around a cusp of its singular curve, followed by geometry alone.

The lengths are those of an example that many papers on assembly modes use, two hundredths in size. At the first leg's
length 0.2996 m a cusp lies near (0.3206, 0.5913) m in the plane of the two others. The motion swings on a circle around
it, a little more than half a turn to either side: at both ends the legs are the same and the assemblies are not.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from workbench.mjcf.setup import Setup

BASE = np.array([[0.0, 0.0], [0.3182, 0.0], [0.0, 0.2]])
JOINTS = np.array([[0.0, 0.0], [0.3408, 0.0], [0.2647274647887324, 0.3219341693367302]])
"""of the platform, in its own frame"""

CENTRE, RADIUS = np.array([0.3205673, 0.5913196]), 0.055
MIDDLE, SWING, RATE = 1.955, 3.3, 1.5
"""rad, rad, rad/s: the angle on the circle is MIDDLE + SWING sin(RATE t)"""

FIRST = 0.2996
START = np.array([0.29, 0.076, -0.303])
"""first guess of the platform's first joint and angle"""

SAMPLES = 281
PLATFORM = ((0.19, 0.1), 1.3)
"""mass centre and mass"""

MODEL = """<mujoco><compiler angle="radian"/><option gravity="0 -9.81 0"><flag contact="disable"/></option><worldbody>
{limbs}
</worldbody>
<equality><connect name="two" site1="e2" site2="B2"/><connect name="three" site1="e3" site2="B3"/></equality>
</mujoco>"""
LIMB = """<body name="cylinder{i}" pos="{x} {y} 0"><joint name="h{i}" axis="0 0 1"/>
 <inertial pos="0.07 0 0" mass="0.4" diaginertia="1e-4 2e-3 2e-3"/>
 <body name="piston{i}"><joint name="q{i}" type="slide" axis="1 0 0"/>
  <inertial pos="-0.08 0 0" mass="0.25" diaginertia="1e-4 1e-3 1e-3"/><site name="e{i}"/>{platform}</body></body>"""
TOP = """<body name="platform"><joint name="b1" axis="0 0 1"/>
 <inertial pos="{cx} {cy} 0" mass="{m}" diaginertia="4e-3 4e-3 8e-3"/>
 <site name="B2" pos="{b2[0]} {b2[1]} 0"/><site name="B3" pos="{b3[0]} {b3[1]} 0"/>
 <site name="P" pos="0.12 0.1 0"/></body>"""


def model_text() -> str:
    (cx, cy), mass = PLATFORM
    top = TOP.format(cx=cx, cy=cy, m=mass, b2=JOINTS[1], b3=JOINTS[2])
    limbs = [LIMB.format(i=i + 1, x=x, y=y, platform=top if i == 0 else "") for i, (x, y) in enumerate(BASE.tolist())]
    return MODEL.format(limbs="\n".join(limbs))


def joint_points(pose: np.ndarray) -> np.ndarray:
    """Platform joints ``(n, 3, 2)`` of poses x, y, angle ``(n, 3)``."""
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    turn = np.stack([np.stack([c, -s], axis=1), np.stack([s, c], axis=1)], axis=1)
    return pose[:, None, :2] + np.einsum("nij,kj->nki", turn, JOINTS)


def legs(pose: np.ndarray) -> np.ndarray:
    """Lengths ``(n, 3)``: the inverse kinematics of this robot."""
    return np.asarray(np.linalg.norm(joint_points(pose) - BASE, axis=2))


def lengths(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The motion of the legs, q, qd, qdd ``(n, 3)``."""
    angle = MIDDLE + SWING * np.sin(RATE * t)
    speed, rise = SWING * RATE * np.cos(RATE * t), -SWING * RATE**2 * np.sin(RATE * t)
    wave = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    turned = np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    still = np.zeros((len(t), 1))
    return (
        np.hstack([still + FIRST, CENTRE + RADIUS * wave]),
        np.hstack([still, RADIUS * speed[:, None] * turned]),
        np.hstack([still, RADIUS * (rise[:, None] * turned - speed[:, None] ** 2 * wave)]),
    )


def followed(t: np.ndarray, fine: int = 12) -> np.ndarray:
    """Poses ``(n, 3)`` of the continuous motion, by Newton on three unknowns in fine steps of time."""
    pose, result = START.copy(), []
    times = np.concatenate([np.linspace(a, b, fine, endpoint=False) for a, b in pairwise(t)])
    times = np.append(times, t[-1])
    wanted = lengths(times)[0]
    for step, target in enumerate(wanted):
        for _ in range(50):
            gap = target - legs(pose[None])[0]
            if np.abs(gap).max() < 1e-15:
                break
            probe = np.repeat(pose[None], 6, axis=0)
            probe[:3] += 1e-6 * np.eye(3)
            probe[3:] -= 1e-6 * np.eye(3)
            around = legs(probe)
            pose = pose + np.linalg.solve((around[:3] - around[3:]).T / 2e-6, gap)
        if step % fine == 0:
            result.append(pose)
    return np.array(result)


def coordinates(pose: np.ndarray) -> dict[str, np.ndarray]:
    """Every joint of the model by geometry, names to ``(n,)``."""
    away = joint_points(pose) - BASE
    turn = np.unwrap(np.arctan2(away[:, :, 1], away[:, :, 0]), axis=0)
    q = np.linalg.norm(away, axis=2)
    return {
        **{f"h{i + 1}": turn[:, i] for i in range(3)},
        **{f"q{i + 1}": q[:, i] for i in range(3)},
        "b1": np.unwrap(pose[:, 2]) - turn[:, 0],
    }


def setup_at(pose: np.ndarray) -> Setup:
    home = {name: float(value[0]) for name, value in coordinates(pose[None]).items()}
    return Setup(actuated=("q1", "q2", "q3"), platform_site="P", initial=tuple(home.items()))
