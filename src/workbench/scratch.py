"""Directories for files in between; what a process that was killed left there, the next one removes."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from workbench.file_lock import open_lock, take

PREFIX = "workbench_"
LOCK = "in_use"


class Scratch:
    """A directory of this process's own; its lock says that the process lives.

    Raises
    ------
    OSError
        It cannot be made.
    """

    def __init__(self) -> None:
        _remove_abandoned()
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX))
        self._lock = open_lock(self.path / LOCK, create=True)
        take(self._lock)

    def close(self) -> None:
        """Remove it."""
        self._lock.close()
        shutil.rmtree(self.path, ignore_errors=True)


@contextmanager
def scratch_directory() -> Iterator[Path]:
    """Give a directory that is removed at the end.

    Raises
    ------
    OSError
        It cannot be made.
    """
    scratch = Scratch()
    try:
        yield scratch.path
    finally:
        scratch.close()


def _remove_abandoned() -> None:
    for path in Path(tempfile.gettempdir()).glob(f"{PREFIX}*/{LOCK}"):
        # others' directories, and those that are gone in this moment, stay as they are
        with contextlib.suppress(OSError), open_lock(path, create=False) as lock:
            abandoned = take(lock)
            if abandoned and not path.parent.is_symlink():
                shutil.rmtree(path.parent, ignore_errors=True)
