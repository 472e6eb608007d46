"""Control against known answers: a pendulum and a four-bar, the order of computed torque, weight over stiffness, work.

Every check has a spoiled twin that has to fail.
"""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import workbench as wb
from control_machines import FOURBAR, PENDULUM, Acceleration, fourbar, pendulum, reference_of, tracked
from workbench.arrays import FloatArray
from workbench.control.controllers import Gains, law_of
from workbench.control.loop import TRACKED, Tracked, run_loop
from workbench.control.models import FormulaModel
from workbench.control.sampling import Course, Desired, Sampling, desired_at_ticks
from workbench.errors import ModelError
from workbench.reference import MujocoReference
from workbench.reference.forward import Plant
from workbench.reference.forward_kernels import DONE
from workbench.reference.stiff_plant import StiffPlant

ROBOT = "models/asym_2rss_ppap.xml"
RATE, TICKS = 200.0, 101


def ideal(rate: float, joints: int, delay: float = 0.0) -> Sampling:
    zero = np.zeros(joints)
    return Sampling(rate, delay, zero, zero, True, np.full(joints, math.inf))


def sine(offset: FloatArray, amplitude: FloatArray, frequency: FloatArray) -> Course:
    def course(t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        phase = np.outer(t, frequency)
        return (
            offset + amplitude * np.sin(phase),
            amplitude * frequency * np.cos(phase),
            -amplitude * frequency**2 * np.sin(phase),
        )

    return course


@pytest.mark.parametrize(
    ("text", "joint", "site", "initial", "acceleration"),
    [
        (PENDULUM, "swing", "tip", {"swing": 0.4}, pendulum),
        (FOURBAR, "crank", "middle", {"crank": 1.0, "elbow": -0.5, "wrist": -1.5}, fourbar),
    ],
)
def test_a_machine_under_pd_moves_as_its_equation_says(
    tmp_path: Path, text: str, joint: str, site: str, initial: dict[str, float], acceleration: Acceleration
) -> None:
    reference = reference_of(tmp_path, text, joint, site, **initial)
    plant = Plant(reference)
    home = reference.home[0]
    desired = desired_at_ticks(sine(np.array([home]), np.array([0.4]), np.array([7.0])), 0.0, (TICKS - 1) / RATE, RATE)
    plant.begin(reference.home, np.zeros(1))
    gains = Gains(3.0, 0.7, np.diag(plant.mass).copy())
    law = law_of("pd", None, gains, desired)
    found = run_loop(plant, law, desired, ideal(RATE, 1), 1.0 / RATE / 4)
    assert found.status == TRACKED
    wanted = _exact(acceleration, law, desired)
    assert np.abs(found.q[:, 0] - wanted).max() < 1e-6
    assert np.abs(found.q[:, 0] - desired.q[:, 0]).max() > 1e-2  # the motion is not followed by itself

    def spoiled(q: float, qd: float, tau: float) -> float:
        return acceleration(q, qd, tau) * 1.001

    assert np.abs(found.q[:, 0] - _exact(spoiled, law, desired)).max() > 1e-6


def _exact(acceleration: Acceleration, law: object, desired: Desired) -> FloatArray:
    def held(k: int, q: float, qd: float) -> float:
        return float(law(k, np.array([q]), np.array([qd]))[0])  # type: ignore[operator]

    return tracked(acceleration, held, (desired.q[0, 0], desired.qd[0, 0]), len(desired.t), RATE)


@pytest.fixture(scope="module")
def robot() -> wb.Robot:
    return wb.load_robot(ROBOT)


def _computed_torque(robot: wb.Robot, model: str, rate: float, **plant: float) -> tuple[Tracked, Desired, Plant]:
    course = sine(robot.home + np.array([0.0, 0.02, -0.03]), np.array([0.05, 0.2, 0.2]), np.array([8.0, 17.0, 23.0]))
    desired = desired_at_ticks(course, 0.0, 0.25, rate)
    real = Plant(robot.with_parameters(**plant).reference if plant else robot.reference)
    real.begin(robot.home, np.zeros(3))
    law = law_of(
        "computed torque", FormulaModel(robot, model, np.zeros(3)), Gains(10.0, 1.0, np.diag(real.mass)), desired
    )
    return run_loop(real, law, desired, ideal(rate, 3), 1e-3), desired, real


def test_computed_torque_with_the_exact_model_errs_in_proportion_to_the_period(robot: wb.Robot) -> None:
    errors = {model: [] for model in ("distributed", "lumped")}
    for model, found in errors.items():
        for rate in (500.0, 1000.0, 2000.0):
            run, desired, _ = _computed_torque(robot, model, rate)
            assert run.status == TRACKED
            found.append(float(np.abs(run.q - desired.q).max()))
    exact = errors["distributed"]
    # a torque that is held is late by half a period: of first order
    orders = [math.log2(a / b) for a, b in pairwise(exact)]
    assert orders == pytest.approx([1.0, 1.0], abs=0.1)
    # the twin: with another model an error stays that no rate takes away
    assert math.log2(errors["lumped"][1] / errors["lumped"][2]) < 0.7


def test_an_unknown_payload_leaves_its_weight_over_the_stiffness(robot: wb.Robot) -> None:
    extra = 0.05
    still = desired_at_ticks(sine(robot.home, np.zeros(3), np.zeros(3)), 0.0, 0.5, 500.0)
    errors = {}
    for load in (0.0, extra):
        plant = Plant(robot.with_parameters(payload=robot.values["payload"] + load).reference)
        plant.begin(robot.home, np.zeros(3))
        gains = Gains(20.0, 1.0, np.diag(plant.mass).copy())
        law = law_of("pd + weight", FormulaModel(robot, "distributed", np.zeros(3)), gains, still)
        run = run_loop(plant, law, still, ideal(500.0, 3), 1e-3)
        errors[load] = still.q[-1] - run.q[-1]
        assert np.abs(run.qd[-1]).max() < 1e-6
    # the payload's weight, felt by the actuators through the platform's Jacobian alone
    weight = -robot.jacobian(robot.home).T @ np.array([0.0, 0.0, extra * robot.values["g"]])
    expected = weight / (gains.kp * gains.mass)
    joints = np.abs(expected) > 1e-9
    assert joints[1:].all()
    assert errors[extra][joints] == pytest.approx(expected[joints], rel=0.01)
    assert np.abs(errors[0.0]).max() < 1e-4 * np.abs(expected).max()  # the twin: a payload that is known leaves nothing


def test_the_work_of_the_actuators_is_what_mujoco_finds_in_the_energy(robot: wb.Robot) -> None:
    run, _, plant = _computed_torque(robot, "lumped", 1000.0)
    assert run.status == TRACKED
    gained = _energy(robot.reference, run)
    assert run.work == pytest.approx(gained, abs=1e-7 * _stirred(run))
    assert abs(gained) > 1e-3
    rubbed, _, _ = _computed_torque(robot, "lumped", 1000.0, damping_q2=0.01)
    assert abs(rubbed.work - _energy(robot.reference, rubbed)) > 1e-4  # the twin: a damper takes its share
    assert plant.q.tolist() == run.q[-1].tolist()


def _energy(reference: MujocoReference, run: Tracked) -> float:
    ends = np.array([0, -1])
    found = reference.inverse_dynamics(run.q[ends], run.qd[ends], np.zeros((2, 3))).energy.sum(axis=1)
    return float(found[1] - found[0])


def _stirred(run: Tracked) -> float:
    """Energy that went through the actuators, J."""
    return float(np.abs(run.tau[:-1] * np.diff(run.q, axis=0)).sum())


def test_both_routes_agree_and_do_not_when_one_has_other_masses(robot: wb.Robot) -> None:
    run, desired, _ = _computed_torque(robot, "distributed", 1000.0)
    law = law_of(
        "computed torque", FormulaModel(robot, "distributed", np.zeros(3)), Gains(10.0, 1.0, np.ones(3)), desired
    )
    error = float(np.abs(run.q - desired.q).max())
    for other, agrees in ((robot, True), (robot.with_parameters(payload=0.02), False)):
        stiff = StiffPlant(other.reference)
        assert stiff.takes(1e-3)
        stiff.stiffen(1e-3, explicit=True)
        off = float(np.abs(run_loop(stiff, law, desired, ideal(1000.0, 3), 1e-3).q - run.q).max())
        assert (off < 0.01 * error) is agrees
        found = []
        for times in (1, 2):
            stiff.stiffen(2.5e-4 / times, explicit=False)
            found.append(run_loop(stiff, law, desired, ideal(1000.0, 3), 2.5e-4, times).q)
        off = float(np.abs(2.0 * found[1] - found[0] - run.q).max())
        assert (off < 0.1 * error) is agrees


def test_both_routes_agree_under_a_force(robot: wb.Robot) -> None:
    force = np.array([20.0, -15.0, 40.0])
    course = sine(robot.home, np.array([0.05, 0.2, 0.2]), np.array([8.0, 17.0, 23.0]))
    desired = desired_at_ticks(course, 0.0, 0.1, 1000.0)

    def run(plant: Plant | StiffPlant, known: FloatArray) -> Tracked:
        model, gains = FormulaModel(robot, "distributed", known), Gains(10.0, 1.0, np.ones(3))
        return run_loop(plant, law_of("computed torque", model, gains, desired), desired, ideal(1000.0, 3), 1e-3)

    one, stiff = run(Plant(robot.reference, force), force), StiffPlant(robot.reference, force)
    stiff.stiffen(1e-3, explicit=True)
    other = run(stiff, force)
    error = float(np.abs(one.q - desired.q).max())
    assert np.abs(other.q - one.q).max() < 0.01 * error
    assert np.abs(other.x - one.x).max() < 0.01 * error
    # the twin: a model that is not told the force errs by what the force is worth
    assert np.abs(run(Plant(robot.reference, force), np.zeros(3)).q - desired.q).max() > 10.0 * error


def test_a_delay_is_served_in_parts_of_a_period(tmp_path: Path) -> None:
    """Under a torque that is a function of time alone, 1.5 periods of delay move a step of it by as much."""
    reference = reference_of(tmp_path, PENDULUM, "swing", "tip", swing=0.4)
    plant = Plant(reference)
    desired = desired_at_ticks(sine(reference.home, np.zeros(1), np.zeros(1)), 0.0, 0.05, RATE)
    hold = float(_bias(plant, reference))

    def law(k: int, q: FloatArray, qd: FloatArray) -> FloatArray:
        return np.array([hold + (0.2 if k >= 2 else 0.0)])

    found = run_loop(plant, law, desired, ideal(RATE, 1, delay=1.5 / RATE), 1.0 / RATE)
    moved = np.abs(found.q[:, 0] - found.q[0, 0])
    assert moved[3] < 1e-12  # 2 + 1.5 periods lie between the third and the fourth tick
    expected = 0.5 * 0.2 / (0.011 + 0.8 * 0.25**2) * (0.5 / RATE) ** 2
    assert moved[4] == pytest.approx(expected, rel=1e-3)


def _bias(plant: Plant, reference: MujocoReference) -> float:
    plant.begin(reference.home, np.zeros(1))
    return float(plant.bias[0])


def test_forces_that_are_not_covered_are_refused(tmp_path: Path) -> None:
    text = PENDULUM.replace('<option gravity="0 0 -9.81">', '<option gravity="0 0 -9.81" density="900">')
    with pytest.raises(ModelError, match="control is not covered for this model"):
        Plant(reference_of(tmp_path, text, "swing", "tip", swing=0.4))


def test_friction_springs_and_rotors_act(tmp_path: Path) -> None:
    joint = '<joint name="swing" axis="0 -1 0" damping="0.3" frictionloss="0.2" armature="0.01" stiffness="1.5"'
    text = PENDULUM.replace('<joint name="swing" axis="0 -1 0"', joint)
    plant = Plant(reference_of(tmp_path, text, "swing", "tip", swing=0.4))
    plant.begin(np.array([0.4]), np.array([2.0]))
    weight = 0.8 * 9.81 * 0.25 * np.cos(0.4)
    assert plant.bias[0] == pytest.approx(weight + 0.3 * 2.0 + 0.2 + 1.5 * 0.4, rel=1e-9)
    assert plant.mass[0, 0] == pytest.approx(0.011 + 0.8 * 0.25**2 + 0.01, rel=1e-9)
    assert plant.move(plant.bias, 1e-3, 1) == DONE
