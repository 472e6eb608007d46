"""Is it good enough: formulas without a bound held against the accuracy that the campaign wants."""

from __future__ import annotations

from collections.abc import Mapping

from workbench.campaign.good import NO, UNDECIDED, YES, answers, good_enough
from workbench.report.attention import unknown_cases
from workbench.report.case_section import joint_heading
from workbench.report.load import ErrorRow, Run
from workbench.report.section import Section, plain_section
from workbench.report.tables import Cell, Status, Table, columns
from workbench.report.text import percent

ENOUGH = {
    YES: Status("passed", "✓", "yes"),
    NO: Status("refuted", "✗", "NO", loud=True),
    UNDECIDED: Status("undecided", "?", "undecided"),
}
"""Looks of the answers."""
MARKS = {YES: "✓", NO: "✗", UNDECIDED: "?"}


def good_section(run: Run, anchors: Mapping[str, str]) -> Section | None:
    """Answer by case and joint; None where nobody asked."""
    good = run.manifest.good
    if good is None:
        return None
    found = answers(run.rows, good, unknown_cases(run.manifest))
    sentences = [answer.sentence for answer in found] or ["No formula without a bound was computed."]
    tables = [good_table(run, good, anchors)] if found else []
    return plain_section("good", "Is it good enough", sentences, tables)


def good_table(run: Run, good: float, anchors: Mapping[str, str]) -> Table:
    """Errors of formulas without a bound by case and joint, each with its answer."""
    groups: dict[tuple[str, str, str], dict[str, ErrorRow]] = {}
    for row in run.rows:
        if good_enough(row, good):
            groups.setdefault((row.case, row.candidate, row.reference), {})[row.joint] = row
    rows = []
    for (case, candidate, reference), by_joint in groups.items():
        said = {joint: good_enough(row, good) for joint, row in by_joint.items()}
        cells = [
            Cell(f"{MARKS[said[j]]} {percent(by_joint[j].peak_error)}", by_joint[j].peak_error, emphasis=said[j] != YES)
            if j in by_joint
            else Cell("–")
            for j in run.manifest.joints
        ]
        whole = next((answer for answer in (NO, UNDECIDED) if answer in said.values()), YES)
        rows.append(
            (Cell(case, link=anchors.get(case)), Cell(candidate), Cell(reference), *cells, Cell(status=ENOUGH[whole]))
        )
    joints = [joint_heading(run, joint) for joint in run.manifest.joints]
    return Table(
        "good-enough",
        f"Is it good enough, within {100 * good:.3g} % of the reference's peak on every joint?",
        columns(("Case", "Candidate", "Reference", *joints, "Good enough"), joints),
        tuple(rows),
        "Peak error max|Δτ| / max|τ_ref| of that joint over the case; ✓ keeps the wanted accuracy, ✗ exceeds it, ?"
        " cannot be decided because the reference's own uncertainty is too large. The wanted accuracy is"
        " the campaign's or --good's; the answer judges nothing and belongs to these motions.",
    )
