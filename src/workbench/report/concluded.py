"""The verdict on stored results: the one of `workbench.campaign.conclusion`, with the look that a report gives it."""

from __future__ import annotations

from workbench.campaign.conclusion import (
    FAILED as FAILED_RUN,
)
from workbench.campaign.conclusion import (
    INCOMPLETE,
    NOTHING_JUDGED,
    PASSED,
    UNDECIDED_RUN,
    WORDS,
    CaseOutcome,
    Conclusion,
    conclude,
)
from workbench.report.load import Run
from workbench.report.tables import Status

LOOKS = {
    PASSED: Status("passed", "✓", WORDS[PASSED], loud=True),
    FAILED_RUN: Status("failed", "✗", WORDS[FAILED_RUN], loud=True),
    UNDECIDED_RUN: Status("undecided", "?", WORDS[UNDECIDED_RUN], loud=True),
    INCOMPLETE: Status("error", "⚠", WORDS[INCOMPLETE], loud=True),
    NOTHING_JUDGED: Status("unjudged", "–", WORDS[NOTHING_JUDGED], loud=True),
}


def conclusion_of(run: Run) -> Conclusion:
    """Judge a stored run by its rows and cases; what its manifest says besides can only make it worse."""
    cases = {
        name: CaseOutcome(record.status, record.kinematics_verdicts) for name, record in run.manifest.cases.items()
    }
    found = conclude(run.rows, cases)
    if run.manifest.status == "failed" and found.passed:
        return Conclusion(FAILED_RUN, "the run says so, though no row of it does.")
    if run.manifest.status == "error" and found.passed:
        return Conclusion(INCOMPLETE, f"the run ended in an error; {found.sentence}")
    return found
