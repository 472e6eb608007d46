"""Read a study's run directory: manifest.json, control.json, runs.parquet and errors.parquet."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import Field

from workbench.control.names import CONTROL, ERROR_COLUMNS, ERRORS, LOOP_COLUMNS, RUNS
from workbench.errors import OutputError
from workbench.parquet_columns import read_columns
from workbench.records import Record, read_record
from workbench.report.manifest import Manifest

LARGEST = 1_000_000_000
MOST_ROWS = 400
"""Rows of a table of all runs; the rest stands in errors.parquet."""
TEXTS = frozenset({"case", "controller", "model", "rate_asked", "status", "reason", "key", "joint"})


class ClaimVerdict(Record):
    """A sentence with what became of it."""

    id: str
    text: str
    source: str = ""
    verdict: str
    sentence: str = ""
    varied: dict[str, str] = Field(default_factory=dict)
    note: str = ""


class StudyRecord(Record):
    """control.json."""

    runs: int
    tracked: int
    unstable: int
    undecided: int
    failed: int
    reasons: tuple[str, ...] = ()
    wanted_m: float
    enough: float
    claims: tuple[ClaimVerdict, ...] = ()


@dataclass(frozen=True)
class Place:
    """Where in a study a run stands."""

    case: str
    controller: str
    model: str
    speed: float
    rate: float
    rate_asked: str
    bandwidth: float

    @property
    def name(self) -> str:
        """Controller and model."""
        return self.controller if self.model == "none" else f"{self.controller}, {self.model}"


@dataclass(frozen=True)
class StudyRun:
    """A finished study."""

    directory: Path
    manifest: Manifest
    study: StudyRecord
    runs: tuple[dict[str, Any], ...] = field(repr=False)
    """rows of runs.parquet"""
    errors: dict[int, dict[str, dict[str, Any]]] = field(repr=False)
    """run -> joint, or ``platform`` -> row of errors.parquet"""

    def place(self, row: dict[str, Any]) -> Place:
        """Where a run stands."""
        return Place(**{name: row[name] for name in LOOP_COLUMNS})

    def platform(self, row: dict[str, Any]) -> dict[str, Any] | None:
        """The platform's errors of a run, None where it is unstable or was not computed."""
        return self.errors.get(row["index"], {}).get("platform")


def load_study(directory: Path, manifest: Manifest) -> StudyRun:
    """Read what a finished study has stored.

    Raises
    ------
    OutputError
        One line that names the file and what is wrong with it.
    """
    study = read_record(directory / CONTROL, StudyRecord, 1)
    runs = _rows(directory / RUNS, ("index", *LOOP_COLUMNS, "status", "reason", "key", "ended", "spread"))
    errors: dict[int, dict[str, dict[str, Any]]] = {}
    for row in _rows(directory / ERRORS, ("index", *LOOP_COLUMNS, *ERROR_COLUMNS)):
        errors.setdefault(row["index"], {})[row["joint"]] = row
    if len(runs) != study.runs:
        raise OutputError(f"{directory / RUNS}: {len(runs)} runs; {CONTROL} counts {study.runs}")
    return StudyRun(directory, manifest, study, tuple(runs), errors)


def _rows(path: Path, columns: tuple[str, ...]) -> list[dict[str, Any]]:
    try:
        table = read_columns(path, columns, LARGEST, TEXTS, ("index",))
    except FileNotFoundError as error:
        raise OutputError(f"{path}: missing") from error
    rows: list[dict[str, Any]] = table.to_pylist()
    return rows
