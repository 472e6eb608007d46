"""The 4-RPRP robot: two closed forms, a third oracle written here, MuJoCo, and the paper's own numbers.

Every comparison has a twin that is spoiled on purpose and must exceed the tolerance.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from planar_4rprp_cases import (
    DIFFERENCES,
    HOME,
    MODEL,
    ROUND_OFF,
    Motion,
    along,
    example,
    first_rate,
    peak_error,
    random_parameters,
    scattered,
    second_rate,
    slow,
)
from workbench.capabilities.load import load_robot as load_mechanism
from workbench.capabilities.robot import Robot
from workbench.reference.mujoco_reference import MujocoReference
from workbench.robots import screws
from workbench.robots.planar_4rprp import screws as screw_route
from workbench.robots.planar_4rprp.closed_form import HOME_SOLUTION, Planar4Rprp


@pytest.fixture(scope="module")
def robot() -> Robot:
    mechanism = load_mechanism(MODEL)
    assert isinstance(mechanism.closed_form, Planar4Rprp)
    return mechanism


@pytest.fixture(scope="module")
def reference() -> MujocoReference:
    return MujocoReference(MODEL)


# --- kinematics


def test_table_2_with_its_signs(robot: Robot):
    printed = 1e-3 * np.array(
        [[264.86, -248.13, 300], [-264.86, -248.13, 300], [300, 248.13, 300], [-300, 248.13, 300]]
    )
    found = robot.forward_kinematics_all(HOME[None])[0]
    assert np.abs(found - printed).max() < 5e-6
    np.testing.assert_array_equal(found[HOME_SOLUTION], robot.forward_kinematics(HOME[None])[0])
    assert np.abs(found - np.abs(printed)).max() > 5e-6  # without the signs that the scan lost


def test_all_four_solutions_have_the_same_limb_lengths(robot: Robot):
    q, _, _ = scattered(robot, 50, 1)
    p = robot.parameters
    x = robot.forward_kinematics_all(q)
    real = ~np.isnan(x[..., 0])
    assert real[:, 2:].all()
    lengths = np.stack([np.hypot(x[..., 1], x[..., 2]), np.hypot(x[..., 0], x[..., 1] - p.h),
                        np.hypot(x[..., 1], p.b - x[..., 2])], axis=-1)  # fmt: skip
    np.testing.assert_allclose(lengths[real], np.broadcast_to(q[:, None], x.shape)[real], atol=1e-14)


def test_a_solution_that_is_not_real_is_nan(robot: Robot):
    # limb 2 long enough for the upper solutions, too short for the lower ones
    q = robot.inverse_kinematics([[0.01, 0.25, 0.3]])
    found = robot.forward_kinematics_all(q)[0]
    assert np.isnan(found[:2]).all()
    assert np.isfinite(found[2:]).all()


def test_inverse_kinematics_undoes_forward_kinematics(robot: Robot):
    q, _, _ = scattered(robot, 100, 2)
    np.testing.assert_allclose(robot.inverse_kinematics(robot.forward_kinematics(q)), q, atol=1e-14)


def test_platform_motion_by_finite_differences(robot: Robot):
    q, qd, qdd = slow(robot, 40, 3)
    x, xd, xdd = robot.platform_motion(q, qd, qdd)
    moved = along(robot.forward_kinematics, q, qd, qdd)
    assert (peak_error(first_rate(moved), xd) < DIFFERENCES).all()
    assert (peak_error(second_rate(moved), xdd) < DIFFERENCES).all()
    np.testing.assert_allclose(np.einsum("nij,nj->ni", robot.jacobian(q), qd), xd, atol=1e-12)
    still = robot.platform_motion(q, 0 * qd, qdd)[2]  # twin: without the velocity products
    assert (peak_error(still, xdd) > 1e-3).any()
    back = robot.joint_motion(x, xd, xdd)
    for found, expected in zip(back, (q, qd, qdd), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-11)


def test_reduced_jacobian_inverts_the_jacobian_and_has_the_determinant_stated(robot: Robot):
    q, _, _ = scattered(robot, 60, 4)
    rows = robot.reduced_jacobian(q)
    np.testing.assert_allclose(rows @ robot.jacobian(q), np.broadcast_to(np.eye(3), rows.shape), atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(rows, axis=2), 1.0, atol=1e-14)
    x = robot.forward_kinematics(q)
    stated = robot.parameters.b * x[:, 0] * x[:, 1] / np.prod(q, axis=1)
    np.testing.assert_allclose(np.linalg.det(rows), stated, atol=1e-14)
    np.testing.assert_allclose(robot.singularity_measures(q)["det J_r"], stated, atol=1e-15)
    assert np.abs(np.linalg.det(rows) - stated * x[:, 2] / x[:, 1]).max() > 1e-3


# --- dynamics against an oracle written here


@dataclasses.dataclass(frozen=True)
class Spoil:
    """What to do wrong in the oracle."""

    limbs: tuple[int, ...] = (1, 2, 3, 4)
    rods: float = 1.0
    force: float = 1.0
    gravity: float = 1.0
    piston_from_pivot: bool = False
    swapped_inertia: bool = False


NOTHING = Spoil()


def oracle(p: Any, motion: Motion, force: np.ndarray, spoil: Spoil = NOTHING) -> np.ndarray:
    """D'Alembert for eleven bodies; accelerations and partial derivatives by finite differences of positions.

    Positions come from eq. (14)-(16); nothing is shared with the package.
    """

    def bodies(q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        z = (p.b**2 + q[:, 0] ** 2 - q[:, 2] ** 2) / (2 * p.b)
        y = np.sqrt(q[:, 0] ** 2 - z**2)
        x = np.sqrt(q[:, 1] ** 2 - (y - p.h) ** 2)
        platform = np.stack([x, y, z], axis=1)
        pivots = {1: (0, 0, 0), 2: (0, 0, p.b), 3: (p.a, 0, p.b), 4: (p.a, 0, 0)}
        centres, masses, angles, inertias = [platform], [p.m6], [0 * x], [0.0]
        for number in spoil.limbs:
            pivot = np.array(pivots[number], dtype=float)
            plane = 2 if number in (1, 3) else 0
            arm = np.zeros_like(platform)
            arm[:, plane] = platform[:, plane] - pivot[plane]
            arm[:, 1] = y if plane == 2 else y - p.h
            length = np.linalg.norm(arm, axis=1, keepdims=True)
            angle = np.arctan2(arm[:, plane], arm[:, 1])
            about_x = (number in (1, 3)) != spoil.swapped_inertia
            centres += [pivot + p.c2 * arm / length,
                        pivot + arm * (p.c3 / length if spoil.piston_from_pivot else 1 - p.c3 / length)]  # fmt: skip
            masses += [p.m2, p.m3]
            angles += [angle, angle]
            inertias += [p.I2x, p.I3x] if about_x else [p.I2z, p.I3z]
        centres += [platform * [0, 1, 1], platform * [1, 1, 0]]
        masses += [spoil.rods * p.m4] * 2
        angles += [0 * x] * 2
        inertias += [0.0] * 2
        return np.stack(centres, 1), np.stack(angles, 1), np.array(masses), np.array(inertias)

    q, qd, qdd = motion
    _, _, masses, inertias = bodies(q)
    down = np.array([0.0, -p.g * spoil.gravity, 0.0])
    needed = masses[:, None] * (second_rate(along(lambda s: bodies(s)[0], q, qd, qdd)) - down)
    needed[:, 0] -= spoil.force * force
    moments = inertias * second_rate(along(lambda s: bodies(s)[1], q, qd, qdd))
    tau = np.empty_like(q)
    for joint in range(3):
        unit = np.zeros_like(q)
        unit[:, joint] = 0.2  # slow, as the motions
        moved = first_rate(along(lambda s: bodies(s)[0], q, unit, 0 * unit)) / 0.2
        turned = first_rate(along(lambda s: bodies(s)[1], q, unit, 0 * unit)) / 0.2
        tau[:, joint] = np.sum(needed * moved, axis=(1, 2)) + np.sum(moments * turned, axis=1)
    return tau


SPOILED = {
    "limb 4 omitted": Spoil(limbs=(1, 2, 3)),
    "one body 4 per limb": Spoil(rods=2.0),
    "force reversed": Spoil(force=-1.0),
    "gravity upwards": Spoil(gravity=-1.0),
    "c3 measured from A": Spoil(piston_from_pivot=True),
    "I_x and I_z exchanged": Spoil(swapped_inertia=True),
}


@pytest.mark.parametrize("seed", range(8))
def test_torques_by_finite_differences_of_positions(robot: Robot, seed: int):
    mechanism = robot.with_parameters(**random_parameters(seed)) if seed else robot
    motion = slow(mechanism, 30, seed)
    force = np.array([40.0, -100.0, 70.0])
    tau = mechanism.inverse_dynamics(*motion, external_force=force)
    assert (peak_error(tau, oracle(mechanism.parameters, motion, force)) < DIFFERENCES).all()


@pytest.mark.parametrize("spoil", SPOILED.values(), ids=SPOILED.keys())
def test_the_oracle_sees_what_is_spoiled(robot: Robot, spoil: Spoil):
    motion = slow(robot, 30, 0)
    force = np.array([40.0, -100.0, 70.0])
    tau = robot.inverse_dynamics(*motion, external_force=force)
    assert (peak_error(tau, oracle(robot.parameters, motion, force, spoil)) > 1e-5).any()


def test_lumped_masses_are_bars_without_rotational_inertia(robot: Robot):
    motion = example(101, speed=10.0)
    p = dataclasses.replace(robot.parameters, I2x=0.0, I2z=0.0, I3x=0.0, I3z=0.0)
    lumped = robot.inverse_dynamics(*motion, mass_model="lumped")
    assert (peak_error(lumped, oracle(p, motion, np.zeros(3))) < 1e-6).all()
    assert (peak_error(robot.inverse_dynamics(*motion), lumped) > 1e-2).all()


def test_power_balance(robot: Robot, reference: MujocoReference):
    """tau . qd + f . xd = dE/dt, with MuJoCo's energy along a smooth motion."""
    time = np.linspace(0.0, 0.4, 4001)
    q, qd, qdd = (np.squeeze(part) for part in _sines(time))
    force = np.array([30.0, -50.0, 20.0])
    tau = robot.inverse_dynamics(q, qd, qdd, external_force=force)
    xd = robot.platform_motion(q, qd, qdd)[1]
    power = np.sum(tau * qd, axis=1) + xd @ force
    energy = reference.inverse_dynamics(q, qd, qdd).energy.sum(axis=1)
    step = time[1] - time[0]
    rate = (energy[:-4] - 8 * energy[1:-3] + 8 * energy[3:-1] - energy[4:]) / (12 * step)
    scale = np.abs(rate).max()
    assert np.abs(power[2:-2] - rate).max() < 1e-8 * scale
    assert np.abs(power[2:-2] - 2 * (xd @ force)[2:-2] - rate).max() > 1e-2 * scale  # force reversed


def _sines(time: np.ndarray) -> Motion:
    """Two sines per joint at 5 to 15 rad/s."""
    slow, fast, phase = np.array([5.0, 7.0, 6.0]), np.array([13.0, 11.0, 15.0]), np.array([0.0, 1.0, 2.0])
    size = np.array([0.02, 0.025, 0.015])
    a, b = slow * time[:, None] + phase, fast * time[:, None]
    q = HOME + size * (np.sin(a) + 0.5 * np.cos(b))
    qd = size * (slow * np.cos(a) - 0.5 * fast * np.sin(b))
    return q, qd, -size * (slow**2 * np.sin(a) + 0.5 * fast**2 * np.cos(b))


# --- dynamics against MuJoCo


@pytest.mark.parametrize("seed", range(100, 150))
def test_random_parameters_and_forces_against_mujoco(seed: int):
    changes = random_parameters(seed)
    mechanism = load_mechanism(MODEL, **changes)
    engine = MujocoReference(MODEL, **changes)
    motion = scattered(mechanism, 12, seed)
    force = 300 * np.random.default_rng(seed).normal(size=(12, 3))
    for mass_model in ("distributed", "lumped"):
        result = engine.inverse_dynamics(*motion, mass_model=mass_model, external_force=force)
        tau = mechanism.inverse_dynamics(*motion, mass_model=mass_model, external_force=force)
        assert (peak_error(tau, result.tau) < ROUND_OFF).all()
    for found, expected in zip(mechanism.platform_motion(*motion), (result.x, result.xd, result.xdd), strict=True):
        assert (peak_error(found, expected) < 1e-11).all()
    spoiled = mechanism.with_parameters(c2=changes["c2"] * (1 + 1e-6), I2x=changes["I2x"], I2z=changes["I2z"])
    assert (peak_error(spoiled.inverse_dynamics(*motion, mass_model="lumped", external_force=force), result.tau)
            > ROUND_OFF).any()  # fmt: skip


@pytest.mark.parametrize("force", [None, (0.0, -1000.0, 0.0), (0.0, 1000.0, 0.0)])
def test_the_papers_example_against_mujoco(robot: Robot, reference: MujocoReference, force):
    motion = example(101)
    truth = reference.inverse_dynamics(*motion, external_force=force).tau
    for name in ("distributed", "screws"):
        given = np.broadcast_to(np.zeros(3) if force is None else force, truth.shape)
        assert (peak_error(robot.candidates[name].function(robot, *motion, given), truth) < ROUND_OFF).all()


def test_forces_of_the_papers_example(robot: Robot):
    """Ranges in newtons that the assumptions written in the model lead to."""
    motion = example(2001)

    def ranges(force: float) -> np.ndarray:
        tau = robot.inverse_dynamics(*motion, external_force=(0.0, force, 0.0))
        return np.stack([tau.min(axis=0), tau.max(axis=0)], axis=1)

    free = [[11.859, 14.805], [-0.0735, 0.1317], [11.985, 14.711]]
    np.testing.assert_allclose(ranges(0.0), free, atol=6e-4)
    loaded = ranges(-1000.0)
    np.testing.assert_allclose(loaded[[0, 2]], [[737.8, 886.6], [745.7, 880.6]], atol=0.06)
    np.testing.assert_allclose(loaded[1], free[1], atol=6e-4)  # tau2 does not feel the force


# --- the paper's own route


def test_screws_agree_with_the_direct_form(robot: Robot):
    for seed in range(20):
        mechanism = robot.with_parameters(**random_parameters(seed))
        q, qd, qdd = scattered(mechanism, 20, seed)
        force = 300 * np.random.default_rng(seed).normal(size=q.shape)
        direct = {m: mechanism.inverse_dynamics(q, qd, qdd, m, force) for m in ("distributed", "lumped")}
        x = mechanism.forward_kinematics(q)
        for model, tau in direct.items():
            found = screw_route.torques(mechanism.parameters, q, qd, qdd, x, force, model)
            assert (peak_error(found, tau) < ROUND_OFF).all()
        printed = mechanism.candidates["screws-as-printed"].function(mechanism, q, qd, qdd, force)
        assert (peak_error(printed, direct["distributed"]) > 1e-3).all()


def test_the_virtual_line_is_reciprocal_to_all_but_the_actuator(robot: Robot):
    x = robot.forward_kinematics(scattered(robot, 10, 5)[0])
    for number in (1, 2, 3, 4):
        chain = screw_route.limb(robot.parameters, number, x).screws
        form = screws.klein(chain[:, screw_route.LINE_OF_LIMB, None], chain)
        np.testing.assert_allclose(form, np.broadcast_to([0, 0, 0, 1, 0, 0], form.shape), atol=1e-15)


def test_accelerations_by_lie_screws_and_the_lost_sign(robot: Robot):
    q, qd, qdd = scattered(robot, 30, 6)
    x, xd, xdd = robot.platform_motion(q, qd, qdd)
    right = screw_route.motion(robot.parameters, qd, qdd, x)
    np.testing.assert_allclose(right.jacobian_r, robot.reduced_jacobian(q), atol=1e-15)
    np.testing.assert_allclose(right.xd, xd, atol=1e-12)
    assert (peak_error(right.xdd, xdd) < 1e-12).all()
    for rates in right.rates.values():
        np.testing.assert_allclose(rates[:, 1:3], 0.0, atol=1e-13)  # the virtual joints stand still
    printed = screw_route.motion(robot.parameters, qd, qdd, x, moment_sign=-1.0)
    np.testing.assert_allclose(printed.xd, xd, atol=1e-12)  # velocities do not show it
    assert (peak_error(printed.xdd, xdd) > 1e-2).any()
    # what changes sign is the Lie-screw term: driver - qdd
    lie = [np.einsum("nij,nj->ni", m.jacobian_r, m.xdd) - qdd for m in (right, printed)]
    np.testing.assert_allclose(lie[0], -lie[1], atol=1e-11)
