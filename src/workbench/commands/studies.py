"""What ``workbench run`` does for campaigns with ``[control]``: call, show progress, print what was found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from workbench.campaign.spec import Campaign
from workbench.commands.sweeps import SweepProgress
from workbench.console import print_changes, print_conclusion
from workbench.control.run import StudyOutcome, run_study
from workbench.errors import SpecError
from workbench.sweep.resumable import SweepOptions
from workbench.terminal import out


def refuse_options(campaign: str, **given: Any) -> None:
    """Refuse what a study does not heed.

    Raises
    ------
    SpecError
        Names the option.
    """
    for name, value in given.items():
        if value:
            option = {"relative": "--set NAME*=FACTOR"}.get(name, f"--{name.replace('_', '-')}")
            raise SpecError(f"{campaign}: {option} does not go with a campaign that has [control]")


def run_study_and_print(
    campaign: Campaign,
    file: Path,
    directory: Path | None,
    *,
    model: Path | None,
    settings: Mapping[str, float],
    command: list[str],
    options: SweepOptions,
    report: Callable[[Path], object],
    candidates: Sequence[str | Path] = (),
    controllers: Sequence[str | Path] = (),
) -> int:
    """Run a study, write its report and print its outcome; return the exit code."""
    with SweepProgress() as progress:
        outcome = run_study(
            campaign,
            file,
            directory or Path("reports") / campaign.name,
            model=model,
            settings=settings,
            command=command,
            show=progress,
            report=report,
            options=options,
            candidates=candidates,
            controllers=controllers,
        )
    print_study(outcome)
    return outcome.conclusion.exit_code


def print_study(outcome: StudyOutcome) -> None:
    """Print the claims with their verdicts, what is unstable, and the verdict on the run."""
    summary = outcome.summary
    print_changes(outcome.manifest)
    if summary["claims"]:
        table = Table(title="Claims about models in control", title_justify="left", box=box.SIMPLE_HEAD)
        for column in ("claim", "verdict", "figures"):
            table.add_column(column, overflow="fold")
        for claim in summary["claims"]:
            table.add_row(claim["text"], claim["verdict"], claim["sentence"])
        out.print(table)
    for one in summary["first_unstable"]:
        out.print(Text(f"run {one['run']}: {one['reason']}"), style="yellow")
    for reason in summary["reasons"]:
        out.print(Text(f"not computed: {reason}"), style="yellow")
    print_conclusion(outcome.conclusion)
    out.print(
        Text(f"Report: {outcome.directory / 'report.html'}; data: control.json, runs.parquet, errors.parquet"),
        soft_wrap=True,
    )
