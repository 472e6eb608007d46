"""Loop closure: every sample on the home branch in whatever order it comes, or an error that names it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

import workbench as wb
from robots import MODEL, FourBar, sine_sum, table_1, write_model
from workbench.capabilities.robot import Robot
from workbench.errors import ModelError, MotionError
from workbench.reference import ReferenceResult, continuation
from workbench.reference.closure import LoopCloser
from workbench.reference.sides import NO_SIDES

SAME = 1e-12
CONNECT = '<connect name="loop" site1="coupler_tip" site2="rocker_tip"/>'


def four_bar(folder: Path, branch: int = 1, **options: str) -> wb.MujocoReference:
    model = FourBar(branch)
    options = {"equality": CONNECT, "home": model.home()} | options
    return wb.MujocoReference(write_model(folder, model.bodies(), **options))


def at_rest(reference: wb.MujocoReference, q: np.ndarray) -> ReferenceResult:
    return reference.inverse_dynamics(q, np.zeros_like(q), np.zeros_like(q))


# --- order and branch -------------------------------------------------------------------------------------------------


def test_scattered_samples_close_as_a_trajectory_does() -> None:
    q, qd, qdd = sine_sum(np.random.default_rng(3), np.linspace(0.0, 2.0, 150), 0.9)
    order = np.random.default_rng(4).permutation(len(q))
    along = wb.MujocoReference(MODEL).inverse_dynamics(q, qd, qdd)
    scattered = wb.MujocoReference(MODEL).inverse_dynamics(q[order], qd[order], qdd[order])
    assert np.abs(scattered.x - along.x[order]).max() < SAME
    # the spin of a rod about its own axis depends on the way; all else does not
    model = mujoco.MjModel.from_xml_path(str(MODEL))
    fixed = [model.jnt_qposadr[j] for j in range(model.njnt) if model.jnt_type[j] != mujoco.mjtJoint.mjJNT_BALL]
    assert np.abs(scattered.qpos[:, fixed] - along.qpos[order][:, fixed]).max() < SAME
    assert np.abs(scattered.tau - along.tau[order]).max() < SAME * np.abs(along.tau).max()
    assert np.abs(scattered.tau - along.tau).max() > 1e-3 * np.abs(along.tau).max()


def test_single_samples_far_from_home_keep_the_branch_of_the_closed_form() -> None:
    mech, reference = table_1(), wb.MujocoReference(MODEL)
    rng = np.random.default_rng(7)
    q = np.array([0.0, 0.8, 0.8]) + rng.uniform(-1, 1, (400, 3)) * [0.2, 0.7, 0.7]
    inside = [i for i in range(len(q)) if _measures(mech, q[i : i + 1]) > 0.15]
    assert len(inside) > 150
    res = at_rest(reference, q[inside])
    assert np.abs(res.x - mech.forward_kinematics(q[inside])).max() < SAME * 100
    assert res.closure_residual.max() <= 1e-13
    for i in inside[:20]:
        assert np.abs(at_rest(reference, q[i : i + 1]).x - mech.forward_kinematics(q[i : i + 1])).max() < SAME * 100


def _measures(mech: Robot, q: np.ndarray) -> float:
    try:
        return float(min(np.abs(v).min() for v in mech.singularity_measures(q).values()))
    except MotionError:
        return 0.0


@pytest.mark.parametrize("branch", [1, -1])
@pytest.mark.parametrize("scattered", [False, True])
def test_both_assembly_branches_of_a_four_bar(tmp_path: Path, branch: int, scattered: bool) -> None:
    q = np.linspace(-3.0, 3.0, 200)  # nearly a full turn of the crank
    if scattered:
        q = np.random.default_rng(1).permutation(q)
    res = at_rest(four_bar(tmp_path, branch), q[:, None])
    poses = FourBar(branch).poses(q)
    assert np.abs(res.x[:, [0, 2]] - poses[:, 3, :2]).max() < SAME
    assert np.abs(res.x[:, 1]).max() < SAME
    other = FourBar(-branch).poses(q)
    assert np.abs(res.x[:, [0, 2]] - other[:, 3, :2]).min(axis=0).max() > 1e-3


def test_one_sample_asked_for_alone_is_where_it_is_among_others(tmp_path: Path) -> None:
    q = np.linspace(-3.0, 3.0, 61)[:, None]
    together = at_rest(four_bar(tmp_path), q)
    fresh = four_bar(tmp_path)
    for i in (0, 17, 60):
        assert np.abs(at_rest(fresh, q[i : i + 1]).qpos - together.qpos[i]).max() < SAME


def by_machine_code(made: wb.MujocoReference, q: np.ndarray) -> np.ndarray:
    """Where the coupler's end is at one sample, x and z."""
    found: np.ndarray = at_rest(made, q).x[0, [0, 2]]
    return found


def by_the_slower_way(made: wb.MujocoReference, q: np.ndarray) -> np.ndarray:
    """The same where MuJoCo's positions close the loops, as they do where the package's own machine code does not."""
    engine, structure = made._closer.engine, made._closer.structure
    slow = LoopCloser(engine, structure, compiled=False)
    assert slow.mechanism is None
    data = mujoco.MjData(engine.model)
    data.qpos = slow.close(q).qpos[0]
    mujoco.mj_kinematics(engine.model, data)
    found: np.ndarray = data.site_xpos[structure.platform_site][[0, 2]]
    return found


@pytest.mark.parametrize("end", [by_machine_code, by_the_slower_way])
@pytest.mark.parametrize("guard", ["", "CORRECTION", "LONGEST_STEP"])
def test_branches_that_nearly_meet_are_told_apart(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    guard: str,
    end: Callable[[wb.MujocoReference, np.ndarray], np.ndarray],
) -> None:
    """A tenth of a millimetre parts the branches where all bars are in line; every sample is reached past that."""
    # the rule of test_sides.py alone would do it; these stand for branches that have a third between them
    monkeypatch.setattr(continuation, "side_table", lambda *_: NO_SIDES)
    if guard:
        monkeypatch.setattr(continuation, guard, np.inf)
    wrong = 0
    q = np.random.default_rng(1).uniform(-6.0, 6.0, 25)
    for branch in (1, -1):
        model = FourBar(branch)
        model.coupler, model.rocker = 0.2001, 0.2
        path = write_model(tmp_path, model.bodies(), CONNECT, home=model.home())
        expected = model.poses(q)[:, 3, :2]
        for i in range(len(q)):  # each alone, so that none is a stone to step on for another
            x = end(wb.MujocoReference(path), q[i : i + 1, None])
            wrong += bool(np.linalg.norm(x - expected[i]) > 1e-9)
    # the twin: without either guard a step ends on the other branch, closed to rounding
    assert wrong > 3 if guard else wrong == 0


# --- what cannot be closed --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("place", [0, 5, 30])
def test_a_sample_out_of_reach_is_named(tmp_path: Path, place: int) -> None:
    # a rocker that cannot follow: the crank stops where coupler and rocker are in line
    model = FourBar()
    model.rocker = 0.12
    path = write_model(tmp_path, model.bodies(), CONNECT, home=model.home(0.3))
    limit = np.arccos((0.3**2 + 0.1**2 - 0.37**2) / (2 * 0.3 * 0.1))
    q = np.random.default_rng(2).uniform(0.0, 0.97 * limit, (40, 1))
    at_rest(wb.MujocoReference(path), q)
    q[place] = 1.03 * limit
    with pytest.raises(MotionError, match=f"^sample {place}, joint q: the loops cannot be closed at q = ") as caught:
        at_rest(wb.MujocoReference(path), q)
    assert caught.value.facts["sample"] == place


def test_a_robot_sample_out_of_reach_is_named() -> None:
    q = np.tile([0.0, np.pi / 4, np.pi / 4], (30, 1))
    q[11, 0] = 0.31
    with pytest.raises(MotionError, match=r"^sample 11, joint q1: the loops cannot be closed"):
        at_rest(wb.MujocoReference(MODEL), q)


def test_loops_that_cannot_close_at_all_are_refused(tmp_path: Path) -> None:
    model = FourBar()
    home = model.home()
    # crank and rocker together do not bridge what ground and coupler leave open, whatever the crank's angle
    model.coupler = 0.9
    with pytest.raises(ModelError, match=r'cannot be closed from the home pose; equality "loop"'):
        wb.MujocoReference(write_model(tmp_path, model.bodies(), CONNECT, home=home))


def test_a_pose_where_the_actuator_loses_the_mechanism_is_refused(tmp_path: Path) -> None:
    model = FourBar()
    model.rocker = 0.12
    path = write_model(tmp_path, model.bodies(), CONNECT, home=model.home(0.3))
    limit = np.arccos((0.3**2 + 0.1**2 - 0.37**2) / (2 * 0.3 * 0.1))
    with pytest.raises(MotionError, match=r"^sample 1, joint"):
        at_rest(wb.MujocoReference(path), np.array([[0.3], [limit]]))


# --- freedoms ---------------------------------------------------------------------------------------------------------

PENDULUM = """<body name="upper"><joint name="q" axis="0 1 0"/>
  <inertial pos="0 0 -.3" mass="1" diaginertia=".01 .01 .001"/>
  <body name="lower" pos="0 0 -.6"><joint name="q_lower" axis="0 1 0"/>
    <inertial pos="0 0 -.2" mass=".7" diaginertia=".01 .01 .001"/><site name="P" pos="0 0 -.4"/></body></body>"""


def test_a_freedom_that_no_actuator_holds_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        ModelError,
        match=r'1 freedom\(s\) that no actuator holds: with all of q at rest, joint "q_lower" by 1 can still',
    ):
        wb.MujocoReference(write_model(tmp_path, PENDULUM))
    wb.MujocoReference(write_model(tmp_path, PENDULUM, motors=("q", "q_lower")))


def test_redundant_constraints_do_no_harm(tmp_path: Path) -> None:
    q = np.linspace(0.2, 1.5, 20)[:, None]
    once = four_bar(tmp_path)
    twice = four_bar(tmp_path, equality=CONNECT + CONNECT.replace('"loop"', '"again"'))
    assert (once.mobility().mobility, once.mobility().rank, once.mobility().redundant_rows) == (1, 2, 1)
    assert (twice.mobility().mobility, twice.mobility().rank, twice.mobility().redundant_rows) == (1, 2, 4)
    one, two = (r.inverse_dynamics(q, 1 + q, q) for r in (once, twice))
    assert np.abs(one.qpos - two.qpos).max() < SAME
    assert np.abs(one.tau - two.tau).max() < SAME * np.abs(one.tau).max()
    # least norm: the doubled joint carries half the force at each place
    assert np.abs(two.reactions["loop"] - two.reactions["again"]).max() < 1e-10
    assert np.abs(two.reactions["loop"] * 2 - one.reactions["loop"]).max() < 1e-10


def test_mobility_of_the_robot() -> None:
    mobility = wb.MujocoReference(MODEL).mobility()
    assert (mobility.mobility, mobility.rank, mobility.redundant_rows, mobility.idle_freedoms) == (3, 8, 1, 2)


# --- joint equalities -------------------------------------------------------------------------------------------------


def test_a_gear_follows_its_polynomial(tmp_path: Path) -> None:
    equality = '<joint joint1="q_lower" joint2="q" polycoef="0.1 -2 0.3 0.05 0.01"/>'
    q = np.linspace(-1.0, 1.0, 9)[:, None]
    res = wb.MujocoReference(write_model(tmp_path, PENDULUM, equality)).inverse_dynamics(q, 0 * q + 1.5, 0 * q - 0.7)
    y = q[:, 0]
    assert np.abs(res.qpos[:, 1] - np.polyval([0.01, 0.05, 0.3, -2, 0.1], y)).max() < SAME
    first, second = np.polyval([0.04, 0.15, 0.6, -2], y), np.polyval([0.12, 0.3, 0.6], y)
    assert np.abs(res.qvel[:, 1] - 1.5 * first).max() < SAME
    assert np.abs(res.qacc[:, 1] - (-0.7 * first + 1.5**2 * second)).max() < SAME
    assert np.abs(res.qacc[:, 1] - (-0.7 * first)).max() > 0.1


def test_a_joint_equality_alone_holds_the_joint_still(tmp_path: Path) -> None:
    reference = wb.MujocoReference(write_model(tmp_path, PENDULUM, '<joint joint1="q_lower" polycoef="0.4 0 0 0 0"/>'))
    q = np.linspace(-1.0, 1.0, 5)[:, None]
    res = reference.inverse_dynamics(q, 1 + q, q)
    assert np.abs(res.qpos[:, 1] - 0.4).max() < SAME
    assert np.abs(res.qvel[:, 1]).max() == 0.0


def test_a_gear_counts_from_the_joints_reference_positions_as_mujoco_does(tmp_path: Path) -> None:
    bodies = PENDULUM.replace('name="q" axis', 'name="q" ref="0.3" axis')
    bodies = bodies.replace('name="q_lower" axis', 'name="q_lower" ref="-0.4" axis')
    path = write_model(tmp_path, bodies, '<joint joint1="q_lower" joint2="q" polycoef="0.1 2 0.3 0 0"/>')
    q = np.linspace(-0.5, 0.9, 5)[:, None]
    res = at_rest(wb.MujocoReference(path), q)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for qpos in res.qpos:
        data.qpos = qpos
        mujoco.mj_forward(model, data)
        assert np.abs(data.efc_pos).max() < SAME
    assert np.abs(res.qpos[:, 1] + 0.4 - np.polyval([0.3, 2, 0.1], q[:, 0] - 0.3)).max() < SAME


# --- welds ------------------------------------------------------------------------------------------------------------


def welded(folder: Path, quat: str, other: str, model: FourBar | None = None) -> Path:
    """The four-bar with its last hinge on a stub at the rocker's tip, and the stub welded to the coupler."""
    model = model or FourBar()
    stub = f"""<body name="stub" pos="{model.rocker} 0 0"><joint name="q_stub" axis="0 -1 0"/>
      <inertial pos="0 0 0" mass="0.3" diaginertia="0.002 0.002 0.002"/><site name="stub" quat="{other}"/></body>"""
    bodies = model.bodies().replace('<site name="rocker_tip"', stub + '<site name="rocker_tip"')
    bodies = bodies.replace('<site name="coupler_tip"', f'<site name="coupler_tip" quat="{quat}"')
    phi, psi = model.angles(np.array([0.9]))
    home = f"{model.home()} {phi[0] - psi[0]}"
    return write_model(folder, bodies, '<weld name="loop" site1="coupler_tip" site2="stub"/>', home=home)


TILTED = "0.5 -0.3 0.7 0.2"


def test_a_weld_keeps_place_and_turn(tmp_path: Path) -> None:
    path = welded(tmp_path, TILTED, TILTED)
    q = np.random.default_rng(5).uniform(-3.0, 3.0, 50)
    res = wb.MujocoReference(path).inverse_dynamics(q[:, None], 1 + q[:, None], q[:, None])
    assert res.closure_residual.max() <= 1e-13
    assert res.velocity_residual.max() < SAME
    assert res.acceleration_residual.max() < SAME * 100
    phi, psi = FourBar().angles(q)
    stub = res.qpos[:, 3] - (phi - psi)
    assert np.abs(stub - 2 * np.pi * np.round(stub / (2 * np.pi))).max() < SAME
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for qpos in res.qpos:
        data.qpos = qpos
        mujoco.mj_kinematics(model, data)
        one, two = (data.site(name) for name in ("coupler_tip", "stub"))
        assert np.abs(one.xpos - two.xpos).max() < SAME
        assert np.abs(one.xmat - two.xmat).max() < SAME


def test_a_weld_between_frames_that_differ_turns_the_stub(tmp_path: Path) -> None:
    turn = 0.3  # about -y, the hinges' axis
    path = welded(tmp_path, "1 0 0 0", f"{np.cos(turn / 2)} 0 {-np.sin(turn / 2)} 0")
    q = np.array([[0.9], [0.5]])
    phi, psi = FourBar().angles(q[:, 0])
    res = at_rest(wb.MujocoReference(path), q)
    assert np.abs(res.qpos[:, 3] - (phi - psi - turn)).max() < SAME


def test_a_weld_that_would_need_a_turn_out_of_the_plane_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="cannot be closed from the home pose"):
        wb.MujocoReference(welded(tmp_path, "1 0 0 0", f"{np.cos(0.01)} {np.sin(0.01)} 0 0"))


# --- idle spin --------------------------------------------------------------------------------------------------------


def test_a_rod_between_two_ball_joints_does_not_spin() -> None:
    q, qd, qdd = sine_sum(np.random.default_rng(8), np.linspace(0.0, 1.0, 40), 0.9)
    res = wb.MujocoReference(MODEL).inverse_dynamics(q, qd, qdd)
    model = mujoco.MjModel.from_xml_path(str(MODEL))
    data = mujoco.MjData(model)
    velocity, acceleration = np.zeros((2, 6))
    across = 0.0
    for qpos, qvel, qacc in zip(res.qpos, res.qvel, res.qacc, strict=True):
        data.qpos, data.qvel = qpos, qvel
        mujoco.mj_forward(model, data)
        data.qacc = qacc
        mujoco.mj_rnePostConstraint(model, data)
        for side in ("left", "right"):
            body = data.body(f"rod_{side}")
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body.id, velocity, 1)
            assert abs(velocity[2]) < SAME * 100  # the rod's axis is its own z
            across = max(across, np.abs(velocity[:2]).max())
            # nor does it begin to
            mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_XBODY, body.id, acceleration, 1)
            assert abs(acceleration[2]) < SAME * 1000
    assert across > 1.0
    assert res.acceleration_residual.max() < 1e-10


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rates_that_overflow_into_no_number_are_refused(sign: float) -> None:
    """Infinite less infinite is no number, over which a maximum passes: the residual would be zero."""
    reference = wb.MujocoReference(MODEL.with_name("planar_4rprp.xml"))
    rates = np.full((1, 3), sign * 1e308)
    with pytest.raises(MotionError, match="singular pose"):
        reference.inverse_dynamics(reference.home[None, :], rates, np.zeros((1, 3)))
    assert np.isfinite(reference.inverse_dynamics(reference.home[None, :], rates / 1e306, np.zeros((1, 3))).tau).all()


@pytest.mark.parametrize("model", ["planar_4rprp.xml", "asym_2rss_ppap.xml"])
def test_squares_of_rates_that_overflow_are_refused(model: str) -> None:
    reference = wb.MujocoReference(MODEL.with_name(model))
    home, still = reference.home[None, :], np.zeros((1, 3))
    with pytest.raises(MotionError, match=r"^sample 0: rates so large that torques overflow "):
        reference.inverse_dynamics(home, still + 1e200, still)
    x = reference.inverse_dynamics(home, still, still).x
    with pytest.raises(MotionError, match=r"^sample 0: rates so large that accelerations overflow "):
        reference.joint_motion(x, still + 1e200, still, ("x", "y", "z"))
    assert np.isfinite(reference.inverse_dynamics(home, still + 1e100, still).tau).all()
