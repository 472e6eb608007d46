"""A command that goes on until it is stopped, in a process of its own whose lines are read as they come."""

from __future__ import annotations

import queue
import subprocess
import sys
import threading
from pathlib import Path
from typing import Self


class TalkingProcess:
    """``workbench ARGUMENTS``, killed at the end of the block; standard output and error are one stream."""

    def __init__(self, *arguments: str, cwd: Path | None = None, patience: float) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "workbench.cli", *arguments],
            cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
        )  # fmt: skip
        self._patience = patience
        self._lines: queue.Queue[str] = queue.Queue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()
        self._reader.join()
        assert self.process.stdout
        self.process.stdout.close()

    def _read(self) -> None:
        assert self.process.stdout
        for line in self.process.stdout:
            self._lines.put(line)

    def line(self) -> str:
        """The next line; waits for it."""
        return self._lines.get(timeout=self._patience)

    def rest(self) -> str:
        """What is left to read once the process has ended; waits for that."""
        self.process.wait(self._patience)
        self._reader.join()
        return "".join(self._lines.get() for _ in range(self._lines.qsize()))
