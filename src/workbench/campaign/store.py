"""The run directory on disk: what each file holds is documented in docs/run-directory.md.

It is written beside its place and moved there when it is whole (`workbench.staging`).
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from workbench.arrays import FloatArray
from workbench.campaign.compare import Row
from workbench.campaign.good import good_enough
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
    # by way of memory: Arrow opens no file whose name is not UTF-8
    content = pd.DataFrame(dict(columns)).to_parquet(index=False, write_page_checksum=True)
    (folder / f"{case}.parquet").write_bytes(content)


def write_summary(stage: Path, rows: list[Row], changed: Collection[str] = (), good: float | None = None) -> None:
    """Write ``summary.csv``; floats in their shortest form that reads back bit-equal.

    *changed* names the cases whose robot is not the one that the campaign's claims and sources are about; *good*
    is the accuracy that is wanted of formulas without a bound.
    """
    frame = pd.DataFrame([dataclasses.asdict(row) for row in rows], columns=[f.name for f in dataclasses.fields(Row)])
    frame["robot"] = ["changed" if row.case in changed else "published" for row in rows]
    frame["good_enough"] = [good_enough(row, good) for row in rows]
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
    if isinstance(value, str):  # names of files may hold what is no text
        return value.encode("utf-8", "backslashreplace").decode()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
