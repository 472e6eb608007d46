"""Runs that can be gone on with: what their directory may hold when one begins, and what is kept until it ends."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.campaign import store
from workbench.campaign.lock import locked
from workbench.campaign.replacing import Request, asked_for
from workbench.errors import OutputError, WorkbenchError
from workbench.staging import IGNORED, DirectoryKind, check_output
from workbench.sweep import files
from workbench.sweep import journal as journal_file
from workbench.sweep.identity import FORMAT, versions


@dataclass(frozen=True)
class SweepOptions:
    """How a sweep or a study is computed; none of it changes a number."""

    jobs: int | None = None
    """local workers; None is one per core that this process may use"""
    scheduler: str | None = None
    """address of a Dask scheduler in place of local workers"""
    fresh: bool = False
    """start over, dropping what is finished"""
    retry_failed: bool = False
    """compute again what failed, was killed or ran out of time"""
    replace: bool = False
    """put the run in the place of an earlier one of another robot, of other cases or candidates"""


@dataclass(frozen=True)
class Resumable:
    """A kind of run that is computed part by part: sweeps of cases, studies of runs."""

    what: str
    """``sweep``, ``study``: for messages"""
    parts: str
    """``cases``, ``runs``: for messages"""
    finished: tuple[str, ...]
    """what its directory may hold at the end"""
    results: str
    """the name in it that stands for finished parts beside the journal's"""
    tables: tuple[str, ...] = ()
    """data sets that are written beside their place first"""

    @property
    def left_behind(self) -> tuple[str, ...]:
        """What a killed run may leave."""
        single = [name for name in (*self.finished, files.PROGRESS, journal_file.NAME) if name not in self.tables]
        return (
            *(f".{name}.part" for name in dict.fromkeys(single) if name not in (store.SERIES, *store.REPORTS)),
            *(f".{name}.new" for name in self.tables),
        )

    @property
    def directory(self) -> DirectoryKind:
        """How its directory is recognised."""
        members = (*self.finished, files.PROGRESS, journal_file.NAME, *self.left_behind)
        return DirectoryKind("run", files.STATE, frozenset({"format", "campaign", "versions"}), members)

    def holds_any(self, directory: Path) -> bool:
        """Tell whether finished parts stand in a directory, be they few."""
        journal = directory / journal_file.NAME
        return (directory / self.results).exists() or (journal.exists() and journal.stat().st_size > 0)


@dataclass(frozen=True)
class Asked:
    """What a run is of: an earlier one of the same is gone on with."""

    campaign: str
    request: Request
    """`replacing.request_of`"""


class Held:
    """A run directory that this process alone writes, with the finished earlier run that waits aside."""

    def __init__(self, kind: Resumable, directory: Path, total: int) -> None:
        place = directory.resolve()
        self.kind, self.path, self.total, self.done = kind, directory, total, 0
        self.aside = place.parent / f".{place.name[:100]}.before"

    def refused(self, error: OSError) -> OutputError:
        """What is said when the system refuses a write."""
        kept = f"; {self.done} of {self.total} {self.kind.parts} were finished before and are kept"
        said = f"{self.path}: cannot be written: {error.strerror or error}{kept if self.done else ''}"
        return OutputError(said, path=str(self.path))

    def complete(self, working: Sequence[str]) -> None:
        """Remove what is needed only while a run is computed, and the earlier run."""
        for name in working:
            (self.path / name).unlink(missing_ok=True)
        shutil.rmtree(self.aside, ignore_errors=True)


@contextmanager
def resumed(
    kind: Resumable, directory: Path, total: int, asked: Asked, options: SweepOptions, lost: Sequence[str] = ()
) -> Iterator[Held]:
    """Hold a run directory: lock it, put aside or clear what may be replaced, note what runs; put back where it fails.

    Parameters
    ----------
    kind, directory, total
        What is computed where, and of how many parts.
    asked
        What the run is of.
    options
        What is done with an earlier run.
    lost
        `evidence_lost`: what of an earlier run this one would not gather, in words.

    Raises
    ------
    OutputError
        Something else stands there, results of other versions, an earlier run that nobody said may be replaced; or the
        system refuses a write: finished parts are kept.
    """
    with locked(directory):
        held = Held(kind, directory, total)
        try:
            _put_aside(held, asked, options, lost)
        except OSError as error:
            raise held.refused(error) from error
        new = not directory.exists()
        try:
            if options.fresh:
                clear(directory, kind)
            else:
                refuse_other_versions(directory)
            begin(directory, kind, asked)
            yield held
        except OSError as error:
            raise held.refused(error) from error
        except WorkbenchError:
            if new and not kind.holds_any(directory):
                shutil.rmtree(directory, ignore_errors=True)
                if held.aside.exists():
                    held.aside.rename(directory)
            raise


def _put_aside(held: Held, asked: Asked, options: SweepOptions, lost: Sequence[str]) -> None:
    """Move a finished earlier run aside where the new one may take its place.

    Raises
    ------
    OutputError
        It is of another robot or other candidates, and nobody said that it may be replaced.
    """
    directory, kind = held.path, held.kind
    if os.access(directory, os.W_OK):
        repair(directory, kind)
    _refuse_another_kind(directory, kind)
    check_output(directory, kind.directory)
    old = files.read_json(directory / files.STATE) or {}
    before = old.get("request")
    other = kind.holds_any(directory) and (
        old.get("campaign") not in (asked.campaign, "") or (before is not None and before != asked.request)
    )
    allowed = options.replace or options.fresh
    way_on = "--replace puts this one in its place, --out names another directory"
    if other and not allowed:
        raise OutputError(
            f"{directory}: holds {kind.parts} of another {kind.what} ({asked_for(old)}; here"
            f" {asked_for({'request': asked.request})}); {way_on}",
            path=str(directory),
        )
    if lost and not allowed:
        raise OutputError(f"{directory}: holds an earlier {kind.what} {'; '.join(lost)}; {way_on}", path=str(directory))
    may_go = other or bool(lost) or options.fresh
    if may_go and (directory / store.MANIFEST).is_file() and not held.aside.exists():
        directory.resolve().rename(held.aside)


def _refuse_another_kind(directory: Path, kind: Resumable) -> None:
    manifest = files.read_json(directory / store.MANIFEST) or {}
    if "campaign" in manifest and not {path.name for path in directory.iterdir()} <= {
        *kind.directory.members,
        *IGNORED,
    }:
        raise OutputError(
            f'{directory}: holds a run of another kind (campaign "{manifest["campaign"]}"); a {kind.what} does not take'
            " its place: --out names another directory",
            path=str(directory),
        )


def clear(directory: Path, kind: Resumable) -> None:
    """Remove an earlier run; what is no part of one was refused before."""
    for name in kind.directory.members:
        _remove(directory / name)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def repair(directory: Path, kind: Resumable) -> None:
    """Make a directory whose state is torn or missing, but that holds such a run, one that can be gone on with.

    Which results hold is decided part by part, by their keys; the versions are part of them.

    Raises
    ------
    OSError
        It cannot be written.
    """
    if not directory.is_dir() or files.read_json(directory / files.STATE) is not None:
        return
    names = {path.name for path in directory.iterdir()}
    if not names or not names <= set(kind.directory.members):
        return
    if names & {files.STATE, kind.results, journal_file.NAME} or names <= set(kind.left_behind):
        begin(directory, kind, Asked("", {}))


def refuse_other_versions(directory: Path) -> None:
    """Refuse to go on with results of other versions.

    Raises
    ------
    OutputError
        One line that names a version that differs.
    """
    state = files.read_json(directory / files.STATE)
    if state is None:
        return
    before, now = state.get("versions"), versions()
    if before == now:
        return
    before = before if isinstance(before, Mapping) else {}
    name = next((n for n in now if before.get(n) != now[n]), "versions")
    raise OutputError(
        f"{directory}: holds results of {name} {before.get(name, 'unknown')}, this is {name} {now[name]}; results of"
        " different versions are never mixed: --fresh starts over, --out names another directory",
        path=str(directory),
        key=name,
    )


def begin(directory: Path, kind: Resumable, asked: Asked) -> None:
    """Make the directory and note what runs in it."""
    directory.mkdir(parents=True, exist_ok=True)
    for name in kind.left_behind:
        _remove(directory / name)
    content: dict[str, Any] = {"campaign": asked.campaign}
    if asked.request:
        content["request"] = dict(asked.request)
    files.write_json(directory / files.STATE, {"format": FORMAT, "versions": versions(), **content})
