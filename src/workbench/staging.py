"""Directories that are written whole or not at all: beside their place first, then moved into it."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from workbench.errors import OutputError
from workbench.reading import read_json

IGNORED = (".DS_Store", "Thumbs.db", "desktop.ini")
"""files that file managers leave everywhere"""


STAGE, OLD, EARLIER = "stage", "old", "earlier"
RANDOM = re.compile(r"[a-z0-9_]{8}")
"""how `tempfile` ends a name"""


@dataclass(frozen=True)
class DirectoryKind:
    """How to recognise a directory that an earlier command wrote, and that may therefore be replaced."""

    what: str
    """``run``, ``workspace``: for messages"""
    marker: str
    """JSON file that every such directory holds"""
    keys: frozenset[str]
    """keys that the marker has"""
    members: tuple[str, ...]
    """all that such a directory holds; anything else would be lost"""


def check_output(directory: Path, kind: DirectoryKind) -> None:
    """Refuse a place where a directory of this kind cannot be written, before anything is computed.

    Raises
    ------
    OutputError
        Not a directory, not writable, or a directory that holds something else: it would be lost.
    """
    try:
        place = directory.resolve()
        if place.exists():
            _check_existing(directory, place, kind)
        parent = place.parent
        while not parent.exists():
            parent = parent.parent
    except (OSError, RuntimeError, ValueError) as error:  # RuntimeError: links in a circle
        raise _refused(directory, error) from error
    if not parent.is_dir():
        raise OutputError(f"{directory}: {parent} is not a directory", path=str(directory))
    if not os.access(parent, os.W_OK | os.X_OK):
        raise OutputError(f"{directory}: {parent} cannot be written", path=str(directory))


def _check_existing(directory: Path, place: Path, kind: DirectoryKind) -> None:
    if not place.is_dir():
        raise OutputError(f"{directory}: exists and is not a directory", path=str(directory))
    if Path.cwd().is_relative_to(place):
        raise OutputError(
            f"{directory}: holds the current directory, which the {kind.what} would replace; name another",
            path=str(directory),
        )
    found = sorted(entry.name for entry in place.iterdir())
    if found and not _is_ours(place / kind.marker, kind):
        raise OutputError(
            f"{directory}: holds files that are no {kind.what} of the workbench, such as {found[0]}; name an empty or"
            " new one",
            path=str(directory),
        )
    strangers = [name for name in found if name not in (*kind.members, *IGNORED)]
    if strangers:
        raise OutputError(
            f"{directory}: {strangers[0]} is no part of a {kind.what} and would be lost; move it or name another"
            " directory",
            path=str(directory),
        )
    if not os.access(place, os.W_OK | os.X_OK):
        raise OutputError(f"{directory}: cannot be written", path=str(directory))


def _is_ours(marker: Path, kind: DirectoryKind) -> bool:
    """Tell our marker from other files of that common name."""
    try:
        content = read_json(marker)
    except (OSError, ValueError):
        return False
    return isinstance(content, dict) and kind.keys <= content.keys()


def _refused(directory: Path, error: Exception) -> OutputError:
    reason = error.strerror if isinstance(error, OSError) else None
    return OutputError(f"{directory}: cannot be written: {reason or error}", path=str(directory))


@contextmanager
def staged(directory: Path, alone: bool = False) -> Iterator[Path]:
    """Give a directory to write into; move it to its place when the block ends well, remove it when it does not.

    Parameters
    ----------
    directory
        Its place.
    alone
        Nobody else writes there, since the caller holds the place's lock: what a killed process left is tidied up.

    Raises
    ------
    OutputError
        The system refuses a write, with its own reason.
    """
    made: list[Path] = []
    if alone:
        recover(directory)
    try:
        place = directory.resolve()
        made = _make_parents(place)
        stage = Path(tempfile.mkdtemp(prefix=_beside(place, STAGE), dir=place.parent))
    except (OSError, RuntimeError, ValueError) as error:
        _remove_empty(made)
        raise _refused(directory, error) from error
    try:
        stage.chmod(0o755)
        yield stage
        _replace(stage, place)
    except OSError as error:
        raise _refused(directory, error) from error
    finally:
        shutil.rmtree(stage, ignore_errors=True)
        _remove_empty(made)


def _beside(place: Path, kind: str) -> str:
    return f".{place.name[:100]}.{kind}."


def recover(directory: Path) -> None:
    """Tidy up beside a place after a process that was killed while it wrote there: the earlier directory goes back.

    Only for who holds the place's lock (`workbench.campaign.lock`): what others write there would go.

    Raises
    ------
    OutputError
        The system refuses it.
    """
    try:
        place = directory.resolve()
        for old in _left(place, OLD):
            if (old / EARLIER).is_dir() and not place.exists():
                (old / EARLIER).rename(place)
        for left in (*_left(place, OLD), *_left(place, STAGE)):
            shutil.rmtree(left, ignore_errors=True)
    except (OSError, RuntimeError, ValueError) as error:
        raise _refused(directory, error) from error


def _left(place: Path, kind: str) -> list[Path]:
    if not place.parent.is_dir():
        return []
    begin = _beside(place, kind)
    found = [path for path in place.parent.iterdir() if path.name.startswith(begin)]
    return sorted(path for path in found if RANDOM.fullmatch(path.name[len(begin) :]) and path.is_dir())


def _make_parents(place: Path) -> list[Path]:
    """Make what is missing above *place*; return it, innermost first."""
    missing = [parent for parent in place.parents if not parent.exists()]
    place.parent.mkdir(parents=True, exist_ok=True)
    return missing


def _remove_empty(made: list[Path]) -> None:
    for parent in made:
        with suppress(OSError):  # it holds a finished run
            parent.rmdir()


def _replace(stage: Path, directory: Path) -> None:
    if not directory.exists():
        stage.rename(directory)
        return
    old = Path(tempfile.mkdtemp(prefix=_beside(directory, OLD), dir=directory.parent))
    aside = old / EARLIER
    try:
        directory.rename(aside)
        stage.rename(directory)
    finally:
        # also after Ctrl-C between the two: the old run goes back
        if aside.exists() and not directory.exists():
            aside.rename(directory)
        shutil.rmtree(old, ignore_errors=True)
