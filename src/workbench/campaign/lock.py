"""One run at a time in a directory: a lock that the system takes back when the process that holds it dies.

No clock and no process number decides: the lock is the system's own (flock), so what a killed run left behind is free,
and a process that happens to have its number is not mistaken for it.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from workbench.errors import OutputError

PATIENCE_S = 0.3
"""How long a held lock is tried again: looking whether it is held (`holder`) takes it for a moment."""


def lock_path(directory: Path) -> Path:
    """Where the lock of a run directory lies: beside it, since the directory itself may be replaced."""
    place = directory.resolve()
    return place.parent / f".{place.name[:100]}.lock"


def _take(descriptor: int) -> bool:
    try:
        if os.name == "nt":
            import msvcrt

            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined, unused-ignore]
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


@contextmanager
def locked(directory: Path) -> Iterator[None]:
    """Hold the lock of a run directory while the block runs.

    Raises
    ------
    OutputError
        Another run holds it; the message names its process. Or the lock cannot be written.
    """
    path = lock_path(directory)
    made = [parent for parent in path.parents if not parent.exists()]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = _acquire(path, directory)
    except (OSError, ValueError) as error:
        _remove_empty(made)
        reason = getattr(error, "strerror", None) or error
        raise OutputError(f"{directory}: cannot be written: {reason}", path=str(directory)) from error
    try:
        with suppress(OSError):  # a full disk: the lock holds all the same
            os.ftruncate(descriptor, 0)
            os.pwrite(descriptor, f"{os.getpid()}\n".encode(), 0)
        yield
    finally:
        with suppress(OSError):
            path.unlink()
        os.close(descriptor)
        _remove_empty(made)


def _acquire(path: Path, directory: Path) -> int:
    deadline = time.monotonic() + PATIENCE_S
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        if _take(descriptor):
            # the run that held it may have removed the file just now; a lock on a file without a name holds nobody off
            with suppress(OSError):
                if os.fstat(descriptor).st_ino == path.stat().st_ino:
                    return descriptor
            os.close(descriptor)
            continue
        holder = os.pread(descriptor, 20, 0).decode(errors="replace").strip() or "?"
        os.close(descriptor)
        if time.monotonic() > deadline:
            raise OutputError(
                f"{directory}: another run (process {holder}) is writing it; wait for its end or name another place",
                path=str(directory),
            )
        time.sleep(0.05)


def _remove_empty(made: list[Path]) -> None:
    for parent in made:
        with suppress(OSError):  # it holds a run
            parent.rmdir()


def holder(directory: Path) -> int | None:
    """Number of the process that writes a run directory; None where none does, 0 where its number is not readable."""
    try:
        descriptor = os.open(lock_path(directory), os.O_RDWR | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        if _take(descriptor):
            return None
        text = os.pread(descriptor, 20, 0).decode(errors="replace").strip()
        return int(text) if text.isdigit() else 0
    finally:
        os.close(descriptor)
