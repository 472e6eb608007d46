"""What a sweep's run directory holds when a run begins: nothing, a run to go on with, or one that may not be mixed."""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from workbench.campaign import store
from workbench.errors import OutputError
from workbench.sweep import files
from workbench.sweep import journal as journal_file
from workbench.sweep.identity import FORMAT, case_key, versions
from workbench.sweep.journal import Journal
from workbench.sweep.plan import Plan
from workbench.sweep.record import GOOD


def clear(directory: Path) -> None:
    """Remove an earlier run; what is no part of one was refused before."""
    for name in files.RUN.members:
        path = directory / name
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def holds_cases(directory: Path) -> bool:
    """Tell whether finished cases stand in a directory, be they few."""
    journal = directory / journal_file.NAME
    return (directory / files.CASES).exists() or (journal.exists() and journal.stat().st_size > 0)


def repair(directory: Path) -> None:
    """Make a directory whose state is torn or missing, but that holds a sweep, one that can be gone on with.

    Which results hold is decided case by case, by their keys; the versions are part of them.

    Raises
    ------
    OSError
        It cannot be written.
    """
    if not directory.is_dir() or files.read_json(directory / files.STATE) is not None:
        return
    names = {path.name for path in directory.iterdir()}
    if not names or not names <= set(files.RUN.members):
        return
    if names & {files.STATE, files.CASES, journal_file.NAME} or names <= set(files.LEFT_BEHIND):
        begin(directory, {"campaign": ""})


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


def begin(directory: Path, content: Mapping[str, Any]) -> None:
    """Make the directory and note what runs in it."""
    directory.mkdir(parents=True, exist_ok=True)
    for name in files.LEFT_BEHIND:
        path = directory / name
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)
    files.write_json(directory / files.STATE, {"format": FORMAT, "versions": versions(), **content})


def open_journal(directory: Path, plan: Plan, common: str, retry_failed: bool) -> Journal:
    """Open the journal with those finished cases that still hold; of a finished run, from its data sets.

    A case holds when its key is the same and its time series, where it kept any, is whole.

    Raises
    ------
    OSError
        It cannot be read or written.
    """
    path = directory / journal_file.NAME
    if not path.exists() and (directory / files.CASES).is_dir():
        temporary = directory / f".{journal_file.NAME}.part"
        temporary.unlink(missing_ok=True)
        try:
            with Journal(temporary, plan.count) as rebuilt:
                for record in files.read_records(directory, plan.keys):
                    if 0 <= record.index < plan.count:
                        rebuilt.append(record)
            os.replace(temporary, path)
        finally:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
    journal = Journal(path, plan.count)
    try:
        _forget_what_does_not_hold(journal, directory, plan, common, retry_failed)
    except BaseException:
        journal.close()
        raise
    return journal


def _forget_what_does_not_hold(journal: Journal, directory: Path, plan: Plan, common: str, retry_failed: bool) -> None:
    for index in range(plan.count):
        if index not in journal:
            continue
        record = journal.read(index)
        holds = record.key == case_key(common, plan.case_dict(index))
        if holds and record.series:
            holds = _hash(series_path(directory, plan, index)) == record.series
        if not holds or (retry_failed and record.status not in GOOD):
            journal.forget(index)


def series_path(directory: Path, plan: Plan, index: int) -> Path:
    """Where a case's time series lie."""
    return directory / store.SERIES / f"{plan.recipe.case_name(index)}.parquet"


def _hash(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""


def remove_stray_series(directory: Path, plan: Plan, kept: Callable[[int], bool]) -> None:
    """Remove time series that no finished case speaks of: left by a kill between series and journal."""
    folder = directory / store.SERIES
    if not folder.is_dir():
        return
    for path in folder.iterdir():
        index = path.stem.rpartition("-")[2]
        named = index.isdigit() and int(index) < plan.count and path == series_path(directory, plan, int(index))
        if not named or not kept(int(index)):
            path.unlink()
    with contextlib.suppress(OSError):
        folder.rmdir()
