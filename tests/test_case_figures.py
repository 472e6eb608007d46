"""Figures that the verdict on a case is made of: unloaded joints, distances of platforms, what is kept of evidence."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from workbench.campaign import compare
from workbench.campaign import evidence as evidence_module
from workbench.campaign.evidence import Effort, Evidence, check_engines, gather_evidence
from workbench.campaign.kinematics import KinematicsChecks, KinematicsRow, _row, check_kinematics
from workbench.campaign.platform import _apart
from workbench.campaign.torques import torques_of
from workbench.campaign.unloaded import UNLOADED, joint_error, largest_reaction, normaliser_of
from workbench.campaign.user_candidates import SLOW_S, UserCandidate, load_candidates
from workbench.errors import ArrayError, CandidateError, SpecError

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


# --- kinematics of a user's own, by stand-ins: what is held against what ----------------------------------------------


def formula_of(kind: str, answer: Any, bound: float = 1e-6) -> Any:
    """A formula that notes what it was called with."""
    calls: list[Any] = []

    def kinematics(robot: Any, *given: Any) -> Any:
        calls.append((robot, *given))
        if isinstance(answer, Exception):
            raise answer
        return answer

    return SimpleNamespace(
        name="mine", kind=kind, kinematics=kinematics, registration=SimpleNamespace(bound=bound), calls=calls
    )


Q = np.array([[0.5, 2.0], [-4.0, 1.0]])
X = np.array([[1.0, -2.0, 0.3], [0.5, 8.0, -0.1]])


def checked(formula: Any) -> tuple[KinematicsChecks, Any]:
    robot = SimpleNamespace(
        offered_kinematics=[formula], coordinates=("x", "z", "ry"), task_units=("m", "m", "rad"), joints=("q1", "q2"),
        coordinate_units=("m", "rad"),
    )  # fmt: skip
    case: Any = SimpleNamespace(motion=SimpleNamespace(q=Q), robot=robot)
    reference: Any = SimpleNamespace(jacobian=lambda q, names: 2.0 * JACOBIAN if names == robot.coordinates else None)
    platform: Any = SimpleNamespace(task=(X, None, None))
    return check_kinematics(case, reference, platform), robot


JACOBIAN = np.arange(12.0).reshape(2, 3, 2) - 4.0


def test_a_forward_kinematics_is_held_against_the_platform() -> None:
    off = np.array([[0.0, 0.0, 2.0 * math.pi], [0.0, 4e-3, 1e-3 - 4.0 * math.pi]])  # whole turns are the same pose
    formula = formula_of("forward kinematics", X + off)
    found, robot = checked(formula)
    (robot_, q, x) = formula.calls[0]
    assert robot_ is robot
    assert q is Q
    assert x is X
    assert [(row.coordinate, row.unit) for row in found.rows] == [("x", "m"), ("z", "m"), ("ry", "rad")]
    # metres are over the largest of all metres, angles over the largest angle
    assert [row.error for row in found.rows] == pytest.approx([0.0, 4e-3 / 8.0, 1e-3 / 0.3], abs=1e-12)
    assert [row.scale for row in found.rows] == [8.0, 8.0, 0.3]
    assert [row.verdict for row in found.rows] == ["pass", "fail", "fail"]
    assert found.faults == []


def test_an_inverse_kinematics_is_held_against_the_joints() -> None:
    formula = formula_of("inverse kinematics", Q + np.array([[2.0 * math.pi, 0.0], [0.0, 1e-3 + 2.0 * math.pi]]))
    found, _ = checked(formula)
    assert formula.calls[0][1] is X
    assert formula.calls[0][2] is Q
    assert [row.coordinate for row in found.rows] == ["q1", "q2"]
    # a slider that is off by 2 pi metres is off
    assert [row.error for row in found.rows] == pytest.approx([2.0 * math.pi / 4.0, 1e-3 / 2.0], rel=1e-9)


def test_a_jacobian_is_held_against_the_references_row_by_row() -> None:
    spoiled = 2.0 * JACOBIAN
    spoiled[1, 2, 0] += 7.0
    found, _ = checked(formula_of("jacobian", spoiled))
    assert [row.error for row in found.rows] == pytest.approx([0.0, 0.0, 7.0 / 14.0], rel=1e-12)
    assert [row.unit for row in found.rows] == ["m per unit of q", "m per unit of q", "rad per unit of q"]


def test_a_kinematics_that_raises_is_a_fault_of_the_case() -> None:
    found, _ = checked(formula_of("forward kinematics", CandidateError("mine.py:3: it raised")))
    assert (found.rows, found.faults) == ([], ["mine.py:3: it raised"])


# --- torques of a user's own ------------------------------------------------------------------------------------------


class Given(UserCandidate):
    """A user's formula that answers what it is told to."""

    def __init__(self, answer: Any, seconds: float = 0.0) -> None:
        self.answer, self.seconds = answer, seconds
        self.told: list[Any] = []

    @property
    def seconds_per_sample(self) -> float:  # type: ignore[override]
        return self.seconds

    @property
    def where(self) -> str:  # type: ignore[override]
        return "mine.py:3"

    def __call__(self, robot: Any, *given: Any, **known: Any) -> Any:
        self.told.append((robot, *given, known))
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer


def torques(*answers: Any, timed: bool = True) -> Any:
    formulas = {f"f{i}": SimpleNamespace(function=answer) for i, answer in enumerate(answers)}
    motion = SimpleNamespace(q=Q, qd=2.0 * Q, qdd=3.0 * Q, t=np.array([0.0, 1.0]))
    case: Any = SimpleNamespace(motion=motion, robot=SimpleNamespace(candidates=formulas), force=5.0 * X)
    return torques_of(case, formulas, SimpleNamespace(x=X), timed=timed)  # type: ignore[arg-type]


def test_a_formula_is_given_the_motion_and_a_users_own_the_platforms_too() -> None:
    users = Given(Q)
    told: list[Any] = []

    def built_in(robot: Any, *given: Any) -> Any:
        told.append(given)
        return Q

    found = torques(users, built_in)
    for given in (told[0], users.told[0][1:-1]):
        for one, factor, what in zip(given, (1.0, 2.0, 3.0, 5.0), (Q, Q, Q, X), strict=True):
            np.testing.assert_array_equal(one, factor * what)
    known = users.told[0][-1]["known"]
    assert known["x"] is X
    assert list(known["t"]) == [0.0, 1.0]
    assert (found.faults, found.warnings) == ({}, [])


def test_a_formula_that_fails_costs_its_own_rows_and_fails_the_case() -> None:
    found = torques(Given(Q), Given(CandidateError("it raised")), Given(CandidateError("NaN", sample=1)))
    assert {name: (one.message, one.not_finite) for name, one in found.faults.items()} == {
        "f1": ("it raised", False),
        "f2": ("NaN", True),
    }
    assert np.isnan(found.torques["f1"]).all()
    assert np.isposinf(found.judged("f1")).all()
    assert found.judged("f0") is Q
    noted = found.noted({"status": "passed", "message": "first", "warnings": ["w"]})
    assert noted == {"status": "failed", "message": "first; it raised; NaN", "warnings": ["w", "it raised", "NaN"]}
    assert found.noted({"status": "passed", "message": None, "warnings": []})["message"] == "it raised; NaN"
    facts = {"status": "passed", "message": None, "warnings": []}
    assert torques(Given(Q)).noted(facts) is facts
    with pytest.raises(ArrayError, match=r"expected tau of shape \(2, 2\), got \(2, 3\)"):
        torques(Given(X))


def test_a_slow_formula_is_warned_of_only_where_time_may_count() -> None:
    slow = 2.0 * SLOW_S
    found = torques(Given(Q, slow), Given(Q, 0.5 * SLOW_S))
    assert found.warnings == [f'candidate "f0" (mine.py:3) is slow: {1e3 * slow:.3g} ms a sample']
    noted = found.noted({"status": "passed", "message": None, "warnings": ["w"]})
    assert noted == {"status": "passed", "message": None, "warnings": ["w", *found.warnings]}
    assert torques(Given(Q, slow), timed=False).warnings == []


# --- evidence ---------------------------------------------------------------------------------------------------------


def test_many_cases_gather_no_more_than_is_looked_at() -> None:
    assert Effort.of_many() == Effort(("mujoco",), budget=False, drawing=False, timed=False, described=False)
    assert Effort.of_many(("mujoco", "pinocchio"), budget=True).budget


@pytest.mark.parametrize(
    ("engines", "excess", "asked"),
    [
        (("mujoco",), (), False),
        (("mujoco", "pinocchio"), (), True),
        (("mujoco", "pinocchio"), (1,), False),  # of which one set of torques among many is the second engine's
    ],
)
def test_a_second_engine_is_asked_where_it_has_one_answer(
    monkeypatch: pytest.MonkeyPatch, engines: tuple[str, ...], excess: tuple[int, ...], asked: bool
) -> None:
    spread = {"lumped": {"q1": 1e-12}}
    monkeypatch.setattr(evidence_module, "_spread", lambda *_: spread)
    monkeypatch.setattr(evidence_module, "_left_open", lambda *_: {})
    case: Any = SimpleNamespace(motion=SimpleNamespace(t=np.zeros(2)), force=None)
    reference: Any = SimpleNamespace(excess_actuators=excess)
    found = gather_evidence(case, reference, {"lumped": None}, [], Effort(engines, budget=False))  # type: ignore[dict-item]
    assert found.spread == (spread if asked else {})
    assert (found.undetermined, found.power, found.replays) == ({}, {}, None)


def test_one_sample_is_nothing_to_drive_along() -> None:
    case: Any = SimpleNamespace(motion=SimpleNamespace(t=np.zeros(1)), robot=None, force=np.zeros((1, 3)))
    assert evidence_module._replays(case, None, []) is None  # type: ignore[arg-type]


def test_a_formula_of_the_time_is_not_driven_along(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The simulation's own states have no time of the motion."""
    formula = '@workbench.candidate("{0}", reference="lumped")\ndef {0}(p, q, qd, qdd{1}):\n    return q\n'
    file = tmp_path / "f.py"
    file.write_text("import workbench\n" + formula.format("plain", "") + formula.format("timed", ", t"))
    candidates: Any = {one.name: SimpleNamespace(function=one) for one in load_candidates([file])}
    assert sorted(candidates) == ["plain", "timed"]
    monkeypatch.setattr(evidence_module, "course_of", lambda case: None)
    monkeypatch.setattr(evidence_module, "replay", lambda reference, course, torques, *_: list(torques))
    robot = SimpleNamespace(candidates=candidates)
    case: Any = SimpleNamespace(
        motion=SimpleNamespace(t=np.arange(2.0)), robot=robot, force=np.zeros((2, 3)), spec=SimpleNamespace(replay=None)
    )
    assert evidence_module._replays(case, None, list(candidates)) == ["plain"]  # type: ignore[arg-type,comparison-overlap]


def test_hints_are_of_what_fails_and_has_a_familiar_shape(monkeypatch: pytest.MonkeyPatch) -> None:
    def hint(tau: Any, reference: Any, t: Any, joints: Any) -> str:
        return "" if tau == "right shape" else f"{tau} {reference} {t} {joints}"

    monkeypatch.setattr(compare, "hint_of", hint)
    case: Any = SimpleNamespace(motion=SimpleNamespace(t="t"), robot=SimpleNamespace(joints="q"))
    verdicts = {"a": "fail", "b": "pass", "c": "undecided", "d": "unexpected-pass", "e": "measured"}
    rows: Any = [SimpleNamespace(candidate=n, reference="lumped", verdict=v) for n, v in verdicts.items() for _ in "12"]
    torque: Any = {"a": "tau a", "b": "tau b", "c": "right shape", "d": "tau d", "e": "tau e"}
    results: Any = {"lumped": SimpleNamespace(tau="ref")}
    assert compare._hints(case, rows, torque, results) == [
        'candidate "a" against "lumped": tau a ref t q',
        'candidate "d" against "lumped": tau d ref t q',
    ]
