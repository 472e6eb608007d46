"""How far a sweep is: counts, rate and time left; shown to the user and left in the run directory for others."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from workbench.sweep import files

SHOW_EVERY_S = 0.25
WRITE_EVERY_S = 2.0


@dataclass(frozen=True)
class Snapshot:
    """One look at a running sweep."""

    done: int
    """finished cases, those of earlier runs included"""
    total: int
    counts: Mapping[str, int] = field(default_factory=dict)
    rate: float = 0.0
    """cases per second of this run, 0 before the first"""
    remaining_s: float | None = None


Show = Callable[[Snapshot], None]


class Meter:
    """Counts finished cases. Rates are measured by a clock that nobody can set back."""

    def __init__(self, directory: Path, done: int, total: int, counts: Mapping[str, int], show: Show | None) -> None:
        self._path = directory / files.PROGRESS
        self._show = show
        self._begun = time.monotonic()
        self._first = done
        self._done, self._total, self._counts = done, total, dict(counts)
        self._shown = self._written = float("-inf")
        self.tell(force=True)

    def count(self, status: str) -> None:
        """Count one more finished case."""
        self._done += 1
        self._counts[status] = self._counts.get(status, 0) + 1
        self.tell()

    def snapshot(self) -> Snapshot:
        """Return where the sweep stands."""
        elapsed, computed = time.monotonic() - self._begun, self._done - self._first
        rate = computed / elapsed if computed and elapsed > 0 else 0.0
        left = (self._total - self._done) / rate if rate else None
        return Snapshot(self._done, self._total, dict(self._counts), rate, left)

    def tell(self, force: bool = False) -> None:
        """Show and write where the sweep stands, not more often than anyone can read."""
        now = time.monotonic()
        if self._show and (force or now - self._shown >= SHOW_EVERY_S):
            self._shown = now
            self._show(self.snapshot())
        if force or now - self._written >= WRITE_EVERY_S:
            self._written = now
            found = self.snapshot()
            content = {
                "done": found.done, "total": found.total, "counts": found.counts, "rate": found.rate,
                "remaining_s": found.remaining_s, "pid": os.getpid(),
            }  # fmt: skip
            # what others may look at is not worth ending a run
            with contextlib.suppress(OSError):
                files.write_json(self._path, content)
