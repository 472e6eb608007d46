"""What vouches for the reference: power balance, forward replay, and what mj_inverse alone would say.

Every check has a twin that is spoiled on purpose and must be caught.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

import workbench as wb
from workbench.errors import ArrayError, MotionError
from workbench.reference import alike, power, replay
from workbench.reference import displaced as displaced_module
from workbench.reference.power import power_balance
from workbench.reference.raw_inverse import raw_mj_inverse

Sine = tuple[list[float], list[float], list[float]]

SIMULATION_1: Sine = ([0.0, np.pi / 4, np.pi / 4], [0.1, np.pi / 12, np.pi / 12], [2.0, 5.0, 5.0])
SIMULATION_2: Sine = (SIMULATION_1[0], SIMULATION_1[1], [10.0, 25.0, 35.0])
PLANAR: Sine = ([0.39, 0.38, 0.39], [0.025, -0.030, 0.020], [8.0, 6.0, 9.0])
FORCE = np.array([12.0, -8.0, 25.0])

PENDULUM = """
<mujoco>
  <compiler angle="radian"/>
  <option gravity="0 0 -9.81"><flag contact="disable"/></option>
  <custom>
    <text name="base_body" data="base"/><text name="platform_site" data="tip"/><text name="lumped_bodies" data="bar"/>
  </custom>
  <worldbody>
    <body name="base">
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <body name="bar">
        <joint name="q1" axis="0 1 0" damping="{damping}"/>
        <inertial pos="0 0 {height}" mass="2" diaginertia="0.03 0.03 0.001"/>
        <site name="tip" pos="0 0 0.4"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="q1" joint="q1"/></actuator>
</mujoco>
"""
"""An open chain whose every quantity has a formula: mass 2 kg, transverse inertia 0.03 kg m^2 about the mass centre."""


def at(sine: Sine) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]:
    offset, amplitude, rate = (np.array(row) for row in sine)

    def motion_at(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        angle = np.outer(t, rate)
        return (
            offset + amplitude * np.sin(angle),
            amplitude * rate * np.cos(angle),
            -amplitude * rate**2 * np.sin(angle),
        )

    return motion_at


@pytest.fixture(scope="module")
def asym(repository: Path) -> wb.MujocoReference:
    return wb.MujocoReference(repository / "models" / "asym_2rss_ppap.xml")


@pytest.fixture(scope="module")
def planar(repository: Path) -> wb.MujocoReference:
    return wb.MujocoReference(repository / "models" / "planar_4rprp.xml")


@pytest.fixture(scope="module")
def closed_form(repository: Path) -> wb.Robot:
    return wb.load_mechanism(repository / "models" / "asym_2rss_ppap.xml")


def pendulum(tmp_path: Path, height: float = -0.2, damping: float = 0.0) -> wb.MujocoReference:
    file = tmp_path / "pendulum.xml"
    file.write_text(PENDULUM.format(height=height, damping=damping))
    return wb.MujocoReference(file)


# power balance


@pytest.mark.parametrize("mass_model", ["distributed", "lumped"])
@pytest.mark.parametrize(
    ("robot", "sine"), [("asym", SIMULATION_1), ("asym", SIMULATION_2), ("planar", PLANAR)], ids=["1", "2", "planar"]
)
def test_power_is_balanced_to_rounding(request: pytest.FixtureRequest, robot: str, sine: Sine, mass_model: str) -> None:
    reference = request.getfixturevalue(robot)
    motion = at(sine)(np.linspace(0.1, 1.0, 40))
    balance = power_balance(reference, *motion, mass_model, FORCE)
    assert balance.relative < 1e-11
    assert balance.differentiation < 1e-11

    tau = reference.inverse_dynamics(*motion, mass_model, FORCE).tau
    for joint in range(3):
        spoiled = tau.copy()
        spoiled[:, joint] *= 1.01
        assert power_balance(reference, *motion, mass_model, FORCE, spoiled).relative > 1e-4, joint
    without_force = reference.inverse_dynamics(*motion, mass_model).tau
    assert power_balance(reference, *motion, mass_model, FORCE, without_force).relative > 1e-2
    other = {"distributed": "lumped", "lumped": "distributed"}[mass_model]
    if sine is SIMULATION_2:
        assert power_balance(reference, *motion, other, FORCE, tau).relative > 1e-2


def test_rate_of_energy_equals_the_formula_of_a_pendulum(tmp_path: Path) -> None:
    t = np.linspace(0.0, 2.0, 97)[:, None]
    q, qd, qdd = 0.3 + np.sin(3 * t), 3 * np.cos(3 * t), -9 * np.sin(3 * t)
    damping = 0.7
    balance = power_balance(pendulum(tmp_path, -0.2, damping), q, qd, qdd)
    inertia, weight = 0.03 + 2 * 0.2**2, 2 * 9.81 * 0.2
    expected = (inertia * qd * qdd + weight * np.sin(q) * qd)[:, 0]
    scale = np.abs(expected).max()
    assert np.abs(balance.storage - expected).max() < 1e-12 * scale
    np.testing.assert_allclose(balance.dissipation, damping * qd[:, 0] ** 2, rtol=1e-14)
    assert balance.relative < 1e-12
    wrong = (inertia * qd * qdd - weight * np.sin(q) * qd)[:, 0]
    assert np.abs(balance.storage - wrong).max() > 0.1 * scale


def test_damping_of_passive_and_ball_joints_is_dissipated(repository: Path, tmp_path: Path) -> None:
    text = (repository / "models" / "asym_2rss_ppap.xml").read_text()
    # without the name of a closed form, so that nothing but the reference judges the model
    text = text.replace('<text name="mechanism" data="asym_2rss_ppap"/>', "").replace(' damping="0"', "")
    model = tmp_path / "damped.xml"
    model.write_text(text.replace("<default>", '<default>\n    <joint damping="0.2"/>', 1))
    reference = wb.MujocoReference(model)
    assert np.all(reference.compiled().dof_damping == 0.2)
    motion = at(SIMULATION_2)(np.linspace(0.1, 1.0, 60))
    balance = power_balance(reference, *motion)
    assert balance.relative < 1e-11
    assert balance.dissipation.min() >= 0.0
    # the twin: not counting what is dissipated
    assert np.abs(balance.residual + balance.dissipation).max() > 1e-2 * balance.peak_power
    actuated = balance.dissipation - 0.2 * np.sum(motion[1][balance.samples] ** 2, axis=1)
    assert actuated.max() > 1e-2 * balance.peak_power, "passive joints dissipate too"


def test_power_balance_keeps_the_peaks_and_names_the_worst_sample(asym: wb.MujocoReference) -> None:
    motion = at(SIMULATION_1)(np.linspace(0.1, 5.0, 1961))
    tau = asym.inverse_dynamics(*motion).tau
    peak = int(np.argmax(np.abs(np.sum(tau * motion[1], axis=1))))
    tau[peak, 1] *= 1.5
    balance = power_balance(asym, *motion, tau=tau)
    assert peak in balance.samples
    assert balance.worst_sample == peak
    assert len(balance.samples) <= power.MOST_SAMPLES


def test_power_balance_at_rest_and_with_nan(asym: wb.MujocoReference) -> None:
    pose = np.array([SIMULATION_1[0]])
    still = np.zeros((1, 3))
    at_rest = power_balance(asym, pose, still, still)
    assert at_rest.peak_power == 0.0
    assert np.isnan(at_rest.relative), "a balance of nothing is no evidence of an uncertainty of zero"
    motion = at(SIMULATION_1)(np.linspace(0.1, 1.0, 20))
    balance = power_balance(asym, *motion, tau=np.full((20, 3), np.nan))
    assert not balance.relative <= 1.0
    with pytest.raises(ArrayError, match=r"tau: expected shape \(20, 3\), got \(19, 3\)"):
        power_balance(asym, *motion, tau=np.zeros((19, 3)))
    with pytest.raises(ArrayError, match="at least one sample"):
        power_balance(asym, *(np.zeros((0, 3)) for _ in range(3)))


def test_steps_are_shortened_at_the_edge_of_the_workspace(planar: wb.MujocoReference) -> None:
    # 10 mm short of where limbs 1 and 3 lie in the base plane and the loops open: a full step would leave the workspace
    height, middle = 0.01, 0.3
    limb = np.hypot(height, middle)
    q, qd, qdd = np.array([[limb, 0.31, limb]]), np.array([[-0.003, 0.1, -0.003]]), np.zeros((1, 3))
    qpos = planar.inverse_dynamics(q, qd, qdd).qpos
    scale = power.time_scale(qd, qdd)
    displaced = power.displaced_samples(planar, qpos, q, qd, qdd)
    with pytest.raises(MotionError):
        power._difference(displaced, np.array([0]), "distributed", power.FIRST_STEP * scale)
    assert power_balance(planar, q, qd, qdd).relative < 1e-6


def test_energy_is_that_of_the_reference_and_of_no_singular_pose(
    asym: wb.MujocoReference, monkeypatch: pytest.MonkeyPatch
) -> None:
    motion, some, step = at(SIMULATION_2)(np.linspace(0.1, 1.0, 40)), np.array([3, 4, 30]), 1e-3
    displaced = power.displaced_samples(asym, asym.inverse_dynamics(*motion).qpos, *motion)
    moved, speed = displaced.moved(some, step)
    for mass_model in ("distributed", "lumped"):
        whole = asym.inverse_dynamics(moved, speed, 0 * moved, mass_model, near=displaced.closed(some, step))
        assert np.array_equal(displaced.energy(some, step, mass_model), whole.energy.sum(axis=1))
    poses = displaced.closed(some, step)
    poses.rank[7] -= 1
    monkeypatch.setattr(displaced_module.Displaced, "closed", lambda *_: poses)
    with pytest.raises(MotionError, match="singular"):
        displaced.energy(some, step, "lumped")


def test_what_is_known_and_shared_changes_no_bit_of_a_balance(asym: wb.MujocoReference) -> None:
    t = np.linspace(0.1, 1.0, 260)  # of more samples than are looked at, each mass model has its own peaks
    motion = at(SIMULATION_2)(t)
    results = {name: asym.inverse_dynamics(*motion, name, along=t) for name in ("distributed", "lumped")}
    displaced = power.displaced_samples(asym, results["distributed"].qpos, *motion)
    kept = []
    for name, result in results.items():
        alone = power_balance(asym, *motion, name, along=t)
        shared = power_balance(asym, *motion, name, along=t, known=result, displaced=displaced)
        for field in dataclasses.fields(alone):
            one, other = getattr(alone, field.name), getattr(shared, field.name)
            assert np.array_equal(one, other), field.name
        kept.append(shared.samples.tolist())
    assert kept[0] != kept[1]
    # in another order, and in parts, poses are the same too
    some = np.array([3, 10, 11, 200])
    other = power.displaced_samples(asym, results["lumped"].qpos, *motion)
    other.closed(some[1:3], 1e-3)
    whole, fresh = other.closed(some, 1e-3), power.displaced_samples(asym, results["lumped"].qpos, *motion)
    for one, two in zip(whole.arrays, fresh.closed(some, 1e-3).arrays, strict=True):
        assert np.array_equal(one, two, equal_nan=True)


# forward replay


def torques_of(mechanism: wb.Robot, **factors: float) -> dict[str, replay.TorqueAt]:
    named: dict[str, replay.TorqueAt] = {
        name: lambda q, qd, qdd, name=name: mechanism.inverse_dynamics(q, qd, qdd, name)
        for name in ("distributed", "lumped")
    }
    for name, factor in factors.items():
        named[name] = lambda q, qd, qdd, factor=factor: factor * mechanism.inverse_dynamics(q, qd, qdd)
    return named


def test_replay_of_simulation_2(asym: wb.MujocoReference, closed_form: wb.Robot) -> None:
    found = replay.replay(asym, at(SIMULATION_2), torques_of(closed_form, off=1.01), 0.0, 1.0)
    assert found.limited_by == ""
    right, lumped = found.replays["distributed"], found.replays["lumped"]
    assert list(found.replays) == [replay.REFERENCE, "distributed", "lumped", "off"]
    np.testing.assert_allclose(right.steps, [1e-3, 5e-4, 2.5e-4])
    # the error on q2, step by step
    np.testing.assert_allclose(right.peak_error[:, 1], [0.024, 0.012, 0.006], rtol=0.03)
    assert right.verdict == "converges"
    assert right.order == pytest.approx(1.0, abs=0.1)
    np.testing.assert_allclose(lumped.peak_error[:, 1], 0.26, rtol=0.06)
    assert lumped.verdict == "stalls"
    assert lumped.worst_joint == "q2"
    assert lumped.text == "stalls at 0.26 rad on q2"
    assert found.replays[replay.REFERENCE].verdict == "converges"
    assert found.replays["off"].verdict == "stalls"


def test_the_same_torques_are_simulated_once(
    asym: wb.MujocoReference, closed_form: wb.Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    torques = torques_of(closed_form, again=1.0, off=1.0 + 1e-11)
    # apart at the finest step alone, and on one joint
    torques["late"] = lambda q, qd, qdd: closed_form.inverse_dynamics(q, qd, qdd) * [
        1.0, 1.0, 1.0 + 1e-11 * (len(q) == replay.HALVINGS[-1] * replay.COARSE_STEPS)
    ]  # fmt: skip
    torques["lumped again"] = torques["lumped"]
    shared = replay.replay(asym, at(SIMULATION_2), torques, 0.0, 1.0).replays
    assert {name: one.same_as for name, one in shared.items()} == {
        "reference": "", "distributed": "reference", "lumped": "", "again": "reference", "off": "", "late": "",
        "lumped again": "lumped",
    }  # fmt: skip
    assert np.array_equal(shared["again"].peak_error, shared["reference"].peak_error)
    # each by itself: not a digit of what a table shows is another
    monkeypatch.setattr(alike, "SAME", -1.0)
    alone = replay.replay(asym, at(SIMULATION_2), torques, 0.0, 1.0).replays
    for name, one in alone.items():
        assert one.same_as == ""
        assert (one.text, one.verdict) == (shared[name].text, shared[name].verdict)
        np.testing.assert_allclose(one.peak_error, shared[name].peak_error, rtol=1e-7)
        np.testing.assert_allclose(one.limit, shared[name].limit, atol=1e-7 * one.peak_error.max())
    assert not np.array_equal(alone["distributed"].peak_error, alone["reference"].peak_error)


def test_what_is_alike_is_so_on_each_joint_at_each_step_size() -> None:
    one = np.array([[1e3, 1e-3], [-2e3, 2e-3]])
    small, nothing, dead = one.copy(), one.copy(), 0.0 * one
    small[0, 1] += 1e-14  # rounding of the large joint, not of this one
    nothing[0, 0] = np.nan
    assert alike.first_alike([np.stack([one, one * (1 + 3e-16), small, nothing, nothing, dead, dead])]) == [
        0, 0, 2, 3, 4, 5, 5,
    ]  # fmt: skip
    assert alike.first_alike([np.stack([one, one]), np.stack([one, small])]) == [0, 1]


def test_replay_of_the_planar_robot_under_force(planar: wb.MujocoReference, repository: Path) -> None:
    mechanism = wb.load_mechanism(repository / "models" / "planar_4rprp.xml")
    force = np.array([60.0, 150.0, -40.0])
    torques: dict[str, replay.TorqueAt] = {
        "right": lambda q, qd, qdd: mechanism.inverse_dynamics(q, qd, qdd, external_force=force),
        "force the wrong way": lambda q, qd, qdd: mechanism.inverse_dynamics(q, qd, qdd, external_force=-force),
    }
    found = replay.replay(planar, at(PLANAR), torques, 0.0, 0.4, force)
    assert found.replays["right"].verdict == "converges"
    assert found.replays["right"].order == pytest.approx(1.0, abs=0.1)
    assert found.replays["force the wrong way"].verdict in ("stalls", "diverges")


def test_an_unstable_motion_is_replayed_only_as_long_as_it_says_something(tmp_path: Path) -> None:
    def upright(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        angle = 12.0 * t[:, None]
        return 0.05 * np.sin(angle), 0.6 * np.cos(angle), -7.2 * np.sin(angle)

    hanging = replay.replay(pendulum(tmp_path, -0.2), upright, {}, 0.0, 1.0)
    standing = replay.replay(pendulum(tmp_path, 0.2), upright, {}, 0.0, 1.0)
    assert hanging.limited_by == ""
    assert hanging.replays[replay.REFERENCE].verdict == "converges"
    assert standing.limited_by == "instability"
    assert standing.stop < 0.95
    assert "unstable" in standing.note
    assert standing.replays[replay.REFERENCE].verdict == "converges"


@pytest.mark.parametrize("threads", [1, 2])
def test_a_lost_replay_is_a_verdict_and_leaves_no_log(
    asym: wb.MujocoReference,
    threads: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(asym, "threads", threads)
    torques: dict[str, replay.TorqueAt] = {
        "nan": lambda q, qd, qdd: np.full_like(q, np.nan),
        "huge": lambda q, qd, qdd: np.full_like(q, 1e9),
        "fine": lambda q, qd, qdd: asym.inverse_dynamics(q, qd, qdd).tau,
    }
    found = replay.replay(asym, at(SIMULATION_1), torques, 0.0, 0.1)
    assert [found.replays[name].verdict for name in torques] == ["diverges", "diverges", "converges"]
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")
    with pytest.raises(ArrayError, match='candidate "flat": expected tau of shape'):
        replay.replay(asym, at(SIMULATION_1), {"flat": lambda q, qd, qdd: q[:, 0]}, 0.0, 0.1)
    with pytest.raises(MotionError, match="stop = 0 s"):
        replay.replay(asym, at(SIMULATION_1), {}, 0.0, 0.0)
    with pytest.raises(ArrayError, match="constant vector"):
        replay.replay(asym, at(SIMULATION_1), {}, 0.0, 0.1, np.zeros((5, 3)))


def test_threads_change_no_bit_of_the_evidence(asym: wb.MujocoReference, closed_form: wb.Robot) -> None:
    def gathered() -> tuple[np.ndarray, ...]:
        found = replay.replay(asym, at(SIMULATION_1), torques_of(closed_form), 0.0, 0.1)
        t = np.linspace(0.1, 1.0, 1500)
        balance = power_balance(asym, *at(SIMULATION_1)(t), along=t)
        return *(one.peak_error for one in found.replays.values()), balance.residual, balance.storage

    one = gathered()
    asym.threads = 2
    try:
        two = gathered()
    finally:
        asym.threads = 1
    assert all(np.array_equal(a, b) for a, b in zip(one, two, strict=True))


@pytest.mark.parametrize(
    ("left", "verdict"),
    [(0.0, "converges"), (0.002, "undecided"), (0.05, "stalls"), (1e3, "diverges"), (-0.002, "undecided")],
)
def test_verdict_from_the_errors_at_three_steps(left: float, verdict: str) -> None:
    """An error of 40 h + left, of either sign, on the second of two joints."""
    steps = np.array([1e-3, 5e-4, 2.5e-4])
    errors = np.zeros((3, 7, 2))
    errors[:, 3, 1] = -(40.0 * steps + left)
    judged = replay._judge(errors, steps, np.array([1.0, 2.0]), (("q1", "m"), ("q2", "rad")))
    assert judged.verdict == verdict
    assert judged.worst_joint == "q2"
    if verdict in ("stalls", "converges"):
        assert judged.limit == pytest.approx(left, abs=1e-15)


def test_a_motion_through_samples(asym: wb.MujocoReference) -> None:
    t = np.linspace(0.0, 1.0, 501)
    exact = at(SIMULATION_2)
    through = replay.motion_through(t, *exact(t))
    between = 0.5 * (t[1:] + t[:-1])
    for found, expected in zip(through(t), exact(t), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())
    for found, expected, accuracy in zip(through(between), exact(between), (1e-9, 1e-7, 1e-5), strict=True):
        np.testing.assert_allclose(found, expected, atol=accuracy * np.abs(expected).max())
    with pytest.raises(MotionError, match="allowed: 0 to 1 s"):
        through(np.array([0.5, 1.1]))
    with pytest.raises(ArrayError, match="equal lengths"):
        replay.motion_through(t[:-1], *exact(t))


# mj_inverse alone


@pytest.mark.parametrize("sine", [SIMULATION_1, SIMULATION_2], ids=["simulation_1", "simulation_2"])
def test_raw_inverse_misses_what_the_loops_carry(asym: wb.MujocoReference, sine: Sine) -> None:
    motion = at(sine)(np.linspace(0.1, 1.0, 200))
    result = asym.inverse_dynamics(*motion, external_force=FORCE)
    raw = raw_mj_inverse(asym, *motion, external_force=FORCE)
    unloaded = asym.inverse_dynamics(*motion).tau
    off = np.abs(raw_mj_inverse(asym, *motion) - unloaded).max(axis=0) / np.abs(unloaded).max(axis=0)
    assert off.min() > 0.8
    assert off.max() < 1.1

    # it is the torque of open branches, on which the loops exert nothing
    model = asym.compiled()
    data, moment, point = mujoco.MjData(model), np.zeros(model.nv), np.zeros((3, model.nv))
    branches = np.zeros_like(raw)
    for i in range(len(raw)):
        data.qpos[:], data.qvel[:] = result.qpos[i], result.qvel[i]
        mujoco.mj_forward(model, data)
        mujoco.mj_mulM(model, data, moment, result.qacc[i])
        mujoco.mj_jacSite(model, data, point, None, asym.structure.platform_site)
        force = moment + data.qfrc_bias - data.qfrc_passive - (asym.base_rotation @ FORCE) @ point
        branches[i] = force[asym.structure.actuated]
    assert np.abs(raw - branches).max() < 1e-6 * np.abs(result.tau).max()


def test_raw_inverse_is_right_where_nothing_is_closed(tmp_path: Path) -> None:
    reference = pendulum(tmp_path, damping=0.3)
    t = np.linspace(0.0, 1.0, 20)[:, None]
    motion = np.sin(3 * t), 3 * np.cos(3 * t), -9 * np.sin(3 * t)
    tau = reference.inverse_dynamics(*motion, external_force=FORCE).tau
    np.testing.assert_allclose(raw_mj_inverse(reference, *motion, external_force=FORCE), tau, rtol=1e-12, atol=1e-12)
    assert np.abs(raw_mj_inverse(reference, *motion) - tau).max() > 1.0


# every case of the campaigns


@pytest.mark.slow
@pytest.mark.parametrize("name", ["almeida_2010", "garcia_murillo_2016"])
def test_every_case_of_the_campaigns(repository: Path, name: str) -> None:
    from workbench.campaign.cases import resolve_cases
    from workbench.campaign.spec import load_campaign

    campaign, file = load_campaign(repository / "campaigns" / f"{name}.toml")
    for case in resolve_cases(campaign, file):
        reference = wb.MujocoReference(case.model, **case.overrides)
        motion, mechanism, force = case.motion, case.robot, case.force[0]
        for mass_model in ("distributed", "lumped"):
            balance = power_balance(reference, motion.q, motion.qd, motion.qdd, mass_model, force)
            assert balance.relative < 1e-11, (case.name, mass_model)
        through = replay.motion_through(motion.t, motion.q, motion.qd, motion.qdd)
        torque = {"distributed": lambda *m, mech=mechanism, f=force: mech.inverse_dynamics(*m, external_force=f)}
        found = replay.replay(reference, through, torque, motion.t[0], motion.t[-1], force)
        assert found.replays["distributed"].verdict == "converges", (case.name, found.replays["distributed"].text)
        assert found.replays["distributed"].order == pytest.approx(1.0, abs=0.1)
