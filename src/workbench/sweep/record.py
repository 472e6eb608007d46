"""What is kept of one case of a sweep: exactly one status, its reason, its rows and a few figures."""

from __future__ import annotations

import json
import zlib
from dataclasses import dataclass, field
from typing import Any

PASSED = "passed"
FAILED = "failed"
"""a bound is exceeded, or computing it raised an error"""
INVALID = "invalid"
"""a result is not a finite number"""
TIMEOUT = "timeout"
KILLED = "killed"
"""its worker died: a signal, a crash, memory"""
FILTERED = "filtered"
"""left out on purpose, by ``[sweep.filter]``"""

STATUSES = (PASSED, FAILED, INVALID, TIMEOUT, KILLED, FILTERED)
GOOD = (PASSED, FILTERED)
"""Statuses that do not fail a run; the others are what ``--retry-failed`` tries again."""

LONGEST_REASON = 300


@dataclass(frozen=True)
class Record:
    """One finished case."""

    index: int
    key: str
    status: str
    reason: str = ""
    rows: list[dict[str, Any]] = field(default_factory=list)
    """as in summary.csv, without the case's name"""
    facts: dict[str, float] = field(default_factory=dict)
    series: str = ""
    """SHA-256 of the time series' file; empty where none was kept"""

    def line(self) -> bytes:
        """Return the record as one line with a checksum; floats read back bit-equal."""
        text = json.dumps(vars(self), separators=(",", ":")).encode()
        return b"%08x %s\n" % (zlib.crc32(text), text)


def parse_line(line: bytes) -> Record | None:
    """Read a line of `Record.line`; None where it is torn or altered."""
    checksum, _, text = line.rstrip(b"\n").partition(b" ")
    if not line.endswith(b"\n") or checksum != b"%08x" % zlib.crc32(text):
        return None
    try:
        record = Record(**json.loads(text))
    except (TypeError, ValueError, RecursionError):  # somebody made a checksum that fits
        return None
    texts = (record.key, record.status, record.reason, record.series)
    whole = type(record.index) is int and all(isinstance(one, str) for one in texts) and record.status in STATUSES
    return record if whole and isinstance(record.rows, list) and isinstance(record.facts, dict) else None


def lost(index: int, key: str, status: str, reason: str) -> Record:
    """Return the record of a case that left no result."""
    text = " ".join(reason.split())
    return Record(index, key, status, text if len(text) <= LONGEST_REASON else text[: LONGEST_REASON - 3] + "...")
