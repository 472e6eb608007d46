"""Large machines for tests: towers of loops, a hand of coupled joints, spherical linkages."""

from __future__ import annotations

import numpy as np

HEAD = '<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81"><flag contact="disable"/></option>'


def custom(site: str) -> str:
    return f'<custom><text name="base_body" data="world"/><text name="platform_site" data="{site}"/></custom>'


def tower(stages: int, seed: int) -> tuple[str, list[str]]:
    """*stages* planar four-bars, each on the coupler of the one below, each plane turned: 3 joints and a motor each."""
    rng = np.random.default_rng(seed)
    world, equalities, inside = "", [], ""
    for k in reversed(range(stages)):
        # closed as drawn: ground pivots 0.2 apart, crank and rocker upright, both 0.1 long
        height = 0.1 * float(rng.uniform(0.8, 1.2))
        tilt = float(rng.uniform(-0.3, 0.3))
        mass = [float(value) for value in rng.uniform(0.2, 2.0, 3)]
        foot = f'<site name="f{k}" pos="0.2 0 0"/>'
        inside = (
            f'<body name="crank{k}"><joint name="q{k}" axis="0 1 0" damping="0.1" frictionloss="0.05"/>'
            f'<geom type="capsule" fromto="0 0 0 0 0 {height}" size=".01" mass="{mass[0]}"/>'
            f'<body name="coupler{k}" pos="0 0 {height}"><joint name="a{k}" axis="0 1 0" damping="0.02"/>'
            f'<geom type="capsule" fromto="0 0 0 .2 0 .03" size=".01" mass="{mass[1]}"/>'
            f'<site name="top{k}" pos="0.1 0 0.05"/>'
            f'<body name="rocker{k}" pos="0.2 0 0"><joint name="b{k}" axis="0 1 0" stiffness="0.3"/>'
            f'<geom type="capsule" fromto="0 0 0 0.02 0 {-height}" size=".01" mass="{mass[2]}"/>'
            f'<site name="s{k}" pos="0 0 {-height}"/></body>'
            f'<body name="next{k}" pos="0.1 0 0.02" euler="0 0 {tilt}">{inside}</body></body></body>{foot}'
        )
        equalities.append(f'<connect name="loop{k}" site1="s{k}" site2="f{k}"/>')
    world = f'<body name="ground">{inside}</body>'
    joints = [f"q{k}" for k in range(stages)]
    motors = "".join(f'<motor joint="{name}"/>' for name in joints)
    text = (
        f"{HEAD}{custom(f'top{stages - 1}')}<worldbody>{world}</worldbody><equality>{''.join(equalities)}</equality>"
        f"<actuator>{motors}</actuator></mujoco>"
    )
    return text, joints


def hand(seed: int) -> tuple[str, list[str]]:
    """Five fingers of three joints: one drives, 14 follow it and each other by quartic polynomials."""
    rng = np.random.default_rng(seed)
    fingers, equalities = "", []
    for f in range(5):
        inside = f'<site name="tip{f}" pos="0.03 0 0"/>'
        for k in reversed(range(3)):
            mass = float(rng.uniform(0.01, 0.05))
            inside = (
                f'<body name="f{f}{k}" pos="{0.03 if k else 0} {0.0 if k else 0.02 * f} 0"><joint name="j{f}{k}"'
                f' axis="0 1 {0.1 * f}" damping="0.01" frictionloss="0.002" armature="0.0001" stiffness="0.01"'
                f' ref="{float(rng.uniform(-0.2, 0.2))}"/><geom type="capsule" fromto="0 0 0 .03 0 0" size=".006"'
                f' mass="{mass}"/>{inside}</body>'
            )
        fingers += inside
    others = [f"j{f}{k}" for f in range(5) for k in range(3)]
    for n, name in enumerate(others[1:]):
        bend = " ".join(repr(float(v)) for v in (0.0, rng.uniform(0.7, 1.2), *rng.normal(0, 0.2, 3)))
        equalities.append(f'<joint joint1="{name}" joint2="{others[n]}" polycoef="{bend}"/>')
    text = (
        f"{HEAD}{custom('tip4')}<worldbody>{fingers}</worldbody><equality>{''.join(equalities)}</equality>"
        '<actuator><motor joint="j00"/></actuator></mujoco>'
    )
    return text, ["j00"]


def spherical(seed: int, digits: int | None) -> tuple[str, list[str]]:
    """A spherical four-bar: four axes through one point, its last hinge closed by two connects, six rows for two.

    *digits* of the axes are written; None writes all.
    """
    rng = np.random.default_rng(seed)
    axes = np.array([[0.1, 0.0, 1.0], [0.6, 0.2, 0.8], [0.7, 0.9, 0.5], [-0.1, 0.8, 0.7]])
    axes = axes + rng.normal(0, 0.03, axes.shape)
    axes /= np.linalg.norm(axes, axis=1)[:, None]

    def shown(values: np.ndarray) -> str:
        return " ".join(repr(float(v)) if digits is None else f"{v:.{digits}f}" for v in values)

    def link(one: np.ndarray, two: np.ndarray, mass: float) -> str:
        return (
            f'<geom type="capsule" fromto="{" ".join(map(str, 0.2 * one))} {" ".join(map(str, 0.2 * two))}" size=".01"'
            f' mass="{mass}"/>'
        )

    text = (
        f'{HEAD}{custom("mid")}<worldbody><body name="crank"><joint name="q" axis="{shown(axes[0])}"/>'
        f"{link(axes[0], axes[1], 0.5)}"
        f'<body name="coupler"><joint name="a" axis="{shown(axes[1])}"/>{link(axes[1], axes[2], 0.7)}'
        f'<site name="mid" pos="{shown(0.2 * axes[1])}"/>'
        f'<site name="c1" pos="{shown(0.2 * axes[2])}"/><site name="c2" pos="{shown(0.3 * axes[2])}"/></body></body>'
        f'<body name="rocker"><joint name="b" axis="{shown(axes[3])}"/>{link(axes[3], axes[2], 0.6)}'
        f'<site name="r1" pos="{shown(0.2 * axes[2])}"/><site name="r2" pos="{shown(0.3 * axes[2])}"/></body>'
        '</worldbody><equality><connect name="one" site1="c1" site2="r1"/><connect name="two" site1="c2" site2="r2"/>'
        '</equality><actuator><motor joint="q"/></actuator></mujoco>'
    )
    return text, ["q"]
