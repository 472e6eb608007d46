"""The papers' claims, and the errors of the whole campaign with the worst first."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from workbench.campaign.verdict import WITHOUT_BOUND
from workbench.report.case_section import joint_heading
from workbench.report.load import ErrorRow, Run
from workbench.report.section import Section
from workbench.report.tables import CLAIM_STATUS, FAILURES, NOT_ABOUT, Cell, Table, columns, verdict_status
from workbench.report.text import error_fraction, exact, percent, quantity

WORST_ROWS = 12
"""How many verification rows the table of worst errors shows; the cases' own tables show all."""


def claims_section(run: Run) -> Section | None:
    """Hold what the papers claim against what was measured."""
    if not run.manifest.claims:
        return None
    rows = []
    for claim in run.manifest.claims:
        claimed = quantity(claim.claimed, claim.unit)
        if claim.kind == "upper":
            claimed = f"below {claimed}"
        elif claim.within:
            claimed = f"{claimed} ± {quantity(claim.within, claim.unit)}"
        rows.append(
            (
                Cell(claim.text),
                Cell(claim.source),
                Cell(claimed, claim.claimed),
                Cell(quantity(claim.measured, claim.unit), claim.measured),
                Cell(status=NOT_ABOUT if claim.not_about else CLAIM_STATUS[claim.holds]),
                Cell(claim.not_about or claim.note),
            )
        )
    table = Table(
        "claims",
        "What the papers claim, next to what this run measured.",
        columns(("Claim", "Source", "Claimed", "Measured", "Verdict", "Note"), numeric=("Claimed", "Measured")),
        tuple(rows),
        "A claim that does not hold is a finding about the paper, not a failure of this run; “cannot be decided” "
        "means that "
        "this run holds no measurement that could confirm or refute it. ± is how far a number may lie from the "
        "printed one "
        "and still agree with it. “Not about this robot” is not judged: the note says what was changed, and the number "
        "measured is that of the changed robot.",
    )
    return Section("claims", "The papers' claims", "tables", {"tables": [table]})


def worst_section(run: Run, anchors: Mapping[str, str]) -> Section:
    """Show the worst verification rows, then declared failures and modelling errors of all cases, largest first."""
    own = [row for row in run.rows if row.kind != "recorded"]
    checked = [row for row in own if row.kind == "verification" or row.verdict in FAILURES]
    checked.sort(key=lambda row: (row.verdict not in FAILURES, -row.badness))
    tables = [
        _worst_table(run, checked, anchors),
        _by_joint(
            run,
            anchors,
            "expected-failure",
            "Declared failures: formulas that are kept wrong on purpose, and what each mistake costs on each joint.",
            "Bold where the campaign declares that the bound cannot hold; the other joints have to keep it",
            error_fraction,
        ),
        _by_joint(
            run,
            anchors,
            "modelling",
            "Modelling error: how far formulas are from a reference that assumes something else, mostly about masses.",
            "The row's largest in bold, and rows in order of it",
            percent,
        ),
        _by_joint(
            run,
            anchors,
            "unbounded",
            "Measured, nothing judged: formulas without a bound against the reference of the same mass model.",
            "The row's largest in bold, and rows in order of it",
            percent,
        ),
        _by_joint(
            run,
            anchors,
            "recorded",
            "Measured or simulated elsewhere: recorded torques against the reference.",
            "What each figure is worth stands in its case's section",
            percent,
        ),
    ]
    return Section("worst", "Worst errors first", "tables", {"tables": [table for table in tables if table.rows]})


def _worst_table(run: Run, checked: list[ErrorRow], anchors: Mapping[str, str]) -> Table:
    shown = checked[:WORST_ROWS]
    names = ("Case", "Candidate", "Reference", "Joint", "Peak error", "Bound", "Error / bound", "Worst at", "Verdict")
    rows = tuple(
        (
            Cell(row.case, link=anchors[row.case]),
            Cell(row.candidate),
            Cell(row.reference),
            Cell(joint_heading(run, row.joint)),
            Cell(error_fraction(row.peak_error), row.peak_error, emphasis=True),
            Cell(exact(row.bound), row.bound),
            Cell(exact(row.peak_error / row.bound, 3) if row.bound else "–", row.peak_error),
            Cell(f"{exact(row.worst_time_s)} s", row.worst_time_s),
            Cell(status=verdict_status(row.verdict)),
        )
        for row in shown
    )
    rest = len(checked) - len(shown)
    more = f" The other {rest} rows are smaller and stand in the sections of their cases." if rest else ""
    return Table(
        "worst-verification",
        f"Verification: the {len(shown)} largest errors of a closed form against the reference with the same mass "
        "model, "
        "measured in their bounds.",
        columns(names, numeric=("Peak error", "Bound", "Error / bound", "Worst at")),
        rows,
        "Peak error is max|Δτ| / max|τ_ref| of that joint over the case; below 1 in “Error / bound” the row "
        f"passes.{more}",
    )


def _by_joint(
    run: Run, anchors: Mapping[str, str], kind: str, shows: str, emphasis: str, number: Callable[[float], str]
) -> Table:
    grouped: dict[tuple[str, str, str], dict[str, ErrorRow]] = {}
    for row in run.rows:
        if row.kind == kind:
            grouped.setdefault((row.case, row.candidate, row.reference), {})[row.joint] = row
    rows: list[tuple[Cell, ...]] = []
    for (case, candidate, reference), by_joint in sorted(
        grouped.items(), key=lambda item: -max(row.badness for row in item[1].values())
    ):
        largest = max(by_joint.values(), key=lambda row: row.badness)
        cells = []
        for joint in run.manifest.joints:
            found = by_joint.get(joint)
            if found is None:
                cells.append(Cell("–"))
                continue
            strong = found is largest if kind in WITHOUT_BOUND else found.verdict == "expected-fail"
            cells.append(Cell(number(found.peak_error), found.peak_error, emphasis=strong))
        loudest = next((row for row in by_joint.values() if row.verdict in FAILURES), largest)
        status = Cell(status=verdict_status(loudest.verdict))
        rows.append((Cell(case, link=anchors[case]), Cell(candidate), Cell(reference), *cells, status))
    joints = [joint_heading(run, joint) for joint in run.manifest.joints]
    return Table(
        f"worst-{kind}",
        shows,
        columns(("Case", "Candidate", "Reference", *joints, "Verdict"), numeric=joints),
        tuple(rows),
        f"Peak error max|Δτ| / max|τ_ref| of that joint over the case. {emphasis}; percentages of forces and of "
        "torques "
        "are not comparable and are never averaged.",
    )
