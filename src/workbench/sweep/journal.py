"""The journal of a running sweep: one line per finished case, appended in whatever order cases finish.

A line counts when its checksum fits, so a torn end costs the cases in it and nothing else. Only the places of the lines
are held in memory.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from workbench.sweep.record import STATUSES, Record, parse_line

NAME = "journal.jsonl"
LONGEST_LINE = 4_000_000
ABSENT = -1


class Journal:
    """An append-only file of records; the last record of a case counts.

    Parameters
    ----------
    path
        The file; made where it is missing.
    count
        Number of cases of the sweep; records of others are ignored.

    Raises
    ------
    OSError
        It cannot be read or written.
    """

    def __init__(self, path: Path, count: int) -> None:
        self._places = np.full(count, ABSENT, dtype=np.int64)
        self._statuses = np.full(count, ABSENT, dtype=np.int8)
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o644)
        # without a buffer: a line that was appended is the system's, whatever becomes of this process
        self._file = os.fdopen(descriptor, "r+b", buffering=0)
        self._end = 0
        try:
            self._scan()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        """Return the journal."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _scan(self) -> None:
        with open(os.dup(self._file.fileno()), "rb") as stream:
            stream.seek(0)
            while line := stream.readline(LONGEST_LINE):
                if line.endswith(b"\n"):
                    record = parse_line(line)
                    if record is not None and 0 <= record.index < len(self._places):
                        self._note(record.index, record.status, self._end)
                    self._end += len(line)
                elif len(line) == LONGEST_LINE:
                    self._end += len(line)
        # a torn last line goes, so that the next one starts afresh
        if os.fstat(self._file.fileno()).st_size > self._end:
            self._file.truncate(self._end)

    def _note(self, index: int, status: str, place: int) -> None:
        self._places[index] = place
        self._statuses[index] = STATUSES.index(status)

    def append(self, record: Record) -> None:
        """Add a finished case, as `add`."""
        self.add(record.index, record.status, record.line())

    def add(self, index: int, status: str, line: bytes) -> None:
        """Add a finished case by its line (`Record.line`); what a full disk leaves of it is taken back.

        Raises
        ------
        OSError
            The system refuses the write.
        """
        try:
            self._file.seek(self._end)
            written = 0
            while written < len(line):
                written += self._file.write(line[written:]) or 0
        except OSError:
            self._file.truncate(self._end)
            raise
        self._note(index, status, self._end)
        self._end += len(line)

    def sync(self) -> None:
        """Make sure that all of it survives a power cut."""
        os.fsync(self._file.fileno())

    def __contains__(self, index: int) -> bool:
        return bool(self._places[index] != ABSENT)

    def status(self, index: int) -> str | None:
        """Status of a case; None where it is not finished."""
        found = int(self._statuses[index])
        return None if found == ABSENT else STATUSES[found]

    def counts(self) -> dict[str, int]:
        """Finished cases by status."""
        return {status: int(np.count_nonzero(self._statuses == i)) for i, status in enumerate(STATUSES)}

    def missing(self) -> Iterator[int]:
        """Indices of the cases that are not finished, in order, as they stand now."""
        return iter(np.flatnonzero(self._places == ABSENT).tolist())

    def forget(self, index: int) -> None:
        """Count a case as not finished."""
        self._places[index] = self._statuses[index] = ABSENT

    def read(self, index: int) -> Record:
        """Return the record of a finished case.

        Raises
        ------
        KeyError
            It is not finished.
        OSError
            The file was changed by others.
        """
        place = int(self._places[index])
        if place == ABSENT:
            raise KeyError(index)
        self._file.seek(place)
        line = b""
        while b"\n" not in line and (piece := self._file.read(16384)):
            line += piece
        line = line[: line.find(b"\n") + 1] or line
        record = parse_line(line)
        if record is None:
            raise OSError(f"case {index} cannot be read back; was the file changed while it was in use?")
        return record
