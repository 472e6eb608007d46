"""Misprints of [Almeida2010] as candidates, the campaign that declares their failures, and what declaring means."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from robots import Motion, motion_inside, peak_error, table_1
from workbench.campaign.candidate_spec import CandidateSpec
from workbench.campaign.evidence import Effort
from workbench.campaign.run import Outcome, run_campaign
from workbench.campaign.spec import load_campaign
from workbench.campaign.verdict import kind_of, verdict_of
from workbench.errors import SpecError
from workbench.robots.asym_2rss_ppap.candidates import CANDIDATES, MISPRINT_NAMES
from workbench.robots.asym_2rss_ppap.literal import APPENDIX_AS_PRINTED, Misprint, lumped_appendix

BOUND = 1e-10
ERRORS_ONLY = Effort(budget=False)


@pytest.fixture(scope="module")
def campaign_file(repository: Path) -> Path:
    return repository / "campaigns" / "almeida_2010_as_printed.toml"


@pytest.fixture(scope="module")
def outcome(campaign_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    return run_campaign(campaign_file, tmp_path_factory.mktemp("as_printed") / "run", effort=ERRORS_ONLY)


@pytest.fixture(scope="module")
def motion() -> Motion:
    found, _ = motion_inside(table_1(), np.random.default_rng(5), np.linspace(0.0, 1.0, 50))
    assert found is not None
    return found


# Candidates


def test_walking_through_the_candidates_meets_no_misprint(motion: Motion) -> None:
    mech = table_1()
    force = np.tile([3.0, -4.0, 5.0], (len(motion[0]), 1))
    assert len(list(mech.candidates)) == len(mech.candidates) == 5
    for name, candidate in mech.candidates.items():
        held_against = mech.inverse_dynamics(*motion, candidate.mass_model, force)
        assert peak_error(candidate.function(mech, *motion, force), held_against) <= BOUND, name


def test_every_form_that_is_wrong_on_purpose_is_wrong_and_found_by_name(motion: Motion) -> None:
    mech = table_1()
    zero = np.zeros_like(motion[0])
    for name, candidate in CANDIDATES.on_purpose.items():
        assert name in mech.candidates
        assert mech.candidates[name] is candidate
        mass_model = candidate.mass_model if candidate.mass_model in mech.mass_models else "distributed"
        error = peak_error(candidate.function(mech, *motion, zero), mech.inverse_dynamics(*motion, mass_model))
        assert error <= BOUND if name == "equimomental" else error > 1e-4, name


def test_end_masses_are_candidates_in_any_ratio() -> None:
    assert "end-masses-0.617" in CANDIDATES
    assert CANDIDATES["end-masses-0.617"].name == "end-masses-0.617"
    for wrong in ("end-masses-1.2", "end-masses", "lumped-as-misprinted"):
        assert wrong not in CANDIDATES


def test_as_printed_is_the_appendix_with_all_its_misprints(motion: Motion) -> None:
    mech = table_1()
    zero = np.zeros_like(motion[0])
    printed = CANDIDATES["lumped-as-printed"].function(mech, *motion, zero)
    literal = (mech.parameters, *motion, *mech.platform_motion(*motion), zero)
    np.testing.assert_array_equal(printed, lumped_appendix(*literal, misprints=APPENDIX_AS_PRINTED))
    for mended in APPENDIX_AS_PRINTED:
        assert np.abs(printed - lumped_appendix(*literal, misprints=APPENDIX_AS_PRINTED - {mended})).max() > 1e-3


def test_every_misprint_is_in_the_campaign(campaign_file: Path) -> None:
    campaign, _ = load_campaign(campaign_file)
    names = {candidate.name for candidate in campaign.candidate}
    assert set(MISPRINT_NAMES) == set(Misprint)
    for misprint, spelt in MISPRINT_NAMES.items():
        assert any(name.endswith(f"-only-{spelt}") for name in names), misprint
    for misprint in APPENDIX_AS_PRINTED:
        assert f"lumped-as-printed-but-{MISPRINT_NAMES[misprint]}" in names


# The campaign


def error(outcome: Outcome, case: str, candidate: str, joint: str) -> float:
    (found,) = [r.peak_error for r in outcome.rows if (r.case, r.candidate, r.joint) == (case, candidate, joint)]
    return found


@pytest.mark.parametrize(
    ("case", "candidate", "joint", "figure"),
    [
        ("simulation_1", "lumped-as-printed", "q2", 1.02),
        ("simulation_1", "lumped-as-printed", "q3", 1.02),
        ("simulation_2", "lumped-as-printed", "q2", 1.22),
        ("simulation_1", "lumped-only-k1", "q1", 0.005),
        ("simulation_2", "lumped-only-k1", "q1", 0.011),
        ("simulation_2", "lumped-only-f2", "q2", 0.060),
    ],
)
def test_what_each_misprint_costs(outcome: Outcome, case: str, candidate: str, joint: str, figure: float) -> None:
    assert error(outcome, case, candidate, joint) == pytest.approx(figure, rel=0.1)


def test_the_campaign_passes_because_everything_that_is_wrong_fails(outcome: Outcome) -> None:
    assert outcome.passed
    assert {row.verdict for row in outcome.rows} == {"pass", "expected-fail"}
    assert all(row.peak_error > 1e-3 for row in outcome.rows if row.verdict == "expected-fail")
    assert all(row.peak_error <= BOUND for row in outcome.rows if row.verdict == "pass")
    assert all(claim["holds"] for claim in outcome.manifest["claims"])


def test_a_misprint_of_the_sign_reaches_tau2_only_through_the_one_in_f2(outcome: Outcome) -> None:
    for case in ("simulation_1", "simulation_2"):
        assert error(outcome, case, "lumped-only-jq33", "q2") <= BOUND
        assert error(outcome, case, "lumped-as-printed-but-f2", "q2") <= BOUND
        assert error(outcome, case, "lumped-as-printed", "q2") > 1.0


def test_simulation_1_does_not_see_the_misprint_in_f2(outcome: Outcome) -> None:
    rows = [r for r in outcome.rows if (r.case, r.candidate) == ("simulation_1", "lumped-only-f2")]
    assert [row.verdict for row in rows] == ["pass"] * 3


# What a declaration means


SPOILED = """
format = 1
name = "declared"
title = "Declared failures"
model = "models/asym_2rss_ppap.xml"
[[candidate]]
name = "{candidate}"
reference = "lumped"
bound = 1e-10
{declared}
[[case]]
name = "one"
[case.motion]
kind = "sine"
offset = [0.0, 0.8, 0.7]
amplitude = [0.05, 0.2, 0.2]
frequency = [5.0, 7.0, 9.0]
stop = 1.0
samples = 30
"""


@pytest.mark.parametrize(
    ("candidate", "declared", "verdicts", "passed"),
    [
        ("lumped-only-k1", 'expect_fail = { one = ["q1"] }', ["expected-fail", "pass", "pass"], True),
        ("lumped-only-k1", "", ["fail", "pass", "pass"], False),
        ("lumped-only-k1", 'expect_fail = { one = ["q1", "q2"] }', ["expected-fail", "unexpected-pass", "pass"], False),
        ("lumped-only-k1", 'expect_fail = { one = ["q2"] }', ["fail", "unexpected-pass", "pass"], False),
        ("lumped-appendix", 'expect_fail = { one = ["q1"] }', ["unexpected-pass", "pass", "pass"], False),
    ],
)
def test_a_declared_failure_has_to_happen_and_no_other_may(
    tmp_path: Path, candidate: str, declared: str, verdicts: list[str], passed: bool
) -> None:
    file = tmp_path / "declared.toml"
    file.write_text(SPOILED.format(candidate=candidate, declared=declared), encoding="utf-8")
    outcome = run_campaign(file, tmp_path / "run", effort=ERRORS_ONLY)
    assert [row.verdict for row in outcome.rows] == verdicts
    assert outcome.passed is passed
    assert (
        outcome.manifest["status"] == outcome.manifest["cases"]["one"]["status"] == ("passed" if passed else "failed")
    )


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_an_error_that_is_no_number_fails_even_where_a_failure_is_declared(value: float) -> None:
    declared = CandidateSpec(name="x", reference="lumped", bound=BOUND, expect_fail={"one": ["q1"]})
    assert verdict_of(declared, "one", "q1", value) == "fail"
    assert verdict_of(declared, "one", "q1", 0.5) == "expected-fail"
    assert kind_of(declared, "lumped") == "expected-failure"


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ('expect_fail = { two = ["q1"] }', 'expect_fail names case "two"'),
        ("expect_fail = { one = [] }", r"expect_fail\.one: list should have at least 1 item"),
        ("printed_cost = 6.2", "printed_cost = 6.2: should be a table with the keys us, source"),
        ('expect_fail = "fail"', "expect_fail = 'fail': should be a table"),
        ('expect_fail = { one = ["q4"] }', 'expect_fail: no joint "q4"'),
    ],
)
def test_wrong_declarations_are_refused(tmp_path: Path, declared: str, message: str) -> None:
    file = tmp_path / "declared.toml"
    file.write_text(SPOILED.format(candidate="lumped", declared=declared), encoding="utf-8")
    with pytest.raises(SpecError, match=message):
        run_campaign(file, tmp_path / "run")


def test_a_declaration_without_a_bound_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "declared.toml"
    text = SPOILED.format(candidate="lumped", declared='expect_fail = { one = ["q1"] }').replace("bound = 1e-10", "")
    file.write_text(text, encoding="utf-8")
    with pytest.raises(SpecError, match="expect_fail needs a bound"):
        load_campaign(file)


FIGURE = """
[[figure]]
id = "rates"
title = "Error over rate"
kind = "error_over"
cases = ["one", "two"]
abscissa = [1.0, 2.0]
label = "rate (rad/s)"
reference = "lumped"
curves = ["cand:lumped"]
"""


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (("", ""), ""),
        (('"one", "two"]', '"one", "three"]'), 'names case "three"'),
        (("[1.0, 2.0]", "[2.0, 1.0]"), "abscissa have to rise"),
        (("[1.0, 2.0]", "[1.0]"), "a number for each"),
        (('label = "rate (rad/s)"', ""), "needs cases, abscissa, label, reference and curves"),
        (('reference = "lumped"\ncurves', 'reference = "distributed"\ncurves'), 'no candidate "lumped" against'),
        (('"cand:lumped"', '"ref:lumped"'), "curves .* are candidates"),
        (('kind = "error_over"', 'kind = "error_over"\ncase = "one"'), "needs cases in place of case"),
        (('kind = "error_over"', 'kind = "platform"'), "needs case"),
        (('kind = "error_over"', 'kind = "platform"\ncase = "one"'), "go with kind error_over"),
    ],
)
def test_figures_over_several_cases(tmp_path: Path, spoil: tuple[str, str], message: str) -> None:
    one = SPOILED.format(candidate="lumped", declared="")
    case = one[one.index("[[case]]") :]
    text = one + case.replace('"one"', '"two"') + FIGURE
    file = tmp_path / "figure.toml"
    file.write_text(text.replace(*spoil) if message else text, encoding="utf-8")
    if message:
        with pytest.raises(SpecError, match=message):
            load_campaign(file)
    else:
        assert load_campaign(file)[0].figure[0].needs == ["one", "two"]
