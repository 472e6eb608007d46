"""``workbench compare``: two runs side by side, on the terminal and as a page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from workbench.compare.asked import Asked
    from workbench.compare.outcome import ComparisonOutcome
    from workbench.compare.runs import Difference, RunComparison
    from workbench.report.load import Run

LONGEST_VALUE = 26
"""Characters of a value that a table shows."""


def compare(
    run_a: Annotated[
        Path,
        typer.Argument(
            metavar="RUN_A",
            help="Run directory, the one before; or a campaign, which is computed now as it stands.",
        ),
    ],
    run_b: Annotated[Path, typer.Argument(metavar="RUN_B", help="Run directory, the one after.")],
    factor: Annotated[
        float, typer.Option(metavar="X", help="An error that grew by more than this factor is worse.")
    ] = 10.0,
    floor: Annotated[
        float, typer.Option(metavar="ERROR", help="Errors below this are rounding, and count as equal to it.")
    ] = 1e-12,
    html: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the comparison as a page.")] = None,
    good: Annotated[
        float | None,
        typer.Option(metavar="FRACTION", help="Wanted accuracy of formulas without a bound in both runs; 0.02 is 2 %."),
    ] = None,
) -> None:
    """Say what changed from one run to another: parameters, what it asks of motors and joints, and every error.

    Exit code 0: nothing got worse; 1: an error grew by more than the factor, or a verdict turned; 2: bad input; 4: the
    runs have no error in common, so nothing is compared.
    """
    from rich.text import Text

    from workbench.campaign.asked import refuse_no_fraction
    from workbench.commands.before import run_before
    from workbench.commands.change_table import LEGEND, change_table
    from workbench.compare.outcome import NOTHING, WORSE, outcome_of
    from workbench.compare.runs import compare_loaded
    from workbench.output_file import refuse_target
    from workbench.report.load import load_run
    from workbench.sweep.files import write_bytes
    from workbench.terminal import out

    refuse_no_fraction(good)
    if html is not None:
        refuse_target(html)
    new = load_run(run_b)
    with run_before(run_a, new.manifest) as old:
        found = compare_loaded(old, new, good)
        outcome = outcome_of(found, factor, floor)
        page = _page(html, (run_a, run_b), (old, new), found, outcome, floor)
    out.print(Text(f"A: {run_a}\nB: {run_b}"), soft_wrap=True)
    _print_differences("Inputs", found.inputs)
    _print_differences("Outcomes", found.outcomes)
    _print_asked(found)
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
    for line in outcome.worse:
        out.print(Text(f"worse: {line}", style="red"), soft_wrap=True)
    for line in outcome.good:
        out.print(Text(line, style="bold" if line.startswith("B") else ""), soft_wrap=True)
    for line in outcome.small:
        out.print(Text(f"needs attention: {line}", style="yellow"), soft_wrap=True)
    if outcome.enough:
        out.print(Text(outcome.enough), soft_wrap=True)
    if html is not None:
        write_bytes(html, page)
        out.print(Text(f"Page: {html}"), soft_wrap=True)
    if outcome.alone:
        out.print(Text(outcome.alone))
    style = {WORSE: "bold red", NOTHING: "bold cyan"}.get(outcome.key, "bold green")
    out.print(Text(outcome.text, style=style), soft_wrap=True)
    if outcome.exit_code:
        raise typer.Exit(outcome.exit_code)


def _page(
    html: Path | None,
    paths: tuple[Path, Path],
    runs: tuple[Run, Run],
    found: RunComparison,
    outcome: ComparisonOutcome,
    floor: float,
) -> bytes:
    if html is None:
        return b""
    from workbench.compare.page import comparison_page

    return comparison_page(*runs, (str(paths[0]), str(paths[1])), found, outcome, floor).encode()


def _print_asked(found: RunComparison) -> None:
    """Print the largest force, speed, power and work of each actuator, where they changed."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from workbench.commands.change_table import NARROW
    from workbench.compare.asked import WORDS, worst_over_cases
    from workbench.compare.sections import ratio_text
    from workbench.terminal import out

    rows = [one for one in worst_over_cases([*found.demands, *_worst_reaction(found)]) if not one.same]
    if not rows:
        return
    title = "What actuators have to give and joints to bear: the largest over the cases of both"
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0), title=title, title_justify="left",
                  title_style="bold", width=NARROW)  # fmt: skip
    for column in ("", "figure", "A", "B", "B / A"):
        table.add_column(column, overflow="fold", justify="left" if column in ("", "figure") else "right")
    previous = ""
    for one in rows:
        first = one.item if one.item != previous else ""
        figures = (_figure(value, one.unit) for value in (one.before, one.after))
        table.add_row(*map(Text, (first, WORDS.get(one.key, one.key), *figures, ratio_text(one.ratio))))
        previous = one.item
    out.print(table)


def _figure(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.4g} {unit}"


def _worst_reaction(found: RunComparison) -> list[Asked]:
    """The reaction of the joint that bears most in the second run."""
    known = [one for one in found.reactions if one.after is not None and not math.isnan(one.after)]
    most = max(known, key=lambda one: one.after or 0.0, default=None)
    return [replace(one, item=f"joint {one.item}") for one in found.reactions if most and one.item == most.item]


def _print_differences(title: str, found: Sequence[Difference]) -> None:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from workbench.commands.change_table import NARROW
    from workbench.terminal import out

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
