"""A comparison as one HTML page that loads nothing from elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

from workbench.campaign.changed import ANOTHER, NOT_JUDGED
from workbench.compare.errors import FLOOR
from workbench.compare.outcome import IN_PART, NOTHING, OK, WORSE, ComparisonOutcome
from workbench.compare.runs import RunComparison
from workbench.compare.sections import comparison_sections, in_short
from workbench.report.build import html_page
from workbench.report.concluded import LOOKS, conclusion_of
from workbench.report.load import Run
from workbench.report.style import figure_style
from workbench.report.tables import Status
from workbench.report.verdict_section import changes

OUTCOMES = {
    OK: Status("passed", "✓", "OK", loud=True),
    WORSE: Status("failed", "✗", "WORSE", loud=True),
    NOTHING: Status("unjudged", "–", "NOTHING COMPARED", loud=True),
}
PART = Status("undecided", "?", IN_PART, loud=True)
"""Not all cases are in both runs."""


@dataclass(frozen=True)
class Side:
    """One of the two runs, for the head of the page."""

    name: str
    note: str
    """that its robot is another than the one that its campaign is about"""
    status: Status


def comparison_page(
    old: Run, new: Run, names: tuple[str, str], found: RunComparison, outcome: ComparisonOutcome, floor: float = FLOOR
) -> str:
    """Return the page.

    Parameters
    ----------
    old, new
        The runs, and *names* what they are called on the page.
    found, outcome
        Of `workbench.compare.runs.compare_loaded` and `workbench.compare.outcome.outcome_of`.

    Raises
    ------
    OutputError
        A series file is missing or unreadable.
    """
    a, b = (
        Side(name, f"{ANOTHER}. {NOT_JUDGED}" if changes(run.manifest) else "", LOOKS[conclusion_of(run).status])
        for run, name in zip((old, new), names, strict=True)
    )
    title = new.manifest.title or new.manifest.campaign
    with figure_style():
        head = {
            "title": title if title == (old.manifest.title or old.manifest.campaign) else f"{names[0]} and {names[1]}",
            "a": a,
            "b": b,
            "status": PART if outcome.word == IN_PART else OUTCOMES[outcome.key],
            "sentence": f"{outcome.sentence[:1].upper()}{outcome.sentence[1:]} {outcome.alone}".strip(),
            "attention": outcome.attention,
            "good": outcome.good,
            "other": [*([outcome.enough] if outcome.enough else []), *in_short(found)],
        }
        return html_page("compare.html.j2", comparison_sections(old, new, found, floor), head)
