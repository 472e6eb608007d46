"""Read a sweep's run directory: manifest.json, sweep.json and the data sets cases/ and summary/."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from workbench.arrays import FloatArray
from workbench.errors import OutputError
from workbench.parquet_columns import read_columns
from workbench.records import read_record
from workbench.report.load import LARGEST_VALUE
from workbench.report.manifest import Manifest
from workbench.report.sweep.summary import FORMAT_VERSION, KeyRecord, Summary

LARGEST_PART = 2_000_000_000
"""Bytes of one part of a data set that are read."""

CONTRAST = "contrast"
CASES, ROWS, SWEEP = "cases", "summary", "sweep.json"
CASE_COLUMNS = ("index", "case", "status", "reason")
TEXT_COLUMNS = frozenset({"case", "status", "reason", "candidate", "reference", "joint", "kind"})
ROW_COLUMNS = ("index", "candidate", "reference", "joint", "kind", "peak_error", "bound")


@dataclass(frozen=True)
class SweepRun:
    """A finished sweep, read and checked. Arrays are in case order."""

    directory: Path
    manifest: Manifest
    summary: Summary
    names: pa.ChunkedArray = field(repr=False)
    """``(n,)`` names of the cases"""
    status: NDArray[np.object_] = field(repr=False)
    """``(n,)``"""
    reasons: pa.ChunkedArray = field(repr=False)
    values: FloatArray = field(repr=False)
    """``(n, keys)`` the varied numbers, in the order of ``summary.keys``"""
    errors: Mapping[tuple[str, str], FloatArray] = field(repr=False)
    """candidate and reference -> ``(n, joints)`` peak errors, fractions; NaN where a case has none"""
    bounds: Mapping[tuple[str, str], float] = field(repr=False)
    """candidate and reference -> the largest error allowed; missing where nothing is"""

    @cached_property
    def worst(self) -> Mapping[tuple[str, str], FloatArray]:
        """Largest peak error over the joints, ``(n,)``; NaN where a case has none."""
        return {pair: table.max(axis=1) for pair, table in self.errors.items()}

    def name(self, index: int) -> str:
        """Name of a case."""
        return str(self.names[index].as_py())

    def reason(self, index: int) -> str:
        """Why a case did not pass."""
        return str(self.reasons[index].as_py() or "")

    def series(self, index: int) -> str:
        """Where the time series of a case lie, relative to the run directory; empty where none were kept."""
        path = Path("series") / f"{self.name(index)}.parquet"
        kept = len(path.parts) == 2 and (self.directory / path).is_file()
        return path.as_posix() if kept else ""

    def key(self, name: str) -> KeyRecord | None:
        """The record of a varied key."""
        return next((key for key in self.summary.keys if key.key == name), None)


def load_sweep(directory: Path, manifest: Manifest) -> SweepRun:
    """Read what a finished sweep has stored.

    Memory: the varied numbers and one number per case, candidate and joint; parts are read one after the other.

    Raises
    ------
    OutputError
        One line that names the file, the key or column, the value and what is allowed.
    """
    summary = _read_summary(directory / SWEEP)
    keys = [key.key for key in summary.keys]
    cases = pa.concat_tables(_tables(directory / CASES, (*CASE_COLUMNS, *keys)))
    if cases.num_rows != summary.cases:
        raise OutputError(f"{directory / CASES}: {cases.num_rows} cases; {SWEEP} counts {summary.cases}")
    if cases.column("index").to_pylist() != list(range(summary.cases)):
        raise OutputError(f"{directory / CASES}: cases are not in order, or not all there; needed: 0, 1, 2, ...")
    values = np.column_stack([cases.column(key).to_numpy() for key in keys]).astype(np.float64)
    if not (np.abs(values) <= LARGEST_VALUE).all():
        index, column = np.argwhere(~(np.abs(values) <= LARGEST_VALUE))[0]
        raise OutputError(
            f"{directory / CASES}: case {index}: {keys[column]} is {values[index, column]:g}; allowed:"
            f" -{LARGEST_VALUE:g} to {LARGEST_VALUE:g}"
        )
    errors, bounds = _read_errors(directory / ROWS, summary, manifest.joints)
    return SweepRun(
        directory,
        manifest,
        summary,
        names=cases.column("case"),
        status=np.array(cases.column("status").to_pylist(), dtype=object),
        reasons=cases.column("reason"),
        values=values,
        errors=errors,
        bounds=bounds,
    )


def _read_summary(path: Path) -> Summary:
    summary = read_record(path, Summary, FORMAT_VERSION)
    if not summary.keys:
        raise OutputError(f"{path}: key 'keys': nothing varies; allowed: at least one", key="keys")
    return summary


def _tables(folder: Path, columns: tuple[str, ...]) -> list[pa.Table]:
    found = sorted(folder.glob("part-*.parquet"))
    if not found:
        raise OutputError(f"{folder}: no part-*.parquet; a finished sweep has them")
    return [_table(path, columns) for path in found]


def _table(path: Path, columns: tuple[str, ...]) -> pa.Table:
    try:
        return read_columns(path, columns, LARGEST_PART, TEXT_COLUMNS, ("index",))
    except FileNotFoundError as error:  # in this moment: its name has just been listed
        raise OutputError(f"{path}: missing") from error


def _read_errors(
    folder: Path, summary: Summary, joints: tuple[str, ...]
) -> tuple[dict[tuple[str, str], FloatArray], dict[tuple[str, str], float]]:
    pairs = [(candidate, reference) for candidate, reference, _ in summary.pairs]
    errors = {pair: np.full((summary.cases, len(joints)), np.nan) for pair in pairs}
    bounds: dict[tuple[str, str], float] = {}
    for path in sorted(folder.glob("part-*.parquet")):
        table = _table(path, ROW_COLUMNS)
        index, value = table.column("index").to_numpy(), table.column("peak_error").to_numpy()
        if len(index) and not (index.min() >= 0 and index.max() < summary.cases):
            wrong = index.min() if index.min() < 0 else index.max()
            raise OutputError(f"{path}: case number {wrong}; allowed: 0 to {summary.cases - 1}", column="index")
        if ((value < 0) | (value > LARGEST_VALUE) & (value < np.inf)).any():
            raise OutputError(
                f"{path}: a peak_error below 0 or beyond {LARGEST_VALUE:g}; allowed: 0 or more, inf, nan",
                column="peak_error",
            )
        bound = table.column("bound").to_numpy()
        judged = ~_is(table, "kind", CONTRAST)
        for pair in pairs:
            of_pair = judged & _is(table, "candidate", pair[0]) & _is(table, "reference", pair[1])
            known = bound[of_pair]
            known = known[np.isfinite(known)]
            if len(known):
                bounds[pair] = float(known.min())
            for column, joint in enumerate(joints):
                kept = of_pair & _is(table, "joint", joint)
                errors[pair][index[kept], column] = value[kept]
    return errors, bounds


def _is(table: pa.Table, column: str, text: str) -> NDArray[np.bool_]:
    """Tell which rows hold a text; by the numbers of a dictionary, without a Python object per row."""
    found: list[NDArray[np.bool_]] = []
    for chunk in table.column(column).chunks:
        coded = chunk.dictionary_encode()
        words = coded.dictionary.to_pylist()
        number = words.index(text) if text in words else -1
        found.append(np.asarray(coded.indices.fill_null(-2)) == number)
    return np.concatenate(found) if found else np.zeros(0, dtype=np.bool_)
