"""Files that a user names to be written: judged before anything is computed, replaced whole, and nothing else is."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from workbench.errors import OutputError


def refuse_target(target: Path) -> None:
    """Refuse what a file cannot take the place of without a loss: a device, a pipe, a link, what its owner protects.

    Raises
    ------
    OutputError
        Naming the file and what it is.
    """
    try:
        status = os.lstat(target)
    except FileNotFoundError:
        if not target.parent.is_dir():
            raise OutputError(f"{target}: there is no directory {target.parent}", path=str(target)) from None
        return
    except (OSError, ValueError) as error:
        raise OutputError(f"{str(target)!r}: {getattr(error, 'strerror', None) or error}", path=str(target)) from error
    if stat.S_ISLNK(status.st_mode):
        raise OutputError(f"{target}: is a symbolic link; name the file that it leads to", path=str(target))
    if not stat.S_ISREG(status.st_mode):
        what = "a directory" if stat.S_ISDIR(status.st_mode) else "no regular file"
        raise OutputError(f"{target}: is {what}; name a file", path=str(target))
    if not status.st_mode & stat.S_IWUSR or not os.access(target, os.W_OK):
        raise OutputError(f"{target}: is read-only; make it writable or name another file", path=str(target))
    if status.st_nlink > 1:
        raise OutputError(
            f"{target}: has {status.st_nlink} names (hard links), of which one would change; name another file",
            path=str(target),
        )
