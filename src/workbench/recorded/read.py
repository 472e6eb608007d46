"""Times, coordinates and torques that another program or a bench wrote: text in any dialect, .mat, .parquet."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from workbench.arrays import FloatArray
from workbench.delimited import Column, Table, factor_of, find_columns, parse_table, read_regular
from workbench.delimited.read import shown
from workbench.delimited.units import spellings_of
from workbench.errors import MotionError, did_you_mean
from workbench.motion.digits import FULL, UNIFORM, rounding_of

MAX_SAMPLES = 100_000


@dataclass(frozen=True)
class Wanted:
    """A column as a campaign names it; empty texts where it leaves that to the file."""

    name: str = ""
    unit: str = ""


@dataclass(frozen=True)
class Written:
    """How a column was written."""

    digits: int
    """`FULL` and more: with all of them"""
    half: float
    """half of its last place, SI; 0 where it has all digits"""

    @property
    def sigma(self) -> float:
        """Standard deviation of its rounding, SI."""
        return self.half * UNIFORM


@dataclass(frozen=True)
class Record:
    """What was read, in SI and in the order of the actuated joints."""

    file: str
    t: FloatArray = field(repr=False)
    """``(n,)``, s; evenly spaced where that is what the file's digits say"""
    q: FloatArray | None = field(repr=False)
    """``(n, na)``; None where the file holds no coordinates"""
    tau: FloatArray | None = field(repr=False)
    """``(n, na)``; None where nobody asked for torques"""
    written_q: tuple[Written, ...]
    written_tau: tuple[Written, ...]
    time_error: float
    """largest rounding of a time, s"""
    notes: tuple[str, ...]


def read_record(
    path: str | Path,
    joints: Sequence[str],
    coordinate_units: Sequence[str],
    force_units: Sequence[str],
    columns: Mapping[str, Wanted],
    torques: bool = True,
) -> Record:
    """Read a table.

    Parameters
    ----------
    path
        ``.csv`` and other text, ``.mat`` (MATLAB 5 to 7.2), ``.parquet``.
    joints, coordinate_units, force_units
        Of the actuated joints; ``m`` or ``rad``, ``N`` or ``N m``.
    columns
        Where a quantity stands under another name: ``t``, a joint or ``q1``, ``tau_JOINT`` or ``tau1``.
    torques
        Whether torques have to be there.

    Raises
    ------
    MotionError
        One line with file, row, column and value.
    """
    names = _Names(tuple(joints))
    _refuse_unknown(str(path), columns, names)
    table = _table(path, tuple(wanted.name for wanted in columns.values() if wanted.name))
    time = _find(table, "t", ("t",), "s", columns)
    if time is None:
        _missing(table, "t")
    t, error, notes = _times(table, time)
    q, written_q = _block(table, names.coordinates, coordinate_units, columns, needed=not torques)
    tau, written_tau = _block(table, names.torques, force_units, columns, needed=True) if torques else (None, ())
    return Record(table.file, t, q, tau, written_q, written_tau, error, tuple(notes))


@dataclass(frozen=True)
class _Names:
    joints: tuple[str, ...]

    @property
    def coordinates(self) -> list[tuple[str, ...]]:
        return [tuple(dict.fromkeys((joint, f"q{i + 1}"))) for i, joint in enumerate(self.joints)]

    @property
    def torques(self) -> list[tuple[str, ...]]:
        return [tuple(dict.fromkeys((f"tau_{joint}", f"tau{i + 1}"))) for i, joint in enumerate(self.joints)]

    @property
    def every(self) -> list[str]:
        return ["t", *(name for group in (*self.coordinates, *self.torques) for name in group)]


def _refuse_unknown(file: str, columns: Mapping[str, Wanted], names: _Names) -> None:
    for key in columns:
        if key not in names.every:
            raise MotionError(f"{file}: columns.{key}: no such quantity{did_you_mean(key, names.every)}", key=key)


# --- files ------------------------------------------------------------------------------------------------------------


def _table(path: str | Path, asked: tuple[str, ...]) -> Table:
    data = read_regular(path, MotionError)
    file, suffix = str(path), Path(path).suffix.lower()
    if suffix == ".mat":
        return _from_variables(_matlab(data, file), file)
    if suffix == ".parquet":
        return _from_variables(_parquet(data, file), file)
    return parse_table(
        _spaced(data, asked), file, MotionError, expected="t, coordinates and torques", most_rows=MAX_SAMPLES
    )


def _spaced(data: bytes, asked: tuple[str, ...]) -> bytes:
    """Turn columns apart by spaces into tabs, and give numbers without a header the names 1, 2, 3 where asked so."""
    lines = data.split(b"\n")
    body = [line for line in lines if line.strip() and not line.lstrip().startswith((b"#", b"%", b"//"))]
    if not body:
        return data
    if not any(sign in body[-1] for sign in (b",", b";", b"\t")) and len(body[-1].split()) > 1:
        lines = [line if line.lstrip().startswith((b"#", b"%", b"//")) else b"\t".join(line.split()) for line in lines]
        body = [line for line in lines if line.strip() and not line.lstrip().startswith((b"#", b"%", b"//"))]
    if asked and all(name.isdigit() for name in asked):
        first = lines.index(body[0])
        sign = next((s for s in (b"\t", b";", b",") if s in body[0]), b",")
        header = sign.join(b"c%d" % (k + 1) for k in range(body[0].strip().count(sign) + 1))
        # in front of the first row on its own line, so that line numbers stay those of the file
        lines[first] = b"\r".join((header, lines[first])) if first == 0 else lines[first]
        if first:
            lines[first - 1] = header
    return b"\n".join(lines)


def _matlab(data: bytes, file: str) -> dict[str, Any]:
    from scipy.io import loadmat

    try:
        found = loadmat(io.BytesIO(data), squeeze_me=False, struct_as_record=False, simplify_cells=True)
    except NotImplementedError:
        raise MotionError(f'{file}: a MATLAB 7.3 file; allowed: up to 7.2 (save it with "-v7")', file=file) from None
    except Exception as error:  # the reader raises whatever a broken file makes of it
        raise MotionError(f"{file}: no MATLAB file that can be read: {error}", file=file) from error
    flat: dict[str, Any] = {}
    for name, value in found.items():
        if name.startswith("__"):
            continue
        members = value.items() if isinstance(value, dict) else [("", value)]
        flat.update({f"{name}.{member}" if member else name: inner for member, inner in members})
    return flat


def _parquet(data: bytes, file: str) -> dict[str, Any]:
    import pyarrow as pa
    from pyarrow import parquet

    try:
        table = parquet.read_table(io.BytesIO(data), page_checksum_verification=True)
        return {name: table.column(name).to_numpy() for name in table.column_names}
    except (pa.ArrowException, OSError, ValueError) as error:
        raise MotionError(f"{file}: no Parquet file that can be read: {error}", file=file) from error


def _from_variables(variables: Mapping[str, Any], file: str) -> Table:
    """Vectors of one length, and matrices with so many rows, as the columns of a table."""
    columns: dict[str, FloatArray] = {}
    for name, value in variables.items():
        array = np.asarray(value)
        if array.dtype.kind not in "fiu" or array.ndim > 2 or array.size == 0:
            continue
        if array.ndim < 2 or 1 in array.shape:
            columns[name.rpartition(".")[2] if "." in name else name] = array.reshape(-1).astype(np.float64)
        else:
            columns |= {f"{name.rpartition('.')[2]}{k + 1}": c.astype(np.float64) for k, c in enumerate(array.T)}
    lengths = {name: len(column) for name, column in columns.items() if len(column) > 1}
    if not lengths:
        raise MotionError(f"{file}: no numeric columns", file=file)
    longest = max(set(lengths.values()), key=list(lengths.values()).count)
    names = [name for name, length in lengths.items() if length == longest]
    if longest > MAX_SAMPLES:
        raise MotionError(f"{file}: {longest} samples; allowed: at most {MAX_SAMPLES}", file=file, value=longest)
    values = np.column_stack([columns[name] for name in names])
    if not np.isfinite(values).all():
        row, column = (int(i) for i in np.argwhere(~np.isfinite(values))[0])
        raise MotionError(
            f"{file}: row {row + 1}, column {names[column]}: {values[row, column]}; allowed: a finite number",
            file=file,
        )
    none = (None,) * len(names)
    return Table(file, tuple(names), tuple(names), none, none, values, tuple(range(1, longest + 1)))


# --- columns ----------------------------------------------------------------------------------------------------------


def _find(
    table: Table, key: str, spellings: Sequence[str], measures: str, columns: Mapping[str, Wanted]
) -> Column | None:
    """A column where the campaign says it is, else under one of its usual names."""
    key = next((spelling for spelling in spellings if spelling in columns), key)
    wanted = columns.get(key)
    if wanted is None or not (wanted.name or wanted.unit):
        for spelling in spellings:
            found = find_columns(table, {spelling: [measures]}, MotionError)
            if spelling in found:
                return found[spelling]
        return None
    name = f"c{wanted.name}" if wanted.name.isdigit() else wanted.name or key
    every = [measures] if not wanted.unit else list(_MEASURES)
    found = find_columns(table, {name: every}, MotionError)
    if name not in found:
        raise MotionError(
            f'{table.file}: line {table.header_line}: no column "{shown(name, quoted=False)}" for {key}'
            f"{did_you_mean(name, table.names)}",
            file=table.file,
            column=name,
        )
    if not wanted.unit:
        return found[name]
    factor = factor_of(wanted.unit, measures)
    if factor is None:
        raise MotionError(
            f'{table.file}: columns.{key}: unit "{wanted.unit}" does not measure {measures}; allowed:'
            f" {spellings_of(measures)}",
            file=table.file,
            column=name,
        )
    return Column(key, found[name].index, factor)


_MEASURES = ("s", "m", "rad", "N", "N m", "m/s", "rad/s", "m/s^2", "rad/s^2", "1")


def _block(
    table: Table,
    groups: list[tuple[str, ...]],
    units: Sequence[str],
    columns: Mapping[str, Wanted],
    needed: bool,
) -> tuple[FloatArray | None, tuple[Written, ...]]:
    """The columns of all joints, or of none."""
    found = [_find(table, group[0], group, unit, columns) for group, unit in zip(groups, units, strict=True)]
    if not needed and not any(found):
        return None, ()
    for group, column in zip(groups, found, strict=True):
        if column is None:
            _missing(table, " or ".join(group))
    written = []
    for column in found:
        assert column is not None
        half, digits = rounding_of(table.values[:, column.index])
        written.append(Written(digits, half * column.factor))
    return np.column_stack([column.si(table) for column in found if column]), tuple(written)


def _missing(table: Table, name: str) -> NoReturn:
    raise MotionError(
        f"{table.file}: line {table.header_line}: column {name} is missing; there are"
        f" {', '.join(shown(n, quoted=False) for n in table.names[:12])}; a campaign's columns say which is which",
        file=table.file,
        column=name,
    )


def _times(table: Table, column: Column) -> tuple[FloatArray, float, list[str]]:
    """Times in seconds, their rounding, and what was made of it."""
    t = column.si(table)
    falls = np.diff(t) <= 0.0
    if falls.any():
        row = int(np.argmax(falls)) + 1
        raise MotionError(
            f"{table.file}: line {table.lines[row]}, column {shown(table.names[column.index], quoted=False)}:"
            f" {t[row]:.12g} s after {t[row - 1]:.12g} s; allowed: strictly increasing",
            file=table.file,
            line=table.lines[row],
        )
    if len(t) < 2:
        raise MotionError(f"{table.file}: {len(t)} samples; allowed: at least 2", file=table.file)
    half, digits = rounding_of(table.values[:, column.index])
    error = half * column.factor
    index = np.arange(len(t), dtype=np.float64)
    step, first = np.polyfit(index, t, 1)
    even = first + step * index
    gap = float(np.abs(t - even).max())
    if gap <= 1e-12 * max(abs(float(t[0])), abs(float(t[-1]))):
        return t, 0.0, []
    if digits < FULL and gap <= 1.2 * error:
        # the line is known to the rounding over the root of the number of samples
        left = 2.0 * error / np.sqrt(len(t))
        return even, left, [f"times of {digits} digits are taken as even, {1e3 * step:.6g} ms apart"]
    return t, error, []
