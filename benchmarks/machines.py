"""Mechanisms made to any size: towers of four-bars, and platforms on six legs or more."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import workbench as wb

HEAD = '<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81"><flag contact="disable"/></option>'


def tower(stages: int) -> str:
    """*stages* planar four-bars, each on the coupler of the one below: three joints, a loop and a motor each."""
    inside, loops, motors = "", "", ""
    for k in reversed(range(stages)):
        height = 0.09 + 0.002 * (k % 5)
        inside = (
            f'<body name="crank{k}"><joint name="q{k}" axis="0 1 0"/>'
            f'<geom type="capsule" fromto="0 0 0 0 0 {height}" size=".01" mass="0.5"/>'
            f'<body name="coupler{k}" pos="0 0 {height}"><joint name="a{k}" axis="0 1 0"/>'
            f'<geom type="capsule" fromto="0 0 0 .2 0 .03" size=".01" mass="0.5"/><site name="top{k}"/>'
            f'<body name="rocker{k}" pos="0.2 0 0"><joint name="b{k}" axis="0 1 0"/>'
            f'<geom type="capsule" fromto="0 0 0 0.02 0 {-height}" size=".01" mass="0.5"/>'
            f'<site name="s{k}" pos="0 0 {-height}"/></body>'
            f'<body name="next{k}" pos="0.1 0 0.02" euler="0 0 0.2">{inside}</body></body></body>'
            f'<site name="f{k}" pos="0.2 0 0"/>'
        )
        loops += f'<connect name="loop{k}" site1="s{k}" site2="f{k}"/>'
        motors += f'<motor joint="q{k}"/>'
    said = f'<text name="base_body" data="world"/><text name="platform_site" data="top{stages - 1}"/>'
    return (
        f'{HEAD}<custom>{said}</custom><worldbody><body name="ground">{inside}</body></worldbody>'
        f"<equality>{loops}</equality><actuator>{motors}</actuator></mujoco>"
    )


def stewart(legs: int) -> str:
    """A platform on *legs* legs of two hinges and a slide, tied by spherical joints: six freedoms, a loop a leg."""
    bodies, sites, loops, motors = "", "", "", ""
    for k in range(legs):
        # feet and heads in pairs, turned against each other, as six legs have them
        foot = 2 * np.pi * (k + (0.25 if k % 2 else -0.25)) / legs
        head = 2 * np.pi * (k + (-0.2 if k % 2 else 0.2)) / legs
        low = np.array([np.cos(foot), np.sin(foot), 0.0])
        high = np.array([0.6 * np.cos(head), 0.6 * np.sin(head), 1.0])
        way = high - low
        length = float(np.linalg.norm(way))
        way /= length
        side = np.cross([0.0, 0.0, 1.0], way)
        side /= np.linalg.norm(side)
        x, y = side, np.cross(way, side)
        frame = " ".join(f"{value!r}" for value in map(float, (*x, *y)))
        place = " ".join(f"{value!r}" for value in map(float, low))
        bodies += (
            f'<body name="yoke{k}" pos="{place}" xyaxes="{frame}"><joint name="u{k}" axis="1 0 0"/>'
            f'<inertial pos="0 0 0.01" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/>'
            f'<body name="tube{k}"><joint name="v{k}" axis="0 1 0"/>'
            f'<geom type="capsule" fromto="0 0 0 0 0 0.5" size="0.02" mass="1"/>'
            f'<body name="rod{k}" pos="0 0 {length!r}"><joint name="q{k}" type="slide" axis="0 0 1"/>'
            f'<geom type="capsule" fromto="0 0 -0.5 0 0 0" size="0.015" mass="0.5"/><site name="h{k}"/>'
            "</body></body></body>"
        )
        point = " ".join(f"{value!r}" for value in map(float, high - [0.0, 0.0, 1.0]))
        sites += f'<site name="p{k}" pos="{point}"/>'
        loops += f'<connect name="loop{k}" site1="h{k}" site2="p{k}"/>'
        motors += f'<motor joint="q{k}"/>'
    platform = (
        '<body name="platform" pos="0 0 1"><freejoint/><geom type="cylinder" size="0.6 0.02" mass="10"/>'
        f'<site name="centre"/>{sites}</body>'
    )
    said = '<text name="base_body" data="world"/><text name="platform_site" data="centre"/>'
    return (
        f"{HEAD}<custom>{said}</custom><worldbody>{bodies}{platform}</worldbody>"
        f"<equality>{loops}</equality><actuator>{motors}</actuator></mujoco>"
    )


def together(reference: wb.MujocoReference, change: np.ndarray) -> np.ndarray:
    """The same change ``(n, 1)`` of every motor's coordinate; legs of a platform grow alike, which lifts it."""
    return change * np.ones(len(reference.joint_names))
