"""From bytes to a table of floats, whichever of the usual dialects wrote it; what is ambiguous is refused, not guessed.

Separators are comma, semicolon or tab, whichever stands in the header; the decimal sign is found in the cells. Comments
begin with ``#``, ``%`` or ``//``. Lines end in LF, CRLF or CR. Text is UTF-8, with or without a byte order mark.
"""

from __future__ import annotations

import csv
import os
import re
import stat
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from workbench.arrays import FloatArray
from workbench.delimited.units import UNITS, split_unit
from workbench.errors import WorkbenchError

MAX_BYTES = 2**28
"""A larger file is taken for a slip; 100,000 samples of 40 columns with all digits are 80 MB."""

MAX_ROWS = 10_000_000
MAX_COLUMNS = 10_000
SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}
COMMENTS = ("#", "%", "//")

_SHOWN = 40
"""Longest piece of a file's text that a message repeats."""

_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
"""What is a number with a decimal comma and as well one with commas between its thousands"""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


@dataclass(frozen=True)
class Table:
    """A table as it was read; a position in it can be named in the words of its file."""

    file: str
    headers: tuple[str, ...]
    """as written, units included"""
    names: tuple[str, ...]
    """the same without units"""
    header_units: tuple[str | None, ...]
    """what was taken off the headers"""
    line_units: tuple[str | None, ...]
    """of a line of units below the header"""
    values: FloatArray = field(repr=False)
    """``(n, columns)``, in the file's units"""
    lines: tuple[int, ...] = field(repr=False)
    """line of each sample, counted from 1"""
    header_line: int = 1
    separator: str = ","
    decimal: str = "."

    def where(self, row: int, column: int) -> str:
        """``motion.csv: line 3, column q2``, for messages."""
        return f"{self.file}: line {self.lines[row]}, column {shown(self.names[column], quoted=False)}"


def read_regular(path: str | Path, error: type[WorkbenchError], most: int = MAX_BYTES) -> bytes:
    """Read a regular file whole.

    Raises
    ------
    WorkbenchError
        *error*: no regular file (a pipe is refused, not waited for), not readable, or more than *most* bytes.
    """
    file = str(path)
    try:
        # O_NONBLOCK: opening a pipe that nobody writes to would wait for ever
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with open(handle, "rb") as stream:
            status = os.fstat(stream.fileno())
            if stat.S_ISDIR(status.st_mode):
                raise IsADirectoryError(0, "Is a directory")
            if not stat.S_ISREG(status.st_mode):
                raise error(f"{file}: cannot be read: no regular file", file=file)
            if status.st_size > most:
                raise error(f"{file}: {status.st_size} bytes; allowed: at most {most}", file=file)
            return stream.read(most)
    except OSError as problem:
        raise error(f"{file}: cannot be read: {problem.strerror or problem}", file=file) from problem
    except ValueError as problem:  # a null character in the path
        raise error(f"{file!r}: cannot be read: {problem}", file=file) from problem


def read_table(
    path: str | Path, error: type[WorkbenchError], *, expected: str = "column names", most_rows: int = MAX_ROWS
) -> Table:
    """Read a file and `parse_table` it.

    Raises
    ------
    WorkbenchError
        *error*, as `read_regular` and `parse_table`.
    """
    return parse_table(read_regular(path, error), str(path), error, expected=expected, most_rows=most_rows)


def parse_table(
    data: bytes,
    file: str,
    error: type[WorkbenchError],
    *,
    expected: str = "column names",
    most_rows: int = MAX_ROWS,
) -> Table:
    """Turn bytes into a table.

    Parameters
    ----------
    data, file
        The file's content, and its name for messages.
    error
        Class of the errors raised: whose table it is decides.
    expected
        What the header should say, for the message where there is none.
    most_rows
        More samples are refused.

    Raises
    ------
    WorkbenchError
        *error*: not UTF-8, no header, two separators in the header, a line with another number of cells, a cell that is
        not a finite number, decimal points and decimal commas in one file, commas that may as well stand between
        thousands. The message names file, line, column and value; the facts hold them too.
    """
    return _Parser(file, error, most_rows).parse(_text(data, file, error), expected)


def shown(text: str, quoted: bool = True) -> str:
    """Return a piece of a file's text, cut, and without what would disturb a terminal."""
    cut = f"{repr(text[:_SHOWN])[1:-1]}{'...' if len(text) > _SHOWN else ''}"
    return f'"{cut}"' if quoted else cut


def _text(data: bytes, file: str, error: type[WorkbenchError]) -> str:
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise error(f"{file}: UTF-16 text; allowed: UTF-8 (save it as CSV UTF-8)", file=file)
    try:
        # -sig: spreadsheets begin their UTF-8 files with a byte order mark
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        raise error(f"{file}: not UTF-8 text (byte {problem.start})", file=file) from problem


class _Parser:
    """One file on its way to a table; it keeps where it is, so that a refusal can say so."""

    def __init__(self, file: str, error: type[WorkbenchError], most_rows: int) -> None:
        self.file, self.error, self.most_rows = file, error, most_rows
        self.comma: tuple[int, str, str] | None = None
        """first cell with a comma in it: line, column, cell"""
        self.point: tuple[int, str, str] | None = None
        self.grouped = True
        """so far every comma may as well stand between thousands"""

    def parse(self, text: str, expected: str) -> Table:
        lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
        start, separator = self._declared(lines)
        header_line, header_text, from_comment = self._header(lines, start, separator, expected)
        separator = separator or self._separator(header_line, header_text)
        headers = [cell.strip() for cell in next(csv.reader([header_text], delimiter=separator, skipinitialspace=True))]
        while len(headers) > 1 and not headers[-1]:  # trailing separators
            headers.pop()
        if len(headers) > MAX_COLUMNS:
            self.refuse(header_line, f"{len(headers)} columns; allowed: at most {MAX_COLUMNS}")
        names, header_units = zip(*(split_unit(header) for header in headers), strict=True)
        line_units: tuple[str | None, ...] = (None,) * len(headers)
        values, where = array("d"), list[int]()
        for line, cells in self._rows(lines, start if from_comment else header_line, separator):
            while len(cells) > len(headers) and not cells[-1]:
                cells.pop()
            if len(cells) != len(headers):
                self._refuse_length(line, cells, len(headers), separator)
            if not where and self._is_unit_row(cells):
                line_units = tuple(cell.strip("[]() ") or None for cell in cells)
                continue
            if len(where) == self.most_rows:
                self.refuse(line, f"more samples than allowed: {self.most_rows}")
            where.append(line)
            values.extend(self._number(line, name, cell) for name, cell in zip(names, cells, strict=True))
        self._check_decimal()
        return Table(
            file=self.file,
            headers=tuple(headers),
            names=names,
            header_units=header_units,
            line_units=line_units,
            values=np.frombuffer(values, dtype=np.float64).reshape(len(where), len(headers)).copy(),
            lines=tuple(where),
            header_line=header_line,
            separator=separator,
            decimal="," if self.comma else ".",
        )

    def refuse(self, line: int, message: str, **facts: Any) -> NoReturn:
        raise self.error(f"{self.file}: line {line}: {message}", **{"file": self.file, "line": line, **facts})

    def _declared(self, lines: list[str]) -> tuple[int, str]:
        """A first line ``sep=;`` is a spreadsheet's own word on its separator."""
        found = re.fullmatch(r"sep=([,;\t])", lines[0].strip(" \"'"))
        return (1, found[1]) if found else (0, "")

    def _header(self, lines: list[str], start: int, declared: str, expected: str) -> tuple[int, str, bool]:
        """Line number and text of the header; it may be a comment where numbers follow it at once (NumPy's savetxt)."""
        comment: tuple[int, str] | None = None
        for number, line in enumerate(lines[start:], start=start + 1):
            text = line.strip(" ")
            if not text.strip("\t,; "):
                continue
            if text.startswith(COMMENTS):
                comment = number, text.lstrip("#%/ ")
                continue
            cells = re.split(declared or "[,;\t]", text)
            if any(_NUMBER.fullmatch(cell.strip(' "').replace(",", ".")) for cell in cells) and not self._named(cells):
                # numbers where names should be; the comment above may hold them
                if comment and len(re.split(declared or "[,;\t]", comment[1])) > 1:
                    return *comment, True
                self.refuse(number, f"numbers where the header should be: {shown(text)}; allowed: {expected}")
            return number, text if declared == "\t" else text.lstrip(" "), False
        raise self.error(f"{self.file}: no header line; allowed: {expected}", file=self.file)

    def _named(self, cells: list[str]) -> bool:
        return any(re.match(r'[ "]*[^\W\d]', cell) and cell.strip().lower() not in ("nan", "inf") for cell in cells)

    def _separator(self, line: int, text: str) -> str:
        bare = re.sub(r'"[^"]*"', "", text)
        found = [sign for sign in SEPARATORS if sign in bare]
        if len(found) > 1:
            seen = " and ".join(SEPARATORS[sign] for sign in found)
            self.refuse(line, f"{seen} in the header; allowed: one separator, or names in quotes")
        return found[0] if found else ","

    def _rows(self, lines: list[str], after: int, separator: str) -> Iterator[tuple[int, list[str]]]:
        """Yield line number and cells of every line that is neither blank nor a comment."""
        reader = csv.reader(self._sound(lines, after), delimiter=separator, skipinitialspace=True)
        while True:
            try:
                row = next(reader)
            except StopIteration:
                return
            except csv.Error as problem:
                line = after + reader.line_num
                raise self.error(f"{self.file}: line {line}: {problem}", file=self.file, line=line) from problem
            cells = [cell.strip() for cell in row]
            if any(cells) and not cells[0].startswith(COMMENTS):
                yield after + reader.line_num, cells

    def _sound(self, lines: list[str], after: int) -> Iterator[str]:
        """Lines with their quotes in pairs; a comment may hold any."""
        for number in range(after, len(lines)):
            line = lines[number]
            if '"' in line:
                if line.lstrip(" ").startswith(COMMENTS):
                    line = ""
                elif line.count('"') % 2:
                    self.refuse(number + 1, f"{shown(line)}: a quote that is not closed")
            yield line + "\n"

    def _refuse_length(self, line: int, cells: list[str], wanted: int, separator: str) -> NoReturn:
        hint = ""
        if separator == "," and len(cells) == 2 * wanted:
            hint = "; decimal commas need semicolons or tabs between cells"
        else:
            others = [name for sign, name in SEPARATORS.items() if sign != separator and sign in "".join(cells)]
            if len(cells) == 1 and others:
                hint = f"; {' and '.join(others)} in this line, {SEPARATORS[separator]} in the header"
        self.refuse(line, f"{len(cells)} cells; allowed: {wanted}, as in the header{hint}")

    def _is_unit_row(self, cells: list[str]) -> bool:
        """Whether the first line behind the header says units: no number in it, and a known unit."""
        bare = [cell.strip("[]() ") for cell in cells]
        if any(_NUMBER.fullmatch(cell.replace(",", ".")) for cell in bare):
            return False
        return any(cell in UNITS for cell in bare) and all(cell in UNITS or not cell for cell in bare)

    def _number(self, line: int, name: str, cell: str) -> float:
        text = cell
        if "," in cell:
            self.comma = self.comma or (line, name, cell)
            self.grouped = self.grouped and _GROUPED.fullmatch(cell) is not None
            text = cell.replace(",", ".") if "." not in cell and cell.count(",") == 1 else cell
        elif self.point is None and "." in cell:
            self.point = line, name, cell
        try:
            # Python reads 1_000 and digits of other scripts as numbers; in a table they are slips
            number = float("nan") if "_" in text or not text.isascii() else float(text)
        except ValueError:
            number = float("nan")
        if not -np.inf < number < np.inf:
            raise self.error(
                f"{self.file}: line {line}, column {shown(name, quoted=False)}: {shown(cell)}; allowed: a finite"
                f" number{self._why_no_number(cell)}",
                file=self.file,
                line=line,
                column=name,
                value=cell,
            )
        return number

    @staticmethod
    def _why_no_number(cell: str) -> str:
        if re.fullmatch(r"[+-]?\d{1,3}(([.,' ]|\u00a0)\d{3})*[.,]?\d*", cell) and not cell.isdigit():
            return " without signs between thousands"
        return ""

    def _check_decimal(self) -> None:
        if self.comma is None:
            return
        line, name, cell = self.comma
        if self.point is not None:
            other_line, other_name, other = self.point
            self.refuse(
                line,
                f"column {shown(name, quoted=False)}: {shown(cell)} has a decimal comma, and {shown(other)} (line"
                f" {other_line}, column {shown(other_name, quoted=False)}) a point; allowed: one of both",
                column=name,
                value=cell,
            )
        if self.grouped:
            self.refuse(
                line,
                f"column {shown(name, quoted=False)}: {shown(cell)}: a decimal comma, or one between thousands?"
                " allowed: decimal points",
                column=name,
                value=cell,
            )
