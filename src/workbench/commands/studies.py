"""What ``workbench run`` does for campaigns with ``[control]``: call, show progress, print what was found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from workbench.campaign.spec import Campaign
from workbench.commands.sweeps import WRITING, SweepProgress, duration, size
from workbench.console import print_changes, print_conclusion
from workbench.control.estimate import estimate_study
from workbench.control.files import STUDY
from workbench.control.plan import pairs_of
from workbench.control.run import StudyOutcome, run_study
from workbench.errors import SpecError
from workbench.rendering import tracking_film
from workbench.sweep.resumable import SweepOptions
from workbench.terminal import out

PLURALS = {"controller with its model": "controllers with their models"}


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


def dry_run_study(
    campaign: Campaign,
    file: Path,
    model: Path | None,
    settings: Mapping[str, float],
    jobs: int | None,
    candidates: Sequence[str | Path] = (),
    controllers: Sequence[str | Path] = (),
) -> None:
    """Print what a study is made of and would take; nothing is written."""
    found = estimate_study(campaign, file, model, settings, jobs, candidates, controllers)
    plan, spec = found.plan, found.plan.spec
    parts = (
        (len(campaign.case), "case"), (len(pairs_of(spec)), "controller with its model"), (len(spec.speeds), "speed"),
        (len(spec.rates), "rate"), (len(spec.bandwidths), "bandwidth"),
    )  # fmt: skip
    words = [f"{n} {what if n == 1 else PLURALS.get(what, what + 's')}" for n, what in parts]
    out.print(Text(f"{campaign.name}: {len(plan.loops)} runs, of {', '.join(words)}"), soft_wrap=True)
    out.print(Text(f"  time: about {duration(found.seconds)} with {found.jobs} worker{'s' if found.jobs > 1 else ''}"))
    out.print(
        Text(f"  disk: about {size(found.bytes_at_end)}, {size(found.bytes_while_running)} while it runs"),
    )
    route = "" if spec.second_route == "all" else "; MuJoCo's own route is not run"
    tried = f"{len(found.tried)} tried, at {', '.join(f'{loop.rate:.4g}' for loop in found.tried)} Hz"
    out.print(Text(f"  {tried}: {found.tried_unstable} unstable, {found.tried_failed} not computed{route}"))


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
    pictures: bool,
    candidates: Sequence[str | Path] = (),
    controllers: Sequence[str | Path] = (),
) -> int:
    """Run a study, write its report and print its outcome; return the exit code."""
    with SweepProgress(STUDY.parts) as progress:
        outcome = run_study(
            campaign,
            file,
            directory or Path("reports") / campaign.name,
            model=model,
            settings=settings,
            command=command,
            show=progress,
            report=progress.saying(WRITING, report),
            film=progress.saying("drawing the film", tracking_film.draw_tracking) if pictures else None,
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
