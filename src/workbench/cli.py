"""The command line: parse, call, print.

Exit code 0: every bound holds; 1: a bound fails; 2: bad input; 3: a fault of the workbench itself; 4: nothing was held
against a bound; 130: interrupted; 143, 129: ended by SIGTERM, SIGHUP.
"""

from __future__ import annotations

import atexit
import gc
import io
import os
import re
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Annotated, NoReturn

import typer

from workbench._version import __version__
from workbench.commands.compare import compare
from workbench.commands.diagnose import diagnose
from workbench.commands.docs import docs
from workbench.commands.model import model
from workbench.commands.new import new
from workbench.commands.report import report
from workbench.commands.robots import robots
from workbench.commands.run import run
from workbench.commands.status import status
from workbench.commands.studio import studio
from workbench.commands.watch import watch
from workbench.commands.workspace import workspace
from workbench.errors import WorkbenchError
from workbench.notices import subscribers

app = typer.Typer(
    name="workbench",
    help="Validate closed-form dynamics of parallel robots against MuJoCo.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)

BAD_INPUT = 2
INTERNAL = 3
INTERRUPTED = 130
SIGNALLED = 128
"""plus the number of the signal that ended a command"""
BROKEN_PIPE = 141

SHOWN = 200
LONG_WORD = re.compile(r"\S{600,}")
"""Nobody reads these to their end: a line of a message stays a line."""
LONGEST_LINE, KEPT_END = 1400, 300
"""Characters of a message, and of its end, which holds the way on."""

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


app.command()(report)
app.command()(run)
app.command()(new)
app.command()(status)
app.command()(docs)
app.command()(robots)
app.command()(workspace)
app.add_typer(model)
app.command()(compare)
app.command()(diagnose)
app.command()(watch)
app.command()(studio)


def main() -> NoReturn:
    """Run the command line; whatever goes wrong becomes one line and an exit code."""
    # an interpreter that ends looks through all there is, several times: most of a second with the libraries of a run
    atexit.unregister(gc.freeze)
    atexit.register(gc.freeze)
    if _notice not in subscribers:
        subscribers.append(_notice)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # names of files may hold what is no text
            stream.reconfigure(errors="backslashreplace")
    with _asked_to_end() as asked:
        code = _run(sys.argv[1:] or ["--help"], asked)
    sys.exit(code)


@contextmanager
def _asked_to_end() -> Iterator[list[int]]:
    """Make SIGTERM and SIGHUP end the command as Ctrl-C does, with everything tidied up; give those that came."""
    came: list[int] = []

    def end(number: int, frame: object) -> None:
        signal.signal(number, signal.SIG_DFL)  # a second one ends it at once
        came.append(number)
        raise KeyboardInterrupt

    before = {}
    if threading.current_thread() is threading.main_thread():
        numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
        # who ignores a signal, as nohup does, goes on ignoring it
        before = {n: signal.signal(n, end) for n in numbers if signal.getsignal(n) is signal.SIG_DFL}
    try:
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _notice(text: str) -> None:
    typer.echo(f"workbench: {text}", err=True)


def _run(arguments: list[str], asked: Sequence[int] = ()) -> int:
    for argument in arguments:
        if "\0" in argument:  # no system hands one over; what calls this from Python may
            return _complain(f"{argument!r}: a null byte in an argument", BAD_INPUT)
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
    if asked:
        return _complain(f"ended by {signal.Signals(asked[0]).name}", SIGNALLED + asked[0])
    if code == INTERRUPTED:
        return _complain("interrupted", INTERRUPTED)
    return int(code or 0)


def _complain(what: object, code: int) -> int:
    message = what.format_message() if hasattr(what, "format_message") else str(what)
    line = LONG_WORD.sub(lambda word: f"{word[0][:SHOWN]}...", " ".join(message.split()))
    if len(line) > LONGEST_LINE:
        line = f"{line[: LONGEST_LINE - KEPT_END]} ... {line[-KEPT_END:]}"
    typer.echo(f"workbench: {line}", err=True)
    return code


if __name__ == "__main__":
    main()
