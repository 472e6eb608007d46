"""Locks on open files that the system takes back when the process that holds them dies, on every system."""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO

import portalocker


def open_lock(path: Path, create: bool) -> BinaryIO:
    """Open a lock file without a buffer, so that what is written to it and read from it is the file's.

    Raises
    ------
    OSError
        It cannot be opened, or is missing and not to be made.
    """
    descriptor = os.open(path, os.O_RDWR | (os.O_CREAT if create else 0) | getattr(os, "O_NONBLOCK", 0), 0o644)
    return os.fdopen(descriptor, "r+b", buffering=0)


def take(file: BinaryIO) -> bool:
    """Lock an open file until it is closed; False where another process holds it."""
    try:
        portalocker.lock(file, portalocker.LockFlags.EXCLUSIVE | portalocker.LockFlags.NON_BLOCKING)
    except (portalocker.LockException, OSError):
        return False
    return True
