"""What cannot be counted is refused, all of it at once; what is left out is held against the motion."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from own_mechanisms import FOURBAR
from workbench.errors import ModelError
from workbench.mjcf.refusal import Refusal, joined
from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference
from workbench.reference.left_out import limits_left, touches
from workbench.reference.structure import refusals_of

GUESS = (("crank", 1.0), ("elbow", -0.5), ("wrist", -1.5))
SETUP = Setup(("crank",), "coupler", initial=GUESS)
OPEN = FOURBAR.replace('<option><flag contact="disable"/></option>', "")

MANY = (
    OPEN.replace('name="elbow"', 'name="elbow" range="-3 3"')
    .replace('name="wrist"', 'name="wrist" range="-2 2"')
    .replace("<worldbody>", '<worldbody><body name="loose"><freejoint name="root"/><geom size=".1"/></body>')
    .replace(
        "<equality>",
        '<tendon><spatial name="cable" frictionloss="1"><site site="tip"/><site site="ground"/></spatial></tendon>'
        '<equality><tendon name="taut" tendon1="cable"/>',
    )
)


def test_all_refusals_come_at_once() -> None:
    found = refusals_of(mujoco.MjModel.from_xml_string(MANY))
    kinds = {refusal.kind: refusal for refusal in found}
    assert set(kinds) >= {"contacts", "limits", "floating bodies", "tendon friction", "tendon equality", "no actuator"}
    assert [r.name for r in found if r.kind == "limits"] == ["elbow", "wrist"]
    assert (kinds["limits"].tag, kinds["limits"].ignore) == ("joint", "limits")
    assert (kinds["floating bodies"].name, kinds["tendon equality"].name) == ("root", "taut")
    assert all(refusal.way for refusal in found)


def test_one_error_joins_them(tmp_path: Path) -> None:
    path = tmp_path / "model.xml"
    path.write_text(MANY)
    with pytest.raises(ModelError) as refused:
        MujocoReference(path, setup=SETUP)
    text = str(refused.value)
    assert text.count("\n") == 0
    for word in ('tendon "cable" has frictionloss', 'equality "taut"', 'joint "root" is free'):
        assert word in text
    assert "range" not in text  # limits and contacts are looked at along the motion


def test_a_file_without_any_has_none() -> None:
    model = FOURBAR.replace(
        "</mujoco>",
        '<custom><text name="base_body" data="world"/><text name="platform_site" data="coupler"/></custom>'
        '<actuator><motor joint="crank"/></actuator></mujoco>',
    )
    assert refusals_of(mujoco.MjModel.from_xml_string(model)) == []


def test_explicit_pairs_are_contacts(tmp_path: Path) -> None:
    text = OPEN.replace("<geom ", '<geom contype="0" conaffinity="0" ')
    path = tmp_path / "model.xml"
    path.write_text(text)
    assert MujocoReference(path, setup=SETUP)
    names = iter("abc")
    named = "".join(
        part + (f'<geom name="{next(names)}" ' if k < 3 else "") for k, part in enumerate(text.split("<geom "))
    )
    paired = named.replace("<equality>", '<contact><pair name="p" geom1="a" geom2="c"/></contact><equality>')
    found = {refusal.kind: refusal.message for refusal in refusals_of(mujoco.MjModel.from_xml_string(paired))}
    assert 'pair "p" makes geoms "a" and "c" collide' in found["contact pairs"]


def test_a_joined_message_says_what_and_how() -> None:
    error = joined(
        "m.xml", [Refusal("a is so", "joint", "a", "do this", "k"), Refusal("b is so", "geom", "b", "or that", "l")]
    )
    assert str(error) == "m.xml: a is so; do this. Also: b is so; or that"


def test_limits_that_a_motion_leaves_are_named() -> None:
    text = FOURBAR.replace('name="elbow"', 'name="elbow" range="-0.6 -0.2"').replace(
        'name="crank" axis', 'name="crank" range="0 2" axis'
    )
    model = mujoco.MjModel.from_xml_string(text)
    qpos = np.array([[1.0, -0.5, -1.5], [1.1, -0.7, -1.4], [1.2, -0.65, -1.3]])
    (left,) = limits_left(model, qpos)
    assert (left.name, left.sample, left.value, left.lower, left.upper) == ("elbow", 1, -0.7, -0.6, -0.2)
    assert left.text(np.array([0.0, 0.5, 1.0])) == 't = 0.5 s, joint "elbow" = -0.7 rad; its range is -0.6 to -0.2 rad'
    assert limits_left(model, qpos[:1]) == []


def test_limits_of_ball_joints_and_fixed_tendons() -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><compiler angle="radian"/><worldbody><body><joint name="ball" type="ball" range="0 0.5"/>'
        '<geom size=".1"/></body><body><joint name="a"/><geom size=".1"/></body></worldbody><tendon>'
        '<fixed name="t" range="-1 1"><joint joint="a" coef="3"/></fixed></tendon></mujoco>'
    )
    turned = np.array([[np.cos(0.3), 0.0, np.sin(0.3), 0.0, 0.4]])
    ball, tendon = limits_left(model, turned)
    assert (ball.name, ball.value) == ("ball", pytest.approx(0.6))
    assert (tendon.element, tendon.value) == ("tendon", pytest.approx(1.2))
    assert limits_left(model, np.array([[1.0, 0.0, 0.0, 0.0, 0.2]])) == []


def test_geoms_that_a_motion_makes_touch_are_named() -> None:
    text = (
        '<mujoco><option><flag contact="disable"/></option><worldbody><geom name="floor" type="box" size="1 1 .1"/>'
        '<body pos="0 0 1"><joint name="z" type="slide"/><geom name="foot" size=".2"/></body></worldbody></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(text)
    assert touches(model, np.array([[0.0], [-0.5]])) == []
    (touch,) = touches(model, np.array([[0.0], [-0.8], [-0.75]]))
    assert {touch.one, touch.two} == {"floor", "foot"}
    assert (touch.sample, touch.always) == (1, False)
    assert touch.depth == pytest.approx(0.1)
    assert touches(model, np.array([[-0.8]]))[0].always
    assert model.opt.disableflags == mujoco.mjtDisableBit.mjDSBL_CONTACT.value
