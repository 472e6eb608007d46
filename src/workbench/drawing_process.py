"""The process that draws figures of a run's cases while the next cases are computed; it never fails a run.

It begins before the run has loaded what it computes with, so that what draws is loaded meanwhile. Each case is told to
it as a line of JSON once its time series stands in the run directory to be; drawings come back as lines of JSON. Nobody
waits for it: whatever becomes of it, what it has not drawn is drawn by the report.
"""

from __future__ import annotations

import contextlib
import json
import queue
import subprocess
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from workbench import processes

popen = subprocess.Popen
"""What starts the process."""

WORKER = "workbench.report.drawing_worker"
"""The module that runs in it."""

Drawn = Mapping[tuple[str, str], str]
"""From a figure's key, and a digest of what it was drawn from, to the drawing."""


class DrawingProcess:
    """Tells a process of its own what to draw, and keeps what came."""

    def __init__(self) -> None:
        self._drawn: dict[tuple[str, str], str] = {}
        self._told: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        try:
            self._process: subprocess.Popen[bytes] | None = popen(
                processes.python_module(WORKER),
                env=processes.environment(),
                cwd=Path(__file__).parent,  # libraries find nothing of the current directory
                stdin=subprocess.PIPE,  # closed by the system when this process dies: then the other ends, too
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                # Ctrl-C in a terminal goes to the run alone, which ends this process itself
                start_new_session=True,
            )
        except OSError:  # no room for another process
            self._process = None
            return
        for work in (self._tell, self._listen):
            threading.Thread(target=work, args=(self._process,), daemon=True).start()

    def case(self, told: Mapping[str, Any]) -> None:
        """Have the figures of a case drawn, `workbench.campaign.drawn.case_to_draw`; returns at once."""
        self._told.put(json.dumps(told, ensure_ascii=True).encode("ascii") + b"\n")

    @property
    def drawn(self) -> Drawn:
        """What has come until now."""
        return self._drawn

    def close(self) -> None:
        """End the process."""
        self._told.put(None)
        if self._process is None:
            return
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()

    def _tell(self, process: subprocess.Popen[bytes]) -> None:
        """In a thread: a process that does not read must not hold the run up."""
        assert process.stdin is not None
        with contextlib.suppress(OSError, ValueError):  # it is gone, or its end of the pipe
            while (line := self._told.get()) is not None:
                process.stdin.write(line)
                process.stdin.flush()

    def _listen(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdout is not None
        with contextlib.suppress(OSError, ValueError, KeyError, TypeError):  # the last line may be torn
            for line in process.stdout:
                found = json.loads(line)
                self._drawn[found["key"], found["from"]] = found["svg"]
