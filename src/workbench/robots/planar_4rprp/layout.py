"""What the formulas of this robot take for granted about its model: bodies, joints, loops and sites."""

from __future__ import annotations

from workbench.robots.assumptions.layout import BodyInfo, Layout, LoopInfo, X, Y, Z

LIMBS_ABOUT_X = (1, 3)
"""Limbs that turn about axes parallel to x; 2 and 4 turn about z."""


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
