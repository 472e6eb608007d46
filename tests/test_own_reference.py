"""The reference on mechanisms that the workbench has never seen: redundant actuation, loose freedoms, the set-up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from own_mechanisms import FOURBAR, PARALLELOGRAM
from workbench.campaign.robot_spec import RobotKeys
from workbench.capabilities.load import robot_with
from workbench.errors import ModelError, MotionError
from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference
from workbench.reference.power import power_balance

GUESS = (("crank", 1.0), ("elbow", -0.5), ("wrist", -1.5))


def reference(directory: Path, text: str, actuated: tuple[str, ...], **keys: object) -> MujocoReference:
    path = directory / "model.xml"
    path.write_text(text)
    return MujocoReference(path, setup=Setup(actuated, "coupler", **keys))  # type: ignore[arg-type]


@pytest.fixture
def single(tmp_path: Path) -> MujocoReference:
    return reference(tmp_path, FOURBAR, ("crank",), initial=GUESS)


def whole_turn(single: MujocoReference):  # type: ignore[no-untyped-def]
    q = np.linspace(0.0, 6.0, 9)[:, None]
    return single.inverse_dynamics(q, np.full_like(q, 3.0), np.ones_like(q))


def test_the_file_need_name_nothing(single: MujocoReference) -> None:
    found = whole_turn(single)
    assert single.joint_names == ("crank",)
    assert single.mobility().mobility == 1
    assert found.closure_residual.max() < 1e-13
    assert found.acceleration_residual.max() < 1e-12


@pytest.mark.parametrize("rate", [1e150, 1e200, 1e308])
def test_rates_beyond_all_arithmetic_are_refused(single: MujocoReference, rate: float) -> None:
    """Loops that close at no speed that a number can hold: an error, never an infinite torque or NaN."""
    with pytest.raises(MotionError, match=r"^sample 1, joint \w+: "):
        single.inverse_dynamics([[0.5], [0.5]], [[1.0], [rate]], [[0.0], [0.0]])


def test_torques_of_excess_actuators_have_least_norm_and_do_the_same_work(
    tmp_path: Path, single: MujocoReference
) -> None:
    one = whole_turn(single)
    two = reference(tmp_path, FOURBAR, ("crank", "wrist"), initial=GUESS)
    assert two.excess_actuators == 1
    q, qd, qdd = one.qpos[:, [0, 2]], one.qvel[:, [0, 2]], one.qacc[:, [0, 2]]
    found = two.inverse_dynamics(q, qd, qdd)
    per_crank = qd / 3.0
    assert np.abs((found.tau * per_crank).sum(axis=1) - one.tau[:, 0]).max() < 1e-13
    least = per_crank * (one.tau[:, 0] / (per_crank**2).sum(axis=1))[:, None]
    assert np.abs(found.tau - least).max() < 1e-13
    # torques of the crank alone do the same work too, and are not the least
    alone = np.column_stack([one.tau[:, 0], np.zeros(len(q))])
    assert np.abs(found.tau - alone).max() > 0.1
    balance = power_balance(two, q, qd, qdd, "distributed", np.zeros((len(q), 3)))
    assert balance.relative < 1e-9


def test_dry_friction_of_each_excess_actuator_is_its_own(tmp_path: Path, single: MujocoReference) -> None:
    crank, wrist, elbow = 0.7, 0.4, 0.3

    def rubbing(**joints: float) -> MujocoReference:
        text = FOURBAR
        for name, loss in joints.items():
            text = text.replace(f'<joint name="{name}"', f'<joint name="{name}" frictionloss="{loss}"')
        return reference(tmp_path, text, ("crank", "wrist"), initial=GUESS)

    one = whole_turn(single)
    motion = one.qpos[:, [0, 2]], one.qvel[:, [0, 2]], one.qacc[:, [0, 2]]
    qd = motion[1]
    ways = np.where(np.abs(qd) > 1e-9, np.sign(qd), 0.0)
    assert {-1.0, 1.0} <= set(ways[:, 1]), "the wrist turns back on the way"
    smooth = rubbing().inverse_dynamics(*motion).tau
    rough = rubbing(crank=crank, wrist=wrist)
    added = rough.inverse_dynamics(*motion).tau - smooth
    assert np.abs(added - ways * [crank, wrist]).max() < 1e-13
    assert power_balance(rough, *motion).relative < 1e-9
    # friction of a passive joint is work for both, shared like any other
    shared = rubbing(elbow=elbow).inverse_dynamics(*motion).tau - smooth
    work = elbow * np.abs(one.qvel[:, 1])
    assert np.abs((shared * qd).sum(axis=1) - work).max() < 1e-13
    assert np.abs(shared - qd * (work / (qd**2).sum(axis=1))[:, None]).max() < 1e-13


@pytest.mark.parametrize("which", [0, 1, 2])
def test_what_excess_actuators_cannot_do_together_is_refused(
    tmp_path: Path, single: MujocoReference, which: int
) -> None:
    one = whole_turn(single)
    two = reference(tmp_path, FOURBAR, ("crank", "wrist"), initial=GUESS)
    motion = [one.qpos[:, [0, 2]], one.qvel[:, [0, 2]], one.qacc[:, [0, 2]]]
    motion[which] = motion[which] + [0.0, 1e-3]
    with pytest.raises(MotionError, match="more actuators than freedoms"):
        two.inverse_dynamics(*motion)


def test_a_parallelogram_driven_at_both_cranks_shares_the_load_evenly(tmp_path: Path) -> None:
    both = reference(
        tmp_path, PARALLELOGRAM, ("left", "right"), initial=(("left", 1.0), ("right", 1.0), ("hinge", -1.0))
    )
    q = np.linspace(0.6, 1.4, 5)[:, None] * [1.0, 1.0]
    tau = both.inverse_dynamics(q, 0 * q, 0 * q).tau
    assert np.abs(tau[:, 0] - tau[:, 1]).max() < 1e-13
    # weight of two cranks at half their length and of the coupler at the whole, on both motors
    expected = 9.81 * 0.2 * np.cos(q[:, 0]) * (0.3 + 0.8) / 2
    assert np.abs(tau[:, 0] - expected).max() < 1e-12


@pytest.mark.parametrize("rate", [0.0, 2.0])
def test_a_parallelogram_laid_flat_is_refused_even_at_rest(tmp_path: Path, rate: float) -> None:
    """Flat, it may go on as an antiparallelogram: the loops close to rounding there, and determine nothing."""
    one = reference(tmp_path, PARALLELOGRAM, ("left",), initial=(("left", 1.0), ("right", 1.0), ("hinge", -1.0)))
    q = np.array([[0.5], [0.0]])
    for short in (0.5, 1e-3):  # a thousandth short of it all is well
        near = one.inverse_dynamics([[short]], [[rate]], [[0.0]])
        assert np.abs(near.qpos - [short, -short, short]).max() < 1e-12
    with pytest.raises(MotionError, match=r"^sample 1, joint (hinge|right): singular pose at left = 0;"):
        one.inverse_dynamics(q, np.full_like(q, rate), 0 * q)


ROD = '<geom type="capsule" fromto="0 0 0 .5 0 0" size=".01" mass=".5"/>'
RSSR = f"""<mujoco><compiler angle="radian"/><option><flag contact="disable"/></option><worldbody>
 <body name="crank"><joint name="crank"/><geom type="capsule" fromto="0 0 0 .1 0 0" size=".01" mass=".3"/>
  <body name="rod" pos=".1 0 0"><joint name="ball" type="ball"/>{ROD}<site name="far" pos=".5 0 0"/></body></body>
 <body pos=".6 0 -.3"><joint axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 .3" size=".01" mass=".4"/>
  <site name="coupler" pos="0 0 .3"/></body>
</worldbody><equality><connect site1="far" site2="coupler"/></equality></mujoco>"""
"""A spatial four-bar whose rod may spin about its own axis."""


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        ('<geom pos=".25 0 .2" size=".02" mass=".5"/>', "its mass centre lies 0.1 m off the line"),
        ('<geom type="box" pos=".25 0 0" size=".02 .02 .1" mass=".5"/>', "moments of inertia differ around the line"),
    ],
)
def test_a_rod_that_gravity_or_inertia_would_spin_is_refused(tmp_path: Path, extra: str, message: str) -> None:
    assert reference(tmp_path, RSSR, ("crank",)).mobility().idle_freedoms == 1
    with pytest.raises(ModelError, match=message):
        reference(tmp_path, RSSR.replace(ROD, ROD + extra), ("crank",))


@pytest.mark.parametrize(("attribute", "warned"), [("damping", True), ("armature", True), ("pos", False)])
def test_what_would_spin_a_rod_is_warned_of(tmp_path: Path, attribute: str, warned: bool) -> None:
    value = "0 0 0" if attribute == "pos" else "0.1"
    path = tmp_path / "model.xml"
    path.write_text(RSSR.replace('type="ball"', f'type="ball" {attribute}="{value}"'))
    keys = RobotKeys(model="model.xml", actuated=["crank"], platform_site="coupler")
    robot = robot_with(path, {}, keys.own_robot(path, path))
    warnings = robot.warnings(np.zeros(1), np.zeros((1, 1)))
    assert [text.split(":")[0] for text in warnings] == (["rod rod"] if warned else [])


def test_a_rod_closed_at_its_own_ball_joint_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="place the site at the rod's other end"):
        reference(tmp_path, RSSR.replace('name="far" pos=".5 0 0"', 'name="far"'), ("crank",))


REFUSED = {
    "unactuated freedom": (
        FOURBAR.replace('name="tip" pos="0.3 0 0"/>', 'name="off" pos="0.3 0 0"/>').replace(
            "</body>\n  </body>",
            '<body pos="0.3 0 0"><joint name="fifth" axis="0 1 0"/>'
            '<geom size=".1" mass="1"/><site name="tip" pos="0.2 0 0"/></body></body>\n  </body>',
            1,
        ),
        Setup(("crank",), "coupler", initial=(*GUESS, ("fifth", 1.0))),
        r'1 freedom\(s\) that no actuator holds: with all of crank at rest, joint "\w+" by',
    ),
    "two branches": (
        FOURBAR.replace('pos="0.5 0 0"/>', 'pos="0.9 0 0"/>'),
        Setup(("crank",), "coupler"),
        "two assembly branches meet",
    ),
    "cannot close": (FOURBAR.replace('pos="0.5 0 0"/>', 'pos="2.5 0 0"/>'), Setup(("crank",), "coupler"), "open by"),
    "loops switched off": (
        FOURBAR.replace("<flag ", '<flag equality="disable" '),
        Setup(("crank",), "coupler", initial=GUESS),
        "<flag equality> is disabled",
    ),
    "no freedom": (
        FOURBAR.replace("</equality>", '<joint joint1="elbow" joint2="crank"/></equality>'),
        Setup(("crank",), "coupler", initial=GUESS),
        "the loops leave no freedom, so that crank cannot move",
    ),
    "free bodies": (
        FOURBAR.replace("</worldbody>", '<body><freejoint name="loose"/><geom size=".1"/></body></worldbody>'),
        Setup(("crank",), "coupler", initial=GUESS),
        'joint "loose" is free',
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_not_covered_is_refused(tmp_path: Path, name: str) -> None:
    text, setup, message = REFUSED[name]
    assert text != FOURBAR
    (tmp_path / "model.xml").write_text(text)
    with pytest.raises(ModelError, match=message):
        MujocoReference(tmp_path / "model.xml", setup=setup)


def test_a_loose_body_can_be_ignored(tmp_path: Path, single: MujocoReference) -> None:
    expected = whole_turn(single).tau
    found = reference(tmp_path, REFUSED["free bodies"][0], ("crank",), initial=GUESS, ignore=("free bodies",))
    assert np.abs(whole_turn(found).tau - expected).max() < 1e-12


LEFT_OUT = {
    "limits": FOURBAR.replace('name="elbow"', 'name="elbow" range="-3 3"'),
    "contacts": FOURBAR.replace('<option><flag contact="disable"/></option>', ""),
}


@pytest.mark.parametrize("ignore", [(), ("limits", "contacts")])
@pytest.mark.parametrize("what", LEFT_OUT)
def test_limits_and_contacts_are_left_out(
    tmp_path: Path, single: MujocoReference, what: str, ignore: tuple[str, ...]
) -> None:
    """Torques are the same; what a motion meets is `workbench.reference.crossings`'s business."""
    assert LEFT_OUT[what] != FOURBAR
    expected = whole_turn(single).tau
    found = reference(tmp_path, LEFT_OUT[what], ("crank",), initial=GUESS, ignore=ignore)
    assert np.abs(whole_turn(found).tau - expected).max() < 1e-12
