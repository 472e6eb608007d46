"""Where a command writes, and how it shows that it goes on; loads nothing of what is computed.

`out` is the standard output and `err` the standard error; both are as wide as the terminal, or `WIDE`.
"""

from __future__ import annotations

import time
from types import TracebackType
from typing import Any, Self

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, TextColumn, TimeElapsedColumn

WIDE = 110
"""Columns of a table where there is no terminal to ask, in a log for instance."""

LINE_EVERY_S = 10.0
"""Seconds between lines of progress where there is no terminal."""


def _console(stderr: bool) -> Console:
    console = Console(stderr=stderr, highlight=False)
    return console if console.is_terminal else Console(stderr=stderr, highlight=False, width=WIDE)


out = _console(stderr=False)
err = _console(stderr=True)


class Bar:
    """A progress bar on a terminal; nothing of it elsewhere. *last* is its last column: the time gone, if not said."""

    def __init__(self, what: str, last: ProgressColumn | None = None) -> None:
        self._what = what
        self._bar = Progress(
            TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), last or TimeElapsedColumn(),
            console=err, transient=True, disable=not err.is_terminal,
        )  # fmt: skip
        self._task: Any = None

    def __enter__(self) -> Self:
        """Start the bar."""
        if err.is_terminal:
            self._bar.start()
        self._task = self._bar.add_task(self._what, total=None, note="")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Take the bar away."""
        if err.is_terminal:  # some versions of rich end with an empty line elsewhere
            self._bar.stop()


class CaseProgress(Bar):
    """A progress bar on a terminal, one plain line per case elsewhere."""

    def __init__(self) -> None:
        super().__init__("preparing")

    def __call__(self, case: str, number: int, total: int) -> None:
        """Show that a case begins; an empty name means that the report is being written."""
        label = escape(case) if case else "writing the report"
        if err.is_terminal:
            self._bar.update(self._task, description=label, completed=number, total=total)
        elif case:
            err.print(f"[{number + 1}/{total}] {case}", markup=False)


class Steps(Bar):
    """Steps of something that may take a while: a bar on a terminal, a line now and then elsewhere.

    *what* is said beside it: ``drawing figures``.
    """

    def __init__(self, what: str) -> None:
        super().__init__(what)
        self._said = time.monotonic()

    def __call__(self, done: int, total: int) -> None:
        """Show that so many steps are done."""
        now = time.monotonic()
        if err.is_terminal:
            self._bar.update(self._task, completed=done, total=total)
        elif now - self._said > LINE_EVERY_S:
            self._said = now
            err.print(f"[{done}/{total}] {self._what}", markup=False)
