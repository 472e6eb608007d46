"""The files of a sweep's run directory; docs/sweeps.md says what each holds.

``cases/`` and ``summary/`` are Parquet data sets, written at the end in case order from the journal, part by part, so
that their bytes depend neither on the number of workers nor on the order in which cases finished.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from workbench import reading
from workbench.campaign import store
from workbench.campaign.compare import Row
from workbench.parquet_columns import table_of
from workbench.sweep.journal import Journal
from workbench.sweep.plan import Plan
from workbench.sweep.record import Record

STATE = "state.json"
SWEEP = "sweep.json"
PROGRESS = "progress.json"
CASES = "cases"
SUMMARY = "summary"
PART_CASES = 2000
"""Cases of one part: what is held in memory while parts are written and read."""

LARGEST_PART = 2_000_000_000
"""Bytes of one part that are read."""

TEXTS = ("candidate", "reference", "joint", "verdict", "kind", "unit")
SUMMARY_SCHEMA = pa.schema(
    [("index", pa.int64()), ("case", pa.string())]
    + [
        (f.name, pa.string() if f.name in TEXTS else pa.int64() if f.name == "pointwise_skipped" else pa.float64())
        for f in dataclasses.fields(Row)
        if f.name != "case"
    ]
)
CASE_COLUMNS = (("index", pa.int64()), *((name, pa.string()) for name in ("case", "status", "reason", "key", "series")))


def part(folder: Path, number: int) -> Path:
    """Where a part of a data set lies."""
    return folder / f"part-{number:05d}.parquet"


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON file whole or not at all; numbers that are not finite become null."""
    text = json.dumps(store._plain(content), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file whole or not at all; what a user names is judged before, by `output_file.refuse_target`."""
    temporary = path.with_name(f".{path.name}.part")
    try:
        temporary.write_bytes(content)
        os.replace(temporary, path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error  # not the name in between
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def read_json(path: Path) -> dict[str, Any] | None:
    """Return a JSON file's content; None where it is missing or torn."""
    try:
        content = reading.read_json(path)
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None


def write_parts(directory: Path, plan: Plan, journal: Journal) -> None:
    """Write ``cases/`` and ``summary/`` from a journal that holds every case; earlier ones are replaced.

    Raises
    ------
    OSError
        The system refuses a write; the journal still holds everything.
    """
    fresh = {name: directory / f".{name}.new" for name in (CASES, SUMMARY)}
    try:
        for folder in fresh.values():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
        facts = _fact_names(plan, journal)
        for number, first in enumerate(range(0, plan.count, PART_CASES)):
            records = [journal.read(i) for i in range(first, min(first + PART_CASES, plan.count))]
            part(fresh[CASES], number).write_bytes(table_bytes(_case_table(plan, records, facts)))
            part(fresh[SUMMARY], number).write_bytes(table_bytes(_summary_table(plan, records)))
        for name, folder in fresh.items():
            shutil.rmtree(directory / name, ignore_errors=True)
            folder.rename(directory / name)
    finally:
        for folder in fresh.values():
            shutil.rmtree(folder, ignore_errors=True)


def table_bytes(table: pa.Table) -> bytes:
    """Return a Parquet file whose pages carry checksums."""
    sink = pa.BufferOutputStream()  # Arrow opens no file whose name is not UTF-8
    pq.write_table(table, sink, compression="zstd", write_page_checksum=True)
    content: bytes = sink.getvalue().to_pybytes()
    return content


def _fact_names(plan: Plan, journal: Journal) -> list[str]:
    """The figures that cases have: those of the first case that has any, since all come from one model."""
    for index in range(plan.count):
        found = journal.read(index).facts
        if found:
            return list(found)
    return []


def _case_table(plan: Plan, records: Sequence[Record], facts: Sequence[str]) -> pa.Table:
    columns: dict[str, Any] = {
        "index": [r.index for r in records],
        "case": [plan.recipe.case_name(r.index) for r in records],
        "status": [r.status for r in records],
        "reason": [r.reason for r in records],
        "key": [r.key for r in records],
        "series": [r.series for r in records],
    }
    values = plan.values[records[0].index : records[0].index + len(records)]
    columns |= {key: values[:, i] for i, key in enumerate(plan.keys)}
    columns |= {name: [r.facts.get(name) for r in records] for name in facts}
    numbers = [(name, pa.float64()) for name in (*plan.keys, *facts)]
    return table_of(columns, pa.schema([*CASE_COLUMNS, *numbers]))


def _summary_table(plan: Plan, records: Sequence[Record]) -> pa.Table:
    rows = [(r.index, row) for r in records for row in r.rows]
    columns: dict[str, Any] = {name: [row.get(name) for _, row in rows] for name in SUMMARY_SCHEMA.names}
    columns |= {"index": [index for index, _ in rows], "case": [plan.recipe.case_name(index) for index, _ in rows]}
    return table_of(columns, SUMMARY_SCHEMA)


def _read_table(path: Path) -> list[dict[str, Any]]:
    buffer = pa.BufferReader(reading.read_bytes(path, LARGEST_PART))
    rows: list[dict[str, Any]] = (
        pq.ParquetFile(buffer, page_checksum_verification=True).read(use_threads=False).to_pylist()
    )
    return rows


def read_records(directory: Path, keys: Sequence[str]) -> Iterator[Record]:
    """Read the records of a finished sweep back from its parts; parts that are torn or missing are left out."""
    for path in sorted((directory / CASES).glob("part-*.parquet")):
        try:
            cases = _read_table(path)
            rows = _read_table(directory / SUMMARY / path.name)
        except (OSError, pa.ArrowException):
            continue
        known = {name for name, _ in CASE_COLUMNS} | set(keys)
        by_case: dict[int, list[dict[str, Any]]] = {}
        for row in rows:
            del row["case"]
            by_case.setdefault(row.pop("index"), []).append(row)
        for case in cases:
            facts = {k: v for k, v in case.items() if k not in known and v is not None}
            yield Record(
                case["index"], case["key"], case["status"], case["reason"], by_case.get(case["index"], []), facts,
                case["series"],
            )  # fmt: skip
