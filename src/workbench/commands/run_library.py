"""``workbench run --robots``: the campaigns of robots of the library, one after the other."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from rich import box
from rich.table import Table
from rich.text import Text

from workbench.campaign.evidence import Effort
from workbench.campaign.run import run_campaign
from workbench.console import CONCLUSIONS
from workbench.errors import WorkbenchError
from workbench.library.measure import figures_of
from workbench.library.page import page, small
from workbench.library.record import LibraryRecord, RobotFigures, read_record, record_path, write_record
from workbench.library.shelf import entries
from workbench.processes import cores
from workbench.report import build_report
from workbench.terminal import CaseProgress, err, out

FAILED, BAD_INPUT, NOTHING_JUDGED = 1, 2, 4


def run_library(
    names: Sequence[str],
    directory: Path | None,
    effort: Effort,
    command: Sequence[str],
    *,
    replace: bool = False,
    record: bool = False,
) -> int:
    """Run robots' campaigns with the formulas of their folders, each into a directory of its name.

    Parameters
    ----------
    names
        Robots of the library, or ``all``.
    directory
        Where the runs go; None is ``reports/library``.
    effort
        How much evidence is gathered.
    command
        The command line, for the manifests.
    replace
        Put runs in the place of earlier ones with more evidence.
    record
        Write what was measured into the library's record and its page; only in a checkout.

    Returns
    -------
    int
        0: every bound of every robot holds; 1: one fails; 2: a campaign could not be run; 4: nothing was judged.
        Of several the first of 2, 1, 4.
    """
    found = entries(names)
    home = directory or Path("reports") / "library"
    table = Table("robot", "verdict", "error", "engines", "run", box=box.SIMPLE_HEAD)
    figures: dict[str, RobotFigures] = {}
    codes: list[int] = []
    for number, entry in enumerate(found, start=1):
        err.print(Text(f"[{number}/{len(found)}] {entry.name}: {entry.robot.spec.title}"))
        try:
            with CaseProgress() as progress:
                outcome = run_campaign(
                    entry.campaign,
                    home / entry.name,
                    command=command,
                    progress=progress,
                    report=build_report,
                    effort=dataclasses.replace(effort, threads=cores()),
                    candidates=[str(path) for path in entry.formulas],
                    replace=replace,
                )
            one = figures_of(entry, outcome, with_workspace=record)
        except WorkbenchError as error:  # the others are still worth running
            codes.append(BAD_INPUT)
            table.add_row(entry.name, Text("BAD INPUT", style="bold red"), "–", "–", Text(str(error)))
            continue
        conclusion = outcome.conclusion
        codes.append(conclusion.exit_code)
        figures[entry.name] = one
        word = Text(conclusion.word, style=CONCLUSIONS[conclusion.status])
        table.add_row(entry.name, word, small(one.error), small(one.spread), str(outcome.directory))
    out.print(table)
    passed = codes.count(0)
    out.print(Text(f"{passed} of {len(found)} robots hold every bound."), soft_wrap=True)
    if record:
        keep(figures)
    return next((code for code in (BAD_INPUT, FAILED, NOTHING_JUDGED) if code in codes), 0)


def keep(figures: dict[str, RobotFigures]) -> None:
    """Put new figures over the old ones; robots that are gone leave the record."""
    from importlib.metadata import version

    from workbench.campaign.provenance import versions

    old, now = read_record(), {entry.name: entry for entry in entries()}
    robots = {name: one for name, one in (old.robots | figures).items() if name in now}
    kept = LibraryRecord(versions=versions() | {"pinocchio": version("pin")}, robots=robots)
    path = record_path()
    write_record(kept, path)
    (path.parents[1] / "docs" / "library.md").write_text(page(list(now.values()), read_record(path)), encoding="utf-8")
