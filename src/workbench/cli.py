"""The command line: parse, call, print. Exit code 0: every bound holds; 1: a bound fails; 2: bad input."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from workbench._version import __version__
from workbench.errors import ParameterError, WorkbenchError

app = typer.Typer(
    name="workbench",
    help="Validate closed-form dynamics of parallel robots against MuJoCo.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)

BOUND_FAILED = 1
BAD_INPUT = 2


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"workbench {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")] = False,
) -> None:
    """Validate closed-form dynamics of parallel robots against MuJoCo."""


@app.command()
def run(
    campaign: Annotated[Path, typer.Argument(help="Campaign file (TOML), or the name of one that comes along.")],
    out: Annotated[Path | None, typer.Option(help="Run directory.", show_default="reports/<campaign name>")] = None,
    only: Annotated[list[str] | None, typer.Option(metavar="CASE", help="Run this case only; may be repeated.")] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Set a parameter in every case, SI units; may be repeated."),
    ] = None,
    model: Annotated[Path | None, typer.Option(help="MJCF file in place of the campaign's own.")] = None,
) -> None:
    """Run a campaign: closed forms against MuJoCo, with a table of errors, a verdict and a report."""
    from workbench.campaign.run import run_campaign  # noqa: PLC0415 - start-up stays light
    from workbench.console import CaseProgress, print_outcome  # noqa: PLC0415
    from workbench.report import build_report  # noqa: PLC0415

    with CaseProgress() as progress:
        outcome = run_campaign(
            campaign,
            out,
            model=model,
            only=only or (),
            settings=_settings(set_ or []),
            command=["workbench", *sys.argv[1:]],
            progress=progress,
            report=build_report,
        )
    print_outcome(outcome)
    if not outcome.passed:
        raise typer.Exit(BOUND_FAILED)


def _settings(assignments: list[str]) -> dict[str, float]:
    """Read ``NAME=VALUE`` options.

    Raises
    ------
    ParameterError
        No ``=``, or a value that is not a number.
    """
    settings = {}
    for assignment in assignments:
        name, equals, value = assignment.partition("=")
        try:
            settings[name.strip()] = float(value)
        except ValueError:
            equals = ""
        if not equals:
            raise ParameterError(f'--set "{assignment}": expected NAME=VALUE with a number in SI units')
    return settings


def main() -> NoReturn:
    """Run the command line; whatever the workbench raises becomes one line and exit code 2."""
    try:
        app()
    except WorkbenchError as error:
        typer.echo(f"workbench: {error}", err=True)
        sys.exit(BAD_INPUT)
    except KeyboardInterrupt:
        typer.echo("workbench: interrupted; nothing was written", err=True)
        sys.exit(130)
    except BrokenPipeError:
        sys.exit(141)
    sys.exit(0)


if __name__ == "__main__":
    main()
