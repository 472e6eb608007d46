"""The verdict on a sweep in one sentence, and what became of its cases."""

from __future__ import annotations

import numpy as np

from workbench.report.section import Section
from workbench.report.sweep.load import SweepRun
from workbench.report.tables import (
    ERROR_VERDICT,
    FAILED,
    PASSED,
    PASSED_VERDICT,
    UNDECIDED_VERDICT,
    Cell,
    Status,
    Table,
    columns,
)
from workbench.report.text import exact, percent, scientific
from workbench.report.verdict_section import candidates_table, model_text

SWEEP_STATUS = {
    "passed": PASSED,
    "failed": FAILED,
    "invalid": Status("invalid", "⊘", "invalid", loud=True),
    "timeout": Status("timeout", "◷", "TIMED OUT", loud=True),
    "killed": Status("killed", "☠", "KILLED", loud=True),
    "filtered": Status("filtered", "", "left out"),
}
MEANING = {
    "passed": "every bound holds",
    "failed": "a bound is exceeded, or computing the case raised an error",
    "invalid": "a result is not a finite number",
    "timeout": "took longer than the campaign's time limit",
    "killed": "the worker died: a crash, a signal, or too much memory",
    "filtered": "left out on purpose by the campaign's filter; nothing was computed, and nothing is known",
}
SAID = {
    "failed": "failed",
    "invalid": "gave results that are not finite numbers",
    "timeout": "ran out of time",
    "killed": "lost their worker",
}
"""What the sentence says of cases that did not pass."""
GOOD = ("passed", "filtered")


def status_of(name: str) -> Status:
    """Return the look of a case's status; one that this version does not know is shown as it stands."""
    return SWEEP_STATUS.get(name, Status("undecided", "?", name))


def number(count: int) -> str:
    """Write a count with its thousands apart."""
    return f"{count:,}"


def verdict_section(run: SweepRun) -> Section:
    """Say whether every case holds its bounds, and count what became of them."""
    status, sentence = verdict(run)
    counts = run.summary.counts
    outcomes = Table(
        "outcomes",
        "What became of the cases.",
        columns(("Outcome", "Cases", "Share", "Meaning"), numeric=("Cases", "Share")),
        tuple(
            (
                Cell(status=status_of(name)) if count else Cell(status_of(name).text.lower()),
                Cell(number(count), count),
                Cell(percent(count / run.summary.cases) if count else "0 %", count / run.summary.cases),
                Cell(MEANING.get(name, "")),
            )
            for name, count in counts.items()
        ),
        "Each case ends as exactly one of these. The run passes when every case passed or was left out, and at least"
        " one passed.",
    )
    tested = len(run.manifest.candidates)
    about = (
        f"{model_text(run.manifest)}, case {run.summary.case} varied {number(run.summary.cases)} times, "
        f"{tested} candidate{'s' if tested != 1 else ''}."
    )
    context = {
        "status": status,
        "sentence": sentence[:1].upper() + sentence[1:],
        "about": about,
        "tables": [outcomes, candidates_table(run.manifest)],
        "diagnosis": {},  # of a formula that fails in a sweep, `workbench diagnose` tells more, on one of its cases
    }
    return Section("verdict", "Verdict", "verdict", context)


def verdict(run: SweepRun) -> tuple[Status, str]:
    """Return the overall status and the sentence with all counts."""
    summary = run.summary
    counts = {name: count for name, count in summary.counts.items() if count}
    total = number(summary.cases)
    passed, left_out = counts.get("passed", 0), counts.get("filtered", 0)
    out = f"{number(left_out)} of {total} {_were(left_out)} left out by the filter" if left_out else ""
    bad = {name: count for name, count in counts.items() if name not in GOOD}
    if bad:
        parts = [f"{number(count)} {SAID.get(name, name)}" for name, count in bad.items()]
        rest = [f"{number(passed)} passed", *([out] if out else [])]
        # a lost or broken case is not a formula that failed; nothing is known of it
        status = FAILED if "failed" in bad else ERROR_VERDICT
        return status, f"of {total} cases {_joined(parts)}; {_joined(rest)}."
    if not passed:
        return UNDECIDED_VERDICT, f"all {total} cases were left out by the filter, so nothing is verified."
    if not run.bounds:
        return UNDECIDED_VERDICT, f"no formula was held against a bound in {number(passed)} cases; nothing is verified."
    what = f"all {number(passed)} cases that were computed" if left_out else f"all {total} cases"
    return PASSED_VERDICT, f"{what} hold every bound ({_worst(run)}){f'; {out}' if out else ''}."


def _worst(run: SweepRun) -> str:
    """Name the error that comes nearest to its bound."""
    pair = max(run.bounds, key=lambda p: float(np.nanmax(run.worst[p], initial=0.0)) / run.bounds[p])
    if not np.isfinite(run.worst[pair]).any():
        return "no error is stored"
    index = int(np.nanargmax(run.worst[pair]))
    joint = run.manifest.joints[int(np.argmax(run.errors[pair][index]))]
    return (
        f"worst is {pair[0]} on joint {joint} in case {run.name(index)}: {scientific(float(run.worst[pair][index]))} "
        f"of the reference's peak against a bound of {exact(run.bounds[pair])}"
    )


def _were(count: int) -> str:
    return "was" if count == 1 else "were"


def _joined(parts: list[str]) -> str:
    return " and ".join([", ".join(parts[:-1]), parts[-1]]) if len(parts) > 1 else parts[0]
