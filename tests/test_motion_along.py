"""A motion around a cusp: closed along it, or jumps that are refused; held against geometry that closes no loop."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

import cusp_robot as cusp
import workbench as wb
from robots import MODEL, sine_sum
from workbench.errors import MotionError
from workbench.reference import along, mujoco_reference
from workbench.reference.power import power_balance
from workbench.reference.replay import motion_through, replay

T = np.linspace(0.0, 2.0 * np.pi / cusp.RATE, cusp.SAMPLES)

ENDS = [int(np.argmin(np.abs(cusp.SWING * np.sin(cusp.RATE * T) - side * np.pi))) for side in (1, -1)]
"""Samples on opposite sides of the swing, with the same legs to a few millimetres"""


@pytest.fixture(scope="module")
def poses() -> np.ndarray:
    return cusp.followed(T)


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("cusp") / "cusp.xml"
    path.write_text(cusp.model_text())
    return path


@pytest.fixture
def build(model: Path, poses: np.ndarray) -> Callable[..., wb.MujocoReference]:
    return lambda **options: wb.MujocoReference(model, setup=cusp.setup_at(poses[0]), **options)


def oracle(reference: wb.MujocoReference, poses: np.ndarray) -> np.ndarray:
    """Torques of the continuous motion from MuJoCo's open tree, every joint's motion by geometry and splines.

    Virtual work: W = dqpos/dq by differences of the geometry; no loop is closed, no constraint Jacobian is used.
    """
    compiled = reference.compiled()
    data = mujoco.MjData(compiled)
    names = [compiled.joint(j).name for j in range(compiled.njnt)]
    curve = make_interp_spline(T, poses, 7)
    pose, rate, rise = curve(T), curve(T, nu=1), curve(T, nu=2)

    def qpos(p: np.ndarray) -> np.ndarray:
        found = cusp.coordinates(p)
        return np.stack([found[name] for name in names], axis=1)

    h = 1e-3
    at = {k: qpos(pose + k * h * rate + 0.5 * (k * h) ** 2 * rise) for k in (-2, -1, 0, 1, 2)}
    at = {k: v + 2 * np.pi * np.round((at[0] - v) / (2 * np.pi)) for k, v in at.items()}
    velocity = (8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * h)
    acceleration = (16 * (at[1] + at[-1]) - (at[2] + at[-2]) - 30 * at[0]) / (12 * h**2)
    tau = np.zeros((len(T), 3))
    for s in range(len(T)):
        data.qpos[:], data.qvel[:], data.qacc[:] = at[0][s], velocity[s], acceleration[s]
        mujoco.mj_kinematics(compiled, data)
        mujoco.mj_comPos(compiled, data)
        mujoco.mj_crb(compiled, data)
        mujoco.mj_comVel(compiled, data)
        force = np.zeros(compiled.nv)
        mujoco.mj_rne(compiled, data, 1, force)
        d = 1e-5 * np.eye(3)
        ways = [(pose[s] + d, pose[s] - d)]
        change = np.array([qpos(np.stack([a, b])) for a, b in zip(*ways[0], strict=True)])
        dqpos = (change[:, 0] - change[:, 1]).T / 2e-5
        dq = dqpos[[names.index(f"q{i}") for i in (1, 2, 3)]]
        tau[s] = (dqpos @ np.linalg.inv(dq)).T @ force
    return tau


def test_the_motion_is_one_that_scattered_closure_gets_wrong(build: Callable, poses: np.ndarray) -> None:
    """Legs come back, the platform does not: the premise of all that follows."""
    q, qd, qdd = cusp.lengths(T)
    np.testing.assert_allclose(cusp.legs(poses), q, atol=1e-12)
    assert np.abs(q[ENDS[0]] - q[ENDS[1]]).max() < 5e-3
    assert np.linalg.norm(poses[ENDS[0]] - poses[ENDS[1]]) > 0.5
    assert np.abs(np.diff(poses, axis=0)).max() < 0.1
    scattered = build().inverse_dynamics(q, qd, qdd)
    assert np.abs(np.diff(scattered.qpos, axis=0)).max() > 1.0
    assert scattered.closure_residual.max() < 1e-13


def test_a_motion_around_a_cusp_has_the_torques_of_the_continuous_motion(build: Callable, poses: np.ndarray) -> None:
    q, qd, qdd = cusp.lengths(T)
    reference = build()
    found = reference.inverse_dynamics(q, qd, qdd, along=T)
    expected = oracle(reference, poses)
    peak = np.abs(expected).max(axis=0)
    inside = slice(8, -8)  # the oracle's spline is worse at its ends
    assert (np.abs(found.tau - expected)[inside] / peak).max() < 1e-5
    # where the platform is says the geometry, to rounding
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    place = poses[:, :2] + np.stack([0.12 * c - 0.1 * s, 0.12 * s + 0.1 * c], axis=1)
    assert np.abs(found.x[:, :2] - place).max() < 1e-11
    # the twin: scattered samples
    wrong = reference.inverse_dynamics(q, qd, qdd)
    assert (np.abs(wrong.tau - expected)[inside] / peak).max() > 0.1


def test_results_do_not_depend_on_threads_and_repeat(build: Callable) -> None:
    q, qd, qdd = cusp.lengths(np.linspace(0.0, T[-1], 1400))
    one, three = (
        build(threads=threads).inverse_dynamics(q, qd, qdd, along=np.linspace(0.0, T[-1], 1400)) for threads in (1, 3)
    )
    for name in ("tau", "qpos", "x"):
        np.testing.assert_array_equal(getattr(one, name), getattr(three, name))


def test_a_motion_that_needs_no_following_is_closed_as_before() -> None:
    t = np.linspace(0.0, 2.0, 300)
    q, qd, qdd = sine_sum(np.random.default_rng(5), t, 0.7)
    reference = wb.MujocoReference(MODEL)
    scattered, ordered = reference.inverse_dynamics(q, qd, qdd), reference.inverse_dynamics(q, qd, qdd, along=t)
    # by other ways to the same poses, to rounding
    for name in ("tau", "x", "xd", "xdd"):
        one, other = getattr(scattered, name), getattr(ordered, name)
        assert np.abs(one - other).max() <= 1e-12 * np.abs(other).max(), name


def test_jumps_between_neighbours_are_refused_with_time_and_joint(
    build: Callable, monkeypatch: pytest.MonkeyPatch
) -> None:
    q, qd, qdd = cusp.lengths(T)
    # samples as scattered closure leaves them: what stood before
    monkeypatch.setattr(along.OrderedClosure, "close_along", along.OrderedClosure.follow)
    with pytest.raises(
        MotionError, match=r"^sample \d+, joint \w+: jumps by \d\S* since t = \S+ s; its rates"
    ) as caught:
        build().inverse_dynamics(q, qd, qdd, along=T)
    assert caught.value.facts["sample"] > 1
    assert caught.value.facts["value"] > 10 * caught.value.facts["limit"]


def test_a_table_whose_lines_are_not_a_motion_is_refused(build: Callable) -> None:
    q, qd, qdd = (array.copy() for array in cusp.lengths(T))
    q[140:] += 0.01
    with pytest.raises(MotionError, match=r"^sample 140, joint \w+: jumps by "):
        build().inverse_dynamics(q, qd, qdd, along=T)
    q, qd, qdd = cusp.lengths(T)
    with pytest.raises(MotionError, match=r"^sample \d+, joint \w+: jumps by "):
        build().inverse_dynamics(q, qd / 57.3, qdd / 57.3, along=T)
    with pytest.raises(wb.WorkbenchError, match="differ in their number of samples"):
        build().inverse_dynamics(q, qd, qdd, along=T[:-1])


def test_power_balance_sees_a_jump_and_no_motion_that_goes_on(build: Callable, monkeypatch: pytest.MonkeyPatch) -> None:
    motion = cusp.lengths(T)
    assert power_balance(build(), *motion, along=T).relative < 1e-10
    monkeypatch.setattr(along.OrderedClosure, "close_along", along.OrderedClosure.follow)
    monkeypatch.setattr(mujoco_reference, "refuse_jumps", lambda *_: None)
    assert power_balance(build(), *motion, along=T).relative > 1.0


def test_the_replay_follows_the_motion(build: Callable) -> None:
    q, qd, qdd = cusp.lengths(T)
    found = replay(build(), motion_through(T, q, qd, qdd), {}, 0.0, float(T[-1]))
    assert found.replays["reference"].verdict == "converges"


def test_samples_are_closed_near_given_configurations(build: Callable, poses: np.ndarray) -> None:
    """The same legs, two assemblies: each sample stays where it is told to begin."""
    q, qd, qdd = cusp.lengths(T)
    reference = build()
    ordered = reference.inverse_dynamics(q, qd, qdd, along=T)
    middle = q[ENDS].mean(axis=0, keepdims=True).repeat(2, axis=0)
    near = reference.inverse_dynamics(middle, qd[ENDS], qdd[ENDS], near=ordered.qpos[ENDS])
    assert np.abs(near.qpos - ordered.qpos[ENDS]).max() < 0.1
    assert np.abs(near.qpos[0] - near.qpos[1]).max() > 0.5
    assert near.closure_residual.max() < 1e-13


def test_a_sample_that_the_motion_cannot_reach_is_named(build: Callable) -> None:
    q, qd, qdd = (array.copy() for array in cusp.lengths(T))
    q[200:, 2] += 2.0
    with pytest.raises(MotionError, match=r"^sample 200, joint q3: the loops cannot be closed at "):
        build().inverse_dynamics(q, qd, qdd, along=T)
