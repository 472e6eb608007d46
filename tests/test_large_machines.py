"""Machines of 15 to 60 joints: towers of loops, coupled fingers. Of more than a few hundred: one line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

from made_machines import HEAD, custom, hand, tower
from nullspace_oracle import NullSpaceOracle
from workbench.errors import ModelError
from workbench.importing.proposal import propose
from workbench.limits import MOST_FREEDOMS
from workbench.reference import MujocoReference
from workbench.reference.power import PLAIN, power_balance
from workbench.reference.power_terms import terms_of
from workbench.reference.survey import INDEPENDENT, _Rest

AGREE = 1e-9
FORCE = np.array([1.0, 2.0, -3.0])
MACHINES: dict[str, tuple[Callable[[], tuple[str, list[str]]], str, int, float]] = {
    "21 joints, 7 loops": (lambda: tower(7, 1), "top6", 21, 0.05),
    "60 joints, 20 loops": (lambda: tower(20, 2), "top19", 60, 0.02),
    "15 joints, 14 quartics": (lambda: hand(3), "tip4", 15, 0.05),
}


def made(name: str, tmp_path: Path) -> tuple[MujocoReference, NullSpaceOracle, list[np.ndarray]]:
    make, _, joints, size = MACHINES[name]
    text, actuated = make()
    path = tmp_path / "model.xml"
    path.write_text(text, encoding="utf-8")
    oracle = NullSpaceOracle(text, actuated)
    assert oracle.model.nv == joints
    rng = np.random.default_rng(3)
    t = np.linspace(0.0, 1.0, 30)[:, None]
    phase, rate = rng.uniform(0, 6, len(actuated)), rng.uniform(1, 4, len(actuated))
    turn = rate * t + phase
    home = np.array(oracle.model.qpos0)[oracle.adrs]
    motion = home + size * (np.sin(turn) - np.sin(phase)), size * rate * np.cos(turn), -size * rate**2 * np.sin(turn)
    return MujocoReference(path), oracle, list(motion)


@pytest.mark.parametrize("name", MACHINES)
def test_torques_are_the_null_spaces(tmp_path: Path, name: str) -> None:
    reference, oracle, (q, qd, qdd) = made(name, tmp_path)
    tau = reference.inverse_dynamics(q, qd, qdd, external_force=FORCE).tau
    site = MACHINES[name][1]
    for s in (0, 13, 29):
        pose = oracle.close(oracle.model.qpos0, q[s])
        expected = oracle.inverse_dynamics(pose, qd[s], qdd[s], site, FORCE).tau
        assert np.abs(tau[s] - expected).max() < AGREE * np.abs(expected).max()
        spoiled = oracle.inverse_dynamics(pose, qd[s], 1.0001 * qdd[s], site, FORCE).tau
        assert np.abs(spoiled - expected).max() > AGREE * np.abs(expected).max()


@pytest.mark.parametrize("name", MACHINES)
def test_rounding_of_the_power_balance_is_told_from_wrong_torques(tmp_path: Path, name: str) -> None:
    reference, _, (q, qd, qdd) = made(name, tmp_path)
    balance = power_balance(reference, q, qd, qdd, external_force=FORCE)
    assert balance.uncertainty <= PLAIN
    tau = reference.inverse_dynamics(q, qd, qdd, external_force=FORCE).tau
    wrong = power_balance(reference, q, qd, qdd, external_force=FORCE, tau=tau * (1 + 1e-7))
    assert wrong.uncertainty > 1e-8


def test_a_large_machine_reaches_no_more_than_rounding(tmp_path: Path) -> None:
    reference, _, (q, qd, qdd) = made("60 joints, 20 loops", tmp_path)
    balance = power_balance(reference, q, qd, qdd, external_force=FORCE)
    assert balance.relative > PLAIN
    assert balance.relative < balance.rounding < 100 * balance.relative


def test_summands_of_a_balance_are_counted_by_their_sizes() -> None:
    """A weight on a spring and a damper, by hand; of a state in which the summands cancel."""
    mass, height, rate, pull, stiffness, damping, gravity = 2.0, -0.3, 4.0, -5.0, 70.0, 6.0, 9.81
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 -{gravity}"/><worldbody><body><joint type="slide" axis="0 0 1"'
        f' stiffness="{stiffness}" damping="{damping}"/><geom size=".1" mass="{mass}"/></body></worldbody></mujoco>'
    )
    terms = terms_of(model, np.array([[height]]), np.array([[rate]]), np.array([[pull]]))
    weight, spring = mass * gravity, stiffness * abs(height)
    assert terms.energy[0] == pytest.approx(weight * abs(height) + mass * rate**2 / 2 + spring * abs(height), rel=1e-12)
    passive = abs(stiffness * -height - damping * rate)
    assert terms.power[0] == pytest.approx(rate * (mass * abs(pull) + weight + passive), rel=1e-12)


def loose(joints: int) -> str:
    """Bodies side by side, each on a hinge with a motor."""
    body = '<body><joint name="j{0}"/><geom size=".01" mass="1"/><site name="s{0}"/></body>'
    bodies = "".join(body.format(k) for k in range(joints))
    motors = "".join(f'<motor joint="j{k}"/>' for k in range(joints))
    return f"{HEAD}{custom('s0')}<worldbody>{bodies}</worldbody><actuator>{motors}</actuator></mujoco>"


def test_more_joints_than_can_be_answered_for_are_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "many.xml"
    said = rf"many.xml: joints with {MOST_FREEDOMS + 1} freedoms; allowed: {MOST_FREEDOMS}; "
    path.write_text(loose(MOST_FREEDOMS + 1), encoding="utf-8")
    for look in (MujocoReference, propose):
        with pytest.raises(ModelError, match=said) as caught:
            look(path)
        assert "\n" not in str(caught.value)
    path.write_text(loose(MOST_FREEDOMS), encoding="utf-8")
    assert len(MujocoReference(path).joint_names) == MOST_FREEDOMS


@pytest.mark.parametrize("spoiled", [False, True])
def test_joints_that_drive_a_motion_are_counted_as_by_rank(spoiled: bool) -> None:
    """Step by step against the rank of all columns taken so far; the twin forgets every second step."""
    rng = np.random.default_rng(4)
    unlike = 0
    for _ in range(20):
        motions = np.linalg.qr(rng.normal(size=(12, 5)))[0].T
        motions[:, rng.choice(12, 4, replace=False)] = 0.0
        motions = np.linalg.qr(motions.T)[0].T
        rest, taken = _Rest(motions), np.zeros((0, 5))
        for count, column in enumerate(rng.permutation(12)):
            more = np.vstack([taken, motions[:, column]])
            free = np.linalg.matrix_rank(more, tol=INDEPENDENT) > len(taken)
            taken = more if free else taken
            unlike += rest.take(column) is not bool(free)
            if spoiled and count % 2:
                rest._count = max(0, rest._count - 1)
            left = np.linalg.svd(taken)[2][len(taken) :] @ motions
            unlike += bool(np.abs(rest.scores - np.linalg.norm(left, axis=0)).max() > 1e-6)
    assert unlike > 5 if spoiled else unlike == 0
