"""Draws the figures of a report, on two cores where a second one can help.

The second process draws from the end and sends what is done; the first draws from the front, takes what came, and never
waits: whatever becomes of the second, every figure gets drawn, and its bytes are the same whoever drew it.
"""

from __future__ import annotations

import contextlib
import gc
import multiprocessing
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection
from typing import Any

from workbench.processes import cores
from workbench.report.plot import Plot

WORTH_IT = 12
"""Figures from which on a second process pays."""
COLLECT_EVERY = 100
"""Figures between two collections of garbage: eighty megabytes."""
ROOM = 1 << 20
"""Bytes that may wait to be taken, so that the second process need not wait for the first."""

Show = Callable[[int, int], None]
"""Called with the number of figures that are drawn, and of all."""


def draw(plots: Sequence[Plot], show: Show | None = None, *, second: bool = False) -> None:
    """Draw all figures, each once, in the style that is set; *second* allows a second process, where that pays."""
    with _second(plots) if second and len(plots) >= WORTH_IT and can_fork() else contextlib.nullcontext() as sent:
        drawn: set[int] = set()
        for number, plot in enumerate(plots):
            _take(sent, plots, drawn)
            if show:
                show(len(drawn), len(plots))
            if number in drawn:
                continue
            if number % COLLECT_EVERY == COLLECT_EVERY - 1:
                gc.collect()
            _ = plot.svg
            drawn.add(number)
        if show:
            show(len(plots), len(plots))


def can_fork() -> bool:
    """Whether a copy of this process can be made that shares its data: on Linux, with a second core."""
    return sys.platform == "linux" and cores() > 1


def _take(sent: Connection | None, plots: Sequence[Plot], drawn: set[int]) -> None:
    """Take what the second process has sent, if there is one and it lives."""
    with contextlib.suppress(EOFError, OSError):
        while sent is not None and not sent.closed and sent.poll():
            number, svg = sent.recv()
            vars(plots[number])["svg"] = svg  # where the property keeps it
            drawn.add(number)


@contextlib.contextmanager
def _second(plots: Sequence[Plot]) -> Iterator[Connection | None]:
    context: Any = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    with contextlib.suppress(ImportError, OSError, AttributeError):
        import fcntl

        fcntl.fcntl(sender.fileno(), fcntl.F_SETPIPE_SZ, ROOM)
    process = context.Process(target=_from_the_end, args=(plots, receiver, sender), daemon=True)
    try:
        with warnings.catch_warnings():  # other threads may hold locks for ever in a copy: nobody waits for it
            warnings.filterwarnings("ignore", "This process .* is multi-threaded", DeprecationWarning)
            process.start()
    except OSError:  # no room for another process
        yield None
        return
    sender.close()
    try:
        yield receiver
    finally:
        process.kill()
        process.join()
        receiver.close()


def _from_the_end(plots: Sequence[Plot], receiver: Connection, sender: Connection) -> None:
    receiver.close()
    with contextlib.suppress(Exception):  # the first process draws what is missing, and says what is wrong with it
        for number in reversed(range(len(plots))):
            sender.send((number, plots[number].svg))
