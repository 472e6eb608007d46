"""The rendered pictures that a run has stored: a still of the robot, and a sheet of frames that the page plays.

A report draws nothing itself: the same stored pictures give the same bytes on every machine.
"""

from __future__ import annotations

import base64
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from pydantic import Field

from workbench.errors import OutputError
from workbench.reading import read_bytes
from workbench.records import Record, read_record, reason
from workbench.report.load import Run

FOLDER, RECORD, STILL, FILM = "pictures", "pictures.json", "mechanism.webp", "film.webp"
FORMAT_VERSION = 1
MOST_FRAMES, MOST_PIXELS = 10_000, 10_000
LARGEST = 1_000_000
"""Bytes of a picture that goes into the page."""
OTHER_MODEL = "the stored pictures show another model"


class PicturesRecord(Record):
    """pictures.json."""

    format: int
    note: str = ""
    """why there are no pictures; empty where there are some"""
    case: str = ""
    model_sha256: str = ""
    columns: int = 1
    width: int = 1
    height: int = 1
    times: Annotated[tuple[float, ...], Field(max_length=MOST_FRAMES)] = ()


@dataclass(frozen=True)
class Film:
    """The robot of one case in motion; or, where ``note`` is set, why it cannot be shown."""

    case: str
    note: str = ""
    record: PicturesRecord | None = None
    sheet: bytes = field(default=b"", repr=False)
    still: bytes = field(default=b"", repr=False)
    """the picture at the first moment"""
    still_file: str = f"{FOLDER}/{STILL}"

    @property
    def address(self) -> str:
        """The sheet of frames as an address that loads nothing."""
        return address(self.sheet)

    @property
    def still_address(self) -> str:
        """The still picture as an address that loads nothing."""
        return address(self.still)

    @property
    def times(self) -> str:
        """Seconds of the frames."""
        return " ".join(f"{time:g}" for time in self.record.times) if self.record else ""

    @property
    def rows(self) -> int:
        """Rows of the sheet."""
        return -(-len(self.record.times) // self.record.columns) if self.record else 1

    @property
    def alt(self) -> str:
        """What stands for the picture."""
        return (
            f"The robot's model, rendered by MuJoCo, in the course of case {self.case}; without a script, at its first "
            "moment."
        )


def film_of(run: Run) -> Film | None:
    """Read the stored pictures; None where the run was told to make none.

    Raises
    ------
    OutputError
        The record is torn or of another format; a picture is missing, not WebP, or too large for a page.
    """
    path = run.directory / FOLDER / RECORD
    if not os.path.lexists(path):
        return None
    record = read_record(path, PicturesRecord, FORMAT_VERSION)
    first = next(iter(run.manifest.cases), "")
    if record.note:
        return Film(first, record.note)
    if record.model_sha256 != run.manifest.model.sha256:
        return Film(first, OTHER_MODEL)
    if (
        record.case not in run.manifest.cases
        or not record.times
        or not min(record.columns, record.width, record.height) >= 1
        or max(record.columns, record.width, record.height) > MOST_PIXELS
    ):
        raise OutputError(f"{path}: case {record.case!r} with {len(record.times)} frames; needed: a case of the run")
    folder = run.directory / FOLDER
    return Film(record.case, "", record, webp(folder / FILM), webp(folder / STILL))


def address(picture: bytes) -> str:
    """Return a WebP picture as an address that loads nothing."""
    return f"data:image/webp;base64,{base64.b64encode(picture).decode('ascii')}"


def webp(path: Path) -> bytes:
    """Read a stored picture.

    Raises
    ------
    OutputError
        It is missing, no WebP, or too large for a page.
    """
    try:
        content = read_bytes(path, LARGEST)
    except OSError as error:
        raise OutputError(
            f"{path}: cannot be read ({reason(error)}); allowed: a WebP picture of at most {LARGEST} bytes"
        ) from error
    if content[:4] != b"RIFF" or content[8:12] != b"WEBP" or len(content) > LARGEST:
        raise OutputError(f"{path}: {len(content)} bytes; allowed: a WebP picture of at most {LARGEST} bytes")
    return content
