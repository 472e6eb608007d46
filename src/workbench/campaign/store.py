"""The run directory on disk: what each file holds is documented in docs/run-directory.md.

It is written beside its place and moved there when it is whole (`workbench.staging`).
"""

from __future__ import annotations

import csv
import dataclasses
import io
import json
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.compare import Row
from workbench.campaign.good import good_enough
from workbench.parquet_columns import column_bytes
from workbench.staging import DirectoryKind

FORMAT = 1
MANIFEST = "manifest.json"
SUMMARY = "summary.csv"
SERIES = "series"
PICTURES = "pictures"
REPORTS = ("report.html", "report.md", "report.pdf", "drawn.json", "figures", "tables", "data")
RUN = DirectoryKind(
    what="run",
    marker=MANIFEST,
    keys=frozenset({"format", "campaign", "cases"}),
    members=(MANIFEST, SUMMARY, SERIES, PICTURES, *REPORTS),
)


def write_series(stage: Path, case: str, columns: Mapping[str, FloatArray]) -> None:
    """Write one case's time series as Parquet; the same numbers give the same bytes."""
    folder = stage / SERIES
    folder.mkdir(exist_ok=True)
    (folder / f"{case}.parquet").write_bytes(column_bytes(columns))


def write_summary(stage: Path, rows: Sequence[Row], changed: Collection[str] = (), good: float | None = None) -> None:
    """Write ``summary.csv``, the text of `summary_text`."""
    with (stage / SUMMARY).open("w", encoding="utf-8", newline="") as file:
        file.write(summary_text(rows, changed, good))


def summary_text(rows: Sequence[Row], changed: Collection[str] = (), good: float | None = None) -> str:
    """Return what ``summary.csv`` holds; floats in their shortest form that reads back bit-equal.

    *changed* names the cases whose robot is not the one that the campaign's claims and sources are about; *good*
    is the accuracy that is wanted of formulas without a bound.
    """
    names = [field.name for field in dataclasses.fields(Row)]
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow([*names, "robot", "good_enough"])
    for row in rows:
        robot = "changed" if row.case in changed else "published"
        cells = [*(getattr(row, name) for name in names), robot, good_enough(row, good)]
        table.writerow([_cell(cell) for cell in cells])
    return text.getvalue()


def _cell(value: Any) -> Any:
    if isinstance(value, float):
        return "" if np.isnan(value) else repr(float(value))
    return "" if value is None else value


def write_manifest(stage: Path, manifest: Mapping[str, Any]) -> None:
    """Write ``manifest.json``, the text of `manifest_text`."""
    (stage / MANIFEST).write_text(manifest_text(manifest), encoding="utf-8")


def manifest_text(manifest: Mapping[str, Any]) -> str:
    """Return what ``manifest.json`` holds; numbers that are not finite become null: JSON has no word for them."""
    return json.dumps(_plain(manifest), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, str):  # names of files may hold what is no text
        return value.encode("utf-8", "backslashreplace").decode()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
