"""What ``workbench run`` does for campaigns with a sweep: call, show progress, print the outcome; and dry runs."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import ParamSpec, TypeVar

from rich import box
from rich.progress import TextColumn
from rich.table import Table
from rich.text import Text

from workbench import processes
from workbench.campaign.evidence import Effort, check_engines
from workbench.campaign.margins import IN_SWEEPS
from workbench.campaign.spec import Campaign
from workbench.campaign.verdict import WITHOUT_BOUND
from workbench.console import print_changes, print_conclusion
from workbench.errors import OutputError
from workbench.sweep.estimate import estimate
from workbench.sweep.progress import Snapshot
from workbench.sweep.resumable import SweepOptions
from workbench.sweep.run import SweepOutcome, run_sweep
from workbench.terminal import LINE_EVERY_S, Bar, err, out

P = ParamSpec("P")
R = TypeVar("R")

SHOWN_DRIVERS = 6
WRITING = "writing the report"


def duration(seconds: float) -> str:
    """Say how long something takes."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    if seconds < 3600:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"


def size(bytes_: float) -> str:
    """Say how much room something takes."""
    for unit in ("kB", "MB", "GB"):
        bytes_ /= 1000
        if bytes_ < 1000 or unit == "GB":
            break
    return f"{bytes_:.3g} {unit}"


def plain_line(found: Snapshot, parts: str = "cases") -> str:
    """One line of progress; *parts* is what is counted."""
    troubles = [f"{n} {status}" for status, n in found.counts.items() if n and status != "passed"]
    rate = [f"{found.rate:.1f} {parts}/s"] if found.rate else []
    left = [f"{duration(found.remaining_s)} left"] if found.remaining_s else []
    return f"[{found.done}/{found.total}] " + (", ".join([*rate, *left, *troubles]) or parts)


class SweepProgress(Bar):
    """A bar with rate and time left on a terminal, a plain line now and then elsewhere."""

    def __init__(self, parts: str = "cases") -> None:
        super().__init__(parts, TextColumn("{task.fields[note]}"))
        self._said, self._last = float("-inf"), -1

    def __call__(self, found: Snapshot) -> None:
        """Show where the sweep stands."""
        if err.is_terminal:
            note = plain_line(found, self._what).partition("] ")[2]
            self._bar.update(self._task, completed=found.done, total=found.total, note=note)
        elif time.monotonic() - self._said >= LINE_EVERY_S or (found.done == found.total != self._last):
            self._said, self._last = time.monotonic(), found.done
            err.print(plain_line(found, self._what), markup=False)

    def saying(self, what: str, does: Callable[P, R]) -> Callable[P, R]:
        """Return *does*, which says on a terminal *what* is being done when it is called: all is computed then."""

        def said(*arguments: P.args, **named: P.kwargs) -> R:
            if err.is_terminal:
                self._bar.update(self._task, note=what)
            return does(*arguments, **named)

        return said


def dry_run(
    campaign: Campaign,
    file: Path,
    model: Path | None,
    settings: Mapping[str, float],
    effort: Effort,
    jobs: int | None,
    candidates: Sequence[str | Path] = (),
    only: Sequence[str] = (),
    keep_going: bool = False,
) -> None:
    """Print what a run would take; nothing is written."""
    check_engines(effort.engines)
    found = estimate(campaign, file, model, settings, effort, jobs, candidates, only, keep_going)
    out.print(Text(f"{campaign.name}: {found.cases} cases, {found.samples} samples"))
    workers = "worker" if found.jobs == 1 else "workers"
    out.print(Text(f"  time: about {duration(found.seconds)} with {found.jobs} {workers}"))
    running = f", {size(found.bytes_while_running)} while it runs" if campaign.sweep and not only else ""
    out.print(Text(f"  disk: about {size(found.bytes_at_end)}{running}"))
    if campaign.good is not None:
        out.print(Text(f"  good: {100 * campaign.good:.3g} % is asked of {', '.join(found.measured)}"))
    if found.limited:
        out.print(Text(f"  actuators: limits of {', '.join(found.limited)} are held against every case"))
    for line in found.left_out:
        out.print(Text(f"  cannot be driven, left out: {line}"), soft_wrap=True)
    if campaign.sweep and not only:
        parts = [f"{found.tried_filtered} left out by the filter", f"{found.tried_failed} not passed"]
        out.print(Text(f"  of {found.tried} cases tried: {', '.join(parts)}"))


def run_and_print(
    campaign: Campaign,
    file: Path,
    directory: Path | None,
    *,
    model: Path | None,
    settings: Mapping[str, float],
    command: list[str],
    effort: Effort,
    options: SweepOptions,
    report: Callable[[Path], object],
    candidates: Sequence[str | Path] = (),
) -> int:
    """Run a sweep, write its report and print its outcome; return the exit code."""
    check_engines(effort.engines)
    with SweepProgress() as progress:
        outcome = run_sweep(
            campaign,
            file,
            directory or Path("reports") / campaign.name,
            model=model,
            settings=settings,
            command=command,
            show=progress,
            effort=effort,
            options=options,
            candidates=candidates,
            report=progress.saying(WRITING, report),
        )
    print_sweep(outcome)
    return outcome.conclusion.exit_code


def report_apart(directory: Path) -> None:
    """Write a sweep's report in a process of its own: what drawing takes does not add to what the run holds.

    Raises
    ------
    OutputError
        The report cannot be written; the results stand.
    """
    command = processes.python_module("workbench.cli", "report", "--", str(directory))
    done = subprocess.run(
        command, env=processes.environment(), stdin=subprocess.DEVNULL, capture_output=True, text=True,
        errors="replace", check=False,
    )  # fmt: skip
    if done.returncode:
        said = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        raise OutputError(said.removeprefix("workbench: "), path=str(directory))


def print_sweep(outcome: SweepOutcome) -> None:
    """Print counts, errors over all cases, what drives them, and the verdict."""
    summary = outcome.summary
    print_changes(outcome.manifest)
    table = Table(title="Errors over all cases, largest joint", title_justify="left", box=box.SIMPLE_HEAD)
    for column in ("candidate", "MuJoCo model", "median", "95 %", "largest", "case"):
        table.add_column(column, justify="right" if column in ("median", "95 %", "largest") else "left")
    for row in summary["errors"]:
        if row["joint"] == "any" and row["cases"]:
            show = _percent if row["kind"] in WITHOUT_BOUND else _scientific
            numbers = (row["quantiles"]["0.5"], row["quantiles"]["0.95"], row["max"])
            table.add_row(row["candidate"], row["reference"], *map(show, numbers), row["worst_case"])
    out.print(table)
    if outcome.manifest["actuators"]:
        out.print(Text(IN_SWEEPS, style="yellow"))
    drivers = summary["drivers"][:SHOWN_DRIVERS]
    if drivers:
        listed = ", ".join(f"{d['key']} {d['rank_correlation']:+.2f}" for d in drivers)
        out.print(Text(f"Error of {drivers[0]['candidate']} rises with (rank correlation): {listed}"))
    for reason in summary["reasons"]:
        if reason["status"] != "filtered" or not summary["counts"]["passed"]:
            out.print(Text(f"{reason['status']} ({reason['cases']}): {reason['example']}"), style="yellow")
    print_conclusion(outcome.conclusion)
    out.print(Text(f"Report: {outcome.directory / 'report.html'}; data: sweep.json, cases, summary"), soft_wrap=True)


def _percent(value: float) -> str:
    return f"{100 * value:.2f} %"


def _scientific(value: float) -> str:
    return f"{value:.1e}"
