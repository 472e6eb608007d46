"""What of an earlier sweep's cases holds when a run begins."""

from __future__ import annotations

import contextlib
import hashlib
import os
from collections.abc import Callable
from pathlib import Path

from workbench.campaign import store
from workbench.sweep import files
from workbench.sweep import journal as journal_file
from workbench.sweep.identity import case_key
from workbench.sweep.journal import Journal
from workbench.sweep.plan import Plan
from workbench.sweep.record import GOOD
from workbench.sweep.resumable import Resumable

SWEEP = Resumable(
    what="sweep",
    parts="cases",
    finished=(
        files.STATE, files.SWEEP, files.CASES, files.SUMMARY, store.MANIFEST, store.SERIES, *store.REPORTS,
    ),
    results=files.CASES,
    tables=(files.CASES, files.SUMMARY),
)  # fmt: skip


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


def keep_series(directory: Path, plan: Plan, index: int, series: bytes | None) -> None:
    """Write a case's time series, where it has any.

    Raises
    ------
    OSError
        The system refuses the write.
    """
    if series is not None:
        path = series_path(directory, plan, index)
        path.parent.mkdir(exist_ok=True)
        files.write_bytes(path, series)


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
