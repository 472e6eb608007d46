"""Read a run directory: manifest.json, summary.csv and, case by case, series/<case>.parquet."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow

from workbench.arrays import FloatArray
from workbench.errors import OutputError
from workbench.parquet_columns import read_columns
from workbench.records import read_record, read_text
from workbench.report.manifest import FORMAT_VERSION, Manifest
from workbench.report.tables import KINDS, VERDICT_STATUS

LARGEST_SERIES = 500_000_000
"""Bytes of one case's time series that are read."""

LARGEST_VALUE = 1e100
"""Magnitude of a number that a figure can show."""

UNFINISHED = "journal.jsonl"
"""Holds the cases of a sweep while it runs, or after it was stopped."""

Series = Mapping[str, FloatArray]
"""Column name -> values, shape ``(n,)``, SI."""


@dataclass(frozen=True)
class ErrorRow:
    """One row of summary.csv: one case, candidate, reference and joint. Errors are fractions."""

    case: str
    candidate: str
    reference: str
    joint: str
    peak_error: float
    rms_error: float
    pointwise_error: float
    worst_time_s: float
    bound: float | None
    verdict: str
    kind: str
    peak_reference: float
    unit: str
    pointwise_skipped: int
    normaliser: float
    """what turns the largest difference into `peak_error`: the reference's peak, unless the run says otherwise"""
    uncertainty: float = math.nan
    """of the reference itself, relative; NaN where nobody looked"""

    @property
    def badness(self) -> float:
        """Sort key: how large the error is, in bounds where there is a bound; NaN counts as worst."""
        value = self.peak_error / self.bound if self.bound else self.peak_error
        return math.inf if math.isnan(value) else value


@dataclass(frozen=True)
class Run:
    """A run directory, read and checked."""

    directory: Path
    manifest: Manifest
    rows: tuple[ErrorRow, ...]

    @cached_property
    def rows_of_case(self) -> dict[str, list[ErrorRow]]:
        """The rows by case, in file order; every case of the manifest is a key."""
        grouped: dict[str, list[ErrorRow]] = {name: [] for name in self.manifest.cases}
        for row in self.rows:
            grouped[row.case].append(row)
        return grouped

    def series(self, case: str) -> Series:
        """Read the time series of one case.

        Raises
        ------
        OutputError
            The file is missing, unreadable, lacks a column that every series has, or holds what no run writes.
        """
        folder = self.directory / "series"
        path = folder / f"{case}.parquet"
        if path.parent != folder or case in ("", ".", ".."):
            raise OutputError(f"{self.directory}: case {case!r} cannot be a file name; allowed: one path component")
        record = self.manifest.cases.get(case)
        try:
            table = read_columns(path, None, LARGEST_SERIES, rows=record.samples if record else None)
        except FileNotFoundError as error:
            raise OutputError(f"{path}: missing, though manifest.json lists case {case!r} as computed") from error
        columns = {name: _floats(table.column(name)) for name in table.column_names}
        self._check_columns(path, columns)
        return columns

    def _check_columns(self, path: Path, columns: Series) -> None:
        axes = [f"x{k + 1}" for k in range(len(self.manifest.platform_axes))]
        coordinates = [f"q{k + 1}" for k in range(len(self.manifest.joints))]
        needed = ["t", *coordinates, *axes, *(f"{d}{axis[1:]}" for d in ("xd", "xdd") for axis in axes)]
        for name in needed:
            if name not in columns:
                raise OutputError(f'{path}: column "{name}" is missing; needed: {", ".join(needed)}', column=name)
        if len(columns["t"]) == 0:
            raise OutputError(f"{path}: holds no samples; allowed: at least 1")
        for name, values in columns.items():
            # a formula that failed has gaps; where the robot is, and when, is always known
            right = (np.abs(values) <= LARGEST_VALUE) | (np.isnan(values) & (name not in needed))
            if not right.all():
                row = int(np.argmin(right))
                raise OutputError(
                    f"{path}: row {row + 1}: {name} is {values[row]:g}; allowed: -{LARGEST_VALUE:g} to"
                    f" {LARGEST_VALUE:g}",
                    column=name,
                )
        if not (np.diff(columns["t"]) > 0).all():
            row = int(np.argmin(np.diff(columns["t"]) > 0)) + 1
            raise OutputError(f"{path}: row {row + 1}: t does not grow; allowed: times in order", column="t")


def _floats(column: pyarrow.ChunkedArray) -> FloatArray:
    """Return a column as numbers; not by Arrow's own `to_numpy`, which imports pandas first: a second."""
    whole = column.combine_chunks()
    if whole.null_count or not len(whole):
        return np.asarray(whole.to_numpy(zero_copy_only=False), dtype=np.float64)
    return np.array(np.from_dlpack(whole), dtype=np.float64)


def load_run(directory: Path) -> Run:
    """Read manifest.json and summary.csv of a run directory and check that they belong together.

    Raises
    ------
    OutputError
        One line that names the file, the key or line, the value and what is allowed.
    """
    manifest = read_manifest(directory)
    if manifest.control is not None:
        raise OutputError(
            f"{directory}: holds a study of {manifest.control.runs} runs under control, where this needs a run of"
            " cases; its numbers are in control.json, runs.parquet and errors.parquet",
            path=str(directory),
        )
    if manifest.sweep is not None:
        raise OutputError(
            f"{directory}: holds a sweep of {manifest.sweep.cases} cases, where this needs a run without one; "
            "its data sets cases/ and summary/ read with pandas.read_parquet"
        )
    path = directory / "summary.csv"
    rows = rows_of(path, read_text(path))
    for number, row in enumerate(rows, start=2):
        for what, value, valid in (
            ("case", row.case, manifest.cases),
            ("candidate", row.candidate, {*manifest.candidates, *_recorded(manifest, row)}),
            ("joint", row.joint, manifest.joints),
        ):
            if value not in valid:
                raise OutputError(
                    f"{path}: line {number}: {what} {value!r} is not in manifest.json; valid: {', '.join(valid)}"
                )
    return Run(directory, manifest, rows)


def read_manifest(directory: Path) -> Manifest:
    """Read manifest.json of a run directory, with a sweep or without.

    Raises
    ------
    OutputError
        One line that names the file, the key and the value; or says that a sweep is not finished.
    """
    path = directory / "manifest.json"
    if not path.exists() and (directory / UNFINISHED).exists():
        raise OutputError(
            f"{directory}: holds a sweep that is not finished; the same workbench run command goes on with it, and "
            "writes the report at the end"
        )
    manifest = read_record(path, Manifest, FORMAT_VERSION)
    count = len(manifest.joints)
    for key in ("coordinate_units", "force_units"):
        if len(getattr(manifest, key)) != count:
            raise OutputError(f"{path}: key {key!r}: {len(getattr(manifest, key))} units for {count} joints", key=key)
    return manifest


LONGEST_NUMBER = 40
"""Characters of a number in summary.csv."""

LARGEST_COUNT = 1e12

REQUIRED_COLUMNS = (
    *("case", "candidate", "reference", "joint", "peak_error", "rms_error", "pointwise_error", "worst_time_s"),
    *("bound", "verdict", "kind", "peak_reference", "unit", "pointwise_skipped"),
)


def _recorded(manifest: Manifest, row: ErrorRow) -> tuple[str, ...]:
    case = manifest.cases.get(row.case)
    return tuple(case.recorded) if case and row.kind == "recorded" else ()


def rows_of(path: Path, text: str) -> tuple[ErrorRow, ...]:
    """Return what the *text* of a summary.csv holds; *path* is where it stands, for messages.

    Raises
    ------
    OutputError
        As `load_run`.
    """
    # The csv module and not pandas: a case may be called "nan" or "1e5" and must stay text.
    reader = csv.DictReader(io.StringIO(text, newline=""))
    rows: dict[tuple[str, ...], ErrorRow] = {}
    try:
        header = reader.fieldnames or []
        for column in REQUIRED_COLUMNS:
            if header.count(column) != 1:
                found = "is missing" if column not in header else f"stands {header.count(column)} times"
                raise OutputError(f'{path}: column "{column}" {found}; needed: {", ".join(REQUIRED_COLUMNS)}')
        for record in reader:
            where = f"{path}: line {reader.line_num}"
            if None in record or None in record.values():
                raise OutputError(f"{where}: expected {len(header)} fields; the line is torn")
            row = _row(path, reader.line_num, record)
            key = (row.case, row.candidate, row.reference, row.joint)
            if key in rows:
                raise OutputError(f"{where}: is there twice: case {', '.join(key)}")
            rows[key] = row
    except csv.Error as error:
        raise OutputError(f"{path}: line {reader.line_num}: {error}") from error
    return tuple(rows.values())


def _row(path: Path, line: int, record: Mapping[str, str]) -> ErrorRow:
    def refused(column: str, allowed: str) -> OutputError:
        return OutputError(
            f"{path}: line {line}: {column} is {record[column][:60]!r}; allowed: {allowed}", column=column
        )

    def number(column: str) -> float:
        text = record[column]
        try:
            # Python reads 1_000 as a number; nobody writes so many digits
            value = float(text if "_" not in text and len(text) <= LONGEST_NUMBER else "?")
        except ValueError as error:
            raise refused(column, "a number") from error
        if LARGEST_VALUE < abs(value) < math.inf:
            raise refused(column, f"at most {LARGEST_VALUE:g}, inf or nan")
        return value

    def error(column: str) -> float:
        value = number(column)
        if value < 0:
            raise refused(column, "a number, 0 or more")
        return value

    def word(column: str, valid: tuple[str, ...]) -> str:
        if record[column] not in valid:
            raise refused(column, ", ".join(valid))
        return record[column]

    def count(column: str) -> int:
        value = number(column)
        if not (value >= 0 and value.is_integer() and value < LARGEST_COUNT):
            raise refused(column, "a count, 0 or more")
        return int(value)

    def bound() -> float | None:
        if not record["bound"].strip():
            return None
        value = number("bound")
        if not 0 < value < math.inf:
            raise refused("bound", "empty, or a number > 0")
        return value

    return ErrorRow(
        case=record["case"],
        candidate=record["candidate"],
        reference=record["reference"],
        joint=record["joint"],
        peak_error=error("peak_error"),
        rms_error=error("rms_error"),
        pointwise_error=error("pointwise_error"),
        worst_time_s=number("worst_time_s"),
        bound=bound(),
        verdict=word("verdict", tuple(VERDICT_STATUS)),
        kind=word("kind", KINDS),
        peak_reference=number("peak_reference"),
        unit=record["unit"],
        pointwise_skipped=count("pointwise_skipped"),
        normaliser=number("normaliser" if record.get("normaliser") else "peak_reference"),
        uncertainty=number("uncertainty") if record.get("uncertainty", "").strip() else math.nan,
    )
