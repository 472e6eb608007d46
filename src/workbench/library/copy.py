"""A robot of the library, copied to a place of the user's own."""

from __future__ import annotations

import shutil
from pathlib import Path

from workbench.errors import OutputError
from workbench.library.shelf import Entry

SKIPPED = shutil.ignore_patterns("__pycache__", "*.pyc")


def copy_folder(entry: Entry, place: Path) -> None:
    """Copy a robot's folder; nothing that stands there is replaced.

    Raises
    ------
    OutputError
        Something stands at *place* already, or the system refuses to write there.
    """
    if place.exists() or place.is_symlink():
        raise OutputError(f"{place}: exists already; name a directory that does not", path=str(place))
    try:
        shutil.copytree(entry.folder, place, ignore=SKIPPED, copy_function=shutil.copyfile)
    except OSError as error:
        raise OutputError(f"{place}: {error.strerror or error}", path=str(place)) from error
