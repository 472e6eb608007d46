"""Rods between two spherical joints, wherever the loop is cut and however many bodies they are made of."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from workbench.errors import ModelError, MotionError
from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference
from workbench.reference.closures import read_closures
from workbench.reference.frames import Frames
from workbench.reference.left_open import left_open
from workbench.reference.rods import ROUND, RodFrame, idle_rods

HEAD = '<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81"><flag contact="disable"/></option><worldbody>'
CRANK = (
    '<body name="crank"><joint name="crank" axis="0 0 1"/>'
    '<geom type="capsule" fromto="0 0 0 .1 0 0" size=".01" mass=".5"/>'
)
ROD_MASS = '<geom type="capsule" fromto="0 0 0 .3 .1 .1" size=".006" mass=".2"/>'
BALL = '<joint name="b1" type="ball"/>'
PIN = (
    '<body name="pin" pos=".4 .1 0"><joint name="pin" axis="1 0 0"/>'
    '<geom type="capsule" fromto="0 0 0 0 0 .1" size=".01" mass=".4"/><site name="out" pos="0 0 .1"/></body>'
)
LOOP = '</worldbody><equality><connect name="loop" site1="end" site2="out"/></equality></mujoco>'


def rod(joints: str = BALL, mass: str = ROD_MASS, inside: str = '<site name="end" pos=".3 .1 .1"/>') -> str:
    return f'{HEAD}{CRANK}<body name="rod" pos=".1 0 0">{joints}{mass}{inside}</body></body>{PIN}{LOOP}'


PLAIN = rod()
SAME = {
    "cut at the far hinge": (
        f'{HEAD}<site name="foot" pos=".4 .1 0"/>{CRANK}<body name="rod" pos=".1 0 0">{BALL}{ROD_MASS}'
        '<body name="pin" pos=".3 .1 .1"><joint name="b2" type="ball"/>'
        '<geom type="capsule" fromto="0 0 -.1 0 0 0" size=".01" mass=".4"/><site name="out"/>'
        '<site name="low" pos="0 0 -.1"/><site name="low2" pos=".1 0 -.1"/></body></body></body>'
        '<site name="foot2" pos=".5 .1 0"/></worldbody><equality>'
        '<connect site1="low" site2="foot"/><connect site1="low2" site2="foot2"/></equality></mujoco>'
    ),
    "three hinges in place of the ball": rod(
        '<joint name="x" axis="1 0 0"/><joint name="y" axis="0 1 0"/><joint name="z" axis="0 0 1"/>'
    ),
    "an empty marker on it": rod(inside='<body pos=".15 .05 .05"/><site name="end" pos=".3 .1 .1"/>'),
    "two bodies welded together": rod(
        mass='<geom type="capsule" fromto="0 0 0 .3 .1 .1" size=".006" mass=".15"/>',
        inside='<body pos=".3 .1 .1" euler=".3 .2 .1"><site name="end"/></body>'
        '<body><geom type="capsule" fromto="0 0 0 .3 .1 .1" size=".006" mass=".05"/></body>',
    ),
    "a free body between two connects": (
        f'{HEAD}{CRANK}<site name="start" pos=".1 0 0"/></body><body name="rod" pos=".1 0 0"><freejoint/>{ROD_MASS}'
        f'<site name="begin"/><site name="end" pos=".3 .1 .1"/></body>{PIN}</worldbody><equality><connect site1="end"'
        ' site2="out"/><connect site1="begin" site2="start"/></equality></mujoco>'
    ),
}


def torque(tmp_path: Path, text: str, **more: object) -> tuple[np.ndarray, np.ndarray, MujocoReference]:
    path = tmp_path / "model.xml"
    path.write_text(text, encoding="utf-8")
    t = np.linspace(0.0, 1.0, 21)[:, None]
    motion = 0.2 * np.sin(3 * t), 0.6 * np.cos(3 * t), -1.8 * np.sin(3 * t)
    reference = MujocoReference(path, setup=Setup(("crank",), "out", **more))  # type: ignore[arg-type]
    result = reference.inverse_dynamics(*motion, external_force=[1.0, 2.0, 3.0])
    return result.tau, left_open(reference, result, *motion, external_force=np.array([1.0, 2.0, 3.0])), reference


FREE = "a free body between two connects"


def test_a_free_rod_between_two_connects_is_refused_and_not_guessed(tmp_path: Path) -> None:
    """Its spin is idle as well; the free joint that is split hides it, so that the file is refused."""
    with pytest.raises(ModelError, match="freedom\\(s\\) that no actuator holds"):
        torque(tmp_path, SAME[FREE])


@pytest.mark.parametrize("name", [name for name in SAME if name != FREE])
def test_the_spin_is_idle_wherever_the_rod_is_cut(tmp_path: Path, name: str) -> None:
    expected, open_by, plain = torque(tmp_path, PLAIN)
    assert plain.structure.idle == ("rod",)
    assert not open_by.any()
    found, _, reference = torque(tmp_path, SAME[name])
    assert reference.structure.idle == ("rod",)
    assert reference.mobility().mobility == 1
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
    heavier = SAME[name].replace('mass=".2"', 'mass=".21"').replace('mass=".05"', 'mass=".06"')
    assert np.abs(torque(tmp_path, heavier)[0] - expected).max() > 1e-4 * np.abs(expected).max()


INERTIAL = (
    '<inertial pos="0.15 0.05 0.05" quat="0.9758416966222777 0 -0.15448783630654317 0.15448783630654317" mass="0.1567"'
    ' diaginertia="3.75e-6 {} {}"/>'
)


def test_a_lopsided_rod_is_warned_of_with_its_worth(tmp_path: Path) -> None:
    uneven, worth, reference = torque(tmp_path, rod(mass=INERTIAL.format(0.004487, 0.004488)))
    even, none, plain = torque(tmp_path, rod(mass=INERTIAL.format(0.0044875, 0.0044875)))
    assert not plain.notes
    assert not none.any()
    assert any("no body of revolution" in note for note in reference.notes)
    assert worth == pytest.approx(np.abs(uneven - even).max(axis=0), rel=1e-6)
    assert 1e-8 < worth[0] / np.abs(even).max() < 1e-4
    with pytest.raises(ModelError, match="moments of inertia differ around"):
        torque(tmp_path, rod(mass=INERTIAL.replace("3.75e-6", "5e-4").format(0.0044, 0.0047)))


def test_a_lopsided_rod_of_two_bodies(tmp_path: Path) -> None:
    cap = '<body pos=".3 .1 .1"><geom size=".012" pos=".0003 0 0" mass=".03"/></body><site name="end" pos=".3 .1 .1"/>'
    even = cap.replace(".0003 0 0", "0 0 0")
    off, worth, _ = torque(tmp_path, rod(inside=cap))
    on = torque(tmp_path, rod(inside=even))[0]
    # the mass centre moves along the axis, too, which is no part of being lopsided
    assert 0.0 < worth[0] < 10 * np.abs(off - on).max()


def test_a_rod_that_is_made_round_keeps_mass_centre_and_inertia_along_its_axis() -> None:
    """Of two bodies: the rod made round by numbers of its first body is measured anew, whole."""
    cap = (
        '<body pos=".3 .1 .1"><geom size=".012" pos=".0003 0 .02" mass=".03"/></body><site name="end" pos=".3 .1 .1"/>'
    )
    model = mujoco.MjModel.from_xml_string(rod(inside=cap))
    closures = read_closures(model)
    frames = Frames.of(closures.frames)
    (one,) = idle_rods(model, closures.blocks)
    before = RodFrame(model, one, frames)
    centre, inertia = before._inertia()
    place, wanted = before.rounded()
    body, axis = before.group[0], (before.far - before.near) / before.length
    moments, frame = np.linalg.eigh(wanted)
    if np.linalg.det(frame) < 0:
        frame[:, 0] *= -1
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(frame).ravel())
    model.body_ipos[body], model.body_inertia[body], model.body_iquat[body] = place, moments, quaternion
    after_centre, after = RodFrame(model, one, frames)._inertia()
    assert axis @ after_centre == pytest.approx(axis @ centre, rel=1e-12)
    assert np.linalg.norm(np.cross(axis, after_centre - before.near)) < 1e-13
    assert np.linalg.norm(np.cross(axis, centre - before.near)) > 1e-4
    along, whole = axis @ inertia @ axis, np.trace(inertia)
    across = 0.5 * (whole - along)
    expected = across * np.eye(3) + (along - across) * np.outer(axis, axis)
    np.testing.assert_allclose(after, expected, atol=1e-12 * whole)
    assert np.abs(inertia - expected).max() > 1e-6 * whole


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            rod(inside='<site name="end" pos=".3 .1 .1"/><geom pos=".1 .1 .2" size=".02" mass=".2"/>'),
            "mass centre lies",
        ),
        (PLAIN.replace('gravity="0 0 -9.81"', 'gravity="0 0 -9.81" viscosity="0.1"'), "a fluid acts on rod"),
    ],
)
def test_what_spins_a_rod_is_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        torque(tmp_path, text)


def test_a_platform_rides_on_no_idle_spin(tmp_path: Path) -> None:
    path = tmp_path / "model.xml"
    path.write_text(
        rod(inside='<site name="end" pos=".3 .1 .1"/><site name="on" pos=".15 .05 .05"/><site name="off"/>')
    )
    assert MujocoReference(path, setup=Setup(("crank",), "on"))
    path.write_text(path.read_text().replace('<site name="off"/>', '<site name="off" pos="0 0 .1"/>'))
    with pytest.raises(ModelError, match='platform site "off" lies'):
        MujocoReference(path, setup=Setup(("crank",), "off"))
    path.write_text(rod(inside='<site name="off" pos="0 0 .1"/><site name="end" pos=".3 .1 .1"/>'))
    with pytest.raises(ModelError, match='platform site "off" lies'):  # the first of all sites
        MujocoReference(path, setup=Setup(("crank",), "off"))


def test_what_is_plainly_round_is_round_by_the_closer_look_too() -> None:
    """Rods off by parts of `ROUND`, mass centre or inertia: the quick look never passes what the other refuses."""
    plainly, closely = [], []
    for off in (0.0, 1e-9, 3e-8, 2e-7, 1.1e-6, 1e-3):
        for shift, inertia in (((off, -off), "1e-3 1e-3"), ((0.0, 0.0), f"1e-3 {1e-3 * (1 + off):.17g}")):
            mass = f'<inertial mass=".2" pos=".1 {shift[0]:.17g} {shift[1]:.17g}" diaginertia="1e-5 {inertia}"/>'
            text = rod(mass=mass, inside='<site name="end" pos=".3 0 0"/>')
            model = mujoco.MjModel.from_xml_string(text)
            closures = read_closures(model)
            (one,) = idle_rods(model, closures.blocks)
            shape = RodFrame(model, one, Frames.of(closures.frames))
            plainly.append(shape.plainly_round())
            closely.append(not shape.unevenness().beyond(ROUND))
    assert all(close for plain, close in zip(plainly, closely, strict=True) if plain)
    assert plainly[:4] == [True] * 4
    assert closely[-2:] == [False] * 2


def turning(joints: str) -> str:
    """A crank that may turn all around, a rod, a rocker."""
    return (
        f'{HEAD}{CRANK}<body name="rod" pos=".1 0 0">{joints}<geom type="capsule" fromto="0 0 0 .4 .1 .25" size=".008"'
        ' mass=".4"/><site name="end" pos=".4 .1 .25"/></body></body><body name="rocker" pos=".5 .1 0">'
        '<joint name="rocker" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 .25" size=".01" mass=".8"/>'
        f'<site name="out" pos="0 0 .25"/></body>{LOOP}'
    )


GIMBAL = '<joint name="x" axis="1 0 0"/><joint name="y" axis="0 1 0"/><joint name="z" axis="0 0 1"/>'


@pytest.mark.parametrize("samples", [201, 801])
def test_three_hinges_of_a_rod_may_turn_as_a_ball_joint_does(tmp_path: Path, samples: int) -> None:
    """A motion that is coarse for the rod's own turn, which no loop holds, is a motion all the same; the turn stays."""
    t = np.linspace(0.0, 2.0, samples)
    motion = 7 * np.sin(2 * t)[:, None], 14 * np.cos(2 * t)[:, None], -28 * np.sin(2 * t)[:, None]
    found = []
    for joints in (BALL, GIMBAL):
        path = tmp_path / "model.xml"
        path.write_text(turning(joints), encoding="utf-8")
        reference = MujocoReference(path, setup=Setup(("crank",), "out"))
        found.append(reference.inverse_dynamics(*motion, along=t).tau)
    assert np.abs(found[0] - found[1]).max() < 1e-11 * np.abs(found[0]).max()
    qpos = reference.closer.close_along(motion[0]).qpos
    hinges = np.array([reference.loaded.model.joint(name).qposadr[0] for name in "xyz"])
    assert np.ptp(qpos[:, hinges[:2]], axis=0).max() < 1.0, "the rod spins on and on"


def test_a_jump_of_a_joint_that_a_loop_holds_is_refused_beside_such_a_rod(tmp_path: Path) -> None:
    path = tmp_path / "model.xml"
    path.write_text(turning(GIMBAL), encoding="utf-8")
    t = np.linspace(0.0, 2.0, 401)
    q, qd, qdd = 0.7 * np.sin(2 * t)[:, None], 1.4 * np.cos(2 * t)[:, None], -2.8 * np.sin(2 * t)[:, None]
    q[200:] += 0.3
    with pytest.raises(MotionError, match="joint crank: jumps by"):
        MujocoReference(path, setup=Setup(("crank",), "out")).inverse_dynamics(q, qd, qdd, along=t)
