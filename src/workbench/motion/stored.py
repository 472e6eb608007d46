"""The time series of a run read back as a motion: `series/CASE.parquet`, or a table made from it."""

from __future__ import annotations

import io
import re

import numpy as np

from workbench.delimited import Table
from workbench.errors import MotionError

PARQUET = b"PAR1"
"""How a Parquet file begins."""

_SERIES = re.compile(r"x(d{0,2})\d+|(ref|cand|rec|band|part|reaction|point|tau)_.+|closure_residual")
"""Columns of a run's series that are no part of a joint motion (docs/run-directory.md)."""

_MOTION = re.compile(r"t|[qx]d{0,2}\d+")


def is_series_column(name: str) -> bool:
    """Whether a column belongs to a run's series and not to the motion."""
    return _SERIES.fullmatch(name) is not None


def parquet_table(data: bytes, file: str, most_rows: int) -> Table:
    """Return the columns of a motion, joint and platform, of a Parquet file.

    Raises
    ------
    MotionError
        No Parquet file, a column that is no list of finite numbers, or more samples than allowed.
    """
    import pyarrow as pa
    from pyarrow import parquet

    try:
        stored = parquet.ParquetFile(io.BytesIO(data), page_checksum_verification=True)
        names = [name for name in stored.schema_arrow.names if _MOTION.fullmatch(name)]
        rows = stored.metadata.num_rows
        if rows > most_rows:
            raise MotionError(f"{file}: {rows} samples; allowed: at most {most_rows}", file=file, value=rows)
        table = stored.read(columns=names)
        columns = [np.asarray(table.column(name).to_numpy(), dtype=np.float64) for name in names]
    except (pa.ArrowException, OSError, ValueError, TypeError) as error:
        raise MotionError(f"{file}: no Parquet file that can be read: {error}", file=file) from error
    for name, column in zip(names, columns, strict=True):
        if not np.isfinite(column).all():
            row = int(np.argmin(np.isfinite(column)))
            raise MotionError(
                f"{file}: row {row + 1}, column {name}: {column[row]}; allowed: a finite number", file=file, column=name
            )
    none = (None,) * len(names)
    values = np.column_stack(columns) if columns else np.zeros((rows, 0))
    return Table(file, tuple(names), tuple(names), none, none, values, tuple(range(1, rows + 1)))
