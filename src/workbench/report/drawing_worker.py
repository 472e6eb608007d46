"""Draws figures of a run's cases in a process of its own while the run goes on, and writes the run's report.

`workbench.drawing_process` tells it, a line of JSON for each case and one for the report, and hears of every figure
that is drawn. A case whose figures cannot be drawn is passed over: the report draws them. A drawing is taken only
where a digest of what it was drawn from is the digest of what the run directory holds. The process ends with the one
that began it.
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import queue
import signal
import sys
import threading
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

from workbench.drawing_process import DRAWN, FAILED, WRITTEN
from workbench.records import validated
from workbench.report.build import DRAWN_STYLE, build_report
from workbench.report.drawing import COLLECT_EVERY
from workbench.report.drawn_from import Drawn, drawn_from
from workbench.report.load import Run, rows_of
from workbench.report.manifest import Manifest
from workbench.report.plot import Plot
from workbench.report.sections import plots_of_case, unique_keys
from workbench.report.style import figure_style

Say = Callable[[bytes], object]
"""Sends a line to the run."""

NICE = 5
"""The run that it belongs to goes first, the pictures after it."""


def plots_of(told: Mapping[str, Any]) -> list[tuple[Plot, str]]:
    """Return the figures of a case that `workbench.campaign.drawn.case_to_draw` tells of, each with its digest.

    Raises
    ------
    OutputError
        As `workbench.report.load.load_run`, and where the series is missing.
    """
    directory, case, names = Path(told["directory"]), str(told["case"]), told["names"]
    manifest = validated(directory / "manifest.json", Manifest, told["manifest"])
    run = Run(directory, manifest, rows_of(directory / "summary.csv", told["summary"]))
    plots = plots_of_case(run, case, names)
    digests = drawn_from(run, plots, {case: unique_keys("case", names)[case]})
    return [(plot, digests[plot.key]) for plot in plots]


def case(told: Mapping[str, Any], drawn: dict[tuple[str, str], str], say: Say, over: threading.Event) -> None:
    """Draw the figures of a case into *drawn*, until all results stand: what is left, two processes draw."""
    for plot, digest in [] if over.is_set() else plots_of(told):
        if over.is_set():
            return
        drawn[plot.key, digest] = plot.svg
        say(DRAWN)


def report(run_dir: Path, drawn: Drawn, say: Say) -> None:
    """Write the report of a run, with the figures that are drawn already, and say whether it stands there."""

    def show(*_: int) -> None:
        say(DRAWN)

    try:
        build_report(run_dir, show=show, second=True, drawn=drawn)
    except Exception:  # the run tries it itself, and says what is wrong
        say(FAILED)
    else:
        say(WRITTEN)


def serve(tasks: queue.SimpleQueue[dict[str, Any]], say: Say, over: threading.Event) -> None:
    """Draw and write what is asked for, for ever."""
    drawn: dict[tuple[str, str], str] = {}
    gc.disable()
    gc.freeze()  # what the modules hold need not be looked through
    with figure_style(DRAWN_STYLE):
        while True:
            told = tasks.get()
            if "report" in told:
                report(Path(told["report"]), drawn, say)
                continue
            before = len(drawn) // COLLECT_EVERY
            with contextlib.suppress(Exception):
                case(told, drawn, say, over)
            if len(drawn) // COLLECT_EVERY > before:
                gc.collect()


def _listen(source: BinaryIO, tasks: queue.SimpleQueue[dict[str, Any]], over: threading.Event) -> None:
    """Read until the run that began this process ends, and end; *over* is set when it asks for its report."""
    for line in source:
        told = json.loads(line)
        if "report" in told:
            over.set()
        tasks.put(told)
    os._exit(0)


def main() -> None:
    """Serve, until the run that began this process ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of a terminal's Ctrl-C the run takes care
    if hasattr(os, "nice"):
        os.nice(NICE)
    tasks: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
    over = threading.Event()
    answers = os.dup(sys.stdout.fileno())
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # whatever is printed must not get between the answers
    # not sys.stdin: its lock, held by the thread, aborts the interpreter when it ends
    source = os.fdopen(os.dup(sys.stdin.fileno()), "rb")
    threading.Thread(target=_listen, args=(source, tasks, over), daemon=True).start()
    serve(tasks, partial(os.write, answers), over)
