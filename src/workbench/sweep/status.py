"""How far a run is, read from its directory without touching it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from workbench.campaign import store
from workbench.campaign.lock import holder
from workbench.errors import OutputError
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
        return _finished(manifest)
    state = files.read_json(directory / files.STATE)
    if state is None and process is None:
        raise OutputError(f"{directory}: holds no run of the workbench", path=str(directory))
    progress: dict[str, Any] = files.read_json(directory / files.PROGRESS) or {}
    counts = _count(directory / journal_file.NAME)
    running = process is not None
    return RunStatus(
        RUNNING if running else STOPPED,
        str((state or {}).get("campaign", "")),
        sum(counts.values()),
        progress.get("total"),
        counts,
        float(progress.get("rate") or 0.0) if running else 0.0,
        progress.get("remaining_s") if running else None,
        process or None,
    )


def _finished(manifest: dict[str, Any]) -> RunStatus:
    sweep = manifest.get("sweep")
    if isinstance(sweep, dict):
        counts = dict(sweep.get("counts", {}))
    else:
        counts = {}
        for case in manifest["cases"].values():
            counts[case["status"]] = counts.get(case["status"], 0) + 1
    total = sum(counts.values())
    return RunStatus(FINISHED, str(manifest.get("campaign", "")), total, total, counts)


def _count(path: Path) -> dict[str, int]:
    """Finished cases by status; the last line of a case counts."""
    statuses: dict[int, str] = {}
    try:
        with path.open("rb") as stream:
            for line in stream:
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
