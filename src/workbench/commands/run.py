"""``workbench run``: a campaign, of cases or with a sweep."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from workbench.commands.assignments import settings
from workbench.commands.options import CampaignOrNone, OtherModel, SetInCases
from workbench.errors import SpecError

if TYPE_CHECKING:
    from workbench.campaign.evidence import Effort


def run(
    campaign: CampaignOrNone = None,
    robots: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="In place of a campaign: check this robot of the library, or all; may be repeated."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Run directory; an earlier run of the same is replaced, a sweep gone on with. Default: reports/NAME.",
        ),
    ] = None,
    only: Annotated[
        list[str] | None, typer.Option(metavar="CASE", help="Run this case only, of a sweep too; may be repeated.")
    ] = None,
    set_: SetInCases = None,
    model: OtherModel = None,
    candidates: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FILE",
            help="File with formulas of your own, which is run: .py .m .c .so .jl .R or a program; may be repeated.",
        ),
    ] = None,
    controllers: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FILE", help="Python file with controllers of your own for [control], run; may be repeated."
        ),
    ] = None,
    engines: Annotated[
        str, typer.Option(metavar="LIST", help="mujoco, or mujoco,pinocchio to check the reference by a second engine.")
    ] = "mujoco",
    quick: Annotated[
        bool, typer.Option("--quick", help="Errors only: no power balance, no forward replay, no raw mj_inverse.")
    ] = False,
    pictures: Annotated[
        bool, typer.Option(help="Draw the robot for the report, where this machine can; a sweep has no pictures.")
    ] = True,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check everything; print cases, samples, time and disk; write nothing.")
    ] = False,
    keep_going: Annotated[
        bool,
        typer.Option(
            "--keep-going",
            help="Record cases that cannot be driven, with the nearest pose that can; run the others, as sweeps do.",
        ),
    ] = False,
    replace: Annotated[
        bool,
        typer.Option(
            "--replace",
            help="Replace an earlier run of another robot, other cases or candidates, of more evidence, with pictures.",
        ),
    ] = False,
    good: Annotated[
        float | None,
        typer.Option(
            metavar="FRACTION",
            help="Wanted accuracy of formulas without a bound, 0.02 is 2 %: is lumped good enough? Judges nothing.",
        ),
    ] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Workers of a sweep. Default: one per core.")] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Start a sweep over; drops what is finished.")] = False,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Compute cases of a sweep again that did not pass.")
    ] = False,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            envvar="DASK_SCHEDULER_ADDRESS",
            help="Compute a sweep on a Dask cluster, tcp://host:8786, in place of local workers.",
        ),
    ] = None,
) -> None:
    """Run a campaign: closed forms against MuJoCo, with a table of errors, a verdict and a report.

    Exit code 0: every bound holds; 1: a bound fails or cannot be decided, or a case could not be computed; 2: bad
    input; 4: nothing was held against a bound, so nothing is judged.
    """
    from workbench.campaign.spec import campaign_names, load_campaign

    if robots:
        others: dict[str, object] = {
            "CAMPAIGN": campaign, "--only": only, "--set": set_, "--model": model, "--candidates": candidates,
            "--dry-run": dry_run, "--keep-going": keep_going, "--good": good, "--jobs": jobs, "--fresh": fresh,
            "--retry-failed": retry_failed, "--scheduler": scheduler,
        }  # fmt: skip
        if beside := [name for name, value in others.items() if value]:
            raise SpecError(f"--robots {robots[0]}: runs a robot's own campaign as it is, without {beside[0]}")
        from workbench.commands.run_library import run_library

        code = run_library(robots, out, _effort(engines, quick), ["workbench", *sys.argv[1:]], replace=replace)
        if code:
            raise typer.Exit(code)
        return
    if campaign is None:
        raise SpecError(f"which CAMPAIGN? A TOML file, or one that comes along: {', '.join(campaign_names())}")
    values, relative = settings(set_ or [])
    command = ["workbench", *sys.argv[1:]]
    spec, file = load_campaign(campaign)
    if spec.control is not None:
        from workbench.commands.studies import dry_run_study, refuse_options, run_study_and_print
        from workbench.commands.sweeps import report_apart
        from workbench.sweep.computing import SweepInterrupted
        from workbench.sweep.resumable import SweepOptions

        given = {"only": only, "good": good, "relative": relative}
        given |= {"quick": quick, "keep_going": keep_going, "engines": engines != "mujoco"}
        refuse_options(str(campaign), **given)
        if dry_run:
            dry_run_study(spec, file, model, values, jobs, candidates or (), controllers or ())
            return
        try:
            code = run_study_and_print(
                spec,
                file,
                out,
                model=model,
                settings=values,
                command=command,
                options=SweepOptions(jobs, scheduler, fresh, retry_failed, replace),
                candidates=candidates or (),
                controllers=controllers or (),
                report=report_apart,
                pictures=pictures,
            )
        except SweepInterrupted as stop:
            typer.echo(f"workbench: {stop}", err=True)
            raise
        if code:
            raise typer.Exit(code)
        return
    if controllers:
        raise SpecError(f"{campaign}: --controllers {controllers[0]}: the campaign has no [control]")
    sweep = spec.sweep is not None and not only
    if relative and (sweep or dry_run):
        raise SpecError(f"{campaign}: --set NAME*=FACTOR does not go with {'--dry-run' if dry_run else 'a sweep'}")
    if sweep and good is not None:
        raise SpecError(f"{campaign}: --good {good:g}: a sweep counts its designs by sweep.good of the campaign")
    if not sweep and not dry_run:
        from workbench.commands.run_cases import run_cases_and_print

        code = run_cases_and_print(
            spec,
            campaign,
            lambda: _effort(engines, quick),
            pictures=pictures,
            out=out,
            model=model,
            only=only or (),
            settings=values,
            relative=relative,
            command=command,
            candidates=candidates or (),
            keep_going=keep_going,
            replace=replace,
            good=good,
        )
        if code:
            raise typer.Exit(code)
        return
    from workbench.campaign.asked import with_good
    from workbench.commands.sweeps import dry_run as print_dry_run
    from workbench.commands.sweeps import report_apart, run_and_print
    from workbench.sweep.computing import SweepInterrupted
    from workbench.sweep.resumable import SweepOptions

    spec, effort = with_good(spec, good), _effort(engines, quick)
    if dry_run:
        print_dry_run(spec, file, model, values, effort, jobs, candidates or (), only or (), keep_going)
        return
    try:
        code = run_and_print(
            spec,
            file,
            out,
            model=model,
            settings=values,
            command=command,
            effort=effort,
            options=SweepOptions(jobs, scheduler, fresh, retry_failed, replace),
            candidates=candidates or (),
            report=report_apart,
        )
    except SweepInterrupted as stop:
        typer.echo(f"workbench: {stop}", err=True)
        raise
    if code:
        raise typer.Exit(code)


def _effort(engines: str, quick: bool) -> Effort:
    from workbench.campaign.evidence import Effort

    return Effort(tuple(dict.fromkeys(part.strip() for part in engines.split(","))), budget=not quick)
