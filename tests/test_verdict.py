"""What a row of errors means: bounds, declared failures, and whether the reference is good enough to say so."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from workbench.campaign.candidate_spec import CandidateSpec
from workbench.campaign.changed import Change
from workbench.campaign.changes import Changes
from workbench.campaign.claims import judge_claims
from workbench.campaign.evidence import Evidence, check_engines
from workbench.campaign.spec import Campaign, CaseSpec, ClaimSpec
from workbench.campaign.verdict import FAILURES, kind_of, verdict_of
from workbench.errors import SpecError
from workbench.reference.power import PLAIN, PowerBalance

BOUND = 1e-10
PLAINLY = CandidateSpec(name="x", reference="lumped", bound=BOUND)
DECLARED = CandidateSpec(name="x", reference="lumped", bound=BOUND, expect_fail={"one": ["q1"]})
MEASURED = CandidateSpec(name="x", reference="lumped")


@pytest.mark.parametrize(
    ("error", "plainly", "declared"),
    [
        (0.0, "pass", "unexpected-pass"),
        (BOUND, "pass", "unexpected-pass"),
        (1.001 * BOUND, "fail", "expected-fail"),
        (math.inf, "fail", "fail"),
        (math.nan, "fail", "fail"),
    ],
)
def test_within_the_bound_or_not(error: float, plainly: str, declared: str) -> None:
    assert verdict_of(PLAINLY, "one", "q1", error) == plainly
    assert verdict_of(DECLARED, "one", "q1", error) == declared
    # a failure is declared for one joint of one case
    assert verdict_of(DECLARED, "one", "q2", error) == plainly
    assert verdict_of(DECLARED, "two", "q1", error) == plainly
    assert verdict_of(MEASURED, "one", "q1", error, 1.0) == "measured"


@pytest.mark.parametrize(
    ("error", "uncertainty", "verdict"),
    [
        # within: what the reference leaves open has to be under a tenth of the bound
        (0.0, 0.09 * BOUND, "pass"),
        (0.0, 0.11 * BOUND, "undecided"),
        (0.9 * BOUND, 0.11 * BOUND, "undecided"),
        # beyond: under a tenth of the error
        (50 * BOUND, 4 * BOUND, "fail"),
        (50 * BOUND, 6 * BOUND, "undecided"),
        (math.inf, 1.0, "fail"),
        # nobody looked
        (0.0, math.nan, "pass"),
        (50 * BOUND, math.nan, "fail"),
    ],
)
def test_a_verdict_needs_a_reference_ten_times_as_good(error: float, uncertainty: float, verdict: str) -> None:
    assert verdict_of(PLAINLY, "one", "q1", error, uncertainty) == verdict


def test_what_fails_a_campaign() -> None:
    assert {"fail", "unexpected-pass", "undecided"} == FAILURES


def test_kinds_of_rows() -> None:
    found = [kind_of(one, "distributed") for one in (PLAINLY, DECLARED, MEASURED)]
    assert found == ["verification", "expected-failure", "modelling"]
    assert kind_of(MEASURED, "lumped") == "unbounded"


def test_a_declared_failure_needs_a_bound() -> None:
    with pytest.raises(ValueError, match="expect_fail needs a bound"):
        CandidateSpec(name="x", reference="lumped", expect_fail={"one": ["q1"]})


def test_a_bound_of_the_case_goes_over_the_candidates() -> None:
    motion = {"kind": "rest", "q": [0.0], "samples": 2}
    case = CaseSpec.model_construct(name="one", motion=motion, bounds={"q2": 1e-3})
    assert PLAINLY.in_case(case, "q1").bound == BOUND
    assert PLAINLY.in_case(case, "q2").bound == 1e-3
    assert DECLARED.in_case(case, "q2").expect_fail == DECLARED.expect_fail
    # what has no bound is measured, whatever the case says
    assert MEASURED.in_case(case, "q2").bound is None


def balance(relative: float, rounding: float = 0.0) -> PowerBalance:
    none = np.zeros(1)
    return PowerBalance(np.zeros(1, dtype=np.int64), none, none, none, none, none, 1.0, relative, 0, 0.0, rounding)


KNOWN = {"power": 3e-9, "spread": 2e-9, "left open": 1e-9}


@pytest.mark.parametrize("largest", KNOWN)
def test_the_references_uncertainty_is_the_largest_that_is_known(largest: str) -> None:
    worth = KNOWN | {largest: 5e-9}
    evidence = Evidence(
        power={"lumped": balance(worth["power"])},
        spread={"lumped": {"q1": worth["spread"]}},
        undetermined={"lumped": {"q1": worth["left open"]}},
    )
    assert evidence.uncertainty("lumped", "q1") == 5e-9
    # what was not looked at on a joint or for a mass model says nothing of it
    assert evidence.uncertainty("lumped", "q2") == worth["power"]
    assert math.isnan(evidence.uncertainty("distributed", "q1"))


def test_one_figure_alone_is_enough() -> None:
    assert Evidence(spread={"lumped": {"q1": 7.0}}).uncertainty("lumped", "q1") == 7.0
    assert Evidence(power={"lumped": balance(7.0)}).uncertainty("lumped", "q1") == 7.0
    assert Evidence(undetermined={"lumped": {"q1": 7.0}}).uncertainty("lumped", "q1") == 7.0


def test_a_balance_of_nothing_is_no_uncertainty_of_zero() -> None:
    assert math.isnan(Evidence(power={"lumped": balance(math.nan)}).uncertainty("lumped", "q1"))


@pytest.mark.parametrize(
    ("relative", "rounding", "expected"),
    [(1e-13, 0.0, 1e-13), (1e-13, 1e-9, 1e-13), (1e-9, 1e-8, PLAIN), (1e-8, 1e-9, 9e-9), (1e-8, 0.0, 1e-8)],
)
def test_rounding_of_heavy_bodies_is_not_put_down_to_the_torques(
    relative: float, rounding: float, expected: float
) -> None:
    assert balance(relative, rounding).uncertainty == pytest.approx(expected, rel=1e-12)


# claims: what a paper prints against what was measured

ROWS = [
    ("one", "x", "lumped", "q1", 0.03, 0.01),
    ("one", "x", "lumped", "q2", 0.05, 0.02),
    ("one", "x", "distributed", "q1", 0.5, 0.03),
    ("one", "y", "lumped", "q1", 0.7, 0.04),
    ("two", "x", "lumped", "q1", 0.9, 0.06),
]
"""case, candidate, reference, joint, peak error, rms error"""
FACTS = {
    "one": {"closure_residual": 0.0, "peak_speed": 2.5, "solutions_at_start": [[0.1, 0.2, 0.3], [0.1, -0.2, 0.3]]},
    "two": {"closure_residual": 0.0, "peak_speed": None},
    "not driven": {},
}


def judged(kind: str, claimed: float, within: float = 0.0, **measure: object) -> tuple[float | None, bool | None]:
    claim = ClaimSpec(
        id="c",
        text="t",
        source="s",
        kind=kind,
        claimed=claimed,
        within=within,
        unit="",
        measure={"case": "one"} | measure,
    )  # type: ignore[arg-type]
    names = ("case", "candidate", "reference", "joint", "peak_error", "rms_error")
    rows = [SimpleNamespace(kind="verification", **dict(zip(names, row, strict=True))) for row in ROWS]
    campaign = Campaign.model_construct(claim=[claim])
    (found,) = judge_claims(campaign, {"x", "y"}, rows, FACTS, {}, None)  # type: ignore[arg-type]
    assert (found["id"], found["claimed"], found["kind"], found["within"]) == ("c", claimed, kind, within)
    return found["measured"], found["holds"]


CLAIM = ClaimSpec.model_validate(
    {"id": "c", "text": "t", "source": "s", "kind": "upper", "claimed": 1.0, "note": "as printed", "unit": "1"}
    | {"measure": {"case": "one", "quantity": "peak_error"}}
)


def judged_claim(claim: ClaimSpec = CLAIM, *, kind: str = "verification", **about: object) -> dict[str, object]:
    row = SimpleNamespace(
        kind=kind, case="one", candidate="x", reference="lumped", joint="q1", peak_error=0.5, rms_error=0.1
    )
    campaign = Campaign.model_construct(claim=[claim])
    robots, changes = about.get("robots", {}), about.get("changes", Changes())
    return judge_claims(campaign, {"x"}, [row], FACTS, robots, changes)[0]  # type: ignore[list-item,arg-type]


def test_a_claim_about_this_robot_says_nothing_of_others() -> None:
    found = judged_claim()
    assert (found["holds"], found["measured"], found["not_about"], found["note"]) == (True, 0.5, "", "as printed")


@pytest.mark.parametrize("kind", ["contrast", "recorded"])
def test_no_claim_is_judged_by_contrasts_or_recorded_torques(kind: str) -> None:
    assert judged_claim(kind=kind)["measured"] is None


class Table:
    """Parameters of which each stands for itself."""

    @staticmethod
    def changed(values: dict[str, float], settings: dict[str, float]) -> dict[str, float]:
        return values | settings


def robot_of(**values: float) -> SimpleNamespace:
    return SimpleNamespace(values=values, description=SimpleNamespace(table=Table))


OTHER_ARM = Change("a", "m", 0.3, 0.4, "--set", ("one",))


@pytest.mark.parametrize(
    ("named", "values", "changes", "not_about"),
    [
        # the claim names its own payload: about a robot that carries it, and about no other
        ({"m": 2.0}, {"m": 2.0, "a": 0.3}, Changes(), ""),
        ({"m": 2.0}, {"m": 1.0, "a": 0.3}, Changes(), "m is 1, not 2"),
        ({"m": 2.0}, {"m": 2.0, "a": 0.4}, Changes(parameters=(OTHER_ARM,)), "a is 0.4, not 0.3"),
        ({"m": 2.0}, {"m": 1.0, "a": 0.4}, Changes(parameters=(OTHER_ARM,)), "m is 1, not 2, a is 0.4, not 0.3"),
        # a model of another name is another robot, whatever its numbers
        ({"m": 2.0}, {"m": 2.0, "a": 0.3}, Changes("the model is other.xml"), "the model is other.xml"),
        ({}, {"m": 1.0, "a": 0.3}, Changes(), ""),
        ({}, {"m": 1.0, "a": 0.4}, Changes(parameters=(OTHER_ARM,)), Changes(parameters=(OTHER_ARM,)).why_not("one")),
    ],
)
def test_a_claim_is_about_the_robot_that_it_names(
    named: dict[str, float], values: dict[str, float], changes: Changes, not_about: str
) -> None:
    claim = CLAIM.model_copy(update={"parameters": named})
    found = judged_claim(claim, robots={"one": robot_of(**values)}, changes=changes)
    assert found["not_about"] == not_about
    assert (found["holds"], found["note"]) == ((None, "") if not_about else (True, "as printed"))


def test_a_bound_that_bounds_nothing_is_refused() -> None:
    CandidateSpec(name="x", reference="lumped", bound=1e6)
    with pytest.raises(ValueError, match="less than or equal to 1000000"):
        CandidateSpec(name="x", reference="lumped", bound=1.01e6)


@pytest.mark.parametrize(
    ("measure", "measured"),
    [
        ({}, 0.7),
        ({"candidate": "x"}, 0.5),
        ({"candidate": "x", "reference": "lumped"}, 0.05),
        ({"candidate": "x", "reference": "lumped", "joint": "q1"}, 0.03),
        ({"reference": "distributed"}, 0.5),
        ({"joint": "q2"}, 0.05),
        ({"case": "two"}, 0.9),
        ({"candidate": "z"}, None),
        ({"case": "three"}, None),
        ({"case": "not driven", "quantity": "peak_speed"}, None),
        ({"quantity": "rms_error", "candidate": "x"}, 0.03),
        ({"quantity": "peak_speed"}, 2.5),
        ({"quantity": "peak_speed", "case": "two"}, None),
        ({"quantity": "peak_acceleration"}, None),
        # the nearest solution, and of it the coordinate that is farthest off
        ({"quantity": "solution_distance", "point": [0.1, -0.21, 0.35]}, 0.05),
    ],
)
def test_what_a_claim_measures(measure: dict[str, object], measured: float | None) -> None:
    found, holds = judged("upper", 1.0, **({"quantity": "peak_error"} | measure))
    assert found == (None if measured is None else pytest.approx(measured, rel=1e-12))
    assert (holds is None) == (measured is None)


@pytest.mark.parametrize(
    ("kind", "claimed", "within", "holds"),
    [
        ("upper", 0.71, 0.0, True),
        ("upper", 0.7, 0.0, False),  # "less than" is less
        ("upper", 0.69, 0.5, False),
        ("value", 0.71, 0.02, True),
        ("value", 0.69, 0.02, True),
        ("value", 0.75, 0.02, False),
        ("value", 0.65, 0.02, False),
    ],
)
def test_whether_a_claim_holds(kind: str, claimed: float, within: float, holds: bool) -> None:
    assert judged(kind, claimed, within, quantity="peak_error") == (0.7, holds)


def test_mujoco_is_the_reference_and_unknown_engines_are_refused() -> None:
    check_engines(("mujoco",))
    with pytest.raises(SpecError, match="mujoco is the reference and cannot be left out"):
        check_engines(("pinocchio",))
    with pytest.raises(SpecError, match='unknown engine "mujocco"; did you mean "mujoco"'):
        check_engines(("mujocco",))
