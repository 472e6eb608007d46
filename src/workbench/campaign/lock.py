"""One run at a time in a directory: a lock that the system takes back when the process that holds it dies.

No clock and no process number decides: the lock is the system's own, so what a killed run left behind is free, and a
process that happens to have its number is not mistaken for it. How each system locks an open file is portalocker's
business; its locks of whole files by name would empty the file, in which the holder's number stands.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from workbench.errors import OutputError
from workbench.file_lock import open_lock, take

PATIENCE_S = 0.3
"""How long a held lock is tried again: looking whether it is held (`holder`) takes it for a moment."""


def lock_path(directory: Path) -> Path:
    """Where the lock of a run directory lies: beside it, since the directory itself may be replaced."""
    place = directory.resolve()
    return place.parent / f".{place.name[:100]}.lock"


def _number(file: BinaryIO) -> str:
    """Process number in a lock file; empty where the system keeps others from reading what is locked."""
    with suppress(OSError):
        file.seek(0)
        return file.read(20).decode(errors="replace").strip()
    return ""


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
        file = _acquire(path, directory)
    except (OSError, ValueError) as error:
        _remove_empty(made)
        reason = getattr(error, "strerror", None) or error
        raise OutputError(f"{directory}: cannot be written: {reason}", path=str(directory)) from error
    try:
        with suppress(OSError):  # a full disk: the lock holds all the same
            file.truncate(0)
            file.write(f"{os.getpid()}\n".encode())
        yield
    finally:
        with suppress(OSError):
            path.unlink()
        file.close()
        with suppress(OSError):  # where an open file cannot be removed
            if os.name == "nt":
                path.unlink()
        _remove_empty(made)


def _acquire(path: Path, directory: Path) -> BinaryIO:
    deadline = time.monotonic() + PATIENCE_S
    while True:
        file = open_lock(path, create=True)
        if take(file):
            # the run that held it may have removed the file just now; a lock on a file without a name holds nobody off
            with suppress(OSError):
                if os.fstat(file.fileno()).st_ino == path.stat().st_ino:
                    return file
            file.close()
            continue
        holder = _number(file) or "?"
        file.close()
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
        file = open_lock(lock_path(directory), create=False)
    except (OSError, ValueError):
        return None
    with file:
        if take(file):
            return None
        text = _number(file)
        return int(text) if text.isdigit() and text.isascii() else 0
