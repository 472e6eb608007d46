"""``workbench status``: how far a run is, from outside."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def status(
    run_dir: Annotated[Path, typer.Argument(metavar="RUN_DIR", help="Run directory, of a run that lives or not.")],
) -> None:
    """Say how far a run is: running, stopped or finished, its cases by status, rate and time left."""
    from workbench.commands.sweeps import duration
    from workbench.sweep.status import run_status

    found = run_status(run_dir)
    name = f" ({found.campaign})" if found.campaign else ""
    total = f" of {found.total}" if found.total is not None else ""
    who = f", process {found.process}" if found.process else ""
    typer.echo(f"{run_dir}{name}: {found.state}{who}")
    typer.echo(f"  {found.done}{total} cases finished")
    for kind, cases in found.counts.items():
        if cases:
            typer.echo(f"  {kind}: {cases}")
    if found.rate:
        left = f", {duration(found.remaining_s)} left" if found.remaining_s is not None else ""
        typer.echo(f"  {found.rate:.1f} cases/s{left}")
