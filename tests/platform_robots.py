"""Robots whose platform turns, for tests of task coordinates: a planar 3-RRR, a 6-UPS and a 3-RPS."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from own_mechanisms import HEAD

RRR_BASE = ((-0.216506351, -0.125), (0.216506351, -0.125), (0.0, 0.25))
RRR_HOME = {
    "q1": 1.429,
    "elbow1": -1.656,
    "wrist1": 0.227,
    "q2": -2.76,
    "elbow2": -1.656,
    "q3": -0.665,
    "elbow3": -1.656,
}


def rrr() -> str:
    """Planar 3-RRR in the x-z plane; sites ``centre``, and ``tipped``, turned over about x."""
    limbs = []
    for limb, (x, z) in enumerate(RRR_BASE, start=1):
        end = f'<site name="tip{limb}" pos="0.15 0 0"/>'
        if limb == 1:
            end = """<body name="platform" pos="0.15 0 0"><joint name="wrist1" axis="0 -1 0"/>
             <geom type="cylinder" pos="0.0519615242 0 0.03" zaxis="0 1 0" size="0.06 0.01" mass="0.6"/>
             <site name="centre" pos="0.0519615242 0 0.03"/><site name="tipped" euler="3.141592653589793 0 0"/>
             <site name="p2" pos="0.103923048 0 0"/><site name="p3" pos="0.0519615242 0 0.09"/></body>"""
        limbs.append(
            f"""<body name="crank{limb}" pos="{x} 0 {z}"><joint name="q{limb}" axis="0 -1 0"/>
            <geom type="capsule" fromto="0 0 0 0.13 0 0" size="0.01" mass="0.3"/>
            <body name="distal{limb}" pos="0.13 0 0"><joint name="elbow{limb}" axis="0 -1 0"/>
            <geom type="capsule" fromto="0 0 0 0.15 0 0" size="0.008" mass="0.2"/>{end}</body></body>"""
        )
    return f"""{HEAD}<worldbody>{"".join(limbs)}</worldbody><equality>
    <connect name="loop2" site1="tip2" site2="p2"/>
    <connect name="loop3" site1="tip3" site2="p3"/></equality></mujoco>"""


def six_ups() -> str:
    """A 6-UPS platform, its site's axes parallel to the base's at home, 0.5 m above it."""
    ground = [np.array([0.4 * np.cos(a), 0.4 * np.sin(a), 0.0]) for a in np.radians([-10, 10, 110, 130, 230, 250])]
    feet = [np.array([0.2 * np.cos(a), 0.2 * np.sin(a), 0.0]) for a in np.radians([-50, 50, 70, 170, 190, 290])]
    return _legs(
        ground, feet, np.array([0.0, 0.0, 0.5]), '<joint name="u{0}" axis="1 0 0"/><joint name="v{0}" axis="0 1 0"/>'
    )


def three_rps() -> str:
    """A 3-RPS platform: it can rise and lean; where it turns and shifts besides, the hinges say."""
    angles = np.radians([0, 120, 240])
    ground = [0.35 * np.array([np.cos(a), np.sin(a), 0.0]) for a in angles]
    feet = [0.2 * np.array([np.cos(a), np.sin(a), 0.0]) for a in angles]
    return _legs(ground, feet, np.array([0.0, 0.0, 0.5]), '<joint name="h{0}" axis="0 1 0"/>')


def _legs(ground: list[np.ndarray], feet: list[np.ndarray], above: np.ndarray, hinges: str) -> str:
    bodies, loops = [], []
    for leg, (foot, head) in enumerate(zip(ground, feet, strict=True), start=1):
        along = above + head - foot
        length = float(np.linalg.norm(along))
        along /= length
        # y across the leg: horizontal, and tangential where ground and foot lie in one radial plane
        across = np.cross([0.0, 0.0, 1.0], foot)
        across = across - along * (across @ along)
        across /= np.linalg.norm(across)
        turned = Rotation.from_matrix(np.column_stack([np.cross(across, along), across, along]))
        end = f'<site name="tip{leg}" pos="0 0 {length / 2}"/>'
        if leg == 1:
            pins = "".join(
                f'<site name="pin{n}" pos="{_text(other - head)}"/>' for n, other in enumerate(feet, start=1) if n > 1
            )
            end = f"""<body name="platform" pos="0 0 {length / 2}" quat="{_quaternion(turned.inv())}"><joint name="ball"
             type="ball"/><geom type="cylinder" pos="{_text(-head)}" size="0.2 0.02" mass="2"/>
             <site name="centre" pos="{_text(-head)}"/>{pins}</body>"""
        else:
            loops.append(f'<connect name="loop{leg}" site1="tip{leg}" site2="pin{leg}"/>')
        bodies.append(
            f"""<body name="leg{leg}" pos="{_text(foot)}" quat="{_quaternion(turned)}">{hinges.format(leg)}
            <geom type="capsule" fromto="0 0 0 0 0 {length / 2}" size="0.02" mass="0.8"/>
            <body name="piston{leg}" pos="0 0 {length / 2}"><joint name="q{leg}" type="slide" axis="0 0 1"/>
            <geom type="capsule" fromto="0 0 0 0 0 {length / 2}" size="0.01" mass="0.3"/>{end}</body></body>"""
        )
    return f"{HEAD}<worldbody>{''.join(bodies)}</worldbody><equality>{''.join(loops)}</equality></mujoco>"


def _text(vector: np.ndarray) -> str:
    return " ".join(f"{value:.17g}" for value in vector)


def _quaternion(rotation: Rotation) -> str:
    x, y, z, w = rotation.as_quat()
    return _text(np.array([w, x, y, z]))
