"""What a row of errors means: within its bound or not, and whether the campaign declared that.

A campaign may declare failures: a misprint that is kept on purpose has to show. An error that stays within the bound
then, where the campaign says that it cannot, is the failure.
"""

from __future__ import annotations

import math

from workbench.campaign.spec import CandidateSpec

PASS = "pass"
FAIL = "fail"
MEASURED = "measured"
EXPECTED_FAIL = "expected-fail"
UNEXPECTED_PASS = "unexpected-pass"

FAILURES = frozenset({FAIL, UNEXPECTED_PASS})
"""Verdicts that fail a campaign."""

VERIFICATION = "verification"
MODELLING = "modelling"
EXPECTED_FAILURE = "expected-failure"


def kind_of(candidate: CandidateSpec) -> str:
    """Return what the rows of a candidate are: a verification, a modelling error, or a declared failure."""
    if candidate.bound is None:
        return MODELLING
    return EXPECTED_FAILURE if candidate.expect_fail else VERIFICATION


def verdict_of(candidate: CandidateSpec, case: str, joint: str, peak_error: float) -> str:
    """Judge one row.

    An error that is not a finite number fails, declared or not: a misprint gives wrong numbers, not none.
    """
    if candidate.bound is None:
        return MEASURED
    within = peak_error <= candidate.bound
    if joint not in candidate.expect_fail.get(case, ()):
        return PASS if within else FAIL
    if not math.isfinite(peak_error):
        return FAIL
    return UNEXPECTED_PASS if within else EXPECTED_FAIL
