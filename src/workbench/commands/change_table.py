"""Errors of two runs side by side on a terminal, readable at 80 columns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich import box
from rich.table import Table
from rich.text import Text

from workbench.campaign.verdict import FAILURES, VERIFICATION
from workbench.compare.errors import FLOOR, ErrorChange, growth, growth_text

NARROW = 80
"""Columns that the table is made for; a wider terminal gives no wider one."""

EQUAL, ROUNDING = "=", "~"
LEGEND = f"x2 /2: grew, fell by that factor; {EQUAL} the same bits; {ROUNDING} rounding, both below {FLOOR:g}"


def change_table(
    changes: Sequence[ErrorChange], joints: Iterable[str], factor: float, floor: float = FLOOR, alone: bool = False
) -> Table:
    """Peak errors after, with their change; one block per case, one row per candidate and reference.

    With *alone* there is nothing to compare with, and no change is shown.
    """
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0), width=NARROW)
    table.add_column("candidate / MuJoCo model", overflow="fold", ratio=1)
    joints = list(joints)
    for joint in joints:
        table.add_column(joint, justify="right", no_wrap=True)
        table.add_column("", no_wrap=True, min_width=5)
    groups: dict[tuple[str, str, str, str], dict[str, ErrorChange]] = {}
    for entry in changes:
        key = entry.case, entry.candidate, entry.reference, entry.kind
        groups.setdefault(key, {})[entry.joint] = entry
    previous = ""
    for (case, candidate, reference, _), members in groups.items():
        if case != previous:
            table.add_row(Text(case, style="bold"))
            previous = case
        cells = [Text(f"  {candidate} / {reference}")]
        for joint in joints:
            error, change = _cells(members[joint], factor, floor) if joint in members else (Text(), Text())
            cells += [error, Text() if alone else change]
        table.add_row(*cells)
    return table


def _cells(change: ErrorChange, factor: float, floor: float) -> tuple[Text, Text]:
    before, after = change.before, change.after
    if after is None:
        return Text("-"), Text("gone", style="yellow")
    shown = _error(after.peak_error, change.kind)
    style = "bold red" if after.verdict in FAILURES else ""
    if before is None:
        return Text(shown, style=style), Text("new", style="cyan")
    if change.same:
        return Text(shown, style=style), Text(EQUAL, style="dim")
    if max(before.peak_error, after.peak_error) <= floor:
        return Text(shown, style=style), Text(ROUNDING, style="dim")
    grown = growth(before.peak_error, after.peak_error, floor)
    colour = "bold red" if change.worse(factor, floor) else "yellow" if grown > 1 else "green"
    return Text(shown, style=style), Text(growth_text(grown), style=colour)


def _error(value: float, kind: str) -> str:
    if kind == VERIFICATION or not value >= FLOOR:
        return f"{value:.1e}"
    return f"{100 * value:.2f} %" if value < 100 else f"{value:.1e}"
