"""A process that computes torques on request: limits of time, its end, and what it said before that.

Numbers go through a file of float64 in a private directory, words through lines. Lines of a formula's own are no
replies and are dropped. The process runs in its own session, so that what it started ends with it.
"""

from __future__ import annotations

import contextlib
import os
import queue
import shutil
import signal
import subprocess
import tempfile
import threading
import weakref
from collections.abc import Sequence
from pathlib import Path
from typing import IO

import numpy as np

from workbench.arrays import FloatArray
from workbench.foreign.fault import ForeignError
from workbench.processes import environment

MARK = "\x01workbench "
"""begins every reply"""

REQUEST, REPLY, ERROR = "request.bin", "reply.bin", "error.txt"
MOST_ERROR = 20_000
"""Characters of a process's complaints that are looked at."""


class Served:
    """One such process."""

    def __init__(self, arguments: Sequence[str], scratch: Path, seconds: float) -> None:
        self.scratch = scratch
        self._complaints = scratch / "stderr.txt"
        with open(self._complaints, "wb") as complaints:
            self._process = subprocess.Popen(
                list(arguments),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=complaints,
                cwd=scratch,
                env=environment(),
                start_new_session=True,
                encoding="utf-8",
                errors="replace",
            )
        assert self._process.stdout is not None
        self._lines: queue.Queue[str | None] = queue.Queue()
        threading.Thread(target=_pump, args=(self._process.stdout, self._lines), daemon=True).start()
        self._finalizer = weakref.finalize(self, end, self._process)
        self.greeting = self._wait(seconds)

    def ask(self, seconds: float, word: str = "go") -> str:
        """Send a word and wait for the reply.

        Raises
        ------
        ForeignError
            The process took too long, and was ended; or it ended by itself.
        """
        assert self._process.stdin is not None
        try:
            # an empty line behind: some readers of lines look one character ahead
            self._process.stdin.write(word + "\n\n")
            self._process.stdin.flush()
        except OSError as error:
            raise self._ended() from error
        return self._wait(seconds)

    def close(self) -> None:
        """End the process."""
        self._finalizer()

    @property
    def running(self) -> bool:
        """Whether it can be asked."""
        return self._process.poll() is None

    def complaints(self) -> str:
        """What it wrote to its standard error."""
        try:
            return self._complaints.read_text(encoding="utf-8", errors="replace")[-MOST_ERROR:]
        except OSError:
            return ""

    def _wait(self, seconds: float) -> str:
        while True:
            try:
                line = self._lines.get(timeout=seconds)
            except queue.Empty:
                self.close()
                raise ForeignError(f"takes more than {seconds:g} s") from None
            if line is None:
                raise self._ended()
            if line.startswith(MARK):
                return line.removeprefix(MARK).rstrip("\n")

    def _ended(self) -> ForeignError:
        code = self._process.wait()
        said = self.complaints().strip().splitlines()
        last = f": {said[-1]}" if said else ""
        if code < 0:
            with contextlib.suppress(ValueError):
                return ForeignError(f"ended by {signal.Signals(-code).name}{last}")
        return ForeignError(f"ended with exit code {code}{last}")


def end(process: subprocess.Popen[str]) -> None:
    """End a process with all that it started."""
    if process.poll() is None:
        with contextlib.suppress(OSError):
            if hasattr(os, "killpg"):
                os.killpg(process.pid, signal.SIGKILL)
            else:
                process.kill()
    with contextlib.suppress(OSError, subprocess.TimeoutExpired):
        process.wait(timeout=5.0)
    for stream in (process.stdin, process.stdout):
        with contextlib.suppress(OSError):
            if stream:
                stream.close()


def _pump(stream: IO[str], lines: queue.Queue[str | None]) -> None:
    with contextlib.suppress(OSError, ValueError):
        for line in stream:
            lines.put(line)
    lines.put(None)


class Scratch:
    """A private directory that goes with the object, or at the end of the process."""

    def __init__(self) -> None:
        self.name = tempfile.mkdtemp(prefix="workbench-formula-")
        self._finalizer = weakref.finalize(self, shutil.rmtree, self.name, ignore_errors=True)


def write_request(scratch: Path, parameters: Sequence[float], arrays: Sequence[FloatArray]) -> None:
    """Write ``[n, na, count of parameters, count of arrays]``, parameters and arrays, row by row, as float64."""
    n, na = arrays[0].shape
    head = np.array([n, na, len(parameters), len(arrays), *parameters], dtype=np.float64)
    parts = [head, *(np.ascontiguousarray(array, dtype=np.float64).ravel() for array in arrays)]
    (scratch / REQUEST).write_bytes(np.concatenate(parts).tobytes())


def read_reply(scratch: Path) -> FloatArray:
    """Read ``[rows, columns]`` and numbers, row by row."""
    numbers = np.frombuffer((scratch / REPLY).read_bytes(), dtype=np.float64)
    found: FloatArray = numbers[2:].reshape(int(numbers[0]), int(numbers[1])).copy()
    return found
