"""The verdict on a sweep in one sentence, and what became of its cases."""

from __future__ import annotations

import numpy as np

from workbench.campaign.conclusion import conclude_sweep
from workbench.report.concluded import LOOKS
from workbench.report.section import Section
from workbench.report.sweep.load import SweepRun
from workbench.report.tables import FAILED, PASSED, Cell, Status, Table, columns
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
        "attention": [],
        # what the first screen of a campaign of cases shows besides
        "compared": "",
        "findings": [],
        "still": None,
        "sketch": None,
        "glance": None,
        "diagnosis": {},  # of a formula that fails in a sweep, `workbench diagnose` tells more, on one of its cases
    }
    return Section("verdict", "Verdict", "verdict", context)


def verdict(run: SweepRun) -> tuple[Status, str]:
    """Return the look of the sweep's verdict and its sentence with all counts."""
    found = conclude_sweep(run.summary.counts, bool(run.bounds), _worst(run) if run.bounds else "")
    return LOOKS[found.status], found.sentence


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
