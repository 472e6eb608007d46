"""A URDF with a table of its loops becomes a robot folder that runs, and is the robot that the URDF says."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from typer.testing import CliRunner

from urdf_pinocchio import pinocchio_torques
from workbench.capabilities.load import load_robot
from workbench.cli import app
from workbench.errors import ModelError
from workbench.mjcf.loop_table import Loop, LoopTable, read_loops
from workbench.mjcf.urdf import import_urdf
from workbench.mjcf.urdf_writer import same_robot

INERTIA = '<inertia ixx="{0}" iyy="{1}" izz="{2}" ixy="1e-5" ixz="-2e-5" iyz="3e-5"/>'


def link(name: str, mass: float = 0.0, centre: str = "0 0 0") -> str:
    if not mass:
        return f'<link name="{name}"/>'
    inertia = INERTIA.format(1e-3 * mass, 4e-3 * mass, 4.4e-3 * mass)
    inside = f'<origin xyz="{centre}" rpy="0.1 0.2 -0.3"/><mass value="{mass}"/>{inertia}'
    shape = '<visual><geometry><sphere radius="1"/></geometry></visual>'
    return f'<link name="{name}"><inertial>{inside}</inertial>{shape}</link>'


def joint(name: str, kind: str, parent: str, child: str, xyz: str, rpy: str = "0 0 0", more: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 -1 0"/>{more}</joint>'
    )


LIMIT = '<limit lower="-2" upper="2" effort="100" velocity="10"/>'
FRICTION = '<dynamics damping="0.3" friction="0.0"/>'

FOURBAR = "".join(
    [
        '<robot name="fourbar">', link("base"), link("crank", 0.4, "0.1 0.01 0"), link("coupler", 0.7, "0.2 0 0.02"),
        link("rocker", 0.5, "0.15 0 0"), link("tip"), link("ground"),
        joint("q", "continuous", "base", "crank", "0 0 0"),
        joint("elbow", "revolute", "crank", "coupler", "0.2 0 0", "0 -0.86 0", LIMIT),
        joint("hang", "continuous", "base", "rocker", "0.5 0 0", "0 -1.57 0"),
        joint("tip_frame", "fixed", "coupler", "tip", "0.5 0 0"),
        joint("ground_frame", "fixed", "rocker", "ground", "0.35 0 0"),
        '<transmission name="t"/>', "</robot>",
    ]
)  # fmt: skip

LOOPS = 'closed_loop = [["tip", "ground"]]\ntype = ["3d"]\nname_mot = ["q"]\n'


def folder(tmp_path: Path, urdf: str, loops: str, *more: str) -> tuple[Path, str]:
    (tmp_path / "robot.urdf").write_text(urdf, encoding="utf-8")
    (tmp_path / "loops.toml").write_text(loops, encoding="utf-8")
    arguments = ["new", str(tmp_path / "made"), "--from", str(tmp_path / "robot.urdf")]
    done = CliRunner().invoke(app, [*arguments, "--loops", str(tmp_path / "loops.toml"), *more], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return tmp_path / "made", done.output


@pytest.mark.parametrize("kind", ["3d", "6d", "freed"])
def test_an_imported_robot_runs_and_agrees_with_pinocchio(kind: str, tmp_path: Path) -> None:
    loops, urdf = LOOPS, FOURBAR
    if kind == "6d":  # frames that coincide need a hinge of their own
        pin_link = joint("wrist", "continuous", "coupler", "end", "0.5 0 0") + link("end", 0.1, "0.01 0 0")
        urdf = urdf.replace(joint("tip_frame", "fixed", "coupler", "tip", "0.5 0 0"), pin_link).replace(
            link("tip"), "", 1
        )
        loops = LOOPS.replace("tip", "end").replace("3d", "6d")
    if kind == "freed":
        loops = LOOPS.replace('type = ["3d"]', 'freed = [["ry"]]')
    made, output = folder(tmp_path, urdf, loops)
    assert "not kept: 3 shapes" in output.replace("4 shapes", "3 shapes")
    assert "1 transmissions" in output
    robot = load_robot(made)
    t = np.linspace(0.0, 1.0, 25)[:, None]
    home = robot.home
    q, qd, qdd = home + 0.1 * np.sin(4.0 * t), 0.4 * np.cos(4.0 * t), -1.6 * np.sin(4.0 * t)
    found = robot.reference.inverse_dynamics(q, qd, qdd, along=t[:, 0])
    model = robot.reference.compiled()
    places = {model.joint(j).name: found.qpos[:, model.jnt_qposadr[j]] for j in range(model.njnt)}
    pairs = [("end" if kind == "6d" else "tip", "ground", "6d" if kind == "6d" else "3d")]
    tau, gap = pinocchio_torques(tmp_path / "robot.urdf", pairs, ["q"], places, qd, qdd)
    assert gap < 1e-11
    assert np.abs(tau - found.tau).max() < 1e-9 * np.abs(tau).max()
    # twin: another mass in the URDF is another robot
    (tmp_path / "other.urdf").write_text(urdf.replace('mass value="0.7"', 'mass value="0.71"'), encoding="utf-8")
    tau, _ = pinocchio_torques(tmp_path / "other.urdf", pairs, ["q"], places, qd, qdd)
    assert np.abs(tau - found.tau).max() > 1e-3 * np.abs(tau).max()


def test_damping_and_limits_are_kept(tmp_path: Path) -> None:
    hang = joint("hang", "continuous", "base", "rocker", "0.5 0 0", "0 -1.57 0")
    urdf = FOURBAR.replace(hang, joint("hang", "revolute", "base", "rocker", "0.5 0 0", "0 -1.57 0", LIMIT + FRICTION))
    found = import_urdf(urdf, "robot.urdf", LoopTable((Loop("tip", "ground", ("rx", "ry", "rz")),), ("q",)))
    model = mujoco.MjModel.from_xml_string(found.text)
    assert model.dof_damping[model.joint("hang").dofadr[0]] == 0.3
    assert model.jnt_range[model.joint("hang").id].tolist() == [-2.0, 2.0]
    assert found.limited
    assert any("effort and speed of 2 joints" in line for line in found.lost)


@pytest.mark.parametrize(("kept", "said"), [("effort", True), ("velocity", True), ("", False)])
def test_a_limit_of_effort_or_speed_that_is_lost_is_said(kept: str, said: bool) -> None:
    left = {"effort": "100", "velocity": "10"}
    limit = LIMIT
    for name, value in left.items():
        if name != kept:
            limit = limit.replace(f' {name}="{value}"', "")
    found = import_urdf(FOURBAR.replace(LIMIT, limit), "robot.urdf", LoopTable())
    assert any("effort and speed of 1 joints" in line for line in found.lost) == said


def test_a_frame_may_be_named_by_its_joint() -> None:
    free = ("rx", "ry", "rz")
    by_link, by_joint = (
        import_urdf(FOURBAR, "robot.urdf", LoopTable((Loop(*names, free),), ("q",))).text
        for names in (("tip", "ground"), ("tip_frame", "ground_frame"))
    )
    assert by_joint == by_link


def test_a_mimic_becomes_a_joint_equality() -> None:
    more = '<mimic joint="q" multiplier="-0.5" offset="0.1"/>'
    urdf = FOURBAR.replace(
        "</robot>", link("gear", 0.2) + joint("geared", "continuous", "base", "gear", "0 0 1", more=more)
    )
    found = import_urdf(urdf + "</robot>", "robot.urdf", LoopTable())
    model = mujoco.MjModel.from_xml_string(found.text)
    assert model.neq == 1
    assert model.eq_data[0, :2].tolist() == [0.1, -0.5]


def test_links_without_mass_go_into_the_link_behind_them() -> None:
    """A universal joint as collections write it: two hinges with an empty link in between."""
    elbow = joint("elbow", "revolute", "crank", "coupler", "0.2 0 0", "0 -0.86 0", LIMIT)
    cross = link("cross") + joint("one", "continuous", "crank", "cross", "0.2 0 0", "0.3 0 0.2")
    two = joint("elbow", "revolute", "cross", "coupler", "0.01 0.02 0", "0 0.4 0", more=LIMIT)
    found = import_urdf(FOURBAR.replace(elbow, cross + two), "robot.urdf", LoopTable())
    model = mujoco.MjModel.from_xml_string(found.text)
    assert [model.joint(j).name for j in range(model.njnt)] == ["q", "one", "elbow", "hang"]
    assert model.body("coupler").jntnum[0] == 2
    # what is welded on gives it a mass, and a body of its own
    heavy = cross + link("plate", 0.1) + joint("weld", "fixed", "cross", "plate", "0 0 0")
    other = mujoco.MjModel.from_xml_string(
        import_urdf(FOURBAR.replace(elbow, heavy + two), "robot.urdf", LoopTable()).text
    )
    assert (other.body("cross").jntnum[0], other.body("coupler").jntnum[0]) == (1, 1)
    assert other.body_subtreemass[0] == pytest.approx(model.body_subtreemass[0] + 0.1)
    with pytest.raises(ModelError, match='link "cross" moves and has no mass'):
        import_urdf(FOURBAR.replace(elbow, cross + two), "robot.urdf", LoopTable((Loop("cross", "ground", ()),), ()))


def test_the_round_trip_check_can_fail() -> None:
    found = import_urdf(FOURBAR, "robot.urdf", LoopTable())
    one = mujoco.MjModel.from_xml_string(found.text)
    same_robot(one, one, frozenset(), "robot.urdf")
    for what, old, new in (
        ("mass of", 'mass="0.7"', 'mass="0.7000001"'),
        ("mass centre of", 'pos="0.5 0.0 0.0"', 'pos="0.50000001 0.0 0.0"'),
        ("axis of", 'axis="0.0 -1.0 0.0"', 'axis="0.0 -1.0 0.00000001"'),
    ):
        assert old in found.text
        other = mujoco.MjModel.from_xml_string(found.text.replace(old, new, 1))
        with pytest.raises(ModelError, match=f"{what} "):
            same_robot(one, other, frozenset(), "robot.urdf")


@pytest.mark.parametrize(
    ("urdf", "said"),
    [
        ("<mujoco/>", "root is <mujoco>; a URDF's is <robot>"),
        ("<robot", "line 1, column 0: no XML"),
        ('<!DOCTYPE x [<!ENTITY a "b">]><robot/>', "a document type with entities"),
        (FOURBAR.replace('mass value="0.7"', 'mass value="-1"'), "MuJoCo does not compile it"),
    ],
)
def test_what_is_no_urdf_is_refused_in_one_line(urdf: str, said: str) -> None:
    with pytest.raises(ModelError) as error:
        import_urdf(urdf, "robot.urdf", LoopTable())
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_tables_of_loops_are_read_in_both_forms_and_checked(tmp_path: Path) -> None:
    toml, yaml = tmp_path / "l.toml", tmp_path / "l.yaml"
    toml.write_text(LOOPS, encoding="utf-8")
    yaml.write_text("closed_loop: [['tip', 'ground']]\ntype: ['3D']\nname_mot: ['q']\n", encoding="utf-8")
    assert read_loops(toml) == read_loops(yaml)
    assert read_loops(toml).loops[0].freed == ("rx", "ry", "rz")
    for text, said in (
        ("closed_loop: [[a]]", "closed_loop.0"),
        ("closed_loop: [[a, b]]\ntype: ['3d', '6d']", "type has 2 entries, closed_loop 1"),
        ("closed_loop: [[a, b]]\nfreed: [[rx, ry]]", "rx and ry freed"),
        ("closed_loop: [[a, b]]\nkinds: []", "kinds"),
        ("closed_loop: [", "l.yaml"),
        ("!!python/object/apply:os.system ['true']", "could not determine a constructor"),
    ):
        yaml.write_text(text, encoding="utf-8")
        with pytest.raises(ModelError) as error:
            read_loops(yaml)
        assert said in str(error.value)
        assert "\n" not in str(error.value)
    with pytest.raises(ModelError, match='no frame "tips"'):
        import_urdf(FOURBAR, "robot.urdf", LoopTable((Loop("tips", "ground", ()),)))
