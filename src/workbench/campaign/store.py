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
from contextlib import contextmanager
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


def check_output(directory: Path) -> None:
    """Refuse a place where a run cannot be written, before anything is computed.

    Raises
    ------
    OutputError
        Not a directory, not writable, or a directory that holds something else than a run.
    """
    if directory.exists():
        if not directory.is_dir():
            raise OutputError(f"{directory}: exists and is not a directory", path=str(directory))
        if any(directory.iterdir()) and not (directory / MANIFEST).is_file():
            raise OutputError(
                f"{directory}: holds files that are no run of the workbench (no {MANIFEST}); name an empty or new one",
                path=str(directory),
            )
    parent = _existing_parent(directory)
    if not parent.is_dir() or not os.access(parent, os.W_OK | os.X_OK):
        raise OutputError(f"{directory}: {parent} is not a directory that can be written", path=str(directory))
    if directory.exists() and not os.access(directory, os.W_OK | os.X_OK):
        raise OutputError(f"{directory}: cannot be written", path=str(directory))


def _existing_parent(directory: Path) -> Path:
    parent = directory.absolute().parent
    while not parent.exists():
        parent = parent.parent
    return parent


@contextmanager
def staged(directory: Path) -> Iterator[Path]:
    """Give a directory to write into; move it to its place when the block ends well, remove it when it does not.

    Raises
    ------
    OutputError
        The system refuses a write, with its own reason.
    """
    directory = directory.absolute()
    try:
        directory.parent.mkdir(parents=True, exist_ok=True)
        stage = Path(tempfile.mkdtemp(prefix=f".{directory.name}.", dir=directory.parent))
    except OSError as error:
        raise OutputError(f"{directory}: cannot be written: {error.strerror or error}", path=str(directory)) from error
    try:
        stage.chmod(0o755)
        yield stage
        _replace(stage, directory)
    except OSError as error:
        raise OutputError(f"{directory}: cannot be written: {error.strerror or error}", path=str(directory)) from error
    finally:
        shutil.rmtree(stage, ignore_errors=True)


def _replace(stage: Path, directory: Path) -> None:
    if not directory.exists():
        stage.rename(directory)
        return
    old = Path(tempfile.mkdtemp(prefix=f".{directory.name}.old.", dir=directory.parent))
    directory.rename(old / directory.name)
    try:
        stage.rename(directory)
    except OSError:
        (old / directory.name).rename(directory)
        raise
    finally:
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
