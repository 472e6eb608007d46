"""Figures and statements of other authors, judged: a test for each line of docs/published.md."""

from __future__ import annotations

import re
import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import workbench as wb
from workbench.library.shelf import entry

MOTOR, STIFFNESS, REST, ANCHOR = 0.033, 4530.0, 0.07785, np.array([0.014, 0.0, 0.072])
BETA = -0.0617138900142764496358948458001
BETA_ADD, THETA_ADD = 14222.4439199541138705911625887, -10666.8329399655854029433719415
SOLUTION = {
    "beta": 0.1581077119629904e2, "theta": -0.1575637105984298e2, "gamma": 0.4082224013073101e-1,
    "phi": -0.5347301163226948, "delta": 0.5244099658805304, "omega": 0.5347301163226948,
    "epsilon": 0.1048080741042263e1,
}  # fmt: skip
RATE = 0.1139920302151208e4
"""[TestSet], Andrews' squeezing mechanism: motor, spring, initial accelerations, and the solution at 0.03 s."""


@pytest.fixture(scope="module")
def andrews() -> tuple[wb.Robot, SimpleNamespace, dict[str, Any]]:
    robot = wb.load_robot(entry("andrews").folder)
    return robot, SimpleNamespace(**robot.values), runpy.run_path(str(entry("andrews").formulas[0]))


def spring(place: np.ndarray) -> np.ndarray:
    way = place - ANCHOR
    length = np.linalg.norm(way, axis=1, keepdims=True)
    return -STIFFNESS * (length - REST) / length * way


def test_the_initial_acceleration_of_andrews_mechanism(
    andrews: tuple[wb.Robot, SimpleNamespace, dict[str, Any]],
) -> None:
    reference, q = andrews[0].reference, np.array([[BETA]])
    force = spring(reference.inverse_dynamics(q, 0 * q, 0 * q).x)
    needed = reference.inverse_dynamics(q, 0 * q, 0 * q + BETA_ADD, external_force=force).tau[0, 0]
    assert abs(needed - MOTOR) < 1e-9 * MOTOR
    other = reference.inverse_dynamics(q, 0 * q, 0 * q + 1.0001 * BETA_ADD, external_force=force).tau[0, 0]
    assert abs(other - MOTOR) > 1e-5 * MOTOR


def test_the_initial_acceleration_of_the_rod(andrews: tuple[wb.Robot, SimpleNamespace, dict[str, Any]]) -> None:
    _, p, module = andrews
    foot, corner, *_ = module["motion"](p, np.array([BETA]))
    turn = module["body"](0.0, 0.0, foot, corner, 0.0)[3]  # of K2 by beta; Theta is beyond beta
    assert abs((turn[0] - 1) * BETA_ADD - THETA_ADD) < 1e-9


@pytest.mark.slow
def test_the_published_solution_after_30_ms(andrews: tuple[wb.Robot, SimpleNamespace, dict[str, Any]]) -> None:
    _, p, module = andrews

    def rates(_: float, state: np.ndarray) -> list[float]:
        q, rate = np.full((2, 1), state[0]), np.array([[state[1]], [0.0]])
        force = spring(module["forward"](p, q[:1]))
        # the torque at no acceleration, and the inertia
        tau = module["dyads"](p, q, rate, np.array([[0.0], [1.0]]), np.concatenate([force, 0 * force]))
        return [state[1], (MOTOR - tau[0, 0]) / tau[1, 0]]

    found = solve_ivp(rates, (0.0, 0.03), [BETA, 0.0], method="DOP853", rtol=1e-13, atol=1e-13)
    beta, rate = found.y[:, -1]
    foot, corner, left, right = (points[0][0] for points in module["motion"](p, np.array([beta])))
    a, b = p.xa + 1j * p.ya, p.xb + 1j * p.yb
    angles = {"gamma": 1j * (corner - b), "delta": left - a, "epsilon": 1j * (right - a)}
    turned = {name: float(np.angle(way)) for name, way in angles.items()} | {"beta": beta}
    turned["theta"] = float(np.angle((foot - corner) * np.exp(-1j * beta)))
    turned["phi"] = float(np.angle(1j * (corner - left))) - turned["delta"]
    turned["omega"] = float(np.angle(corner - right)) - turned["epsilon"]
    for name, value in SOLUTION.items():
        off = (turned[name] - value + np.pi) % (2 * np.pi) - np.pi
        assert abs(off) < 2e-9, name
    assert abs(rate - RATE) < 2e-9 * RATE


def test_a_minus_sign_is_lost_in_the_benchmark_pages_table(
    andrews: tuple[wb.Robot, SimpleNamespace, dict[str, Any]],
) -> None:
    """[MBSbenchmarks] page A03: "B 0.03635 0.03273"; K1 and K2 in line, FEB = 2.088 rad, beta = -0.0620 rad."""
    p = andrews[1]
    corner = (p.rr - p.d) * np.exp(-0.0620j)
    for x, open_by in ((0.03635, (0.02, 0.1)), (-0.03635, (0.0, 1e-4))):
        gap = abs(abs(corner - (x + 0.03273j)) - p.ss)
        assert open_by[0] <= gap < open_by[1]


def bricard() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_path(str(entry("bricard").robot.model))
    return model, mujoco.MjData(model)


def curve() -> tuple[np.ndarray, np.ndarray]:
    """Angles A, B of successive links, both halves of cos A + cos B + cos A cos B = 0."""
    a = np.linspace(-np.arccos(-0.5), np.arccos(-0.5), 201)
    b = np.arccos(np.clip(-np.cos(a) / (1 + np.cos(a)), -1, 1))
    return np.concatenate([a, a]), np.concatenate([b, -b])


def test_bricards_mechanism_has_no_freedom_by_gruebler_and_one_in_truth() -> None:
    mobility = wb.load_robot(entry("bricard").folder).reference.mobility()
    assert 6 * 5 - 5 * 6 == 0
    assert (mobility.mobility, mobility.rank, mobility.constraint_rows) == (1, 4, 6)


def test_the_configurations_of_bricards_mechanism_are_a_smooth_closed_curve() -> None:
    first, second = curve()
    gradient = np.hypot(np.sin(first) * (1 + np.cos(second)), np.sin(second) * (1 + np.cos(first)))
    assert gradient.min() > 0.86
    model, data = bricard()
    for a, b in zip(first, second, strict=True):
        data.qpos[:] = [np.pi / 2 - a, np.pi / 2 - b, np.pi / 2 - a, np.pi / 2 - b, np.pi / 2 - a]
        mujoco.mj_forward(model, data)
        places = {name: data.site(name).xpos.copy() for name in ("end", "end_axis", "ground", "ground_axis")}
        gap = [np.abs(places["end" + end] - places["ground" + end]).max() for end in ("", "_axis")]
        assert max(gap) < 1e-14
        rows = np.zeros((6, model.nv))
        for number, name in enumerate(("end", "end_axis")):
            mujoco.mj_jacSite(model, data, rows[3 * number : 3 * number + 3], None, data.site(name).id)
        assert np.linalg.matrix_rank(rows, tol=1e-6) == 4
    data.qpos[:] = [0.1, 0.1, 0.1, 0.1, 0.1]  # not on the curve
    mujoco.mj_forward(model, data)
    assert np.abs(data.site("end").xpos - data.site("ground").xpos).max() > 1e-3


TABLE_1 = {
    "upu": "3-UPU", "puu": "3-PUU", "rrc": "3-RRC", "tripteron": "3-CRR", "rpc": "3-RPC", "prc": "3-PRC",
}  # fmt: skip
"""Robots of the library that are lines of Table 1 of [GarciaMurillo2016]."""


@pytest.mark.parametrize("name", TABLE_1)
def test_a_robot_of_table_1_is_translational(name: str) -> None:
    robot, rng = wb.load_robot(entry(name).folder), np.random.default_rng(7)
    assert robot.reference.mobility().mobility == 3
    q = robot.home + 0.01 * rng.uniform(-1, 1, (8, 3))
    found = robot.reference.inverse_dynamics(q, rng.normal(size=(8, 3)), rng.normal(size=(8, 3)))
    assert np.abs(found.omega).max() < 1e-12
    assert np.abs(found.rotation - found.rotation[0]).max() < 1e-12
    assert np.linalg.matrix_rank(robot.jacobian(q[:1])[0]) == 3


def test_the_3_crr_is_linear() -> None:
    robot, rng = wb.load_robot(entry("tripteron").folder), np.random.default_rng(8)
    q = 0.04 * rng.uniform(-1, 1, (20, 3))
    assert np.abs(robot.forward_kinematics(q) - q).max() < 1e-13
    assert np.abs(robot.jacobian(q) - np.eye(3)).max() < 1e-12


@pytest.mark.parametrize("name", ["puu", "orthoglide"])
def test_the_orthoglide_is_isotropic_where_its_legs_are_at_right_angles(name: str) -> None:
    robot = wb.load_robot(entry(name).folder)
    q = np.zeros((1, 3))
    assert np.abs(robot.forward_kinematics(q)).max() < 1e-13
    assert np.abs(robot.jacobian(q)[0] - np.eye(3)).max() < 1e-12
    assert np.abs(robot.jacobian(q + 0.05)[0] - np.eye(3)).max() > 1e-2


def test_each_line_of_the_page_is_a_source_that_is_explained(repository: Path) -> None:
    page = (repository / "docs" / "published.md").read_text(encoding="utf-8")
    lines = re.findall(r"^\| \[(\w+)\] \|.*\| (holds|refuted)", page, re.MULTILINE)
    assert len(lines) == 9
    references = (repository / "docs" / "references.md").read_text(encoding="utf-8")
    assert all(f"**[{key}]**" in references for key, _ in lines)
