"""What a row of errors means: within its bound or not, and whether the campaign declared that.

A campaign may declare failures: a misprint that is kept on purpose has to show. An error that stays within the bound
then, where the campaign says that it cannot, is the failure.
"""

from __future__ import annotations

import math

from workbench.campaign.candidate_spec import CandidateSpec

PASS = "pass"
FAIL = "fail"
MEASURED = "measured"
EXPECTED_FAIL = "expected-fail"
UNEXPECTED_PASS = "unexpected-pass"
UNDECIDED = "undecided"

AGREES = "agrees"
"""recorded torques: the difference lies within what motion and recorder leave open"""
DIFFERS = "differs"
"""recorded torques: it does not"""

FAILURES = frozenset({FAIL, UNEXPECTED_PASS, UNDECIDED})
"""Verdicts that fail a campaign."""

VERIFICATION = "verification"
MODELLING = "modelling"
"""a formula against a reference of another mass model than its own, without a bound"""
UNBOUNDED = "unbounded"
"""a formula against the reference of its own mass model, without a bound: nobody says how good it has to be"""
WITHOUT_BOUND = (MODELLING, UNBOUNDED)
"""Kinds of rows of formulas that nothing judges."""
EXPECTED_FAILURE = "expected-failure"
RECORDED = "recorded"
"""torques that were measured or simulated elsewhere"""
CONTRAST = "contrast"
"""rows that show what happens without the reference's projection; nothing judges them"""


SHARE = 0.1
"""A verdict counts only where the reference's uncertainty is below this share of the bound or error that it judges."""


def kind_of(candidate: CandidateSpec, mass_model: str) -> str:
    """Return what the rows of a candidate are, which makes an assumption about masses of its own, *mass_model*."""
    if candidate.bound is None:
        return UNBOUNDED if mass_model == candidate.reference else MODELLING
    return EXPECTED_FAILURE if candidate.expect_fail else VERIFICATION


def verdict_of(
    candidate: CandidateSpec, case: str, joint: str, peak_error: float, uncertainty: float = math.nan
) -> str:
    """Judge one row; *uncertainty* is the reference's own, relative, NaN where nobody looked.

    An error that is not a finite number fails, declared or not: a misprint gives wrong numbers, not none.
    """
    if candidate.bound is None:
        return MEASURED
    within = peak_error <= candidate.bound
    if uncertainty >= SHARE * (candidate.bound if within else peak_error):
        return UNDECIDED
    if joint not in candidate.expect_fail.get(case, ()):
        return PASS if within else FAIL
    if not math.isfinite(peak_error):
        return FAIL
    return UNEXPECTED_PASS if within else EXPECTED_FAIL
