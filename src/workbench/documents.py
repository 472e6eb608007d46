"""TOML documents that a user writes: read safely, and whatever is wrong with one said in a line.

A line names file, key (by the names of tables where they have some), value and what is allowed.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from workbench.errors import SpecError, did_you_mean
from workbench.reading import read_bytes
from workbench.schema import NAME_RULE

LARGEST_BYTES = 10_000_000
"""A document larger than this is refused before it is parsed."""

SHOWN = 60
"""Longest piece of a document's text that a message repeats."""


def shorten(text: str) -> str:
    """Cut a text that a message repeats."""
    return text if len(text) <= SHOWN else text[: SHOWN - 3] + "..."


def read_toml(path: Path, shown: str) -> dict[str, Any]:
    """Read a TOML file; *shown* is the name under which errors speak of it.

    Raises
    ------
    SpecError
        It cannot be read, is no UTF-8 text, or no valid TOML.
    """
    try:
        # -sig: some editors begin UTF-8 files with a byte order mark
        text = read_bytes(path, LARGEST_BYTES).decode("utf-8-sig")
        return tomllib.loads(text.replace("\r\n", "\n").replace("\r", "\n"))
    except OSError as error:
        raise SpecError(f"{shown}: {error.strerror or error}", file=shown) from error
    except UnicodeDecodeError as error:
        raise SpecError(f"{shown}: not UTF-8 text (byte {error.start})", file=shown) from error
    except ValueError as error:  # also a number of more digits than Python reads
        raise SpecError(f"{shown}: not valid TOML: {error}", file=shown) from error
    except RecursionError as error:
        raise SpecError(f"{shown}: not valid TOML: nested too deeply", file=shown) from error


@dataclass(frozen=True)
class Form:
    """The schema of a document, as far as messages need it."""

    root: type[BaseModel]
    sections: Mapping[str, type[BaseModel]] = field(default_factory=dict)
    """key of a table -> its schema"""
    kinds: Mapping[str, type[BaseModel]] = field(default_factory=dict)
    """tables that are told apart by their ``kind``"""
    kinds_of: str = ""
    """what those are, for messages: ``motion``"""

    def problem(self, error: ValidationError, document: Mapping[str, Any]) -> str:
        """One line for the first thing that pydantic found: key, what is wrong, value, what is allowed."""
        # an unknown key explains a missing one, so it goes first
        issue = min(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
        tags = {*self.kinds, "float", "constrained-float"}
        place = [part for part in issue["loc"] if part not in tags]
        where = _place(place, document)
        if issue["type"] == "extra_forbidden":
            return f"{where}: unknown key{did_you_mean(str(place[-1]), self._valid_keys(issue['loc']))}"
        if issue["type"] == "missing":
            return f"{where}: missing; this key is required"
        if issue["type"].startswith("union_tag"):
            return f"{where}.kind{self._wrong_kind(issue['input'])}"
        if issue["type"] == "string_pattern_mismatch":
            return f"{where} = {shorten(repr(issue['input']))}; {NAME_RULE}"
        if issue["type"] in ("model_type", "dict_type"):
            section = self.sections.get(str(place[-1]))
            keys = f" with the keys {', '.join(section.model_fields)}" if section else ""
            return f"{where} = {shorten(repr(issue['input']))}: should be a table{keys}"
        message = issue["msg"].removeprefix("Value error, ").removeprefix("Input ")
        # a whole table or list says less than its key
        shown = "" if isinstance(issue["input"], dict | list) else f" = {shorten(repr(issue['input']))}"
        return f"{where}{shown}: {message[0].lower()}{message[1:]}" if where else f"{message[0].lower()}{message[1:]}"

    def _wrong_kind(self, table: Any) -> str:
        if not isinstance(table, dict):
            return f": missing; a {self.kinds_of} is a table with kind and its own keys"
        if "kind" not in table:
            return f": missing; valid: {', '.join(self.kinds)}"
        kind = str(table["kind"])
        return f" = {shorten(repr(kind))}: unknown kind of {self.kinds_of}{did_you_mean(kind, self.kinds)}"

    def _valid_keys(self, place: tuple[int | str, ...]) -> list[str]:
        """Keys that are valid beside the one at *place*."""
        model = self.root
        for part in place[:-1]:
            model = self.kinds.get(str(part), self.sections.get(str(part), model))
        return list(model.model_fields)


def _place(place: list[int | str], document: Any) -> str:
    """``case "simulation_1".motion.stop``: the key's path with names in place of numbers where there are names."""
    text, node = "", document
    for part in place:
        try:
            node = node[part]
        except (KeyError, IndexError, TypeError):
            node = None
        if isinstance(part, int):
            name = next(
                (node[k] for k in ("name", "id") if isinstance(node, dict) and isinstance(node.get(k), str)), ""
            )
            text += f' "{shorten(name)}"' if name else f"[{part + 1}]"
        else:
            text += f".{part}" if text else str(part)
    return text
