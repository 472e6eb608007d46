"""Joint motions from a CSV file, with derivatives as given or from a quintic spline."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray
from workbench.errors import MotionError, did_you_mean
from workbench.motion.base import MAX_SAMPLES, JointMotion, as_times
from workbench.motion.spline import hermite_quintic, interpolating_spline

SPLINE_DEGREE = 5
"""Quintic: its second derivative is a cubic spline, so acceleration is smooth and fourth-order accurate."""

_SHOWN = 40
"""Longest piece of a file's text that a message repeats."""


def from_csv(path: str | Path, columns: Sequence[str] = ("q1", "q2", "q3"), t: ArrayLike | None = None) -> JointMotion:
    """Read a joint motion.

    The file is UTF-8 text with commas between cells. The first line names the columns, in any order: ``t`` in seconds
    (strictly increasing, any spacing) and *columns* in m or rad; then either all of ``qd1 ...`` and ``qdd1 ...``, taken
    as given, or none of them. Blank lines, and lines that begin with ``#``, are skipped.

    Without given derivatives a quintic spline with not-a-knot ends runs through the samples. It returns every position
    exactly. For a smooth motion with spacing h its error is O(h^6) in velocity and O(h^4) in acceleration inside, and
    O(h^5) and O(h^4) with a larger constant within some ten samples of the ends: a sine with 50 samples per period has
    a relative error of acceleration of 4e-7 inside and 1e-4 at the ends, with 200 samples 2e-9 and 4e-7.
    It does not smooth. Errors of size e in the positions, rounding to few digits included, become up to 2 e/h in
    velocity and 8 e/h^2 in acceleration (five times that at the ends): positions rounded to 1e-6 rad every millisecond
    carry some 4 rad/s^2. Write positions with all their digits, or give the derivatives.

    Parameters
    ----------
    path
        The file.
    columns
        Joint columns in actuator order, names that begin with ``q``; ``q1`` has the derivatives ``qd1`` and ``qdd1``.
    t
        Times in seconds to resample to, within the file's; None keeps the file's own. Between samples with given
        derivatives runs the quintic that takes all three of them.

    Returns
    -------
    JointMotion
        Its `consistency` says how well given derivatives fit the positions; no value of it is refused here.

    Raises
    ------
    MotionError
        The file cannot be read; a column is unknown, missing or named twice; a line has another number of cells than
        the header, a cell is not a finite number, time does not increase; fewer than 6 samples without derivatives (1
        with them, 2 to resample); or *t* reaches outside the file. The message names file, line, column and value.
    """
    file = str(path)
    groups = _column_groups(columns)
    names, lines, values = _read(file, groups)
    times = values[:, names.index("t")]
    _check_increasing(file, times, lines)
    given = groups[1][0] in names
    least = SPLINE_DEGREE + 1 if not given else 1 if t is None else 2
    if len(times) < least:
        why = "without qd and qdd columns" if not given else "to resample" if t is not None else "of any file"
        _refuse(f"{file}: {len(times)} samples; allowed: at least {least} {why}", file=file, value=len(times))
    arrays = [values[:, [names.index(name) for name in group]] for group in groups[: 3 if given else 1]]
    grid = times if t is None else _grid_inside(file, t, times)
    if given and t is None:
        return JointMotion(times, *arrays)
    # times from the first sample on: a clock that counts from long ago would cost digits in the spline
    elapsed = times - times[0]
    try:
        curve = hermite_quintic(elapsed, *arrays) if given else interpolating_spline(elapsed, arrays[0], SPLINE_DEGREE)
        q, qd, qdd = (np.asarray(curve(grid - times[0], nu=order)) for order in range(3))
        return JointMotion(grid, q, qd, qdd)
    except MotionError as error:
        raise MotionError(f"{file}: {error}", **{**error.facts, "file": file}) from error


def _column_groups(columns: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    if isinstance(columns, str) or not columns or any(not name.startswith("q") for name in columns):
        raise MotionError(f"columns = {columns!r}; allowed: a list of names that begin with q", value=columns)
    groups = tuple(tuple(prefix + name[1:] for name in columns) for prefix in ("q", "qd", "qdd"))
    if len({name for group in groups for name in group}) < 3 * len(columns):
        raise MotionError(
            f"columns = {columns!r}; allowed: names that differ, from the derivatives' too", value=columns
        )
    return groups


def _read(file: str, groups: Sequence[Sequence[str]]) -> tuple[list[str], list[int], FloatArray]:
    """Return the header's names, each sample's line number, and the cells ``(n, columns)``."""
    try:
        # utf-8-sig: spreadsheets begin their UTF-8 files with a byte order mark
        with open(file, encoding="utf-8-sig", newline="") as stream:
            rows = _rows(file, csv.reader(stream))
            header = next(rows, None)
            if header is None:
                _refuse(f"{file}: no header line; allowed: {_header_text(groups)}", file=file)
            names = _checked_header(file, *header, groups)
            lines: list[int] = []
            values: list[list[float]] = []
            for line, cells in rows:
                if len(lines) == MAX_SAMPLES:
                    _refuse(f"{file}: line {line}: more samples than allowed: {MAX_SAMPLES}", file=file, line=line)
                lines.append(line)
                values.append(_numbers(file, line, names, cells))
    except OSError as error:
        raise MotionError(f"{file}: cannot be read: {error.strerror or error}", file=file) from error
    except UnicodeDecodeError as error:
        raise MotionError(f"{file}: not UTF-8 text (byte {error.start})", file=file) from error
    except ValueError as error:  # a null character in the path
        raise MotionError(f"{file!r}: cannot be read: {error}", file=file) from error
    return names, lines, np.array(values, dtype=np.float64).reshape(len(lines), len(names))


def _rows(file: str, reader: Any) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and cells of every line that is neither blank nor a comment."""
    while True:
        try:
            row = next(reader)
        except StopIteration:
            return
        except csv.Error as error:
            raise MotionError(f"{file}: line {reader.line_num}: {error}", file=file, line=reader.line_num) from error
        cells = [cell.strip() for cell in row]
        if any(cells) and not cells[0].startswith("#"):
            yield reader.line_num, cells


def _checked_header(file: str, line: int, names: list[str], groups: Sequence[Sequence[str]]) -> list[str]:
    where = f"{file}: line {line}"
    valid = ["t", *(name for group in groups for name in group)]
    for name in names:
        if name not in valid:
            hint = did_you_mean(name, valid) if len(name) <= _SHOWN else "; allowed: commas between short names"
            _refuse(f"{where}: unknown column {_shown(name)}{hint}", file=file, line=line, column=name)
        if names.count(name) > 1:
            _refuse(f'{where}: column "{name}" stands {names.count(name)} times; allowed: once', file=file, column=name)
    required = ["t", *groups[0]]
    # one derivative column asks for all of them: half a set cannot be taken as given
    if any(name in names for group in groups[1:] for name in group):
        required = valid
    for name in required:
        if name not in names:
            _refuse(f'{where}: column "{name}" is missing; allowed: {_header_text(groups)}', file=file, column=name)
    return names


def _header_text(groups: Sequence[Sequence[str]]) -> str:
    positions, *derivatives = (",".join(group) for group in groups)
    return f"t,{positions} with all or none of {','.join(derivatives)}"


def _numbers(file: str, line: int, names: list[str], cells: list[str]) -> list[float]:
    if len(cells) != len(names):
        _refuse(
            f"{file}: line {line}: {len(cells)} cells; allowed: {len(names)}, as in the header", file=file, line=line
        )
    numbers = []
    for name, cell in zip(names, cells, strict=True):
        try:
            # Python reads 1_000 as a number; in a table it is a slip
            number = float("nan") if "_" in cell else float(cell)
        except ValueError:
            number = float("nan")
        if not math.isfinite(number):
            _refuse(
                f"{file}: line {line}, column {name}: {_shown(cell)}; allowed: a finite number",
                file=file,
                line=line,
                column=name,
                value=cell,
            )
        numbers.append(number)
    return numbers


def _check_increasing(file: str, times: FloatArray, lines: list[int]) -> None:
    falls = np.diff(times) <= 0.0
    if falls.any():
        row = int(np.argmax(falls)) + 1
        _refuse(
            f"{file}: line {lines[row]}, column t: {times[row]:.12g} s after {times[row - 1]:.12g} s; "
            "allowed: strictly increasing",
            file=file,
            line=lines[row],
            column="t",
            value=float(times[row]),
        )


def _grid_inside(file: str, t: ArrayLike, times: FloatArray) -> FloatArray:
    grid = as_times(t)
    for moment in (grid[0], grid[-1]):
        if not times[0] <= moment <= times[-1]:
            _refuse(
                f"{file}: t = {moment:g} s is outside the file; allowed: {times[0]:g} s to {times[-1]:g} s",
                file=file,
                column="t",
                value=float(moment),
            )
    return grid


def _shown(text: str) -> str:
    # repr escapes what would disturb a terminal
    return f'"{repr(text[:_SHOWN])[1:-1]}{"..." if len(text) > _SHOWN else ""}"'


def _refuse(message: str, **facts: Any) -> NoReturn:
    raise MotionError(message, **facts)
