"""Tables of numbers as spreadsheets and other programs write them: separators, decimal commas, units, comments.

`read_table` turns a file into names, units and floats; whose columns they are is the caller's business.
"""

from workbench.delimited.columns import Column, find_columns
from workbench.delimited.read import Table, parse_table, read_regular, read_table
from workbench.delimited.units import factor_of, split_unit

__all__ = [
    "Column",
    "Table",
    "factor_of",
    "find_columns",
    "parse_table",
    "read_regular",
    "read_table",
    "split_unit",
]
