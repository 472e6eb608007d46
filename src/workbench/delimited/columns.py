"""Which column of a table is which quantity, in SI: by exact name, by a name with its unit, by other spellings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from workbench.arrays import FloatArray
from workbench.delimited.read import Table, shown
from workbench.delimited.units import UNITS, factor_of, spellings_of
from workbench.errors import WorkbenchError

TIME = ("t", "time")
"""Names of the column of times, capitals or not."""


@dataclass(frozen=True)
class Column:
    """A wanted quantity and where the table has it."""

    name: str
    """by which the caller asked"""
    index: int
    factor: float
    """SI worth of one in the table"""

    def si(self, table: Table) -> FloatArray:
        """The column's numbers in SI, ``(n,)``."""
        values: FloatArray = table.values[:, self.index]
        return values if self.factor == 1.0 else values * self.factor


def find_columns(table: Table, wanted: Mapping[str, Sequence[str]], error: type[WorkbenchError]) -> dict[str, Column]:
    """Find named quantities among a table's columns.

    Parameters
    ----------
    table
        From `read_table`.
    wanted
        Name -> what it may measure in SI (``s``, ``m``, ``rad/s`` ...); a column without a unit is in SI. ``t`` is also
        found as ``time``. Names with other capitals are found where only one column can be meant.

    Returns
    -------
    dict
        The columns that were found, by wanted name. Others of the table are not looked at.

    Raises
    ------
    WorkbenchError
        *error*: two columns of one name, or a unit that is unknown or measures something else.
    """
    found: dict[str, Column] = {}
    for name, measures in wanted.items():
        places = _places(table, name)
        if len(places) > 1:
            raise error(
                f"{table.file}: line {table.header_line}: column {shown(table.names[places[0]])} stands {len(places)}"
                " times; allowed: once",
                file=table.file,
                column=name,
            )
        if places:
            found[name] = Column(name, places[0], _factor(table, places[0], name, measures, error))
    return found


def _places(table: Table, name: str) -> list[int]:
    """A header that is the name as it stands goes before one that becomes it without its unit."""
    spellings = TIME if name == "t" else (name,)
    for headers, fold in ((table.headers, False), (table.names, False), (table.names, True)):
        places = [
            place
            for place, header in enumerate(headers)
            if (header.lower() in {s.lower() for s in spellings} if fold else header in spellings)
        ]
        if places:
            return places
    return []


def _factor(table: Table, place: int, name: str, measures: Sequence[str], error: type[WorkbenchError]) -> float:
    # a name that ends like a unit is a name where the caller knows it as one
    unit = table.line_units[place] or (None if table.headers[place] == name else table.header_units[place])
    if unit is None:
        return 1.0
    for kind in measures:
        factor = factor_of(unit, kind)
        if factor is not None:
            return factor
    what = f"measures {UNITS[unit][0]}" if unit in UNITS else "is no unit known here"
    allowed = " or ".join(spellings_of(kind) for kind in measures)
    raise error(
        f"{table.file}: line {table.header_line}: column {shown(table.headers[place])}: {shown(unit)} {what};"
        f" allowed: {allowed}",
        file=table.file,
        column=name,
        unit=unit,
    )
