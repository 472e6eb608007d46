"""The 4-RPRP robot: mobility, singular poses, refusals, and the model file."""

from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest

from planar_4rprp_cases import (
    HOME,
    MODEL,
    random_parameters,
    scattered,
)
from workbench.capabilities.load import load_robot as load_mechanism
from workbench.capabilities.robot import Robot
from workbench.errors import MotionError, ParameterError
from workbench.reference.mujoco_reference import MujocoReference
from workbench.robots.load import load_model
from workbench.robots.planar_4rprp.closed_form import Planar4Rprp
from workbench.robots.planar_4rprp.mobility import gogu_mobility, loop_matrix
from workbench.robots.planar_4rprp.singularity import PaperCondition, paper_singularity_conditions, parallelism


@pytest.fixture(scope="module")
def robot() -> Robot:
    mechanism = load_mechanism(MODEL)
    assert isinstance(mechanism.closed_form, Planar4Rprp)
    return mechanism


@pytest.fixture(scope="module")
def reference() -> MujocoReference:
    return MujocoReference(MODEL)


# --- mobility and singular poses


def test_mobility_by_gogus_count_and_by_rank(robot: Robot, reference: MujocoReference):
    count = gogu_mobility(robot.parameters)
    assert (count.p, count.r, count.mobility) == (14, 11, 3)
    assert (count.limb_connectivity, count.rod_connectivity) == (((3, 3), (3, 3)), (3, 3))
    assert (count.loop_connectivity, count.lost_in_loops, count.platform_connectivity) == ((4, 4), (3, 3), 3)
    assert (count.loop_rows, count.loop_rank) == (18, 11)
    by_rank = reference.mobility()
    assert (by_rank.joint_freedoms, by_rank.rank, by_rank.mobility, by_rank.idle_freedoms) == (14, 11, 3, 0)


def test_a_tilted_axis_changes_the_rank(robot: Robot):
    matrix = loop_matrix(robot.parameters, [[0.25, 0.22, 0.35]])
    assert np.linalg.matrix_rank(matrix, tol=1e-9) == 11
    both = loop_matrix(robot.parameters, [[0.25, 0.22, 0.35], [0.2, 0.25, 0.3]])
    assert both.tolist() == matrix.tolist()  # of the first pose
    tilted = matrix.copy()
    tilted[[0, 1, 2], -1] += tilted[[6, 7, 8], -1]
    tilted[7, -1] += 0.1  # the last revolute no longer parallel to its partner
    assert np.linalg.matrix_rank(tilted, tol=1e-9) > 11


def _held(conditions: tuple[PaperCondition, ...]) -> dict[str, bool]:
    return {condition.name: condition.holds for condition in conditions}


def test_figure_7_is_no_singular_pose(robot: Robot):
    q = robot.inverse_kinematics([[0.3, robot.parameters.h, 0.3]])  # Py = h: limbs 2 and 4 in line
    assert parallelism(robot, q)[0] < 1e-12
    assert not _held(paper_singularity_conditions(robot, q))["w2 not parallel to w4 (Figure 7): |w2 x w4| > 0"]
    assert robot.singularity_measures(q)["det J_r"][0] == pytest.approx(0.1327, abs=1e-4)
    assert np.isfinite(robot.inverse_dynamics(q, 0 * q, 0 * q)).all()


def test_the_papers_conditions_are_not_necessary(robot: Robot):
    # from one side to the other at a constant height; and a pose beyond A1
    z = np.linspace(0.1, 0.5, 41)
    across = robot.inverse_kinematics(np.stack([0 * z + 0.3, 0 * z + 0.15, z], axis=1))
    assert robot.singularity_measures(across)["det J_r"].min() > 0.5
    assert not _held(paper_singularity_conditions(robot, across))["min q1 + min q3 > b"]
    beyond = robot.inverse_kinematics([[0.3, 0.1, -0.1]])
    assert robot.singularity_measures(beyond)["det J_r"][0] > 0.5
    assert not _held(paper_singularity_conditions(robot, beyond))["max q3 < sqrt(min q1^2 + b^2)"]


def test_the_papers_printed_conditions_are_not_sufficient(robot: Robot):
    q = robot.inverse_kinematics([[1e-9, 0.25, 0.3]])
    with pytest.raises(MotionError, match="det J_r"):
        robot.forward_kinematics(q)
    measures = robot.singularity_measures(q)
    assert measures["det J_r"][0] < 1e-6
    assert robot.condition_number(q)[0] > 1e6
    q1, _, q3 = q[0]
    b = robot.parameters.b
    assert q1 + q3 > b
    assert q3 < np.hypot(q1, b)


def test_condition_number_is_that_of_the_rows(robot: Robot):
    q, _, _ = scattered(robot, 10, 7)
    values = np.linalg.svd(robot.reduced_jacobian(q), compute_uv=False)
    np.testing.assert_allclose(robot.condition_number(q), values[:, 0] / values[:, -1], rtol=1e-12)


# --- refusals


@pytest.mark.parametrize(
    ("q", "joint"),
    [
        ((0.2, 0.37, 0.3), "q1, q3"),
        ((0.39, 0.1, 0.39), "q2"),
        ((0.39, -0.37, 0.39), "q2"),
        ((0.0, 0.37, 0.39), "q1"),
        ((0.3, 0.37, 0.3), "q1, q2, q3"),
    ],
)
def test_bad_poses_are_refused_by_sample_and_joint(robot: Robot, q: tuple[float, ...], joint: str):
    batch = np.stack([HOME, HOME, np.array(q)])
    for call in (robot.forward_kinematics, robot.jacobian, lambda s: robot.inverse_dynamics(s, 0 * s, 0 * s)):
        with pytest.raises(MotionError) as caught:
            call(batch)
        assert (caught.value.facts["sample"], caught.value.facts["joint"]) == (2, joint)
        assert "\n" not in str(caught.value)


def test_positions_off_the_home_branch_are_refused(robot: Robot):
    for x, words in (((-0.3, 0.25, 0.3), "Px > 0"), ((0.3, -0.25, 0.3), "Py > 0"), ((0.6, 0.02, 0.3), "limb 4")):
        with pytest.raises(MotionError, match=words):
            robot.inverse_kinematics([x])


def test_parameters_are_checked(robot: Robot):
    for changes in ({"b": 0.0}, {"m2": -1.0}, {"payload": 1.0}, {"I2x": 0.0}):
        with pytest.raises(ParameterError, match=next(iter(changes))):
            robot.with_parameters(**changes)


def test_a_bar_stays_uniform_unless_its_inertia_is_given(robot: Robot):
    p = robot.with_parameters(m2=0.5).parameters
    assert p.I2x == p.I2z == pytest.approx(0.5 * (2 * p.c2) ** 2 / 12, rel=1e-15)
    assert (p.I3x, p.I3z) == (robot.parameters.I3x, robot.parameters.I3z)
    p = robot.with_parameters(c3=0.1).parameters
    assert p.I3x == p.I3z == pytest.approx(0.155 * 0.2**2 / 12, rel=1e-15)
    p = robot.with_parameters(m2=0.5, I2x=0.003, I2z=0.002).parameters
    assert (p.I2x, p.I2z) == (0.003, 0.002)


# --- the model


def test_table_3_and_the_assumptions_stand_in_the_model(robot: Robot):
    p = robot.parameters
    assert (p.a, p.b, p.h, p.g) == (0.6, 0.6, 0.02, 9.81)
    assert (p.m2, p.m3, p.m4, p.m6) == (0.357, 0.155, 0.339, 0.212)
    assert (p.I2x, p.I2z, p.I3x, p.I3z) == (2443.907e-6, 2410.1092e-6, 1022.324e-6, 1021.984e-6)
    # c2, c3: uniform bars with the first entry of Table 3
    assert p.m2 * p.c2**2 / 3 == pytest.approx(p.I2x, rel=1e-5)
    assert p.m3 * p.c3**2 / 3 == pytest.approx(p.I3x, rel=1e-5)


def test_parameters_come_back_from_the_compiled_model_bit_for_bit():
    for seed in range(5):
        changes = random_parameters(seed)
        found = dataclasses.asdict(load_mechanism(MODEL, **changes).parameters)
        assert found == changes


def test_the_model_is_closed_at_home_and_simulates_without_warnings():
    model = load_model(MODEL).model
    data = mujoco.MjData(model)
    np.testing.assert_array_equal(model.key_qpos[0], model.qpos0)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    assert np.abs(data.efc_pos).max() < 1e-15
    assert data.nefc == 18
    # world z up, paper y up: (x, y, z) of the paper is (x, -z, y) of the world
    height = np.sqrt(HOME[0] ** 2 - 0.09)
    np.testing.assert_allclose(data.site("P").xpos, [0.3, -0.3, height], atol=1e-10)
    for _ in range(2000):
        mujoco.mj_step(model, data)
    assert not any(warning.number for warning in data.warning)
    assert np.abs(data.efc_pos).max() < 1e-4
    assert data.site("P").xpos[2] < 0.0  # nothing holds it: it falls along its freedoms


def test_everything_in_the_model_is_named_and_weighs():
    model = load_model(MODEL).model
    obj = mujoco.mjtObj
    kinds = {
        obj.mjOBJ_BODY: model.nbody,
        obj.mjOBJ_JOINT: model.njnt,
        obj.mjOBJ_GEOM: model.ngeom,
        obj.mjOBJ_SITE: model.nsite,
        obj.mjOBJ_EQUALITY: model.neq,
        obj.mjOBJ_ACTUATOR: model.nu,
    }
    for kind, count in kinds.items():
        assert all(mujoco.mj_id2name(model, kind, index) for index in range(count))
    assert model.body_mass[1:].min() > 0.1
    assert not np.any(model.geom_contype | model.geom_conaffinity)
    for passive in (model.dof_damping, model.dof_armature, model.dof_frictionloss):
        assert not np.any(passive)
    moving = model.body_mass[2:].sum()
    p = load_mechanism(MODEL).parameters
    assert moving == pytest.approx(4 * (p.m2 + p.m3) + 2 * p.m4 + p.m6, rel=1e-15)
