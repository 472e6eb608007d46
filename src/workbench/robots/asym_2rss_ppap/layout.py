"""What the formulas of this robot take for granted about its model: bodies, joints, loops and sites."""

from __future__ import annotations

from workbench.robots.assumptions.layout import BodyInfo, Layout, LoopInfo, X, Z

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
