"""JSON files of a run directory: read by a schema, so that nothing that somebody edited gets past the reader."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from workbench.errors import OutputError
from workbench.reading import parse_json, read_bytes

LONGEST_TEXT = 100_000
"""Characters of one text."""


class Record(BaseModel):
    """Base: immutable, tolerant of further keys."""

    model_config = ConfigDict(
        frozen=True, extra="ignore", protected_namespaces=(), allow_inf_nan=False, str_max_length=LONGEST_TEXT
    )


RecordType = TypeVar("RecordType", bound=Record)


def read_text(path: Path) -> str:
    """Read a file of a run directory.

    Raises
    ------
    OutputError
        It is missing or cannot be read.
    """
    try:
        return read_bytes(path).decode("utf-8")
    except FileNotFoundError as error:
        held = "a run directory holds manifest.json and summary.csv, or sweep.json in place of it"
        raise OutputError(f"{path}: missing; {held}") from error
    except (OSError, UnicodeDecodeError) as error:
        raise OutputError(f"{path}: cannot be read ({reason(error)})") from error


def read_record(path: Path, kind: type[RecordType], version: int) -> RecordType:
    """Read a JSON file of a run directory.

    Raises
    ------
    OutputError
        One line that names the file, the key and the value: missing, torn, of another format, or a wrong entry.
    """
    try:
        text = read_text(path)
        data = parse_json(text)
    except ValueError as error:
        raise OutputError(f"{path}: not valid JSON ({short(error)})") from error
    found = data.get("format") if isinstance(data, dict) else None
    if found != version or type(found) is not int:
        raise OutputError(f"{path}: format {found!r} is not supported; allowed: {version}", key="format")
    return validated(path, kind, text)


def validated(path: Path, kind: type[RecordType], text: str) -> RecordType:
    """Return what a JSON text of a file holds, as a record.

    Raises
    ------
    OutputError
        Naming file, key and value.
    """
    try:
        return kind.model_validate_json(text, strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        value = "" if first["type"] == "missing" else f", got {str(first['input'])[:60]!r}"
        raise OutputError(f"{path}: key {key!r}: {first['msg']}{value}", key=key) from error


def reason(error: BaseException) -> str:
    """Return what the system, or a decoder, says about a file, without the file's name."""
    return (isinstance(error, OSError) and error.strerror) or short(error)


def short(error: BaseException) -> str:
    """Return an error's message as one short line."""
    return " ".join(str(error).split())[:160] or type(error).__name__
