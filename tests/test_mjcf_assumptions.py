"""Hand edits of a model: handled right, or refused in one line that names element, attribute, value and limit."""

# ruff: noqa: E501 - one edit to a line, where it fits
from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from robots import peak_error
from workbench import MujocoReference, load_mechanism
from workbench.errors import ModelError
from workbench.reference.check import check_model
from workbench.robots.assumptions.check import check_assumptions
from workbench.robots.load import load_model, open_model

MODELS = Path(__file__).resolve().parents[1] / "models"
ASYM, PLANAR = MODELS / "asym_2rss_ppap.xml", MODELS / "planar_4rprp.xml"
BOTH = pytest.mark.parametrize("model", [ASYM, PLANAR], ids=lambda path: path.stem)
VERIFIED = 1e-10


@dataclass(frozen=True)
class HandEdit:
    """What a user does to the file, and what has to come of it: ``refused`` is a pattern, or None for handled."""

    name: str
    model: Path
    replace: tuple[tuple[str, str], ...]
    refused: str | None = None
    line_of: str = ""
    """text in the line that the message has to name"""

    def write(self, folder: Path) -> Path:
        text = self.model.read_text()
        for old, new in self.replace:
            assert old in text, old
            text = text.replace(old, new, 1)
        path = folder / "edited.xml"
        path.write_text(text)
        return path


ROD = '<inertial pos="0 0 0.15" mass="0.3"'
BAR_2_TIP = '<site name="parallelogram_bar_2_tip" pos="0 0 0.25"/>'
SITE_E = '<site name="platform_E" pos="0 -0.1 0"/>'
MASS_PLATFORM = '<inertial pos="0 0 0" mass="0.45" diaginertia="0.0005 0.0005 0.0005"/>'
Q2 = '<joint name="q2" axis="-1 0 0" ref="0.7853981633974483"'
LOOP_E = '<connect name="spherical_E" site1="rod_left_tip" site2="platform_E"/>'
LOOP_F = '<connect name="spherical_F" site1="rod_right_tip" site2="platform_F"/>'
WELD = '<weld name="rod_24" site1="rod_24_at_2_middle" site2="rod_24_at_4_middle"/>'
MOTORS = '<motor name="q1" joint="q1"/>\n    <motor name="q2" joint="q2"/>'
HINGE_1 = '<joint name="parallelogram_hinge_1" axis="1 0 0"'
PAYLOAD = '<body name="payload">'
FLAG = '<flag contact="disable"/>'
RAIL = '<geom name="base_rail" class="visual"'
ARM = '<body name="arm_left" pos="0 -0.2 0" axisangle="-1 0 0 0.7853981633974483">'

HAND_EDITS = (
    # the six that a user is most likely to make
    HandEdit("rod's mass centre off its axis", ASYM, ((ROD, '<inertial pos="0.001 0 0.15" mass="0.3"'),),
             r'inertial "rod_left" pos is 0.001; the closed form needs 0 within 1e-12 \(number 1: on the axis\)', 'pos="0.001 0 0.15"'),
    HandEdit("one parallelogram bar shorter", ASYM, ((BAR_2_TIP, BAR_2_TIP.replace("0.25", "0.24")),),
             r'site "parallelogram_bar_2_tip" pos is 0.24; .* 0.25 within 1e-12 \(number 3: 1 \* a5\)', "bar_2_tip"),
    HandEdit("site renamed", ASYM, ((SITE_E, SITE_E.replace("platform_E", "platform_e")), ("platform_E\"/>", 'platform_e"/>')),
             r'<site name="platform_E"> is missing; did you mean "platform_e"\?'),
    HandEdit("mass deleted", ASYM, ((MASS_PLATFORM, ""),), r"mass and inertia of moving bodies must be larger .*platform"),
    HandEdit("angle units switched to degrees", ASYM, (('angle="radian"', 'angle="degree"'),)),
    HandEdit("joint axis tilted", ASYM, ((Q2, Q2.replace("-1 0 0", "-1 0.01 0")),),
             r'joint "q2" axis is -0.99995\d* 0.0099995\d* 0; the closed form needs -1 0 0 within 1e-12', 'name="q2"'),
    # the tree
    HandEdit("angle units to degrees, many tilts", PLANAR, (('angle="radian"', 'angle="degree"'),)),
    HandEdit("mass of one bar alone", ASYM, (('pos="0 0 0.125" mass="0.25"', 'pos="0 0 0.125" mass="0.26"'),),
             r'inertial "parallelogram_bar_2" mass is 0.25; .* 0.26'),
    HandEdit("a part bolted to the platform", ASYM, ((PAYLOAD, '<body name="camera"><inertial pos="0 0 0" mass="0.2"'
             ' diaginertia="0.001 0.001 0.001"/></body>' + PAYLOAD),), r'body "camera" mass is 0.2 kg; .* 0', "camera"),
    HandEdit("a joint more", ASYM, (('<joint name="platform_slide"', '<joint name="spin" axis="0 0 1"/><joint name="platform_slide"'),
             ("0 0 0 0 0 0.785", "0 0 0 0 0 0 0.785")), r'body "platform" joints is 2; the closed form needs 1', '"platform"'),
    HandEdit("a ball joint turned into a hinge", ASYM, (('name="spherical_C" type="ball"', 'name="spherical_C"'),
             ("1 0 0 0 0.785", "0 0.785"),), r'joint "spherical_C" type is "hinge"; .* "ball"', "spherical_C"),
    HandEdit("a joint's anchor moved", ASYM, (('name="spherical_C" type="ball"', 'name="spherical_C" type="ball" pos="0 0 0.01"'),),
             r'joint "spherical_C" pos is 0 0 0.01; .* 0 0 0 within', "spherical_C"),
    HandEdit("zero of a joint moved", ASYM, ((Q2, Q2.replace("0.7853981633974483", "0.7")),),
             r'body "arm_left" orientation is turned by 0.085398\d* rad; .*where its joint', "arm_left"),
    HandEdit("body turned", ASYM, (('<body name="slider">', '<body name="slider" euler="0 0.02 0">'),),
             r'body "slider" orientation is turned by 0.02 rad; .* 0 within', '"slider"'),
    HandEdit("body shifted", ASYM, (('<body name="slider">', '<body name="slider" pos="0 0.01 0">'),),
             r'body "slider" pos is 0 0.01 0; .* 0 0 0 within', '"slider"'),
    HandEdit("tilted inertia", ASYM, (('diaginertia="0.00225 0.00225 1e-06"', 'fullinertia="0.00225 0.00225 1e-06 0 1e-5 0"'),),
             r'inertial "rod_left" products of inertia is 1e-05; .* 0 within'),
    HandEdit("base on its side", ASYM, (('<body name="base" quat="0 1 0 0">', '<body name="base">'),),
             r'body "base" orientation is 0 0 -1; .* 0 0 1 within', '"base"'),
    HandEdit("gravity sideways", ASYM, (('gravity="0 0 -9.81"', 'gravity="1 0 -9.81"'),),
             r"option gravity is 1; .* 0 within .*number 1", "<option"),
    # loops, actuators
    HandEdit("a loop left out", ASYM, ((LOOP_E, ""),), r'no <connect site1="rod_left_tip" site2="platform_E">'),
    HandEdit("a loop switched off", ASYM, ((LOOP_E, LOOP_E.replace("/>", ' active="false"/>')),),
             r'connect "spherical_E" active is false; .* true', "spherical_E"),
    HandEdit("rods crossed", ASYM, ((LOOP_E, LOOP_E.replace("platform_E", "platform_F")), (LOOP_F, LOOP_F.replace("platform_F", "platform_E"))),
             r'connect "spherical_E" sites is platform_F and rod_left_tip', "spherical_E"),
    HandEdit("a loop by bodies", ASYM, ((LOOP_E, '<connect name="spherical_E" body1="rod_left" body2="platform" anchor="0 0 0.3"/>'),),
             r'connect "spherical_E" sites is bodies or joints', "spherical_E"),
    HandEdit("a weld turned into a connect", PLANAR, ((WELD, WELD.replace("weld", "connect")),), r'"rod_24" type is "connect"; .* "weld"'),
    HandEdit("a welded site turned", PLANAR, (('<site name="platform_joint"', '<site name="platform_joint" euler="0 0.1 0"'),),
             r'site "platform_joint" quat .* is 0 0.0499\d* 0', "platform_joint"),
    HandEdit("gear ratio", ASYM, (('joint="q2"/>', 'joint="q2" gear="2"/>'),), r'motor "q2" gear is 2 0 0 0 0 0; .* 1 0 0 0 0 0', 'joint="q2"'),
    HandEdit("actuators swapped", ASYM, ((MOTORS, "\n    ".join(reversed(MOTORS.split("\n    ")))),),
             r'actuator joints is "q2 q1 q3"; .* "q1 q2 q3" in this order'),
    HandEdit("an actuator left out", ASYM, (('<motor name="q3" joint="q3"/>', ""),), r'actuator joints is "q1 q2"'),
    HandEdit("position control", ASYM, (('<motor name="q3" joint="q3"/>', '<position name="q3" joint="q3" kp="3"/>'),), r'motor "q3" is gain 3'),
    HandEdit("platform site moved", ASYM, (('<site name="platform" pos="0 0 0"/>', '<site name="platform" pos="0 0 0.05"/>'),),
             r'site "platform" pos is 0 0 0.05; .* 0 0 0', 'site name="platform"'),
    HandEdit("another bar lumped", ASYM, (('data="arm_left arm_right rod_left', 'data="arm_right rod_left'),),
             r'text "lumped_bodies" data is "arm_right rod_left', "lumped_bodies"),
    # what the closed form leaves out
    HandEdit("a spring", ASYM, ((HINGE_1, HINGE_1 + ' stiffness="3"'),),
             r'joint "parallelogram_hinge_1" stiffness is 3; .* no spring', "parallelogram_hinge_1"),
    HandEdit("a limit", ASYM, ((HINGE_1, HINGE_1 + ' range="-1 1"'),), r'"parallelogram_hinge_1" range is set; .* no limit'),
    HandEdit("gravity compensation", ASYM, ((PAYLOAD, PAYLOAD.replace(">", ' gravcomp="1">')),), r'body "payload" gravcomp is 1', "payload"),
    HandEdit("water", ASYM, (('gravity="0 0 -9.81"', 'gravity="0 0 -9.81" density="1000"'),), r"option density is 1000; .* 0", "<option"),
    HandEdit("gravity switched off", ASYM, ((FLAG, '<flag contact="disable" gravity="disable"/>'),), r"flag gravity is disable"),
    HandEdit("contacts", ASYM, ((FLAG, ""), (RAIL, '<geom name="base_rail"')), r"flag contact is enable, and geoms can collide"),
    # edits that change nothing that counts, or that both sides see
    HandEdit("equality and motors renamed, sites swapped", ASYM, ((LOOP_E, '<connect name="x" site1="platform_E" site2="rod_left_tip"/>'),
             ('<motor name="q1"', '<motor name="m"'))),
    HandEdit("robot moved and turned about the vertical", ASYM, (('<body name="base" quat="0 1 0 0">', '<body name="base" pos="1 2 3" quat="0 0.6 0.8 0">'),)),
    HandEdit("platform's own inertia and mass centre", ASYM, ((MASS_PLATFORM, '<inertial pos="0.01 0.02 0.03" mass="0.6" fullinertia="0.005 0.006 0.007 1e-4 2e-4 3e-4"/>'),)),
    HandEdit("payload beside the platform", ASYM, (('<inertial pos="0 0 0" mass="0" diaginertia="0 0 0"/>',
             '<inertial pos="0.1 0.2 0.3" mass="0.7" diaginertia="1e-3 1e-3 1e-3"/>'), (PAYLOAD, '<body name="payload" pos="0 0 0.1" euler="1 2 3">'))),
    HandEdit("home pose of the arm given in another way", ASYM, ((ARM, '<body name="arm_left" pos="0 -0.2 0">'), (Q2, Q2.replace(' ref="0.7853981633974483"', "")))),
    HandEdit("zero of the slider moved with its body", ASYM, (('<body name="slider">', '<body name="slider" pos="0.05 0 0">'),
             ('type="slide" axis="1 0 0"', 'type="slide" axis="1 0 0" ref="0.05"'))),
    HandEdit("a hood on the base", ASYM, ((RAIL, '<body name="hood"><geom type="box" size=".1 .1 .1" contype="0" conaffinity="0"/></body>' + RAIL),)),
    HandEdit("limbs that differ", PLANAR, (('mass="0.155"', 'mass="0.3"'),), r'inertial "piston_2" mass is 0.155; .* 0.3'),
)  # fmt: skip
IDS = [f"{edit.model.stem[:4]}-{edit.name}" for edit in HAND_EDITS]


def disagreement(path: Path, against: Path | None = None) -> float:
    """Peak error of the closed form of one file against the reference of another (or the same), both mass models."""
    mech, ref = load_mechanism(path), MujocoReference(against or path)
    random = np.random.default_rng(7)
    nominal = [0.0, np.pi / 4, np.pi / 4] if mech.name == "asym_2rss_ppap" else [0.3893, 0.3769, 0.3893]
    q = nominal + 0.06 * random.uniform(-1, 1, (20, 3))
    qd, qdd = random.normal(size=(20, 3)), 5 * random.normal(size=(20, 3))
    force = random.normal(size=(20, 3))
    errors = []
    for mass_model in ("distributed", "lumped"):
        result = ref.inverse_dynamics(q, qd, qdd, mass_model, force)
        assert np.abs(result.x - mech.forward_kinematics(q)).max() < VERIFIED
        errors.append(peak_error(mech.inverse_dynamics(q, qd, qdd, mass_model, force), result.tau))
    return max(errors)


@pytest.mark.parametrize(
    "edit", [e for e in HAND_EDITS if e.refused is None], ids=lambda e: f"{e.model.stem[:4]}-{e.name}"
)
def test_hand_edits_that_are_handled(edit: HandEdit, tmp_path: Path) -> None:
    path = edit.write(tmp_path)
    assert disagreement(path) <= VERIFIED
    assert check_model(path, ranges=False).broken == ()


@pytest.mark.parametrize("edit", [e for e in HAND_EDITS if e.refused], ids=lambda e: f"{e.model.stem[:4]}-{e.name}")
def test_hand_edits_that_are_refused(edit: HandEdit, tmp_path: Path) -> None:
    assert edit.refused
    path = edit.write(tmp_path)
    with pytest.raises(ModelError, match=edit.refused) as caught:
        load_model(path)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(str(path))
    if edit.line_of:
        number = re.match(re.escape(str(path)) + r":(\d+): ", message)
        assert number, message
        assert edit.line_of in path.read_text().split("\n")[int(number.group(1)) - 1]
    with pytest.raises(ModelError, match=edit.refused):
        MujocoReference(path)
    try:
        found = check_model(path, ranges=False)
    except ModelError as error:  # what does not compile has nothing to list
        assert str(error) == message  # noqa: PT017
        return
    assert found.exit_code == 1
    assert message in found.broken


def test_there_are_twelve_and_more() -> None:
    assert len(HAND_EDITS) >= 12
    assert len(set(IDS)) == len(HAND_EDITS)


def test_the_comparison_of_handled_edits_can_fail(tmp_path: Path) -> None:
    """Twin: an edit that both sides see is far off the file before it."""
    edit = next(e for e in HAND_EDITS if e.name == "payload beside the platform")
    assert disagreement(edit.write(tmp_path), ASYM) > 1e6 * VERIFIED


@BOTH
def test_the_bundled_models_keep_every_assumption(model: Path) -> None:
    assumptions = check_assumptions(open_model(model))
    assert [a.message for a in assumptions if not a.ok] == []
    assert len(assumptions) > 100
    for kind in (
        "joint axis",
        "joint type",
        "loop",
        "orientation",
        "gear",
        "number",
        "left out",
        "option",
        "custom name",
    ):
        assert any(a.name == kind for a in assumptions), kind
    assert all(a.where and a.value and a.limit for a in assumptions)


@BOTH
def test_check_counts_freedoms_and_measures_ranges(model: Path) -> None:
    check = check_model(model)
    assert check.exit_code == 0
    assert check.mobility is not None
    assert check.mobility.mobility == 3
    assert check.closure_residual is not None
    assert check.closure_residual <= 1e-13
    assert check.platform_gap is not None
    assert check.platform_gap <= 1e-13
    assert check.warnings == ()
    assert [r.joint for r in check.ranges] == ["q1", "q2", "q3"]
    mech = load_mechanism(model)
    home = [0.0, np.pi / 4, np.pi / 4] if model == ASYM else [0.3893182978, 0.3768866111, 0.3893182978]
    for column, found in enumerate(check.ranges):
        assert found.lower < home[column] < found.upper
    if model == ASYM:
        assert (check.mobility.redundant_rows, check.idle_bodies) == (1, ("rod_left", "rod_right"))
        # the platform's circles touch where 2 sqrt(a2^2 - q1^2) is the distance of their centres, 2 (b + a1 cos 45)
        reach = float(np.sqrt(0.3**2 - (0.1 + 0.2 * np.cos(np.pi / 4)) ** 2))
        assert check.ranges[0].upper == pytest.approx(reach, abs=1e-5)
        assert check.ranges[0].lower == pytest.approx(-reach, abs=1e-5)
    else:
        assert (check.mobility.redundant_rows, check.idle_bodies) == (7, ())
        # limbs 1 and 3 are in line where q1 + q3 = b, or q1 - q3 = b
        assert check.ranges[0].lower == pytest.approx(mech.parameters.b - home[2], abs=1e-5)
        assert check.ranges[0].upper == pytest.approx(mech.parameters.b + home[2], abs=1e-5)


def test_check_says_what_the_closed_form_cannot_follow(tmp_path: Path) -> None:
    """The kinematic cross-check sees what no table of names knows: a model on the other assembly branch."""
    text = PLANAR.read_text()
    other = re.sub(r'(<body name="platform" pos=")0.29999999996240867', r"\g<1>-0.29999999996240867", text)
    path = tmp_path / "other.xml"
    path.write_text(mirror_home(other))
    found = check_model(path)
    assert found.exit_code == 1
    assert any('site "P" is' in line and "closed form puts it" in line for line in found.broken), found.broken


def mirror_home(text: str) -> str:
    """Put the 4-RPRP robot's home pose on the branch Px < 0: limbs 2 and 4 lean to the other side."""
    b = np.arctan2(0.2481309, -0.3) - np.arctan2(0.2481309, 0.3)
    q4 = float(np.hypot(0.6 + 0.3, 0.2281))
    lean4 = float(np.arctan2(0.9, 0.2281) - 0.9206502340946104)
    old = 'qpos="0 0.3893182978 0 0.29999999996240867 0 0.3768866111 0 -0.3 0 0.3893182978 0 0 0.376886611159845 0"'
    assert old in text
    lean2 = 2 * 0.9206502339738626
    assert b > 0
    new = f'qpos="0 0.3893182978 0 -0.3 {lean2} 0.3768866111 {-lean2} -0.3 0 0.3893182978 0 {lean4} {q4} {-lean4}"'
    return text.replace(old, new)


def test_check_of_a_model_without_a_closed_form(tmp_path: Path) -> None:
    path = tmp_path / "own.xml"
    path.write_text(ASYM.read_text().replace('<text name="mechanism" data="asym_2rss_ppap"/>', ""))
    found = check_model(path)
    assert found.mechanism is None
    assert found.assumptions == ()
    assert found.exit_code == 0
    assert found.mobility is not None
    assert found.mobility.mobility == 3


def test_check_reports_open_loops_and_the_engines_warnings(tmp_path: Path) -> None:
    path = tmp_path / "open.xml"
    path.write_text(ASYM.read_text().replace(BAR_2_TIP, BAR_2_TIP.replace("0.25", "5")))
    found = check_model(path)
    assert found.exit_code == 1
    assert found.mobility is None
    assert any("cannot be closed" in line for line in found.broken)
    assert any('site "parallelogram_bar_2_tip" pos is 5;' in line for line in found.broken)
    path.write_text(ASYM.read_text().replace('timestep="0.0005"', 'timestep="0.5"'))
    assert any("bad" in line or "unstable" in line for line in check_model(path).warnings)


def test_check_counts_a_motor_for_each_freedom(tmp_path: Path) -> None:
    path = tmp_path / "few.xml"
    text = ASYM.read_text().replace('<text name="mechanism" data="asym_2rss_ppap"/>', "")
    fewer, count = re.subn(r'<motor [^>]*joint="q3"[^>]*/>', "", text)
    assert count == 1
    path.write_text(fewer)
    found = check_model(path, ranges=False)
    assert found.exit_code == 1
    assert any("few.xml: mobility 3, but 2 actuators; each freedom needs one" in line for line in found.broken)
    path.write_text(text)
    assert check_model(path, ranges=False).exit_code == 0
    # one more than freedoms: none of them moves with the others held, so that there are no ranges to look for
    more = re.sub(r'(<motor [^>]*joint="q3"[^>]*/>)', r'\1<motor joint="parallelogram_hinge_1"/>', text)
    path.write_text(more)
    found = check_model(path)
    assert (found.exit_code, found.ranges) == (0, ())
