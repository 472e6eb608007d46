"""Files that others may have put there: no pipe is waited for, nothing larger or deeper than said is taken in."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path
from typing import Any

LARGEST_TEXT = 50_000_000
"""Bytes of a text file that is read whole; a manifest of some hundred cases has a megabyte."""

DEEPEST = 60
"""Tables in tables, lists in lists."""


def read_bytes(path: str | os.PathLike[str], largest: int = LARGEST_TEXT) -> bytes:
    """Read a regular file whole.

    Raises
    ------
    OSError
        It cannot be read, is no regular file (a pipe is refused, not waited for), or is larger than allowed; the
        reason is ``error.strerror``.
    """
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except ValueError as error:  # a null character in the path
        raise OSError(None, str(error), str(path)) from error
    with open(handle, "rb") as stream:
        status = os.fstat(stream.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise OSError(None, f"is {'a directory' if stat.S_ISDIR(status.st_mode) else 'no regular file'}", str(path))
        data = stream.read(largest + 1)
    if len(data) > largest:
        raise OSError(None, f"has more than {largest} bytes; allowed: at most these", str(path))
    return data


def parse_json(text: str) -> Any:
    """Return what a JSON text holds.

    Raises
    ------
    ValueError
        It is no JSON, or nested too deeply.
    """
    try:
        data = json.loads(text)
    except RecursionError as error:
        raise ValueError("nested too deeply") from error
    level: list[Any] = [data]
    for _ in range(DEEPEST):
        level = [
            inner
            for outer in level
            if isinstance(outer, dict | list)
            for inner in (outer.values() if isinstance(outer, dict) else outer)
        ]
        if not level:
            return data
    raise ValueError("nested too deeply")


def read_json(path: Path, largest: int = LARGEST_TEXT) -> Any:
    """Return what a JSON file holds.

    Raises
    ------
    OSError, ValueError
        As `read_bytes` and `parse_json`; UnicodeDecodeError is a ValueError.
    """
    return parse_json(read_bytes(path, largest).decode("utf-8"))
