"""The command line: parse, call, print.

Exit code 0: every bound holds; 1: a bound fails; 2: bad input; 3: a fault of the workbench itself; 130: interrupted.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from workbench._version import __version__
from workbench.commands.assignments import settings
from workbench.commands.model import model
from workbench.commands.workspace import workspace
from workbench.errors import WorkbenchError

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
INTERNAL = 3
INTERRUPTED = 130
BROKEN_PIPE = 141

TRACEBACK = "WORKBENCH_TRACEBACK"
"""environment variable: when set, a fault of the workbench itself shows its traceback"""

USAGE_ERROR: type[Exception] = typer.BadParameter.__mro__[1]
"""what the parser raises for a wrong command line, by whichever name its version exports it"""


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"workbench {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Validate closed-form dynamics of parallel robots against MuJoCo."""


@app.command()
def run(
    campaign: Annotated[
        Path, typer.Argument(metavar="CAMPAIGN", help="Campaign file (TOML), or the name of one that comes along.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Run directory; an earlier run in it is replaced. Default: reports/NAME."),
    ] = None,
    only: Annotated[list[str] | None, typer.Option(metavar="CASE", help="Run this case only; may be repeated.")] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Set a parameter in every case, SI; a2*=1.1 scales."),
    ] = None,
    model: Annotated[
        Path | None, typer.Option(metavar="FILE", help="MJCF file in place of the campaign's own.")
    ] = None,
    engines: Annotated[
        str, typer.Option(metavar="LIST", help="mujoco, or mujoco,pinocchio to check the reference by a second engine.")
    ] = "mujoco",
    quick: Annotated[
        bool, typer.Option("--quick", help="Errors only: no power balance, no forward replay, no raw mj_inverse.")
    ] = False,
) -> None:
    """Run a campaign: closed forms against MuJoCo, with a table of errors, a verdict and a report.

    Exit code 0: every bound holds; 1: a bound fails; 2: bad input, and nothing was written.
    """
    from workbench.campaign.evidence import Effort
    from workbench.campaign.run import run_campaign
    from workbench.console import CaseProgress, print_outcome
    from workbench.report import build_report

    values, relative = settings(set_ or [])
    with CaseProgress() as progress:
        outcome = run_campaign(
            campaign,
            out,
            model=model,
            only=only or (),
            settings=values,
            relative=relative,
            command=["workbench", *sys.argv[1:]],
            progress=progress,
            report=build_report,
            effort=Effort(tuple(dict.fromkeys(part.strip() for part in engines.split(","))), budget=not quick),
        )
    print_outcome(outcome)
    if not outcome.passed:
        raise typer.Exit(BOUND_FAILED)


app.command()(workspace)
app.add_typer(model)


def main() -> NoReturn:
    """Run the command line; whatever goes wrong becomes one line and an exit code."""
    sys.exit(_run(sys.argv[1:] or ["--help"]))


def _run(arguments: list[str]) -> int:
    try:
        code = app(args=arguments, prog_name="workbench", standalone_mode=False)
    except (WorkbenchError, USAGE_ERROR) as error:
        return _complain(error, BAD_INPUT)
    except MemoryError:
        return _complain("out of memory; fewer samples need less", BAD_INPUT)
    except BrokenPipeError:
        # nobody reads any more; a flush at exit would complain
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return _complain(f"{where}{error.strerror or error}", BAD_INPUT)
    except Exception as error:
        if os.environ.get(TRACEBACK):
            raise
        return _complain(f"internal error, {type(error).__name__}: {error}; {TRACEBACK}=1 shows where", INTERNAL)
    if code == INTERRUPTED:
        return _complain("interrupted", INTERRUPTED)
    return int(code or 0)


def _complain(what: object, code: int) -> int:
    message = what.format_message() if hasattr(what, "format_message") else str(what)
    typer.echo(f"workbench: {' '.join(message.split())}", err=True)
    return code


if __name__ == "__main__":
    main()
