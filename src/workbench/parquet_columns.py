"""Columns of a Parquet file: written; and read, judged by what the file says of itself: somebody may have edited it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from workbench.arrays import FloatArray
from workbench.errors import OutputError
from workbench.reading import read_bytes
from workbench.records import short

NUMPY_TYPES = {pa.int64(): np.int64, pa.float64(): np.float64}
MOST_VALUES = 200_000_000
"""Rows times columns that are read at once, 1.6 GB: ten bytes of a file can stand for a million rows."""


def column_bytes(columns: Mapping[str, FloatArray]) -> bytes:
    """Return a Parquet file of some columns ``(n,)``, NaN as a gap; the same numbers give the same bytes."""
    table = pa.table({name: _column(values) for name, values in columns.items()})
    buffer = pa.BufferOutputStream()  # Arrow opens no file whose name is not UTF-8
    # a dictionary of numbers that hardly repeat makes files larger and takes most of the time
    pq.write_table(table, buffer, use_dictionary=False, write_page_checksum=True)
    content: bytes = buffer.getvalue().to_pybytes()
    return content


def _column(values: np.ndarray) -> pa.Array:
    """A column of float32 as such and all else as float64, NaN as a gap; `pyarrow.array` imports pandas first."""
    single = values.dtype == np.float32
    numbers = np.ascontiguousarray(values, dtype=np.float32 if single else np.float64)
    gaps = np.isnan(numbers)
    known = pa.py_buffer(np.packbits(~gaps, bitorder="little")) if gaps.any() else None
    return pa.Array.from_buffers(pa.float32() if single else pa.float64(), len(numbers), [known, pa.py_buffer(numbers)])


def table_of(columns: Mapping[str, Sequence[Any]], schema: pa.Schema) -> pa.Table:
    """Return a table of texts, whole numbers and numbers, None as a gap; `pyarrow.table` imports pandas for it."""
    return pa.table([_array(columns[field.name], field.type) for field in schema], schema=schema)


def _array(values: Sequence[Any], kind: pa.DataType) -> pa.Array:
    known = np.array([value is not None for value in values], dtype=np.bool_)
    gaps = None if known.all() else pa.py_buffer(np.packbits(known, bitorder="little"))
    if kind == pa.string():
        pieces = [b"" if value is None else value.encode() for value in values]
        ends = np.cumsum([0, *map(len, pieces)])
        if ends[-1] > np.iinfo(np.int32).max:
            raise ValueError(f"a column of {ends[-1]} bytes of text; allowed: {np.iinfo(np.int32).max}")
        buffers = [gaps, pa.py_buffer(ends.astype(np.int32)), pa.py_buffer(b"".join(pieces))]
        return pa.Array.from_buffers(kind, len(pieces), buffers)
    numbers = np.array([0 if value is None else value for value in values], dtype=NUMPY_TYPES[kind])
    return pa.Array.from_buffers(kind, len(numbers), [gaps, pa.py_buffer(numbers)])


def read_columns(
    path: Path,
    names: Sequence[str] | None,
    largest: int,
    texts: Collection[str] = (),
    indices: Collection[str] = (),
    rows: int | None = None,
) -> pa.Table:
    """Read columns of a Parquet file of a run directory.

    Parameters
    ----------
    path
        The file.
    names
        Columns that are read; None is all of them.
    largest
        Bytes of the file that are read.
    texts, indices
        Columns of texts, and of whole numbers without a gap; all others hold numbers.
    rows
        How many rows there are to be; None where nobody knows.

    Raises
    ------
    FileNotFoundError
        It is missing.
    OutputError
        One line that names the file and the column: unreadable, missing, there twice, of another type, too many rows.
    """
    try:
        # read_table of a Python file leaves threads behind that abort an interpreter which ends soon after
        with pq.ParquetFile(pa.BufferReader(read_bytes(path, largest)), page_checksum_verification=True) as file:
            chosen = _judged(path, file, names, texts, indices, rows)
            table = file.read(columns=chosen, use_threads=False)
            if table.num_rows != file.metadata.num_rows:  # of its parts' counts, which no checksum covers
                raise ValueError(f"{table.num_rows} rows in its parts, {file.metadata.num_rows} in all")
    except FileNotFoundError:
        raise
    except (OSError, ValueError, pa.ArrowException) as error:
        raise OutputError(f"{path}: not a readable Parquet file ({short(error)})") from error
    for name in indices:
        if table.column(name).null_count:
            raise OutputError(f'{path}: column "{name}" has gaps; allowed: whole numbers', column=name)
    return table


def _is_text(kind: pa.DataType) -> bool:
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))


def _judged(
    path: Path,
    file: pq.ParquetFile,
    names: Sequence[str] | None,
    texts: Collection[str],
    indices: Collection[str],
    rows: int | None,
) -> list[str]:
    schema = file.schema_arrow  # made anew whenever it is asked for
    known = schema.names
    chosen = list(known if names is None else names)
    for name in chosen:
        if known.count(name) != 1:
            found = f"stands {known.count(name)} times" if name in known else "is missing"
            raise OutputError(f'{path}: column "{name[:60]}" {found}', column=name)
        kind = schema.field(name).type
        if name in texts:
            fits, allowed = _is_text(kind.value_type if pa.types.is_dictionary(kind) else kind), "texts"
        elif name in indices:
            fits, allowed = pa.types.is_integer(kind), "whole numbers"
        else:
            fits = pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind)
            allowed = "numbers"
        if not fits:
            raise OutputError(
                f'{path}: column "{name[:60]}" is of type {str(kind)[:60]}; allowed: {allowed}', column=name
            )
    count = file.metadata.num_rows
    if rows is not None and count != rows:
        raise OutputError(f"{path}: {count} rows, where manifest.json has {rows} samples")
    if count * len(chosen) > MOST_VALUES:
        raise OutputError(f"{path}: {count} rows of {len(chosen)} columns; allowed: {MOST_VALUES} values")
    return chosen
