"""Closures as files write them: by sites, by bodies and anchor, welds, joints, fixed tendons; free platforms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nullspace_oracle import NullSpaceOracle
from own_mechanisms import FOURBAR
from workbench.errors import ModelError
from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference

AGREE = 1e-9
SLIDER = """<mujoco><compiler angle="radian"/><option><flag contact="disable"/></option><worldbody>
<body name="crank"><joint name="crank" axis="0 -1 0"/>
 <geom type="capsule" fromto="0 0 0 .15 0 .1" size=".01" mass=".4"/>
 <body name="rod" pos=".15 0 .1"><joint name="elbow" axis="0 -1 0"/>
 <geom type="capsule" fromto="0 0 0 .4 0 -.1" size=".01" mass=".6"/><site name="tip" pos=".4 0 -.1"/></body></body>
<body name="piston" pos=".55 0 0"><joint name="piston" type="slide" axis="1 0 0" damping="2"/>
 <geom size=".03" mass="1.1"/><site name="pin"/></body></worldbody>
<equality>{}</equality></mujoco>"""
BY_SITES = '<connect site1="tip" site2="pin"/>'
SPOILED = '<connect body1="rod" body2="piston" anchor=".39 0 -.1"/>'
SAME = {
    "connect by bodies": '<connect body1="rod" body2="piston" anchor=".4 0 -.1"/>',
    "the other way round": '<connect body1="piston" body2="rod" anchor="0 0 0"/>',
    "weld without torque": '<weld body1="rod" body2="piston" anchor="0 0 0" torquescale="0"/>',
    "weld by sites without torque": '<weld site1="tip" site2="pin" torquescale="0"/>',
    "an inactive one beside it": '<weld body1="rod" active="false"/>' + BY_SITES,
}
APART = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="slide"/><joint type="ball"/>'
SETUP = Setup(("crank",), "tip")


def torque(tmp_path: Path, text: str, setup: Setup = SETUP, start: float = 0.0) -> np.ndarray:
    path = tmp_path / "model.xml"
    path.write_text(text, encoding="utf-8")
    t = np.linspace(0.0, 1.0, 21)[:, None]
    motion = start + 0.3 * np.sin(4 * t), 1.2 * np.cos(4 * t), -4.8 * np.sin(4 * t)
    found = MujocoReference(path, setup=setup).inverse_dynamics(*motion, external_force=[1.0, 2.0, 3.0])
    # the rows' second derivatives are used twice: without accelerations to find them, with them to judge what was found
    assert found.acceleration_residual.max() < 1e-9
    return found.tau


@pytest.mark.parametrize("name", SAME)
def test_one_loop_in_many_words(tmp_path: Path, name: str) -> None:
    expected = torque(tmp_path, SLIDER.format(BY_SITES))
    found = torque(tmp_path, SLIDER.format(SAME[name]))
    assert np.abs(found - expected).max() < AGREE * np.abs(expected).max()
    assert np.abs(torque(tmp_path, SLIDER.format(SPOILED)) - expected).max() > 1e-3


def test_a_weld_by_bodies_keeps_its_relative_pose(tmp_path: Path) -> None:
    # the last link of a four-bar in two halves, welded in the pose that relpose says
    halves = FOURBAR.replace('<site name="tip" pos="0.3 0 0"/>', '<site name="unused" pos="0.3 0 0"/>').replace(
        "</worldbody>",
        '<body name="half" pos="2 1 0"><freejoint name="loose"/><inertial pos="0 0 0" mass="0.1" diaginertia="1e-3 1e-3'
        ' 1e-3"/><site name="tip" pos="0.1 0 0"/></body></worldbody>',
    )
    assert halves != FOURBAR
    weld = '<weld name="halves" body1="rocker" body2="half" relpose="0.2 0 0 1 0 0 0"/>'
    apart = halves.replace("<equality>", f"<equality>{weld}")
    whole = FOURBAR.replace(
        '<site name="tip" pos="0.3 0 0"/>',
        '<site name="tip" pos="0.3 0 0"/><body name="half" pos="0.2 0 0"><inertial pos="0 0 0" mass="0.1"'
        ' diaginertia="1e-3 1e-3 1e-3"/></body>',
    )
    guess = (("crank", 1.0), ("elbow", -0.5), ("wrist", -1.5))
    setup = Setup(("crank",), "coupler", initial=guess)
    expected, found = (torque(tmp_path, text, setup, 1.0) for text in (whole, apart))
    assert np.abs(found - expected).max() < AGREE * np.abs(expected).max()
    stale = apart.replace('relpose="0.2', 'relpose="0.21')
    assert np.abs(torque(tmp_path, stale, setup, 1.0) - expected).max() > 1e-4


@pytest.mark.parametrize("relpose", ["0.2 0 0 1 0 0 0", "0.2 0.01 -0.02 0.8 0.3 0.4 0.33166247903554"])
def test_a_weld_holds_all_turns_wherever_the_mechanism_points(tmp_path: Path, relpose: str) -> None:
    """A four-bar whose last link is welded of two halves, tilted in space together with gravity: the same torques."""
    halves = FOURBAR.replace('<site name="tip" pos="0.3 0 0"/>', "").replace(
        "</worldbody>",
        f'<body name="half" pos="0.5 0 0.1">{APART}<inertial pos=".01 .02 0" mass=".1" diaginertia="2e-3 1e-3 3e-3"/>'
        '<site name="tip"/></body>'
        # held by its weld alone, so that no other loop makes up for a turn that is not held
        f'<body name="rider">{APART}<inertial pos="0 .1 0" mass=".2" diaginertia="2e-3 1e-3 3e-3"/></body></worldbody>',
    )
    place, turn = np.split(np.array([float(word) for word in relpose.split()]), [3])
    # where the rocker ends, seen from the half that is welded to it
    end = Rotation.from_quat(np.roll(turn, -1)).inv().apply(np.array([0.3, 0.0, 0.0]) - place)
    halves = halves.replace('<site name="tip"/>', f'<site name="tip" pos="{" ".join(map(repr, end.tolist()))}"/>')

    def weld(one: str, two: str) -> str:
        return f'<weld body1="{one}" body2="{two}" relpose="{relpose}"/>'

    apart = halves.replace("<equality>", f"<equality>{weld('rocker', 'half')}{weld('coupler', 'rider')}")
    setup = Setup(("crank",), "coupler", initial=(("crank", 1.0), ("elbow", -0.5), ("wrist", -1.5)))
    tilt = [0.4, -0.7, 1.1]
    pull = Rotation.from_euler("XYZ", tilt).apply([0.0, 0.0, -9.81])
    turned = (
        apart.replace("<option>", f'<option gravity="{" ".join(map(repr, pull.tolist()))}">')
        .replace("<worldbody>", f'<worldbody><body euler="{" ".join(map(str, tilt))}">')
        .replace("</worldbody>", "</body></worldbody>")
    )
    found = []
    for name, text in (("straight", apart), ("turned", turned)):
        path = tmp_path / f"{name}.xml"
        path.write_text(text, encoding="utf-8")
        q = np.linspace(0.6, 1.4, 5)[:, None]
        found.append(MujocoReference(path, setup=setup).inverse_dynamics(q, 2 + 0 * q, 3 + 0 * q))
    straight, tilted = found
    assert np.abs(straight.tau - tilted.tau).max() < AGREE * np.abs(straight.tau).max()
    for one in found:
        assert one.acceleration_residual.max() < 1e-10
        assert one.rank.tolist() == [14] * 5


RIDER = '<inertial pos="0 .1 0" mass=".2" diaginertia="2e-3 1e-3 3e-3"/></body>'
PLACE, TURN = "0.1 0.05 -0.02", "0.8 0.3 0.4 0.33166247903554"
SPATIAL_ARM = """<mujoco><compiler angle="radian"/><option><flag contact="disable"/></option><worldbody>
<body><joint name="a" axis=".3 .5 .8"/><geom type="capsule" fromto="0 0 0 .2 .1 0" size=".01" mass="1"/>
<body name="link" pos=".2 .1 0"><joint name="b" axis=".7 -.6 .2"/><geom size=".02" mass=".5"/><site name="p"/>{}</body>
</body>{}</worldbody>{}</mujoco>"""


def test_a_weld_carries_a_rider_through_turns_in_space(tmp_path: Path) -> None:
    """Welded to a link that tumbles, a body asks for the torques that it asks for as a part of that link."""
    part = SPATIAL_ARM.format(f'<body pos="{PLACE}" quat="{TURN}">{RIDER}', "", "")
    apart = SPATIAL_ARM.format(
        "",
        f'<body name="rider" pos=".3 .1 0">{APART}{RIDER}',
        f'<equality><weld body1="link" body2="rider" relpose="{PLACE} {TURN}"/></equality>',
    )
    rng = np.random.default_rng(6)
    q, qd, qdd = rng.uniform(-0.6, 0.6, (6, 2)), rng.uniform(-4, 4, (6, 2)), rng.uniform(-9, 9, (6, 2))

    def asked(text: str) -> np.ndarray:
        (tmp_path / "model.xml").write_text(text, encoding="utf-8")
        reference = MujocoReference(tmp_path / "model.xml", setup=Setup(("a", "b"), "p"))
        return reference.inverse_dynamics(q, qd, qdd).tau

    expected = asked(part)
    assert np.abs(asked(apart) - expected).max() < AGREE * np.abs(expected).max()
    assert np.abs(asked(apart.replace(TURN, "0.6 0.3 0.4 0.62449979983984")) - expected).max() > 1e-4


GEARS = """<mujoco><compiler angle="radian"/><option><flag contact="disable"/></option><worldbody>
<body><joint name="a" axis="0 1 0" ref="0.2"/><geom type="capsule" fromto="0 0 0 .2 0 0" size=".01" mass="1"/>
<site name="p" pos=".2 0 0"/></body>
<body pos="0 .3 0"><joint name="b" axis="0 1 0" ref="-0.3"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".01"
 mass="2"/></body></worldbody>{}</mujoco>"""
BEND = "0.1 0.7 -0.4 0.3 0.2"
BY_JOINTS = f'<equality><joint joint1="b" joint2="a" polycoef="{BEND}"/></equality>'
BY_TENDONS = (
    '<tendon><fixed name="s"><joint joint="a" coef="1"/></fixed><fixed name="t"><joint joint="b" coef="1"/></fixed>'
    f'</tendon><equality><tendon tendon1="t" tendon2="s" polycoef="{BEND}"/></equality>'
)


def test_polynomials_between_joints_and_between_tendons(tmp_path: Path) -> None:
    setup = Setup(("a",), "p")
    by_joints, by_tendons = (torque(tmp_path, GEARS.format(text), setup) for text in (BY_JOINTS, BY_TENDONS))
    assert np.abs(by_joints - by_tendons).max() < 1e-12
    oracle = NullSpaceOracle(GEARS.format(BY_JOINTS), ["a"])
    t = 0.4
    q, qd, qdd = (np.array([v]) for v in (0.3 * np.sin(4 * t), 1.2 * np.cos(4 * t), -4.8 * np.sin(4 * t)))
    pose = oracle.close(oracle.model.qpos0, q)
    expected = oracle.inverse_dynamics(pose, qd, qdd, "p", np.array([1.0, 2.0, 3.0])).tau
    assert np.abs(by_joints[8] - expected).max() < AGREE * np.abs(expected).max()
    straight = GEARS.format(BY_JOINTS.replace("-0.4 0.3 0.2", "0 0 0"))
    assert np.abs(torque(tmp_path, straight, setup)[8] - expected).max() > 1e-3


def test_a_tendon_held_at_its_length(tmp_path: Path) -> None:
    held = (
        '<tendon><fixed name="t"><joint joint="a" coef="2"/><joint joint="b" coef="-1"/></fixed></tendon>'
        '<equality><tendon tendon1="t"/></equality>'
    )
    geared = '<equality><joint joint1="b" joint2="a" polycoef="0 2 0 0 0"/></equality>'
    setup = Setup(("a",), "p")
    assert (
        np.abs(torque(tmp_path, GEARS.format(held), setup) - torque(tmp_path, GEARS.format(geared), setup)).max()
        < 1e-12
    )


SPATIAL = (
    '<tendon><spatial name="cable"><site site="p"/><site site="q"/></spatial></tendon>'
    '<equality><tendon name="taut" tendon1="cable"/></equality>'
)


def test_a_spatial_tendons_equality_is_refused_by_name(tmp_path: Path) -> None:
    text = GEARS.format(SPATIAL).replace("</worldbody>", '<site name="q" pos="1 0 0"/></worldbody>')
    with pytest.raises(ModelError, match='equality "taut" is a tendon equality of a spatial tendon'):
        torque(tmp_path, text, Setup(("a",), "p"))


PLATFORM = """<mujoco><compiler angle="radian"/><option><flag contact="disable"/></option><worldbody>{legs}
<body name="plate" pos="0.02 -0.01 0.5">{joints}<inertial pos="0.01 0.02 0.03" mass="3"
 diaginertia="0.03 0.04 0.05"/><site name="plate" pos="0 0 0.05"/></body></worldbody>
<equality>{loops}</equality></mujoco>"""


def stewart(joints: str) -> str:
    """Six legs: two hinges, a slide, a connect to the plate; closed as drawn."""
    legs, loops = "", ""
    for k in range(6):
        angle, top = k * np.pi / 3, k * np.pi / 3 + (0.35 if k % 2 else -0.35)
        foot = np.array([0.4 * np.cos(angle), 0.4 * np.sin(angle), 0.0])
        corner = np.array([0.2 * np.cos(top), 0.2 * np.sin(top), -0.02])
        way = np.array([0.02, -0.01, 0.5]) + corner - foot
        x, y, z = (repr(float(value)) for value in way)
        legs += (
            f'<body name="u{k}" pos="{float(foot[0])!r} {float(foot[1])!r} 0">'
            f'<joint name="ux{k}" axis="1 0 0" damping="0.05"/>'
            f'<joint name="uy{k}" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 {x} {y} {z}" size=".01" mass=".5"/>'
            f'<body name="l{k}" pos="{x} {y} {z}"><joint name="l{k}" type="slide" axis="{x} {y} {z}"/>'
            '<geom size=".02" mass=".3"/></body></body>'
        )
        loops += f'<connect body1="plate" body2="l{k}" anchor="{" ".join(repr(float(v)) for v in corner)}"/>'
    return PLATFORM.format(legs=legs, joints=joints, loops=loops)


def test_a_platform_on_a_free_joint_that_loops_hold(tmp_path: Path) -> None:
    setup = Setup(tuple(f"l{k}" for k in range(6)), "plate")
    rng = np.random.default_rng(4)
    q, qd, qdd = (size * rng.uniform(-1, 1, (15, 6)) for size in (0.03, 0.2, 1.0))
    found = []
    for joints in ("<freejoint/>", APART):
        path = tmp_path / "model.xml"
        path.write_text(stewart(joints))
        found.append(MujocoReference(path, setup=setup).inverse_dynamics(q, qd, qdd, external_force=[5.0, -3.0, 9.0]))
    assert np.abs(found[0].tau - found[1].tau).max() < 1e-10 * np.abs(found[1].tau).max()
    assert np.abs(found[0].x - found[1].x).max() < 1e-12
    oracle = NullSpaceOracle(stewart("<freejoint/>"), list(setup.actuated))
    force = np.array([5.0, -3.0, 9.0])
    for s in (0, 7):
        pose = oracle.close(oracle.model.qpos0, q[s])
        expected = oracle.inverse_dynamics(pose, qd[s], qdd[s], "plate", force).tau
        assert np.abs(found[0].tau[s] - expected).max() < AGREE * np.abs(expected).max()
        other = oracle.inverse_dynamics(pose, 1.01 * qd[s], qdd[s], "plate", force).tau
        assert np.abs(other - expected).max() > 1e-6


def test_a_loop_inside_a_floating_robot_holds_no_base(tmp_path: Path) -> None:
    floating = (
        SLIDER.format(BY_SITES)
        .replace("<worldbody>", '<worldbody><body name="trunk"><freejoint name="root"/><geom size=".1" mass="1"/>')
        .replace("</worldbody>", "</body></worldbody>")
    )
    with pytest.raises(
        ModelError, match=r'joint "root" is free, and no loop ties its body "trunk" to the world; fix the'
    ):
        torque(tmp_path, floating)
