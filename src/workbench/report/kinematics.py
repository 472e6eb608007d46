"""A user's kinematics against the reference, as a table of a case."""

from __future__ import annotations

from workbench.report.manifest import CaseRecord
from workbench.report.tables import Cell, Table, columns, verdict_status
from workbench.report.text import exact, scientific


def kinematics_table(record: CaseRecord, anchor: str) -> Table:
    """Each coordinate of each formula; empty where none was offered."""
    names = ("Coordinate", "Formula", "Kind", "Error", "Bound", "Verdict")
    rows = tuple(
        (
            Cell(row.coordinate),
            Cell(row.name),
            Cell(row.kind),
            Cell("not finite" if row.error is None else scientific(row.error), row.error, emphasis=True),
            Cell(exact(row.bound), row.bound),
            Cell(status=verdict_status(row.verdict)),
        )
        for row in record.kinematics_checks
    )
    return Table(
        f"{anchor}-kinematics",
        "Verification of kinematics: formulas against the reference, same pose.",
        columns(names, numeric=("Error", "Bound")),
        rows,
        "Largest error over the case, over the largest value of the coordinate's unit there (m and rad apart); of a"
        " Jacobian's row, over its largest entry.",
    )
