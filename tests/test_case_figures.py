"""Figures that the verdict on a case is made of: unloaded joints, distances of platforms, what is kept of evidence."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from workbench.campaign import evidence as evidence_module
from workbench.campaign.evidence import Evidence, check_engines
from workbench.campaign.kinematics import KinematicsChecks, KinematicsRow, _row
from workbench.campaign.platform import _apart
from workbench.campaign.unloaded import UNLOADED, joint_error, largest_reaction, normaliser_of
from workbench.errors import SpecError

REACTION = 200.0


def test_the_largest_reaction_is_the_longest_vector_of_all() -> None:
    one, other = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 0.0]]), np.array([[1.0, 2.0, 2.0]])
    assert largest_reaction([one, other]) == 5.0
    assert largest_reaction([other]) == 3.0
    assert largest_reaction([]) == 0.0


def test_a_joint_without_force_is_judged_by_what_its_bearings_carry() -> None:
    limit = UNLOADED * REACTION
    reference = np.array([0.0, 0.5 * limit, -0.25 * limit, 0.0])
    off = np.array([0.0, 0.1 * limit, -0.3 * limit, 0.0])
    found = joint_error(reference + off, reference, REACTION)
    assert found.peak_error == pytest.approx(0.3, rel=1e-12)
    assert found.pointwise_error == found.peak_error
    assert found.pointwise_skipped == 0
    assert found.rms_error == pytest.approx(math.sqrt((0.1**2 + 0.3**2) / 4), rel=1e-12)
    assert found.peak_reference == 0.5 * limit
    assert normaliser_of(found, REACTION) == limit


@pytest.mark.parametrize(("peak", "divisor"), [(0.999, 1.0), (1.0, 1.0), (1.5, 1.5)])
def test_where_a_joint_begins_to_be_loaded(peak: float, divisor: float) -> None:
    limit = UNLOADED * REACTION
    reference = np.array([0.0, peak * limit])
    found = joint_error(reference + 0.3 * limit, reference, REACTION)
    assert found.peak_error == pytest.approx(0.3 / divisor, rel=1e-12)
    assert normaliser_of(found, REACTION) == pytest.approx(divisor * limit, rel=1e-12)


def test_distances_of_platform_motions() -> None:
    still, moved = np.zeros((2, 3)), np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 4.0]])
    assert _apart(still, still) == 0.0
    assert _apart(moved, still) == math.inf
    assert _apart(1.1 * moved, moved) == pytest.approx(0.1, rel=1e-12)
    assert _apart(still, moved) == 1.0


def test_a_second_engine_is_told_of_only_where_one_was_asked() -> None:
    assert Evidence().facts()["second_engine"] is None
    spread = {"lumped": {"q1": 1e-12}}
    assert Evidence(spread=spread).facts()["second_engine"] == {"engine": "pinocchio", "spread": spread}


@pytest.mark.parametrize(
    ("engines", "message"), [(("drake",), 'unknown engine "drake"'), (("pinocchio",), "mujoco is the reference")]
)
def test_engines_that_are_refused(engines: tuple[str, ...], message: str) -> None:
    with pytest.raises(SpecError, match=message):
        check_engines(engines)


def test_the_second_engine_is_looked_for_only_where_it_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    from workbench.reference import pinocchio_reader

    monkeypatch.setattr(pinocchio_reader, "import_pinocchio", lambda: asked.append("pinocchio"))
    check_engines(("mujoco",))
    assert asked == []
    check_engines(("mujoco", "pinocchio"))
    assert asked == ["pinocchio"]


@pytest.mark.parametrize(
    ("worth", "shares"),
    [
        ([0.0, 0.0], {}),
        ([0.02, 0.0], {"q1": 0.01, "q2": 0.0}),
        ([0.02, 0.1], {"q1": 0.01, "q2": 0.1 / 5.0}),
    ],
)
def test_what_a_model_leaves_open_is_a_share_of_the_peak(
    monkeypatch: pytest.MonkeyPatch, worth: list[float], shares: dict[str, float]
) -> None:
    monkeypatch.setattr(evidence_module, "left_open", lambda *_: np.array(worth))
    motion = SimpleNamespace(q=None, qd=None, qdd=None)
    case: Any = SimpleNamespace(motion=motion, force=None)
    result: Any = SimpleNamespace(tau=np.array([[1.0, -5.0], [-2.0, 3.0]]))
    reference: Any = SimpleNamespace(joint_names=("q1", "q2"))
    assert evidence_module._left_open(case, reference, "lumped", result) == pytest.approx(shares)
    result.tau[:, 0] = 0.0
    found = evidence_module._left_open(case, reference, "lumped", result)
    assert (found.get("q1") == math.inf) == bool(shares)


def row(error: float, bound: float, verdict: str) -> KinematicsRow:
    return KinematicsRow("mine", "position", "x", error, 1.0, "m", bound, verdict)


def test_kinematics_beyond_their_bound_fail_the_case() -> None:
    facts = {"status": "ok", "message": ""}
    assert KinematicsChecks().noted(facts) is facts
    right = KinematicsChecks([row(1e-12, 1e-9, "pass")]).noted(facts)
    assert len(right["kinematics_checks"]) == 1
    assert {key: right[key] for key in facts} == facts
    for checks in (KinematicsChecks([row(1e-3, 1e-9, "fail")]), KinematicsChecks([], ["mine.py:3: it raised"])):
        noted = checks.noted(facts)
        assert {key: noted[key] for key in facts} != facts
        assert "kinematics_checks" in noted


def test_errors_of_kinematics_are_over_the_largest_of_what_is_compared() -> None:
    formula: Any = SimpleNamespace(name="mine", kind="position", registration=SimpleNamespace(bound=1e-3))
    alike = np.array([0.0, 4.0, -1.0])
    found = _row(formula, "x", "m", np.array([0.0, 1e-3, -3e-3]), alike)
    assert found.error == pytest.approx(3e-3 / 4.0, rel=1e-12)
    assert (found.scale, found.verdict) == (4.0, "pass")
    assert _row(formula, "x", "m", np.array([5e-3]), alike).verdict == "fail"
    assert _row(formula, "x", "m", np.array([math.nan]), alike).verdict == "fail"
