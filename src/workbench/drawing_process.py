"""The process that draws figures of a run's cases while the next cases are computed, and writes the run's report.

It begins before the run has loaded what it computes with, so that what draws is loaded meanwhile, and only there. Each
case is told to it as a line of JSON once its time series stands in the run directory to be, and in the end that
directory. It fails no run: where it is gone, or gives no sign of life, the run writes the report itself.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import subprocess
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from workbench import processes

popen = subprocess.Popen
"""What starts the process."""

WORKER = "import gc; gc.disable(); from workbench.report.drawing_worker import main; main()"
"""What runs in it: nothing is looked through for garbage while modules are loaded."""
PATIENCE_S = 120.0
"""How long the run waits for the next sign of life: a figure drawn, or the report written."""
DRAWN, WRITTEN, FAILED = b"drawn\n", b"written\n", b"failed\n"
"""What it says: of a figure, and of a report."""


class DrawingProcess:
    """Tells a process of its own what to draw and to write."""

    def __init__(self) -> None:
        self._told: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._said: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        try:
            self._process: subprocess.Popen[bytes] | None = popen(
                processes.python_code(WORKER),
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

    def report(self, run_dir: Path) -> bool:
        """Have the report of a run directory written and wait for it; where that fails, the process has ended."""
        if self._process is not None:
            self.case({"report": str(run_dir.resolve())})
            with contextlib.suppress(queue.Empty):
                while (said := self._said.get(timeout=PATIENCE_S)) == DRAWN:
                    pass
                if said == WRITTEN:
                    return True
            self.close()
            for torn in run_dir.rglob(f".*.{self._process.pid}.tmp"):  # it may have been about to write
                torn.unlink()
        return False

    def close(self) -> None:
        """End the process."""
        self._told.put(None)
        if self._process is None:
            return
        if self._process.returncode is None and hasattr(os, "killpg"):
            os.killpg(self._process.pid, signal.SIGKILL)  # with the copy of itself that may help it to draw
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
        with contextlib.suppress(OSError, ValueError):  # it is gone
            for line in process.stdout:
                self._said.put(line)
        self._said.put(FAILED)
