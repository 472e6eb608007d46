"""Calls of a user's code: whatever it raises, however long it takes, however much it wants, one exception comes out."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from workbench.no_exit import EndsProcess, no_exit

Result = TypeVar("Result")

LIMIT_MB = 1500.0
"""Memory that one call may take more than there was, where the system can tell."""

LONGEST = 200
"""Characters of a message that are repeated."""


class UnrulyError(Exception):
    """A user's code raised, took too long or too much memory; ``error`` is what came."""

    def __init__(self, message: str, error: BaseException) -> None:
        super().__init__(message)
        self.error = error


class TooSlow(BaseException):
    """Stops a user's code; no ``except Exception`` of theirs holds it up."""


def said(what: object) -> str:
    """Return what an object says of itself, short; some say it by raising, some at great length."""
    try:
        text = str.__getitem__(str(what), slice(LONGEST + 1))
    except MemoryError:
        return "a message that does not fit into memory"
    except Exception:
        return "a message that cannot be shown"
    text = text.encode("utf-8", "backslashreplace").decode()
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def bounded(call: Callable[[], Result], limit_s: float) -> Result:
    """Call a user's code within limits of time and memory.

    Raises
    ------
    UnrulyError
        Whatever it raised, an exit or an endless recursion too, and where it would have ended the process; only Ctrl-C
        stays what it is.
    """
    try:
        with no_exit(), _time(limit_s), _memory(LIMIT_MB):
            return call()
    except TooSlow as error:
        raise UnrulyError(f"takes more than {limit_s:g} s", error) from error
    except EndsProcess as error:
        raise UnrulyError(said(error), error) from error
    except MemoryError as error:
        raise UnrulyError(f"MemoryError: {said(error) or f'needs more than {LIMIT_MB:g} MB'}", error) from error
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # an exit code of theirs would be taken for the verdict
        raise UnrulyError(f"{type(error).__name__}: {said(error)}", error) from error


@contextmanager
def _time(seconds: float) -> Iterator[None]:
    able = hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()
    if not able:
        yield
        return

    def stop(number: int, frame: object) -> None:
        raise TooSlow

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def _memory(megabytes: float) -> Iterator[None]:
    """Let this process take so much more address space; a limit that is closer already stays."""
    try:
        import resource

        with open("/proc/self/statm", "rb") as stream:
            used = int(stream.read().split()[0]) * resource.getpagesize()
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
        wanted = used + int(megabytes * 1e6)
        if soft == resource.RLIM_INFINITY or wanted < soft:
            resource.setrlimit(resource.RLIMIT_AS, (wanted, hard))
    except (ImportError, OSError, ValueError):
        yield
        return
    try:
        yield
    finally:
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
