"""The files of a study's run directory; docs/control.md says what each holds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa

from workbench.campaign import store
from workbench.control.names import CONTROL, ERROR_COLUMNS, ERRORS, LOOP_COLUMNS, RUNS
from workbench.control.plan import Loop
from workbench.parquet_columns import table_of
from workbench.sweep import files
from workbench.sweep.journal import NAME as JOURNAL
from workbench.sweep.journal import Journal
from workbench.sweep.record import Record
from workbench.sweep.resumable import Resumable

FACTS = ("ended", "agreed", "work", "spread")
"""Figures of a run as a whole."""

NUMBERS = frozenset({"speed", "rate", "bandwidth", *FACTS, *ERROR_COLUMNS[1:]})

STUDY = Resumable(
    what="study",
    parts="runs",
    finished=(files.STATE, CONTROL, RUNS, ERRORS, JOURNAL, store.MANIFEST, store.PICTURES, *store.REPORTS),
    results=RUNS,
)


def write_tables(directory: Path, loops: Sequence[Loop], records: Sequence[Record]) -> None:
    """Write ``runs.parquet`` and ``errors.parquet``, in the study's order; the same runs give the same bytes.

    Raises
    ------
    OSError
        The system refuses a write.
    """
    runs, errors = [], []
    for loop, record in zip(loops, records, strict=True):
        place = {"index": record.index, **{name: getattr(loop, name) for name in LOOP_COLUMNS}}
        facts = {name: record.facts.get(name) for name in FACTS}
        runs.append({**place, "status": record.status, "reason": record.reason, "key": record.key, **facts})
        errors += [{**place, **{name: row[name] for name in ERROR_COLUMNS}} for row in record.rows]
    for name, rows, columns in (
        (RUNS, runs, ("index", *LOOP_COLUMNS, "status", "reason", "key", *FACTS)),
        (ERRORS, errors, ("index", *LOOP_COLUMNS, *ERROR_COLUMNS)),
    ):
        schema = pa.schema([(column, _type_of(column)) for column in columns])
        table = table_of({column: [row[column] for row in rows] for column in columns}, schema)
        files.write_bytes(directory / name, files.table_bytes(table))


def _type_of(column: str) -> pa.DataType:
    if column == "index":
        return pa.int64()
    return pa.float64() if column in NUMBERS else pa.string()


def write_journal(directory: Path, records: Sequence[Record]) -> None:
    """Write the journal again in the study's order: what is finished can be gone on with, and is the same bytes."""
    files.write_bytes(directory / JOURNAL, b"".join(record.line() for record in records))


def read_all(journal: Journal, count: int) -> list[Record]:
    """All records, in order."""
    return [journal.read(index) for index in range(count)]
