"""Draws figures of a run's cases in a process of its own while the run goes on (`workbench.drawing_process`).

It reads a line of JSON for each case from its standard input and answers with a line for each figure, in the order in
which the report shows them. A case whose figures cannot be drawn is passed over: the report draws them, and says what
is wrong. It ends with the process that began it.
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
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

from workbench.records import validated
from workbench.report.build import DRAWN_STYLE
from workbench.report.drawn_from import drawn_from
from workbench.report.load import Run, rows_of
from workbench.report.manifest import Manifest
from workbench.report.plot import Plot
from workbench.report.sections import plots_of_case, unique_keys
from workbench.report.style import figure_style

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


def answer(told: Mapping[str, Any], out: BinaryIO) -> None:
    """Draw the figures of a case, each of them sent when it is done."""
    for plot, digest in plots_of(told):
        out.write(json.dumps({"key": plot.key, "from": digest, "svg": plot.svg}).encode("ascii") + b"\n")
        out.flush()


def serve(tasks: queue.SimpleQueue[bytes], out: BinaryIO) -> None:
    """Draw what is asked for, for ever."""
    gc.disable()
    gc.freeze()  # what the modules hold need not be looked through
    with figure_style(DRAWN_STYLE):
        while True:
            with contextlib.suppress(Exception):
                answer(json.loads(tasks.get()), out)
            gc.collect()


def _listen(source: BinaryIO, tasks: queue.SimpleQueue[bytes]) -> None:
    """Read until the run that began this process ends, and end."""
    for line in source:
        tasks.put(line)
    os._exit(0)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of a terminal's Ctrl-C the run takes care
    if hasattr(os, "nice"):
        os.nice(NICE)
    lines: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # whatever is printed must not get between the drawings
    # not sys.stdin: its lock, held by the thread, aborts the interpreter when it ends
    threading.Thread(target=_listen, args=(os.fdopen(os.dup(sys.stdin.fileno()), "rb"), lines), daemon=True).start()
    serve(lines, answers)
