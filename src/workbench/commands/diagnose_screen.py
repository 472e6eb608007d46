"""What ``workbench diagnose`` shows: findings first, then the table of parts, then the mends as a diff."""

from __future__ import annotations

from rich import box
from rich.table import Table
from rich.text import Text

from workbench.diagnosis.result import Diagnosis, Suggestion
from workbench.terminal import out

MOST_MENDS = 6


def print_diagnosis(diagnosis: Diagnosis, searching: bool = False, only_mends: bool = False) -> None:
    """Print a diagnosis; the findings may come before the search for mends is over."""
    if not only_mends:
        _print_findings(diagnosis, searching)
    else:
        _print_mends(diagnosis)


def _print_findings(diagnosis: Diagnosis, searching: bool) -> None:
    out.print()
    out.print(Text(f"Diagnosis of {diagnosis.title}", style="bold"))
    if diagnosis.right:
        worst = diagnosis.digits
        out.print(
            Text(
                f"Nothing is wrong: every part agrees to {worst} digits or better, in {diagnosis.states} states at"
                f" {diagnosis.poses} poses.",
                style="bold green",
            )
        )
    for number, finding in enumerate(diagnosis.findings, start=1):
        text = Text(f"{number}. ", style="bold red")
        text.append(f"{finding.sentence}.", style="not bold default")
        out.print(text)
    out.print()
    if not diagnosis.right:
        table, right = _table(diagnosis)
        out.print(Text("The torque part by part: formula against reference", style="bold"))
        out.print(table)
        if right:
            out.print(Text(f"Other parts: {right}, right in every joint to {diagnosis.digits} digits or better."))
    for note in diagnosis.not_covered:
        out.print(Text(f"Not looked at: {note}.", style="dim"))
    if searching and not diagnosis.right and out.is_terminal:
        out.print(
            Text(f"({diagnosis.seconds.get('findings', 0):.1f} s) Looking for edits that mend it ...", style="dim")
        )


def _table(diagnosis: Diagnosis) -> tuple[Table, int]:
    """The parts that are not right in every joint, and how many others there are."""
    table = Table(box=box.SIMPLE_HEAD)
    table.add_column("part")
    for joint in diagnosis.joints:
        table.add_column(f"tau_{joint}")
    right = 0
    for label, marks in diagnosis.table():
        if all(mark.startswith("right") or not mark for mark in marks):
            right += 1
            continue
        cells = [Text(label)]
        for mark in marks:
            style = "bold red" if mark.startswith(("WRONG", "there")) else "green" if mark else "dim"
            cells.append(Text(mark or "-", style=style))
        table.add_row(*cells)
    return table, right


def _print_mends(diagnosis: Diagnosis) -> None:
    if diagnosis.right:
        return
    for note in diagnosis.mend_notes:
        out.print(Text(note, style="dim"))
    if not diagnosis.suggestions:
        return
    out.print(Text("What would mend it", style="bold"))
    for step in sorted({suggestion.step for suggestion in diagnosis.suggestions}):
        alike = [suggestion for suggestion in diagnosis.suggestions if suggestion.step == step]
        if step > 1:
            out.print(Text("then", style="bold"))
        if len(alike) > 1:
            out.print(Text(f"{len(alike)} edits do the same, each by itself:", style="dim"))
        for suggestion in alike[:MOST_MENDS]:
            _print_mend(suggestion)
        if len(alike) > MOST_MENDS:
            out.print(Text(f"... and {len(alike) - MOST_MENDS} more (--json has them all)", style="dim"))


def _print_mend(suggestion: Suggestion) -> None:
    left = "nothing is left wrong" if not suggestion.left else f"{suggestion.left} entries stay wrong"
    out.print(Text(f"{suggestion.file}:{suggestion.line}  {suggestion.what}; mends {suggestion.mends} entries, {left}"))
    out.print(Text(f"  - {suggestion.before.strip()}", style="red"), soft_wrap=True)
    out.print(Text(f"  + {suggestion.after.strip()}", style="green"), soft_wrap=True)
