"""What the formulas cost, beside what was printed: part of a report's head, since it differs from run to run."""

from __future__ import annotations

from workbench.report.manifest import Manifest
from workbench.report.tables import Cell, Table, columns
from workbench.report.text import exact


def cost_table(manifest: Manifest) -> Table | None:
    """Computing cost of each candidate, microseconds per sample, and its authors' where they printed one."""
    candidates = manifest.candidates
    measured = {name: record for name, record in candidates.items() if record.cost_us is not None}
    if not measured:
        return None
    printed = any(record.printed_cost is not None for record in measured.values())
    rows = []
    for name, record in measured.items():
        assert record.cost_us is not None
        row = [Cell(name), Cell(record.mass_model), Cell(exact(record.cost_us, 2), record.cost_us)]
        if printed and record.printed_cost is None:
            row += [Cell(), Cell(), Cell()]
        elif record.printed_cost is not None:
            us = record.printed_cost.us
            ratio = us / record.cost_us
            row += [Cell(exact(us), us), Cell(_two_digits(ratio), ratio), Cell(record.printed_cost.source)]
        rows.append(tuple(row))
    numbers = ["Here, µs", "Printed, µs", "Printed : here"]
    titles = ["Candidate", "Mass model", *(numbers if printed else numbers[:1]), *(["Source"] if printed else [])]
    reading = (
        "median over some calls in one thread on the machine that is named above, with 5,000 samples each; formulas"
        " from a user's own file, with the samples of the cases."
    )
    if printed:
        reading += (
            " The printed figures were taken by the authors, on their machine and in their language: what can be"
            " compared are orders of magnitude, and the ratio between two mass models in one column."
        )
    shows = "Computing cost: what one sample of inverse dynamics takes."
    return Table("cost", shows, columns(titles, numbers), tuple(rows), reading)


def _two_digits(number: float) -> str:
    rounded = float(f"{number:.2g}")
    return f"{rounded:,.0f}" if rounded >= 10 else f"{rounded:g}"
