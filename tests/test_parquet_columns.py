"""Columns of numbers as Parquet: those that Arrow itself would make of them, and nothing loaded for that."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from workbench.arrays import FloatArray
from workbench.parquet_columns import column_bytes, table_of
from workbench.sweep.files import table_bytes

COLUMNS: dict[str, FloatArray] = {
    "plain": np.array([0.1, -0.0, 5e-324, 1e38, np.inf, -np.inf, 2.0**53 + 1, 3.0, 4.0]),
    "gaps": np.array([np.nan, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, np.nan]),
    "nothing": np.full(9, np.nan),
    "step": np.arange(27.0).reshape(9, 3)[:, 1],
    "backwards": np.arange(9.0)[::-1],
}


def test_the_bytes_are_those_of_arrow() -> None:
    columns = COLUMNS | {name + "_single": values.astype(np.float32) for name, values in COLUMNS.items()}
    for some in (columns, {"none": np.empty(0)}, {}):
        table = pa.table({name: pa.array(values, from_pandas=True) for name, values in some.items()})
        sink = pa.BufferOutputStream()
        pq.write_table(table, sink, use_dictionary=False, write_page_checksum=True)
        assert column_bytes(some) == sink.getvalue().to_pybytes()


def test_other_numbers_are_kept_as_they_are() -> None:
    found = pq.read_table(pa.BufferReader(column_bytes({"a": np.array([True, False]), "b": np.array([3, 2**40])})))
    assert found.to_pydict() == {"a": [1.0, 0.0], "b": [3.0, 2.0**40]}


def test_pandas_is_not_loaded() -> None:
    code = (
        "import sys, numpy as np; from workbench.parquet_columns import column_bytes;"
        " column_bytes({'a': np.ones(3), 'b': np.full(3, np.nan)}); print('pandas' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.strip() == "False"


def test_tables_are_those_that_arrow_makes_by_itself() -> None:
    columns = {
        "text": ["a", None, "äöü €", "", "x" * 300],
        "whole": [1, -(2**62), 0, 3, 4],
        "number": [0.5, math.nan, None, math.inf, -0.0],
        "left out": [1.0] * 5,
    }
    kinds = {"number": pa.float64(), "text": pa.string(), "whole": pa.int64()}
    schema = pa.schema(list(kinds.items()))
    for rows in (5, 1, 0):
        part = {name: values[:rows] for name, values in columns.items()}
        found, expected = table_of(part, schema), pa.table({name: part[name] for name in kinds}, schema=schema)
        found.validate(full=True)
        assert found.schema == expected.schema
        assert repr(found.to_pylist()) == repr(expected.to_pylist())
        assert table_bytes(found) == table_bytes(expected)
    code = (
        "import sys, pyarrow as pa; from workbench.parquet_columns import table_of;"
        " table_of({'a': ['x', None]}, pa.schema([('a', pa.string())])); assert 'pandas' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
