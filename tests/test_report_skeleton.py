"""The points that a drawing of the mechanism joins: bars keep their lengths, loops close, the platform goes its way."""

from __future__ import annotations

import numpy as np
import pytest

import workbench as wb
from workbench.reference.skeleton import Skeleton, skeleton

MODELS = {
    "asym_2rss_ppap": (0.05, 0.75, 0.85),
    "planar_4rprp": (0.39, 0.37, 0.395),
}


def drawn(name: str, **parameters: float) -> tuple[Skeleton, np.ndarray, wb.MujocoReference]:
    q = np.array(MODELS[name]) + 0.02 * np.random.default_rng(3).standard_normal((5, 3))
    model = f"models/{name}.xml"
    reference = wb.MujocoReference(model, **parameters)
    found = reference.inverse_dynamics(q, 0 * q, 0 * q)
    return skeleton(reference, found.qpos), q, reference


@pytest.fixture(autouse=True)
def in_the_repository(repository: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(str(repository))


def length(found: Skeleton, one: str, other: str) -> np.ndarray:
    return np.linalg.norm(found.points[one] - found.points[other], axis=1)


def test_bars_have_the_lengths_of_the_paper() -> None:
    found, q, _ = drawn("asym_2rss_ppap", a1=0.21)
    (arm,), (rod,) = found.links["arm_left"], found.links["rod_left"]
    assert np.abs(length(found, *arm) - 0.21).max() < 1e-12
    assert np.abs(length(found, *rod) - 0.30).max() < 1e-12
    assert np.abs(length(found, *arm) - 0.20).max() > 1e-3  # the length before the change is seen to be wrong
    elbow = found.points[arm[1]]
    expected = np.stack([0 * q[:, 1], -0.2 - 0.21 * np.cos(q[:, 1]), 0.21 * np.sin(q[:, 1])], axis=1)
    assert np.abs(elbow - expected).max() < 1e-12
    assert np.abs(elbow - expected * [1, 1, -1]).max() > 0.1


def test_the_platform_is_where_the_closed_form_says() -> None:
    for name in MODELS:
        found, q, reference = drawn(name)
        x = wb.load_mechanism(f"models/{name}.xml").forward_kinematics(q)
        assert np.abs(found.points[found.platform] - x).max() < 1e-12
        assert np.abs(found.points[found.platform] - x[::-1]).max() > 1e-3
        down = np.array(reference.compiled().opt.gravity) @ reference.base_rotation
        assert np.dot(found.up, down) == pytest.approx(-np.linalg.norm(down))


def test_the_loop_closes_in_the_drawing() -> None:
    found, _, _ = drawn("asym_2rss_ppap")
    assert np.abs(length(found, "site.rod_left_tip", "site.platform_E")).max() < 1e-12
    assert np.abs(length(found, "site.rod_left_tip", "site.platform_F")).min() > 0.1


def test_every_moving_body_and_every_joint_is_drawn() -> None:
    for name in MODELS:
        found, _, reference = drawn(name)
        model = reference.compiled()
        moving = {model.body(b).name for b in range(model.nbody) if reference.structure.moves[b].any()}
        joined = {point for pairs in found.links.values() for pair in pairs for point in pair}
        assert {name for name in moving if f"body.{name}" not in joined} <= {"payload"}
        assert set(found.joints) == {model.joint(j).name for j in range(model.njnt)}
        assert [n for n, joint in found.joints.items() if joint["actuated"]] == list(reference.joint_names)
        for joint in found.joints.values():
            assert joint["point"] in found.points
        assert joined <= set(found.points)


def test_constant_facts_are_json() -> None:
    found, _, _ = drawn("planar_4rprp")
    facts = found.facts()
    assert facts["up"] == pytest.approx([0.0, 1.0, 0.0])
    assert facts["platform"] == found.platform
