"""Parameters of the 4-RPRP robot: meaning, source, and their place in ``models/planar_4rprp.xml``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from workbench.robots.assumptions.layout import BodyInfo, Layout, LoopInfo, X, Y, Z
from workbench.robots.friction import (
    HINGE_DAMPING,
    SLIDE_DAMPING,
    damping_parameter,
    drive_parameters,
    drive_targets,
)
from workbench.robots.parameters import ParameterInfo, Target, UniformRule

TABLE_3 = "[GarciaMurillo2016] Table 3"
EXAMPLE = "[GarciaMurillo2016] section 7"
UNIFORM = "assumption: uniform bar with Table 3's transverse inertia"

LIMBS_ABOUT_X = (1, 3)
"""Limbs that turn about axes parallel to x; 2 and 4 turn about z."""


@dataclass(frozen=True)
class Parameters:
    """Parameters in SI units; all four limbs are equal."""

    a: float
    b: float
    h: float
    m2: float
    m3: float
    m4: float
    m6: float
    g: float
    c2: float
    c3: float
    I2x: float
    I2z: float
    I3x: float
    I3z: float
    damping_q1: float = 0.0
    damping_q2: float = 0.0
    damping_q3: float = 0.0
    coulomb_q1: float = 0.0
    coulomb_q2: float = 0.0
    coulomb_q3: float = 0.0
    armature_q1: float = 0.0
    armature_q2: float = 0.0
    armature_q3: float = 0.0
    damping_A: float = 0.0
    damping_B: float = 0.0
    damping_q4: float = 0.0
    damping_slide: float = 0.0


def _length(name: str, meaning: str) -> ParameterInfo:
    return ParameterInfo(name, "m", meaning, EXAMPLE, minimum=0.0, minimum_allowed=False)


def _mass(name: str, meaning: str) -> ParameterInfo:
    return ParameterInfo(name, "kg", meaning, TABLE_3, minimum=0.0, minimum_allowed=False)


def _inertia(name: str, meaning: str) -> ParameterInfo:
    return ParameterInfo(name, "kg m^2", meaning, TABLE_3, minimum=0.0, minimum_allowed=False)


PARAMETERS: tuple[ParameterInfo, ...] = (
    _length("a", "side A1A4 of the fixed frame, along x; length of rod 1-3"),
    _length("b", "side A1A2 of the fixed frame, along z; length of rod 2-4"),
    ParameterInfo("h", "m", "height of rod 1-3 above rod 2-4", EXAMPLE),
    _mass("m2", "mass of one cylinder (body 2)"),
    _mass("m3", "mass of one piston (body 3)"),
    _mass("m4", "mass of one rod (body 4); there are two rods"),
    _mass("m6", "mass of the platform (body 6)"),
    ParameterInfo("g", "m/s^2", "gravity along -y (down)", EXAMPLE),
    ParameterInfo("c2", "m", "mass centre of the cylinder, from A_i towards B_i", UNIFORM),
    ParameterInfo("c3", "m", "mass centre of the piston, from B_i back towards A_i", UNIFORM),
    _inertia("I2x", "inertia of a cylinder about its mass centre, limbs turning about x (1, 3)"),
    _inertia("I2z", "inertia of a cylinder about its mass centre, limbs turning about z (2, 4)"),
    _inertia("I3x", "inertia of a piston about its mass centre, limbs turning about x (1, 3)"),
    _inertia("I3z", "inertia of a piston about its mass centre, limbs turning about z (2, 4)"),
    *drive_parameters(("q1", "q2", "q3"), ("m", "m", "m")),
    damping_parameter("damping_A", HINGE_DAMPING, "in each of the four hinges A_i on the frame"),
    damping_parameter("damping_B", HINGE_DAMPING, "in each of the four hinges B_i between piston and rod"),
    damping_parameter("damping_q4", SLIDE_DAMPING, "in the passive prismatic joint of limb 4"),
    damping_parameter("damping_slide", SLIDE_DAMPING, "of each rod in the platform"),
)


def _limb(number: int) -> list[Target]:
    """MJCF numbers of one limb; cylinder and piston lie along y of their own frames, the piston's frame is at B_i.

    Both transverse inertias of a body are set, although a limb turns about one axis only: a body with one of them alone
    changed might be none that can exist, and MuJoCo refuses such a body.
    """
    axis = "x" if number in LIMBS_ABOUT_X else "z"
    cylinder, piston = f"cylinder_{number}", f"piston_{number}"
    inertia2, inertia3 = f"I2{axis}", f"I3{axis}"
    first, first_of_axis = number == 1, number in (1, 2)

    def reads(name: str, here: bool) -> str | None:
        return name if here else None

    return [
        Target("inertial", cylinder, "mass", 0, 1.0, ("m2",), reads=reads("m2", first)),
        Target("inertial", cylinder, "pos", 1, 1.0, ("c2",), reads=reads("c2", first)),
        Target("inertial", cylinder, "diaginertia", 0, 1.0, (inertia2,), reads=reads(inertia2, first_of_axis)),
        Target("inertial", cylinder, "diaginertia", 2, 1.0, (inertia2,)),
        Target("geom", f"{cylinder}_tube", "fromto", 4, 2.0, ("c2",)),
        Target("inertial", piston, "mass", 0, 1.0, ("m3",), reads=reads("m3", first)),
        Target("inertial", piston, "pos", 1, -1.0, ("c3",), reads=reads("c3", first)),
        Target("inertial", piston, "diaginertia", 0, 1.0, (inertia3,), reads=reads(inertia3, first_of_axis)),
        Target("inertial", piston, "diaginertia", 2, 1.0, (inertia3,)),
        Target("geom", f"{piston}_rod", "fromto", 4, -2.0, ("c3",)),
        Target("joint", f"hinge_A{number}", "damping", 0, 1.0, ("damping_A",), reads=reads("damping_A", first)),
        Target("joint", f"hinge_B{number}", "damping", 0, 1.0, ("damping_B",), reads=reads("damping_B", first)),
    ]


def _half_rod(name: str, index: int, side: float, length: str, first: bool) -> list[Target]:
    """MJCF numbers of one half of a rod, from its end at B_i to the middle, where the halves are welded."""
    return [
        Target("inertial", name, "mass", 0, 0.5, ("m4",), reads="m4" if first else None),
        Target("inertial", name, "pos", index, 0.25 * side, (length,)),
        Target("site", f"{name}_middle", "pos", index, 0.5 * side, (length,)),
        Target("geom", f"{name}_bar", "fromto", 3 + index, 0.5 * side, (length,)),
    ]


def _at_origin(element: str, name: str) -> Target:
    """A point that has to stay at the origin of its body: a position of zero, checked on every axis."""
    return Target(element, name, "pos", 0, 0.0, ("a",))


TARGETS: tuple[Target, ...] = (
    *(target for number in (1, 2, 3, 4) for target in _limb(number)),
    _at_origin("body", "cylinder_1"),
    _at_origin("site", "P"),
    _at_origin("site", "platform_lower_joint"),
    Target("body", "cylinder_2", "pos", 2, 1.0, ("b",), reads="b"),
    Target("body", "cylinder_3", "pos", 0, 1.0, ("a",), reads="a"),
    Target("body", "cylinder_3", "pos", 2, 1.0, ("b",)),
    Target("body", "cylinder_4", "pos", 0, 1.0, ("a",)),
    *_half_rod("rod_13_at_1", 0, 1.0, "a", first=True),
    *_half_rod("rod_13_at_3", 0, -1.0, "a", first=False),
    *_half_rod("rod_24_at_2", 2, -1.0, "b", first=False),
    *_half_rod("rod_24_at_4", 2, 1.0, "b", first=False),
    Target("inertial", "platform", "mass", 0, 0.5, ("m6",), reads="m6"),
    Target("inertial", "platform_lower", "mass", 0, 0.5, ("m6",)),
    Target("site", "platform_joint", "pos", 1, -1.0, ("h",), reads="h"),
    Target("geom", "platform_post", "fromto", 4, -1.0, ("h",)),
    Target("geom", "frame_A1A2", "fromto", 5, 1.0, ("b",)),
    Target("geom", "frame_A2A3", "fromto", 2, 1.0, ("b",)),
    Target("geom", "frame_A2A3", "fromto", 3, 1.0, ("a",)),
    Target("geom", "frame_A2A3", "fromto", 5, 1.0, ("b",)),
    Target("geom", "frame_A3A4", "fromto", 0, 1.0, ("a",)),
    Target("geom", "frame_A3A4", "fromto", 2, 1.0, ("b",)),
    Target("geom", "frame_A3A4", "fromto", 3, 1.0, ("a",)),
    Target("geom", "frame_A4A1", "fromto", 0, 1.0, ("a",)),
    *drive_targets(("q1", "q2", "q3")),
    Target("joint", "q4", "damping", 0, 1.0, ("damping_q4",), reads="damping_q4"),
    Target("joint", "slide_13", "damping", 0, 1.0, ("damping_slide",), reads="damping_slide"),
    Target("joint", "slide_24", "damping", 0, 1.0, ("damping_slide",)),
    Target("option", "", "gravity", 2, -1.0, ("g",), reads="g"),
)


def _uniform(mass: str, centre: str, inertias: tuple[str, str]) -> UniformRule:
    """A uniform slender bar of length twice the distance of its mass centre from its end."""

    def slender(values: Mapping[str, float]) -> float:
        return values[mass] * (2 * values[centre]) ** 2 / 12

    return UniformRule(when=(mass, centre), sets=dict.fromkeys(inertias, slender), unless=inertias)


UNIFORM_RULES: tuple[UniformRule, ...] = (
    _uniform("m2", "c2", ("I2x", "I2z")),
    _uniform("m3", "c3", ("I3x", "I3z")),
)


def _limb_bodies(number: int) -> tuple[BodyInfo, ...]:
    axis, rod = (X, f"rod_13_at_{number}") if number in LIMBS_ABOUT_X else (Z, f"rod_24_at_{number}")
    return (
        BodyInfo(f"cylinder_{number}", "base", f"hinge_A{number}", "hinge", axis),
        BodyInfo(f"piston_{number}", f"cylinder_{number}", f"q{number}", "slide", Y),
        BodyInfo(rod, f"piston_{number}", f"hinge_B{number}", "hinge", axis, turns=False),
    )


LAYOUT = Layout(
    base="base",
    gravity=(0.0, -1.0, 0.0),
    bodies=(
        *(body for number in (1, 2, 3, 4) for body in _limb_bodies(number)),
        BodyInfo("platform", "rod_13_at_1", "slide_13", "slide", X, turns=False),
        BodyInfo("platform_lower", "rod_24_at_2", "slide_24", "slide", Z, turns=False),
    ),
    loops=(
        LoopInfo("weld", ("rod_13_at_1_middle", "rod_13_at_3_middle")),
        LoopInfo("weld", ("rod_24_at_2_middle", "rod_24_at_4_middle")),
        LoopInfo("weld", ("platform_joint", "platform_lower_joint")),
    ),
    sites={
        "P": "platform",
        "platform_joint": "platform",
        "platform_lower_joint": "platform_lower",
        "rod_13_at_1_middle": "rod_13_at_1",
        "rod_13_at_3_middle": "rod_13_at_3",
        "rod_24_at_2_middle": "rod_24_at_2",
        "rod_24_at_4_middle": "rod_24_at_4",
    },
    platform_site="P",
    lumped_bodies=tuple(f"{body}_{number}" for body in ("cylinder", "piston") for number in (1, 2, 3, 4)),
)
