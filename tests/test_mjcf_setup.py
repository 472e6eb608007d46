"""A file as it lies becomes the model that is computed with: the user's robot, and nothing else changed."""

from __future__ import annotations

import copy
from pathlib import Path

import mujoco
import numpy as np
import pytest

from nullspace_oracle import NullSpaceOracle
from workbench.errors import ModelError
from workbench.mjcf.prepared import Prepared, prepare
from workbench.mjcf.same_robot import BODIES, EQUALITIES, GEOMS, JOINTS, SITES, TENDONS, check_same_robot
from workbench.mjcf.same_robot import PLAIN as PLAIN_ACTUATOR
from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference

ROBOT = """<mujoco>
<compiler angle="radian"/><option gravity="0 0 -9.81"/>
{defaults}
<worldbody>
 <body name="crank"><joint name="crank" axis="0 -1 0"{crank}/>
  <geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.012" mass="0.5"/>
  <body name="rod" pos="0.1 0 0"><joint name="elbow" axis="0 -1 0"/>
   <geom type="capsule" fromto="0 0 0 0.25 0 0" size="0.008" mass="0.4"/><site name="tip" pos="0.25 0 0"/></body></body>
 <body name="piston" pos="0.35 0 0"><joint name="piston" type="slide" axis="1 0 0"/>
  <geom type="box" size="0.03 0.02 0.02" mass="1.2"/><site name="pin"/></body>
 {bodies}
</worldbody>
<equality>{first}<connect name="wrist" site1="tip" site2="pin"/>{last}</equality>
{sections}
</mujoco >
<!-- </mujoco> -->"""


def robot(**parts: str) -> str:
    empty = dict.fromkeys(("defaults", "crank", "bodies", "first", "last", "sections"), "")
    return ROBOT.format(**{**empty, **parts})


SETUP = Setup(("crank",), "pin")
Q, QD, QDD = (np.array([[0.4], [1.2], [2.5]]) * factor for factor in (1.0, 3.0, -7.0))


def torques(tmp_path: Path, text: str, setup: Setup = SETUP) -> np.ndarray:
    path = tmp_path / "model.xml"
    path.write_text(text)
    return MujocoReference(path, setup=setup).inverse_dynamics(Q, QD, QDD).tau


def oracle(text: str) -> np.ndarray:
    """MuJoCo's own constraint Jacobian of the user's file, actuators and all, in a dense null space."""
    found = NullSpaceOracle(text, ["crank"])
    qpos, tau, site = np.array(found.model.qpos0), [], str(found.model.site(0).name)
    for q, qd, qdd in zip(Q, QD, QDD, strict=True):
        qpos = found.close(qpos, q)
        tau.append(found.inverse_dynamics(qpos, qd, qdd, site, np.zeros(3)).tau)
    return np.array(tau)


PLAIN = robot()
GEAR = '<body name="gear" pos="0 0.3 0"><joint name="gear" axis="0 -1 0"/><geom size="0.05" mass="0.2"/></body>'
CUP = '<body name="cup" pos="1 0 0"><freejoint/><body name="handle"><geom size="0.02" mass="0.1"/></body></body>'
MOTOR = '<actuator><{} joint="crank" {}/></actuator>'
SAME_TORQUES = {
    "an end tag with a blank": robot(sections='<actuator><motor joint="crank"/></actuator ><sensor/>'),
    "a self-closed section before another": robot(sections="<sensor/><contact/><keyframe/>"),
    "a loose body before another": robot(bodies=CUP),
    "defaults of motors": robot(
        defaults='<default><motor ctrllimited="true" gear="50" armature="9"/></default>',
        sections=MOTOR.format("motor", 'ctrlrange="-1 1" armature="0"'),
    ),
    "defaults of servos": robot(
        defaults='<default><general gear="7" damping="3" forcelimited="true" forcerange="0 1"/></default>'
    ),
    "names with quotes and ampersands": robot().replace('"pin"', '"a &amp; &quot;b&quot;"'),
    "names with blanks": robot().replace('"pin"', '"the pin"'),
    "several sections": robot(sections="<actuator/><actuator><motor joint='crank'/></actuator><option/>"),
    "a tuple and a sensor of an actuator": robot(
        sections='<actuator><motor name="m" joint="crank"/></actuator><sensor><actuatorfrc actuator="m"/></sensor>'
        '<custom><tuple name="t"><element objtype="actuator" objname="m"/></tuple></custom>'
    ),
}
NAMES = {"names with quotes and ampersands": 'a & "b"', "names with blanks": "the pin"}


@pytest.mark.parametrize("name", SAME_TORQUES)
def test_what_is_no_part_of_the_mechanism_changes_nothing(tmp_path: Path, name: str) -> None:
    text = SAME_TORQUES[name]
    assert text != PLAIN
    setup = Setup(("crank",), NAMES.get(name, "pin"), ignore=("free bodies",) if "loose" in name else ())
    assert np.abs(torques(tmp_path, text, setup) - torques(tmp_path, PLAIN)).max() < 1e-12
    assert np.abs(torques(tmp_path, PLAIN) - oracle(PLAIN)).max() < 1e-9


COUNTED = {
    "rotor and damping at the actuator": robot(
        sections=MOTOR.format("motor", 'gear="20" armature="1e-4" damping="2e-4"')
    ),
    "rotor by the defaults": robot(
        defaults='<default><motor armature="1e-4" gear="30"/></default>', sections=MOTOR.format("motor", "")
    ),
    "two actuators of one joint": robot(
        sections='<actuator><motor joint="crank" armature="0.01"/><position joint="crank" kp="9" armature="0.02"/>'
        "</actuator>"
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", COUNTED)
def test_what_of_an_actuator_belongs_to_the_mechanism_counts(tmp_path: Path, name: str) -> None:
    found = torques(tmp_path, COUNTED[name])
    assert np.abs(found - oracle(COUNTED[name])).max() < 1e-9
    assert np.abs(found - torques(tmp_path, PLAIN)).max() > 1e-2  # twin: without it the torque is another


def test_an_equality_beside_an_ignored_one_stays(tmp_path: Path) -> None:
    """The kind of fault that began it: a self-closed tag taken out took the one behind it along."""
    tendon = '<tendon><fixed name="t"><joint joint="gear" coef="1"/></fixed></tendon>'
    ratio = '<joint joint1="gear" joint2="crank" polycoef="0 2 0 0 0"/>'
    expected = torques(tmp_path, robot(bodies=GEAR, last=ratio))
    setup = Setup(("crank",), "pin", ignore=("tendons",))
    for text in (
        robot(bodies=GEAR, first=f'<tendon tendon1="t"/>{ratio}', sections=tendon),
        robot(bodies=GEAR, last=f'{ratio}<tendon tendon1="t"/>', sections=tendon),
    ):
        assert np.abs(torques(tmp_path, text, setup) - expected).max() < 1e-12
    assert np.abs(expected - torques(tmp_path, PLAIN)).max() > 1e-3


FLOATING = {
    "free joint": '<freejoint name="root"/>',
    "slides and a ball": '<joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>'
    '<joint name="z" type="slide"/><joint name="turn" type="ball"/>',
}


def floated(joints: str) -> str:
    text = robot()
    start, end = text.index(" <body"), text.index("</worldbody>")
    return (
        f'{text[:start]}<body name="base"{{}}>{joints}<geom size="0.1" mass="5"/>{text[start:end]}</body>{text[end:]}'
    )


@pytest.mark.parametrize("name", FLOATING)
def test_a_floating_base_is_fixed_by_name(tmp_path: Path, name: str) -> None:
    text = floated(FLOATING[name]).format("")
    found = torques(tmp_path, text, Setup(("crank",), "pin", fix_base="base"))
    assert np.abs(found - torques(tmp_path, PLAIN)).max() < 1e-12
    with pytest.raises(ModelError, match="no body that floats; valid: base"):
        torques(tmp_path, text, Setup(("crank",), "pin", fix_base="crank"))


def test_a_body_may_be_the_platform(tmp_path: Path) -> None:
    """By its own key, or by the site's where no site has the name."""
    path = tmp_path / "model.xml"
    path.write_text(robot())
    results = [
        MujocoReference(path, setup=setup).inverse_dynamics(Q, QD, QDD)
        for setup in (SETUP, Setup(("crank",), platform_body="piston"), Setup(("crank",), "piston"))
    ]
    for result in results[1:]:
        assert np.array_equal(result.tau, results[0].tau)
        assert np.abs(result.x - results[0].x).max() < 1e-12


PLATFORM = """<mujoco><compiler angle="radian"/><worldbody>
 <body name="a"><joint name="a" type="slide" axis="1 0 0"/><geom size=".05" mass="1"/></body>
 <body name="plate" pos="0.3 0.1 0.2" quat="0.9 0.1 0.2 0.3">{}<geom type="box" size=".2 .1 .02" mass="2"/>
  <site name="out" pos=".1 0 0"/></body>
</worldbody><equality><weld body1="plate" body2="a"/></equality></mujoco>"""


def test_a_platform_on_a_free_joint_moves_as_it_would_on_slides_and_a_ball(tmp_path: Path) -> None:
    path = tmp_path / "model.xml"
    path.write_text(PLATFORM.format('<freejoint name="f"/>'))
    setup = Setup(("a",), "out")
    found = MujocoReference(path, setup=setup).inverse_dynamics(Q, QD, QDD)
    assert np.abs(found.tau - 3.0 * QDD).max() < 1e-9  # two bodies that move as one along a level rail
    assert np.abs(found.x[:, 0] - found.x[0, 0] - (Q - Q[0])[:, 0]).max() < 1e-9


SPOILED = {
    "gravity": lambda m: m.opt.gravity.__setitem__(2, -9.8),
    "a mass": lambda m: m.body_mass.__setitem__(2, 0.41),
    "an inertia": lambda m: m.body_inertia.__setitem__((2, 0), 0.1),
    "a site": lambda m: m.site_pos.__setitem__((0, 0), 0.26),
    "a joint's axis": lambda m: m.jnt_axis.__setitem__((1, 1), 1.0),
    "armature": lambda m: m.dof_armature.__setitem__(0, 0.0),
    "damping": lambda m: m.dof_damping.__setitem__(1, 0.1),
    "an equality switched off": lambda m: m.eq_active0.__setitem__(0, False),
    "an equality's ends": lambda m: m.eq_obj1id.__setitem__(0, 1),
    "a flag": lambda m: setattr(m.opt, "disableflags", m.opt.disableflags | mujoco.mjtDisableBit.mjDSBL_GRAVITY),
    "a motor's gear": lambda m: m.actuator_gear.__setitem__((0, 0), 2.0),
    "a motor's bias": lambda m: m.actuator_biasprm.__setitem__((0, 1), -1.0),
    "a geom": lambda m: m.geom_size.__setitem__((0, 0), 0.5),
}  # fmt: skip


@pytest.fixture(scope="module")
def ready() -> Prepared:
    return prepare(COUNTED["rotor and damping at the actuator"], "model.xml", None, SETUP)


@pytest.mark.parametrize("name", SPOILED)
def test_a_prepared_model_that_is_another_robot_is_refused(ready: Prepared, name: str) -> None:
    assert ready.preparation is not None
    check_same_robot(ready.user, ready.model, ready.preparation, "model.xml")
    other = copy.copy(ready.model)
    SPOILED[name](other)
    with pytest.raises(ModelError, match=r"model.xml: the model as it was prepared is not the file's") as caught:
        check_same_robot(ready.user, other, ready.preparation, "model.xml")
    assert "\n" not in str(caught.value)


@pytest.fixture(scope="module")
def with_tendon() -> Prepared:
    tendon = '<tendon><fixed name="t"><joint joint="crank" coef="1.3"/></fixed></tendon>'
    return prepare(robot(sections=tendon), "model.xml", None, SETUP)


COMPARED = (
    *BODIES, *GEOMS, *SITES, *JOINTS, "dof_frictionloss", "qpos0", "qpos_spring", *TENDONS, *EQUALITIES,
    *PLAIN_ACTUATOR,
)  # fmt: skip


@pytest.mark.parametrize("array", COMPARED)
def test_each_array_that_is_compared_is_refused_by_name_where_it_differs(with_tendon: Prepared, array: str) -> None:
    assert with_tendon.preparation is not None
    check_same_robot(with_tendon.user, with_tendon.model, with_tendon.preparation, "model.xml")
    for side in ("first", "last"):
        other = copy.copy(with_tendon.model)
        values = getattr(other, array)
        row = 0 if side == "first" else -1
        values.flat[row] = not values.flat[row] if values.dtype == bool else values.flat[row] + 1
        with pytest.raises(ModelError, match=rf"is not the file's: {array}( of \"\w+\")? is "):
            check_same_robot(with_tendon.user, other, with_tendon.preparation, "model.xml")


MASSES = {
    "settotalmass": (PLAIN.replace("<compiler ", '<compiler settotalmass="10" '), "79 %"),
    "boundmass": (PLAIN.replace("<compiler ", '<compiler boundmass="0.45" '), "rod by 11.1 %"),
    "inertiafromgeom": (
        PLAIN.replace("<compiler ", '<compiler inertiafromgeom="true" ').replace(
            '<joint name="elbow"', '<inertial pos="0 0 0" mass="4" diaginertia="1 1 1"/><joint name="elbow"'
        ),
        "rod by",
    ),
    "balanceinertia": (
        PLAIN.replace("<compiler ", '<compiler balanceinertia="true" ').replace(
            '<joint name="elbow"', '<inertial pos="0 0 0" mass="4" diaginertia="1 1 3"/><joint name="elbow"'
        ),
        "rod by 44.4 %",
    ),
}


@pytest.mark.parametrize("name", MASSES)
def test_a_compiler_that_changes_masses_is_said(name: str) -> None:
    text, amount = MASSES[name]
    notes = prepare(text, "model.xml", None, SETUP).notes
    assert [note.split()[1] for note in notes] == [f"{name}>"]
    assert amount in notes[0]


def test_a_compiler_that_changes_nothing_is_not_said() -> None:
    """Twin: an option that is used and has no effect."""
    text = PLAIN.replace("<compiler ", '<compiler boundmass="0.1" boundinertia="1e-9" ')
    assert prepare(text, "model.xml", None, SETUP).notes == ()
