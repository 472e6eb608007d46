"""Springs, friction, fluid, gravity compensation, rotors: each counts in torque, power balance and replay."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from nullspace_oracle import NullSpaceOracle
from own_mechanisms import FOURBAR
from workbench.errors import ModelError
from workbench.mjcf.actuators import actuator_effects
from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference
from workbench.reference.power import power_balance
from workbench.reference.replay import replay

GUESS = (("crank", 1.0), ("elbow", -0.5), ("wrist", -1.5))
SETUP = Setup(("crank",), "coupler", initial=GUESS)
AGREE = 1e-9
BALANCE = 1e-8
SEEN = 1e-4
TIMES = np.linspace(0.0, 1.0, 31)

WORLD = '<tendon><fixed name="t" stiffness="2" damping="0.3" frictionloss="0.4" springlength="0.1">'
FEATURES = {
    "spring": ('name="elbow"', 'name="elbow" stiffness="3" springref="0.4"'),
    "polynomial spring": ('name="elbow"', 'name="elbow" stiffness="1 0.5 0.3"'),
    "dry friction": ('name="wrist"', 'name="wrist" frictionloss="0.3"'),
    "damping": ('name="wrist"', 'name="wrist" damping="0.3"'),
    "polynomial damping": ('name="wrist"', 'name="wrist" damping="0.1 0.2 0.05"'),
    "gravity compensation": ('<body name="coupler"', '<body name="coupler" gravcomp="0.6"'),
    "fluid": ("<option>", '<option density="80" viscosity="0.5">'),
    "tendon": (
        "<equality>",
        f'{WORLD}<joint joint="crank" coef="1"/><joint joint="wrist" coef="-0.5"/></fixed></tendon><equality>',
    ),
}


def motion(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return tuple(part[:, None] for part in (1.0 + 0.4 * np.sin(3 * t), 1.2 * np.cos(3 * t), -3.6 * np.sin(3 * t)))  # type: ignore[return-value]


def reference(tmp_path: Path, text: str, setup: Setup = SETUP) -> MujocoReference:
    path = tmp_path / "model.xml"
    path.write_text(text, encoding="utf-8")
    return MujocoReference(path, setup=setup)


def with_feature(name: str) -> str:
    old, new = FEATURES[name]
    assert old in FOURBAR
    return FOURBAR.replace(old, new, 1)


@pytest.mark.parametrize("name", FEATURES)
def test_each_force_counts_in_torque_and_power(tmp_path: Path, name: str) -> None:
    q, qd, qdd = motion(TIMES)
    plain = reference(tmp_path, FOURBAR).inverse_dynamics(q, qd, qdd).tau
    found = reference(tmp_path, with_feature(name))
    result = found.inverse_dynamics(q, qd, qdd)
    oracle = NullSpaceOracle(found.text, ["crank"])
    home = np.array(oracle.model.key_qpos[0])
    peak = np.abs(result.tau).max()
    for s in range(0, len(q), 6):
        expected = oracle.inverse_dynamics(oracle.close(home, q[s]), qd[s], qdd[s], "coupler", np.zeros(3)).tau
        assert np.abs(expected - result.tau[s]).max() < AGREE * peak
    balance = power_balance(found, q, qd, qdd)
    assert balance.relative < BALANCE
    # the twin: torques that leave the feature out break both
    assert np.abs(plain - result.tau).max() > SEEN * peak
    assert power_balance(found, q, qd, qdd, tau=plain).relative > SEEN


@pytest.mark.parametrize("name", ["spring", "damping", "tendon"])
def test_the_replay_feels_it(tmp_path: Path, name: str) -> None:
    plain = reference(tmp_path, FOURBAR)
    found = reference(tmp_path, with_feature(name))

    def without(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        return plain.inverse_dynamics(q, qd, qdd).tau

    outcome = replay(found, motion, {"without": without}, 0.0, 0.5).replays
    assert outcome["reference"].verdict == "converges"
    assert outcome["without"].verdict != "converges"


def test_passive_friction_is_zero_at_rest_and_that_is_said(tmp_path: Path) -> None:
    q, qd, qdd = motion(np.zeros(1))
    rough = reference(tmp_path, with_feature("dry friction"))
    assert any("rests counts as zero" in note for note in rough.notes)
    rest = rough.inverse_dynamics(q, 0 * qd, qdd).tau
    plain = reference(tmp_path, FOURBAR)
    assert not plain.notes
    assert np.array_equal(rest, plain.inverse_dynamics(q, 0 * qd, qdd).tau)


def test_gravity_that_is_switched_off_is_none(tmp_path: Path) -> None:
    q, qd, qdd = motion(TIMES)
    off = reference(tmp_path, FOURBAR.replace("<flag ", '<flag gravity="disable" '))
    zero = reference(tmp_path, FOURBAR.replace("<option>", '<option gravity="0 0 0">'))
    first, second = off.inverse_dynamics(q, qd, qdd), zero.inverse_dynamics(q, qd, qdd)
    assert np.abs(first.tau - second.tau).max() < 1e-14
    for name, force in first.reactions.items():
        assert np.abs(force - second.reactions[name]).max() < 1e-12
    assert power_balance(off, q, qd, qdd).relative < BALANCE


def test_a_spring_that_is_switched_off_is_none(tmp_path: Path) -> None:
    q, qd, qdd = motion(TIMES)
    off = reference(tmp_path, with_feature("spring").replace("<flag ", '<flag spring="disable" '))
    plain = reference(tmp_path, FOURBAR).inverse_dynamics(q, qd, qdd).tau
    assert np.abs(off.inverse_dynamics(q, qd, qdd).tau - plain).max() < 1e-14


def test_reactions_know_of_gravity_compensation_and_not_of_fluids(tmp_path: Path) -> None:
    q, qd, qdd = motion(TIMES)
    still = 0 * qd, 0 * qdd
    # a compensated chain weighs nothing, so that nothing is felt in its joints at rest
    names = ("crank", "coupler", "rocker")
    text = FOURBAR
    for name in names:
        text = text.replace(f'<body name="{name}"', f'<body name="{name}" gravcomp="1"')
    result = reference(tmp_path, text).inverse_dynamics(q, *still)
    assert max(np.abs(force).max() for force in result.reactions.values()) < 1e-12
    heavy = reference(tmp_path, FOURBAR).inverse_dynamics(q, *still).reactions
    assert max(np.abs(force).max() for force in heavy.values()) > 1.0
    assert not reference(tmp_path, with_feature("fluid")).inverse_dynamics(q, qd, qdd).reactions


GEARED = """<mujoco><compiler angle="radian"/><worldbody><body><joint name="a" axis="0 1 0" damping="0.1"
 armature="0.01"/><geom size=".1" mass="1"/></body><body pos="1 0 0"><joint name="b" type="slide" damping="0.2"/>
<geom size=".1" mass="1"/></body></worldbody><actuator>
<motor joint="a" gear="-3" armature="0.2" damping="0.5 0.2 0.3"/><position joint="a" kp="3" armature="0.1"/>
<motor joint="b" gear="2" damping="0.4"/></actuator></mujoco>"""


def test_what_actuators_add_is_found_per_joint() -> None:
    model = mujoco.MjModel.from_xml_string(GEARED)
    bare = mujoco.MjModel.from_xml_string(GEARED[: GEARED.index("<actuator>")] + "</mujoco>")
    effects = actuator_effects(model)
    assert not effects.refusals
    rng = np.random.default_rng(1)
    for _ in range(20):
        qvel = rng.normal(0, 2, 2)
        data, plain = mujoco.MjData(model), mujoco.MjData(bare)
        data.qvel[:] = plain.qvel[:] = qvel
        mujoco.mj_forward(model, data)
        mujoco.mj_forward(bare, plain)
        for joint in (0, 1):
            loss = effects.damping[joint]
            v = qvel[joint]
            assert data.M[joint] - plain.M[joint] == pytest.approx(effects.armature.get(joint, 0.0), abs=1e-12)
            expected = -(loss[0] * v + loss[1] * v * abs(v) + loss[2] * v**3)
            assert data.qfrc_passive[joint] - plain.qfrc_passive[joint] == pytest.approx(expected, abs=1e-12)
            assert abs(expected) > 1e-6


def test_actuator_effects_that_no_joint_can_hold_are_named() -> None:
    tendon = '<tendon><fixed name="t"><joint joint="a" coef="1"/></fixed></tendon>'
    text = GEARED.replace("<actuator>", f'{tendon}<actuator><motor name="pull" tendon="t" armature="0.1"/>')
    (refusal,) = actuator_effects(mujoco.MjModel.from_xml_string(text)).refusals
    assert refusal.name == "pull"
    assert refusal.tag == "actuator"


def test_rotor_and_damping_of_a_motor_count(tmp_path: Path) -> None:
    q, qd, qdd = motion(TIMES)
    custom = '<custom><text name="base_body" data="world"/><text name="platform_site" data="coupler"/></custom>'
    key = '<keyframe><key name="home" qpos="1 -0.5 -1.5"/></keyframe>'
    at_motor = '<actuator><motor joint="crank" gear="4" armature="0.02" damping="0.05"/></actuator>'
    text = FOURBAR.replace("</mujoco>", f"{custom}{key}{at_motor}</mujoco>")
    joint = text.replace(' armature="0.02" damping="0.05"', "").replace(
        'name="crank" axis', 'name="crank" armature="0.32" damping="0.8" axis'
    )
    found = []
    for name, xml in (("motor", text), ("joint", joint)):
        path = tmp_path / f"{name}.xml"
        path.write_text(xml)
        model = MujocoReference(path)
        found.append(model.inverse_dynamics(q, qd, qdd).tau)
        assert power_balance(model, q, qd, qdd).relative < BALANCE
    assert np.abs(found[0] - found[1]).max() < 1e-13
    assert np.abs(found[0] - reference(tmp_path, FOURBAR).inverse_dynamics(q, qd, qdd).tau).max() > 0.1


@pytest.mark.parametrize("force", [(0.0, 0.0, -8.0), (3.0, 0.0, 5.0)])
def test_a_replayed_force_follows_a_platform_that_turns(tmp_path: Path, force: tuple[float, float, float]) -> None:
    found = reference(tmp_path, FOURBAR)
    pull = np.array(force)

    def scaled(factor: float):  # type: ignore[no-untyped-def]
        return lambda q, qd, qdd: found.inverse_dynamics(q, qd, qdd, external_force=factor * pull).tau

    outcome = replay(found, motion, {"same": scaled(1.0), "other": scaled(0.98)}, 0.0, 0.5, pull).replays
    assert outcome["reference"].verdict == outcome["same"].verdict == "converges"
    assert outcome["other"].verdict != "converges"


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("spring", 'spring of joint "elbow"'), ("polynomial damping", 'first number of joint "wrist"'),
        ("gravity compensation", 'gravcomp of body "coupler"'), ("fluid", "the fluid"), ("tendon", 'tendon "t"'),
    ],
)  # fmt: skip
def test_the_second_engine_names_what_it_does_not_count(tmp_path: Path, name: str, word: str) -> None:
    pytest.importorskip("pinocchio")
    from workbench.reference.pinocchio_reference import PinocchioReference

    path = tmp_path / "model.xml"
    path.write_text(with_feature(name))
    with pytest.raises(ModelError, match=word):
        PinocchioReference(path, setup=SETUP)


def test_the_second_engine_agrees_on_passive_friction_and_several_defaults(tmp_path: Path) -> None:
    pytest.importorskip("pinocchio")
    from workbench.reference.pinocchio_reference import PinocchioReference

    q, qd, qdd = motion(TIMES)
    defaults = '<default><geom rgba="1 0 0 1"/></default><default><joint damping="0.2"/></default>'
    text = with_feature("dry friction").replace("<worldbody>", f"{defaults}<worldbody>")
    first = reference(tmp_path, text).inverse_dynamics(q, qd, qdd).tau
    second = PinocchioReference(tmp_path / "model.xml", setup=SETUP).inverse_dynamics(q, qd, qdd).tau
    assert np.abs(first - second).max() < AGREE * np.abs(first).max()
