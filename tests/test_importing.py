"""A real file as it lies becomes a robot that runs; what is left out is held against the motion, and said."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from typer.testing import CliRunner

from own_mechanisms import FOURBAR
from test_mjcf_setup import CUP, PLATFORM, floated, robot
from workbench.campaign.run import run_campaign
from workbench.cli import app
from workbench.errors import MotionError, WorkbenchError
from workbench.importing.proposal import propose
from workbench.importing.write import robot_text, write_folder
from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference
from workbench.reference.crossings import look, refuse_crossings, worth
from workbench.reference.survey import _descended
from workbench.robots.robot_file import read_robot_file

MOTOR = '<actuator><motor joint="crank"/></actuator>'
TREE = """<mujoco><compiler angle="radian"/><worldbody>
 <body name="a"><joint name="a" axis="0 1 0"/><geom size=".05" pos=".1 0 0" mass="1"/>
  <body name="b" pos=".2 0 0"><joint name="b" axis="0 1 0"/><geom size=".05" pos=".1 0 0" mass="1"/>
   <body name="c" pos=".2 0 0"><joint name="c" axis="0 0 1"/><geom size=".04" pos=".1 0 0" mass="1"/></body></body>
 </body>
</worldbody><equality><joint joint1="b" joint2="a" polycoef="0 -1 0 0 0"/></equality>
<actuator><motor joint="a"/><motor joint="b"/></actuator></mujoco>"""


def proposed(tmp_path: Path, text: str, actuated: tuple[str, ...] = ()):  # type: ignore[no-untyped-def]
    path = tmp_path / "model.xml"
    path.write_text(text)
    return propose(path, actuated)


def test_joints_to_drive_are_the_files_own_as_far_as_they_are_independent(tmp_path: Path) -> None:
    found = proposed(tmp_path, TREE)
    assert found.setup.actuated == ("a", "c")
    assert (found.survey.dropped, found.survey.added) == (("b",), ("c",))
    assert (found.survey.mobility, found.survey.rank) == (2, 1)
    assert proposed(tmp_path, TREE, ("b", "c")).setup.actuated == ("b", "c")


def test_without_actuators_the_joint_nearest_to_the_base_drives(tmp_path: Path) -> None:
    assert proposed(tmp_path, robot()).setup.actuated == ("crank",)


def test_a_base_that_floats_is_fixed_and_a_loose_body_stands_still(tmp_path: Path) -> None:
    found = proposed(tmp_path, floated('<freejoint name="root"/>').format(""))
    assert (found.setup.fix_base, found.setup.ignore, found.problem) == ("base", (), "")
    found = proposed(tmp_path, robot(bodies=CUP, sections=MOTOR))
    assert (found.setup.fix_base, found.setup.ignore, found.problem) == ("", ("free bodies",), "")


def test_a_platform_on_a_free_joint_needs_no_edit(tmp_path: Path) -> None:
    found = proposed(tmp_path, PLATFORM.format("<freejoint/>"))
    assert (found.problem, found.setup.platform_site, found.setup.actuated) == ("", "out", ("a",))


def test_an_open_drawing_is_closed_for_the_first_guess(tmp_path: Path) -> None:
    found = proposed(tmp_path, robot(sections=MOTOR).replace('pos="0.35 0 0"', 'pos="0.33 0 0"'))
    assert found.problem == ""
    assert {joint for joint, _ in found.setup.initial} >= {"piston"}


LIMITED = robot(crank=' range="-0.05 1.5"', sections=MOTOR)
HIT = '<body name="wall" pos="0.5 0 0"><geom type="box" size="0.05 0.1 0.1"/></body>'


def test_the_motion_stays_inside_the_limits(tmp_path: Path) -> None:
    found = proposed(tmp_path, LIMITED)
    assert found.motion is not None
    low, high = found.motion.offset[0] - found.motion.amplitude[0], found.motion.offset[0] + found.motion.amplitude[0]
    assert (low >= -0.05, high <= 1.5, found.setup.ignore) == (True, True, ())
    assert any("limits of 1 joint(s)" in note for note in found.left_out)


def crossings(tmp_path: Path, text: str, reach: float, ignore: tuple[str, ...] = ()):  # type: ignore[no-untyped-def]
    path = tmp_path / "model.xml"
    path.write_text(text)
    reference = MujocoReference(path, setup=Setup(("crank",), "pin", ignore=ignore))
    q = np.linspace(0.3, reach, 31)[:, None]
    return look(reference, reference.inverse_dynamics(q, 0 * q, 0 * q))


def test_a_limit_that_the_motion_leaves_is_named_with_value_and_time(tmp_path: Path) -> None:
    times = np.linspace(0.0, 3.0, 31)
    assert crossings(tmp_path, LIMITED, 1.4).crossings == ()
    found = crossings(tmp_path, LIMITED, 1.9)
    with pytest.raises(MotionError, match=r'joint "crank" reaches 1.9 rad, its range is -0.05 to 1.5 rad.*"limits"'):
        refuse_crossings(found, (), times)
    assert refuse_crossings(found, ("limits",), times)[-1].endswith("at t = 3 s")
    switched_off = LIMITED.replace('gravity="0 0 -9.81"/>', 'gravity="0 0 -9.81"><flag limit="disable"/></option>')
    assert crossings(tmp_path, switched_off, 1.9).crossings == ()


def test_what_comes_to_touch_is_named(tmp_path: Path) -> None:
    """The piston drives into a wall; twins: it stops before, the wall collides with nothing, contacts are off."""
    text = robot(bodies=HIT, sections=MOTOR).replace('mass="1.2"/>', 'mass="1.2" name="head"/>')
    times = np.linspace(0.0, 3.0, 31)
    outward = text.replace('pos="0.5 0 0"', 'pos="0.2 0 0"')
    assert [c.what for c in crossings(tmp_path, outward.replace("0.05 0.1 0.1", "0.01 0.1 0.1"), 2.8).crossings][
        :1
    ] == ["contacts"]
    found = crossings(tmp_path, outward.replace("0.05 0.1 0.1", "0.01 0.1 0.1"), 2.8)
    with pytest.raises(MotionError, match=r'geom "head" of piston.* of wall touch, .* m deep.*ignore = \["contacts"\]'):
        refuse_crossings(found, (), times)
    far = text.replace('pos="0.5 0 0"', 'pos="0 5 0"')
    assert crossings(tmp_path, far, 2.8).crossings == ()
    silent = outward.replace("<geom", '<geom contype="0" conaffinity="0"')
    assert crossings(tmp_path, silent, 2.8).crossings == ()


def test_what_ignore_leaves_out_is_measured(tmp_path: Path) -> None:
    """A spring of 2 N m/rad at the elbow: its worth is that of MuJoCo's own, by the power of the whole motion."""
    path = tmp_path / "model.xml"
    path.write_text(robot().replace('name="elbow"', 'name="elbow" stiffness="2" springref="0.3"'))
    q, qd, qdd = (np.array([[0.4], [1.2], [2.5]]) * k for k in (1.0, 3.0, -7.0))
    taus = {}
    for ignore in ((), ("springs",)):
        reference = MujocoReference(path, setup=Setup(("crank",), "pin", ignore=ignore))
        taus[ignore] = reference.inverse_dynamics(q, qd, qdd).tau
    with_it, without = taus.values()
    share = 100 * np.abs(with_it - without).max() / np.abs(with_it).max()
    assert share > 1
    lines = worth(reference, ("springs",), (q, qd, qdd), without)
    assert lines == (f"ignored: springs, worth of the peak torque with them: crank {share:.3g} %",)
    assert worth(reference, (), (q, qd, qdd), without) == ()


def test_a_folder_from_a_file_runs_at_once(tmp_path: Path) -> None:
    source = tmp_path / "from"
    (source / "parts").mkdir(parents=True)
    text = LIMITED.replace("<worldbody>", '<include file="parts/world.xml"/><worldbody>')
    (source / "robot.xml").write_text(text)
    (source / "parts" / "world.xml").write_text('<mujoco><worldbody><site name="mark"/></worldbody></mujoco>')
    made = CliRunner().invoke(app, ["new", str(tmp_path / "made"), "--from", str(source / "robot.xml")])
    assert made.exit_code == 0, made.output
    assert (tmp_path / "made" / "parts" / "world.xml").is_file()
    outcome = run_campaign(tmp_path / "made" / "made.toml", tmp_path / "run")
    assert any("limits of 1 joint(s)" in warning for warning in outcome.manifest["cases"]["small"]["warnings"])
    again = CliRunner().invoke(app, ["new", str(tmp_path / "made"), "--from", str(source / "robot.xml")])
    assert "not an empty directory" in str(again.exception)


@pytest.mark.parametrize("name", ['a \\ "b"', "ö\t", "]x", "a=b # c"])
def test_names_of_any_kind_reach_the_robot_file(tmp_path: Path, name: str) -> None:
    quoted = name.replace("&", "&amp;").replace('"', "&quot;").replace("\t", "&#9;")
    text = robot(sections=MOTOR).replace('"crank"', f'"{quoted}"').replace('"pin"', f'"{quoted}"')
    found = proposed(tmp_path, text)
    file = tmp_path / "robot.toml"
    file.write_text(robot_text(found, "c"), encoding="utf-8")
    setup = read_robot_file(file).setup
    assert setup == found.setup
    assert setup.actuated == (name,)


def test_a_folder_that_is_not_empty_is_left_alone(tmp_path: Path) -> None:
    found = proposed(tmp_path, robot(sections=MOTOR))
    with pytest.raises(WorkbenchError, match="not an empty directory"):
        write_folder(found, tmp_path)


def test_model_check_lists_what_is_refused_and_ends_with_a_robot_file(tmp_path: Path) -> None:
    path = tmp_path / "model.xml"
    path.write_text(LIMITED)
    said = CliRunner().invoke(app, ["model", "check", str(path)])
    assert said.exit_code == 0, said.output
    assert "mobility by rank       1 = 3 joint freedoms - rank 2 of 3" in said.output
    file = tmp_path / "robot.toml"
    file.write_text(said.output[said.output.index("format = 1") :])
    assert read_robot_file(file).setup == propose(path).setup
    assert "workbench new DIR --from" in " ".join(said.output.split())
    unnamed = CliRunner().invoke(app, ["model", "check", str(path), "--actuated", "piston,elbow", "--json"])
    assert '"elbow"' in unnamed.output


def test_a_refusal_names_its_line(tmp_path: Path) -> None:
    """Two things that nothing covers, on two lines, in one message."""
    text = robot(
        bodies='\n<body name="p" pos="0 2 0">\n<freejoint/><geom size="0.1"/></body>\n<body name="q" pos="0 3 0">\n'
        '<freejoint name="f"/><geom size="0.1"/></body>'
    )
    path = tmp_path / "model.xml"
    path.write_text(text)
    with pytest.raises(WorkbenchError) as caught:
        MujocoReference(path, setup=Setup(("crank",), "pin"))
    line = 1 + next(i for i, row in enumerate(text.split("\n")) if "<freejoint/>" in row)
    assert f"line {line}: " in str(caught.value)
    assert len(caught.value.facts["refusals"]) == 2
    assert "\n" not in str(caught.value)


def test_loops_are_closed_from_the_pose_that_is_asked_for() -> None:
    """Not from where the last try has ended."""
    model = mujoco.MjModel.from_xml_string(FOURBAR)
    data, still = mujoco.MjData(model), np.zeros(model.nv, dtype=np.bool_)
    still[0] = True
    near = np.array([1.0, -0.5, -1.5])
    up, _, open_by = _descended(model, data, near, still)
    assert open_by < 1e-9
    other, _, also = _descended(model, data, np.array([1.0, -3.0, 1.0]), still)
    assert also < 1e-9
    assert np.abs(other - up).max() > 0.3  # the other way to assemble it
    again, _, _ = _descended(model, data, near, still)
    assert np.array_equal(again, up)
