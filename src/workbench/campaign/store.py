"""The run directory on disk: what each file holds is documented in docs/run-directory.md.

A run is written to a directory beside its place and moved there when it is whole, so that nothing half-written ever
stands under its final name.
"""

from __future__ import annotations

import dataclasses
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from workbench.arrays import FloatArray
from workbench.campaign.compare import Row
from workbench.errors import OutputError

FORMAT = 1
MANIFEST = "manifest.json"
SUMMARY = "summary.csv"
SERIES = "series"
REPORTS = ("report.html", "report.md", "figures")
IGNORED = (".DS_Store", "Thumbs.db", "desktop.ini")
"""files that file managers leave everywhere"""


def check_output(directory: Path) -> None:
    """Refuse a place where a run cannot be written, before anything is computed.

    Raises
    ------
    OutputError
        Not a directory, not writable, or a directory that holds something else than a run: it would be lost.
    """
    try:
        place = directory.resolve()
        if place.exists():
            _check_existing(directory, place)
        parent = place.parent
        while not parent.exists():
            parent = parent.parent
    except (OSError, RuntimeError, ValueError) as error:  # RuntimeError: links in a circle
        raise _refused(directory, error) from error
    if not parent.is_dir():
        raise OutputError(f"{directory}: {parent} is not a directory", path=str(directory))
    if not os.access(parent, os.W_OK | os.X_OK):
        raise OutputError(f"{directory}: {parent} cannot be written", path=str(directory))


def _check_existing(directory: Path, place: Path) -> None:
    if not place.is_dir():
        raise OutputError(f"{directory}: exists and is not a directory", path=str(directory))
    if Path.cwd().is_relative_to(place):
        raise OutputError(
            f"{directory}: holds the current directory, which a run would replace; name another", path=str(directory)
        )
    found = sorted(entry.name for entry in place.iterdir())
    if found and not _is_run(place / MANIFEST):
        raise OutputError(
            f"{directory}: holds files that are no run of the workbench, such as {found[0]}; name an empty or new one",
            path=str(directory),
        )
    strangers = [name for name in found if name not in (MANIFEST, SUMMARY, SERIES, *REPORTS, *IGNORED)]
    if strangers:
        raise OutputError(
            f"{directory}: {strangers[0]} is no part of a run and would be lost; move it or name another directory",
            path=str(directory),
        )
    if not os.access(place, os.W_OK | os.X_OK):
        raise OutputError(f"{directory}: cannot be written", path=str(directory))


def _is_run(manifest: Path) -> bool:
    """Tell a run's manifest from other files of that common name."""
    try:
        content = json.loads(manifest.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(content, dict) and {"format", "campaign", "cases"} <= content.keys()


def _refused(directory: Path, error: Exception) -> OutputError:
    reason = error.strerror if isinstance(error, OSError) else None
    return OutputError(f"{directory}: cannot be written: {reason or error}", path=str(directory))


@contextmanager
def staged(directory: Path) -> Iterator[Path]:
    """Give a directory to write into; move it to its place when the block ends well, remove it when it does not.

    Raises
    ------
    OutputError
        The system refuses a write, with its own reason.
    """
    made: list[Path] = []
    try:
        place = directory.resolve()
        made = _make_parents(place)
        stage = Path(tempfile.mkdtemp(prefix=f".{place.name[:100]}.", dir=place.parent))
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
    old = Path(tempfile.mkdtemp(prefix=f".{directory.name[:100]}.old.", dir=directory.parent))
    aside = old / "run"
    try:
        directory.rename(aside)
        stage.rename(directory)
    finally:
        # also after Ctrl-C between the two: the old run goes back
        if aside.exists() and not directory.exists():
            aside.rename(directory)
        shutil.rmtree(old, ignore_errors=True)


def write_series(stage: Path, case: str, columns: Mapping[str, FloatArray]) -> None:
    """Write one case's time series as Parquet; the same numbers give the same bytes."""
    folder = stage / SERIES
    folder.mkdir(exist_ok=True)
    pd.DataFrame(dict(columns)).to_parquet(folder / f"{case}.parquet", index=False)


def write_summary(stage: Path, rows: list[Row]) -> None:
    """Write ``summary.csv``; floats in their shortest form that reads back bit-equal."""
    frame = pd.DataFrame([dataclasses.asdict(row) for row in rows], columns=[f.name for f in dataclasses.fields(Row)])
    frame.to_csv(stage / SUMMARY, index=False, lineterminator="\n")


def write_manifest(stage: Path, manifest: Mapping[str, Any]) -> None:
    """Write ``manifest.json``; numbers that are not finite become null, since JSON has no word for them."""
    text = json.dumps(_plain(manifest), indent=1, ensure_ascii=False, allow_nan=False)
    (stage / MANIFEST).write_text(text + "\n", encoding="utf-8")


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
