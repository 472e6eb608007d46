"""Parameters of the asymmetric 2RSS+PPaP robot: meaning, source, and their place in ``models/asym_2rss_ppap.xml``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workbench.errors import ParameterError
from workbench.robots.assumptions.layout import BodyInfo, Layout, LoopInfo, X, Z
from workbench.robots.friction import (
    HINGE_DAMPING,
    SLIDE_DAMPING,
    damping_parameter,
    drive_parameters,
    drive_targets,
)
from workbench.robots.parameters import SIDES, ParameterInfo, Target, UniformRule

TABLE_1 = "[Almeida2010] Table 1"
UNIFORM = "uniform slender bar"


@dataclass(frozen=True)
class Parameters:
    """Parameters in SI units; ``_left`` is limb A-C-E (q2), ``_right`` limb B-D-F (q3).

    The bare name of a sided parameter (``parameters.a2``) reads the common value of both limbs.
    """

    L_left: float
    L_right: float
    l_left: float
    l_right: float
    a1_left: float
    a1_right: float
    a2_left: float
    a2_right: float
    a4: float
    a5: float
    a6: float
    m1_left: float
    m1_right: float
    m2_left: float
    m2_right: float
    m3: float
    m4: float
    m5: float
    m6: float
    payload: float
    g: float
    I1_left: float
    I1_right: float
    I2_left: float
    I2_right: float
    I5: float
    k1_left: float
    k1_right: float
    k2_left: float
    k2_right: float
    k5: float
    damping_q1: float = 0.0
    damping_q2: float = 0.0
    damping_q3: float = 0.0
    coulomb_q1: float = 0.0
    coulomb_q2: float = 0.0
    coulomb_q3: float = 0.0
    armature_q1: float = 0.0
    armature_q2: float = 0.0
    armature_q3: float = 0.0
    damping_parallelogram: float = 0.0
    damping_slide: float = 0.0
    damping_ball_left: float = 0.0
    damping_ball_right: float = 0.0

    def __getattr__(self, name: str) -> Any:
        """Common value of a sided parameter.

        Raises
        ------
        ParameterError
            The limbs differ, so the bare name has no single value.
        AttributeError
            There is no such parameter.
        """
        if name not in SIDED:
            raise AttributeError(f"{type(self).__name__} has no parameter {name}")
        left, right = (getattr(self, f"{name}_{side}") for side in SIDES)
        if left != right:
            raise ParameterError(
                f"parameter {name}: the limbs differ, {name}_left = {left:g}, {name}_right = {right:g}; name one side"
            )
        return left


def _length(name: str, meaning: str, sided: bool = False) -> ParameterInfo:
    return ParameterInfo(name, "m", meaning, TABLE_1, sided, minimum=0.0, minimum_allowed=False)


def _mass(name: str, meaning: str, sided: bool = False) -> ParameterInfo:
    return ParameterInfo(name, "kg", meaning, TABLE_1, sided, minimum=0.0, minimum_allowed=False)


def _inertia(name: str, meaning: str, sided: bool = False) -> ParameterInfo:
    return ParameterInfo(name, "kg m^2", meaning, UNIFORM, sided, minimum=0.0, minimum_allowed=False)


def _fraction(name: str, meaning: str, sided: bool = False) -> ParameterInfo:
    return ParameterInfo(name, "1", meaning, UNIFORM, sided, minimum=0.0, maximum=1.0)


PARAMETERS: tuple[ParameterInfo, ...] = (
    _length("L", "distance of the arms' axes A and B from the centre", sided=True),
    _length("l", "distance of the spherical joints E and F from the platform's centre", sided=True),
    _length("a1", "length of arm AC, BD", sided=True),
    _length("a2", "length of rod CE, DF", sided=True),
    _length("a4", "length of the coupler's guide; in Table 1, in no equation"),
    _length("a5", "length of the parallelogram's bars"),
    _length("a6", "distance between the parallelogram's bars; in no equation"),
    _mass("m1", "mass of one arm", sided=True),
    _mass("m2", "mass of one rod", sided=True),
    _mass("m3", "mass of the platform"),
    _mass("m4", "mass of the slider"),
    _mass("m5", "mass of both parallelogram bars together"),
    _mass("m6", "mass of the coupler"),
    ParameterInfo("payload", "kg", "load mass on the platform, the paper's M", TABLE_1, minimum=0.0),
    ParameterInfo("g", "m/s^2", "gravity along +x3 (down)", "[Almeida2010] section 3.1"),
    _inertia("I1", "transverse inertia of one arm about its mass centre", sided=True),
    _inertia("I2", "transverse inertia of one rod about its mass centre", sided=True),
    _inertia("I5", "transverse inertia of both parallelogram bars about their mass centres"),
    _fraction("k1", "mass centre of the arm, fraction of its length from A, B", sided=True),
    _fraction("k2", "mass centre of the rod, fraction of its length from C, D", sided=True),
    _fraction("k5", "mass centre of the parallelogram bars, fraction of their length from the slider"),
    *drive_parameters(("q1", "q2", "q3"), ("m", "rad", "rad")),
    damping_parameter("damping_parallelogram", HINGE_DAMPING, "in each of the parallelogram's three jointed hinges"),
    damping_parameter("damping_slide", SLIDE_DAMPING, "of the platform in the coupler"),
    damping_parameter("damping_ball", HINGE_DAMPING, "in the spherical joint between arm and rod, C or D", sided=True),
)

SIDED = frozenset(info.name for info in PARAMETERS if info.sided)


def _limb(side: str) -> list[Target]:
    """MJCF numbers of one limb; arms lie along -y (left) or +y (right) of their own frame, rods along +z."""
    out = -1.0 if side == "left" else 1.0
    arm, rod, platform_joint = f"arm_{side}", f"rod_{side}", "E" if side == "left" else "F"
    ball = "spherical_C" if side == "left" else "spherical_D"

    def p(name: str) -> str:
        return f"{name}_{side}"

    return [
        Target("body", arm, "pos", 1, out, (p("L"),), reads=p("L")),
        Target("geom", f"{arm}_motor", "pos", 1, out, (p("L"),)),
        Target("site", f"platform_{platform_joint}", "pos", 1, out, (p("l"),), reads=p("l")),
        Target("geom", f"platform_ball_{platform_joint}", "pos", 1, out, (p("l"),)),
        Target("geom", f"platform_bar_{platform_joint}", "fromto", 4, out, (p("l"),)),
        Target("body", rod, "pos", 1, out, (p("a1"),), reads=p("a1")),
        Target("geom", f"{arm}_bar", "fromto", 4, out, (p("a1"),)),
        Target("site", f"{rod}_tip", "pos", 2, 1.0, (p("a2"),), reads=p("a2")),
        Target("geom", f"{rod}_bar", "fromto", 5, 1.0, (p("a2"),)),
        Target("inertial", arm, "mass", 0, 1.0, (p("m1"),), reads=p("m1")),
        Target("inertial", arm, "diaginertia", 0, 1.0, (p("I1"),), reads=p("I1")),
        Target("inertial", arm, "diaginertia", 2, 1.0, (p("I1"),)),
        Target("inertial", arm, "pos", 1, out, (p("k1"), p("a1")), reads=p("k1")),
        Target("inertial", rod, "mass", 0, 1.0, (p("m2"),), reads=p("m2")),
        Target("inertial", rod, "diaginertia", 0, 1.0, (p("I2"),), reads=p("I2")),
        Target("inertial", rod, "diaginertia", 1, 1.0, (p("I2"),)),
        Target("inertial", rod, "pos", 2, 1.0, (p("k2"), p("a2")), reads=p("k2")),
        Target("joint", ball, "damping", 0, 1.0, (p("damping_ball"),), reads=p("damping_ball")),
    ]


def _parallelogram_bar(number: int, side: float) -> list[Target]:
    """MJCF numbers of one of the two bars, each half of m5 and I5; only the first is read back."""
    bar = f"parallelogram_bar_{number}"
    first = number == 1

    def reads(name: str) -> str | None:
        return name if first else None

    return [
        Target("body", bar, "pos", 1, 0.5 * side, ("a6",), reads=reads("a6")),
        Target("inertial", bar, "mass", 0, 0.5, ("m5",), reads=reads("m5")),
        Target("inertial", bar, "diaginertia", 0, 0.5, ("I5",), reads=reads("I5")),
        Target("inertial", bar, "diaginertia", 1, 0.5, ("I5",)),
        Target("inertial", bar, "pos", 2, 1.0, ("k5", "a5"), reads=reads("k5")),
        Target("geom", f"{bar}_bar", "fromto", 5, 1.0, ("a5",)),
    ]


TARGETS: tuple[Target, ...] = (
    *_limb("left"),
    *_limb("right"),
    *_parallelogram_bar(1, -1.0),
    *_parallelogram_bar(2, 1.0),
    Target("body", "coupler", "pos", 2, 1.0, ("a5",), reads="a5"),
    Target("body", "coupler", "pos", 1, 0.5, ("a6",)),
    Target("joint", "coupler_hinge", "pos", 1, -0.5, ("a6",)),
    Target("site", "parallelogram_bar_2_tip", "pos", 2, 1.0, ("a5",)),
    Target("site", "coupler_joint_2", "pos", 1, 0.5, ("a6",)),
    Target("geom", "coupler_bar", "fromto", 1, -0.5, ("a6",)),
    Target("geom", "coupler_bar", "fromto", 4, 0.5, ("a6",)),
    Target("site", "coupler_guide", "pos", 2, 1.0, ("a4",), reads="a4"),
    Target("geom", "coupler_guide_bar", "fromto", 5, 1.0, ("a4",)),
    Target("inertial", "platform", "mass", 0, 1.0, ("m3",), reads="m3"),
    Target("inertial", "slider", "mass", 0, 1.0, ("m4",), reads="m4"),
    Target("inertial", "coupler", "mass", 0, 1.0, ("m6",), reads="m6"),
    Target("inertial", "payload", "mass", 0, 1.0, ("payload",), reads="payload"),
    *drive_targets(("q1", "q2", "q3")),
    Target("joint", "parallelogram_hinge_1", "damping", 0, 1.0, ("damping_parallelogram",), "damping_parallelogram"),
    Target("joint", "parallelogram_hinge_2", "damping", 0, 1.0, ("damping_parallelogram",)),
    Target("joint", "coupler_hinge", "damping", 0, 1.0, ("damping_parallelogram",)),
    Target("joint", "platform_slide", "damping", 0, 1.0, ("damping_slide",), reads="damping_slide"),
    Target("option", "", "gravity", 2, -1.0, ("g",), reads="g"),
)


def _uniform(mass: str, length: str, inertia: str, fraction: str) -> UniformRule:
    def middle(_values: Mapping[str, float]) -> float:
        return 0.5

    def slender(values: Mapping[str, float]) -> float:
        return values[mass] * values[length] ** 2 / 12

    return UniformRule(when=(mass, length), sets={fraction: middle, inertia: slender}, unless=(inertia,))


UNIFORM_RULES: tuple[UniformRule, ...] = (
    *(_uniform(f"m1_{side}", f"a1_{side}", f"I1_{side}", f"k1_{side}") for side in SIDES),
    *(_uniform(f"m2_{side}", f"a2_{side}", f"I2_{side}", f"k2_{side}") for side in SIDES),
    _uniform("m5", "a5", "I5", "k5"),
)

LAYOUT = Layout(
    base="base",
    gravity=Z,
    bodies=(
        BodyInfo("slider", "base", "q1", "slide", X, turns=False),
        BodyInfo("parallelogram_bar_1", "slider", "parallelogram_hinge_1", "hinge", X),
        BodyInfo("parallelogram_bar_2", "slider", "parallelogram_hinge_2", "hinge", X),
        BodyInfo("coupler", "parallelogram_bar_1", "coupler_hinge", "hinge", X, turns=False),
        BodyInfo("platform", "coupler", "platform_slide", "slide", Z, turns=False),
        BodyInfo("payload", "platform", turns=False),
        BodyInfo("arm_left", "base", "q2", "hinge", (-1.0, 0.0, 0.0)),
        BodyInfo("arm_right", "base", "q3", "hinge", X),
        BodyInfo("rod_left", "arm_left", "spherical_C", "ball"),
        BodyInfo("rod_right", "arm_right", "spherical_D", "ball"),
    ),
    loops=(
        LoopInfo("connect", ("rod_left_tip", "platform_E")),
        LoopInfo("connect", ("rod_right_tip", "platform_F")),
        LoopInfo("connect", ("parallelogram_bar_2_tip", "coupler_joint_2")),
    ),
    sites={
        "platform": "platform",
        "platform_E": "platform",
        "platform_F": "platform",
        "rod_left_tip": "rod_left",
        "rod_right_tip": "rod_right",
        "parallelogram_bar_2_tip": "parallelogram_bar_2",
        "coupler_joint_2": "coupler",
    },
    platform_site="platform",
    lumped_bodies=("arm_left", "arm_right", "rod_left", "rod_right", "parallelogram_bar_1", "parallelogram_bar_2"),
)
