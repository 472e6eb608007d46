"""``workbench compare``: two runs side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from workbench.compare.runs import Difference

WORSE = 1
NOTHING_COMPARED = 4
LONGEST_VALUE = 26
"""Characters of a value that a table shows."""


def compare(
    run_a: Annotated[Path, typer.Argument(metavar="RUN_A", help="Run directory, the one before.")],
    run_b: Annotated[Path, typer.Argument(metavar="RUN_B", help="Run directory, the one after.")],
    factor: Annotated[
        float, typer.Option(metavar="X", help="An error that grew by more than this factor is worse.")
    ] = 10.0,
    floor: Annotated[
        float, typer.Option(metavar="ERROR", help="Errors below this are rounding, and count as equal to it.")
    ] = 1e-12,
) -> None:
    """Say what changed from one run to another: parameters, versions, campaign, and every error.

    Exit code 0: nothing got worse; 1: an error grew by more than the factor, or a verdict turned; 2: bad input; 4: the
    runs have no error in common, so nothing is compared.
    """
    from rich.text import Text

    from workbench.commands.change_table import LEGEND, change_table
    from workbench.compare.errors import all_worse
    from workbench.compare.runs import compare_runs
    from workbench.console import out

    found = compare_runs(run_a, run_b)
    worse = all_worse(found.errors, factor, floor)
    out.print(Text(f"A: {run_a}\nB: {run_b}"), soft_wrap=True)
    _print_differences("Inputs", found.inputs)
    _print_differences("Outcomes", found.outcomes)
    changed = [change for change in found.errors if not change.same]
    equal = len(found.errors) - len(changed)
    shared = {change.case for change in found.errors if change.after is not None}
    shown = [change for change in changed if change.case in shared]
    if shown:
        out.print(Text("Peak errors of B, and how they changed from A", style="bold"))
        out.print(change_table(shown, found.joints, factor, floor))
        out.print(Text(LEGEND, style="dim"))
    if equal:
        out.print(Text(f"{equal} of {len(found.errors)} errors are the same, bit for bit."))
    for line in worse:
        out.print(Text(f"worse: {line}", style="red"), soft_wrap=True)
    if worse:
        out.print(Text(f"WORSE: {len(worse)} by more than a factor of {factor:g}, or by verdict.", style="bold red"))
        raise typer.Exit(WORSE)
    if not found.shared:
        out.print(Text("NOTHING COMPARED: the runs have no error in common.", style="bold cyan"))
        raise typer.Exit(NOTHING_COMPARED)
    alone = sum(change.before is None or change.after is None for change in found.errors)
    rest = f"; {alone} errors in one run only" if alone else ""
    out.print(Text(f"OK: nothing got worse by more than a factor of {factor:g}{rest}.", style="bold green"))


def _print_differences(title: str, found: Sequence[Difference]) -> None:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from workbench.commands.change_table import NARROW
    from workbench.console import out

    if not found:
        out.print(Text(f"{title}: no difference."))
        return
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0), title=title, title_justify="left",
                  title_style="bold", width=NARROW)  # fmt: skip
    for column in ("", "what", "A", "B"):
        table.add_column(column, overflow="fold")
    for difference in found:
        table.add_row(
            Text(difference.group, style="dim"), Text(difference.what), Text(_show(difference.before)),
            Text(_show(difference.after)),
        )  # fmt: skip
    out.print(table)


def _show(value: Any) -> str:
    text = "-" if value is None else value if isinstance(value, str) else repr(value)
    text = " ".join(text.split())
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 3]}..."
