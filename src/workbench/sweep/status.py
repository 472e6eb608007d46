"""How far a run is, read from its directory without touching it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError

from workbench.campaign import store
from workbench.campaign.lock import holder
from workbench.errors import OutputError
from workbench.records import Record, RecordType, read_text, validated
from workbench.sweep import files
from workbench.sweep import journal as journal_file
from workbench.sweep.record import parse_line

RUNNING, STOPPED, FINISHED = "running", "stopped", "finished"


@dataclass(frozen=True)
class RunStatus:
    """Where a run stands."""

    state: str
    """running, stopped (it can be gone on with) or finished"""
    campaign: str
    done: int = 0
    total: int | None = None
    counts: dict[str, int] = field(default_factory=dict)
    rate: float = 0.0
    remaining_s: float | None = None
    process: int | None = None


def run_status(directory: Path) -> RunStatus:
    """Look at a run directory.

    Raises
    ------
    OutputError
        No run there, or it cannot be read.
    """
    process = holder(directory)
    manifest = files.read_json(directory / store.MANIFEST)
    if manifest is not None and "cases" in manifest and process is None:
        return _finished(_read(directory / store.MANIFEST, _Manifest))
    state = files.read_json(directory / files.STATE)
    if state is None and process is None:
        raise OutputError(f"{directory}: holds no run of the workbench", path=str(directory))
    try:
        return _living(directory, process, state)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise OutputError(
            f"{directory}: {files.STATE} or {files.PROGRESS}: {first['msg']}", path=str(directory)
        ) from error


def _living(directory: Path, process: int | None, state: dict[str, Any] | None) -> RunStatus:
    told = files.read_json(directory / files.PROGRESS)
    progress = _Progress() if told is None else _Progress.model_validate(told)
    counts = _count(directory / journal_file.NAME)
    running = process is not None
    return RunStatus(
        RUNNING if running else STOPPED,
        _State.model_validate(state or {}).campaign,
        sum(counts.values()),
        progress.total,
        counts,
        progress.rate or 0.0 if running else 0.0,
        progress.remaining_s if running else None,
        process or None,
    )


class _Case(Record):
    status: str


class _Sweep(Record):
    counts: dict[str, Annotated[int, Field(ge=0, le=10**12)]] = Field(default_factory=dict)


class _Control(Record):
    runs: Annotated[int, Field(ge=0, le=10**9)]


class _Manifest(Record):
    campaign: str = ""
    cases: dict[str, _Case]
    sweep: _Sweep | None = None
    control: _Control | None = None


class _Progress(Record):
    total: Annotated[int, Field(ge=0, le=10**12)] | None = None
    rate: Annotated[float, Field(ge=0)] | None = None
    remaining_s: Annotated[float, Field(ge=0)] | None = None


class _State(Record):
    campaign: str = ""


def _finished(manifest: _Manifest) -> RunStatus:
    if manifest.control is not None:
        counts = {"passed": manifest.control.runs}
    elif manifest.sweep is not None:
        counts = dict(manifest.sweep.counts)
    else:
        counts = dict(Counter(case.status for case in manifest.cases.values()))
    total = sum(counts.values())
    return RunStatus(FINISHED, manifest.campaign, total, total, counts)


def _read(path: Path, kind: type[RecordType]) -> RecordType:
    return validated(path, kind, read_text(path))


def _count(path: Path) -> dict[str, int]:
    """Finished cases by status; the last line of a case counts."""
    statuses: dict[int, str] = {}
    try:
        if not path.is_file():
            return {}
        with path.open("rb") as stream:
            while line := stream.readline(journal_file.LONGEST_LINE):
                record = parse_line(line)
                if record is not None:
                    statuses[record.index] = record.status
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise OutputError(f"{path}: cannot be read: {error.strerror or error}") from error
    counts: dict[str, int] = {}
    for status in statuses.values():
        counts[status] = counts.get(status, 0) + 1
    return counts
