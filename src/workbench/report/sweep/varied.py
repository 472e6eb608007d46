"""What a sweep varied: the numbers, their ranges, how they were chosen, what was left out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from workbench.report.section import Section
from workbench.report.sweep.load import SweepRun
from workbench.report.sweep.summary import KeyRecord
from workbench.report.sweep.verdict import number
from workbench.report.tables import Cell, Table, columns
from workbench.report.text import exact, pretty_unit, with_unit

METHODS = {
    "sobol": "scrambled Sobol points",
    "latin_hypercube": "a Latin hypercube",
    "grid": "a grid: every combination",
    "list": "a list: the first values of all keys, the second ones, ...",
}
SEEDED = ("sobol", "latin_hypercube")


def scale_of(run: SweepRun, key: str) -> str:
    """Return ``log`` where a key is spread by equal factors, else ``linear``."""
    return str(_vary(run).get(key, {}).get("scale") or "linear")


def range_of(run: SweepRun, key: str, low: float, high: float) -> tuple[float, float]:
    """Return the range that the campaign gives a key; where it gives none, that of the values, *low* to *high*."""
    entry = _vary(run).get(key, {})
    first, last = entry.get("low"), entry.get("high")
    if isinstance(first, int | float) and isinstance(last, int | float) and first <= low and high <= last:
        return float(first), float(last)
    return low, high


def label_of(key: KeyRecord) -> str:
    """Return the name of a key with its unit, for axes and headings: ``m2 [factor]``, ``payload [kg]``."""
    unit = "factor" if key.factor else pretty_unit(key.unit) if key.unit not in ("", "1") else ""
    return f"{key.name} [{unit}]" if unit else key.name


def varied_section(run: SweepRun) -> Section:
    """List every varied number with its range, and how the cases were chosen."""
    summary = run.summary
    rows = tuple(
        (
            Cell(key.name),
            Cell(key.meaning),
            *(Cell(exact(limit, 3), limit) for limit in range_of(run, key.key, key.low, key.high)),
            Cell("factor" if key.factor else pretty_unit(key.unit) if key.unit not in ("", "1") else "–"),
            Cell(_base(key)),
            Cell(scale_of(run, key.key)),
        )
        for key in summary.keys
    )
    seed = f", seed {summary.seed}" if summary.method in SEEDED else ""
    method = METHODS.get(summary.method, summary.method)
    names = ("Number", "Meaning", "Lowest", "Highest", "Unit", "Factor of", "Scale")
    table = Table(
        "varied",
        f"What differs from case to case: {number(summary.cases)} cases, chosen by {method}{seed}.",
        columns(names, numeric=("Lowest", "Highest")),
        rows,
        "A factor multiplies what stands under “Factor of”; a "
        "logarithmic scale has as many cases per factor as per any other equal factor." + _filter_text(run),
    )
    return Section("varied", "What was varied", "tables", {"tables": [table]})


def _base(key: KeyRecord) -> str:
    values = {with_unit(exact(value, 6), _unit_of_base(key)) for value in key.base.values()}
    if not key.factor:
        return "–"
    return ", ".join(sorted(values)) if values else "the case's own"


def _unit_of_base(key: KeyRecord) -> str:
    return "" if key.factor else key.unit


def _filter_text(run: SweepRun) -> str:
    found = _sweep(run).get("filter")
    if not isinstance(found, Mapping):
        return ""
    said = []
    if found.get("inside_workspace"):
        said.append("motions that the closed form cannot follow")
    if isinstance(found.get("singularity"), int | float):
        said.append(f"motions whose least scaled determinant is below {exact(found['singularity'])}")
    return f" Left out: {' and '.join(said)}." if said else ""


def _sweep(run: SweepRun) -> Mapping[str, Any]:
    found = run.manifest.spec.get("sweep")
    return found if isinstance(found, Mapping) else {}


def _vary(run: SweepRun) -> dict[str, Mapping[str, Any]]:
    entries = _sweep(run).get("vary")
    known = [entry for entry in entries if isinstance(entry, Mapping)] if isinstance(entries, list) else []
    return {str(entry.get("key")): entry for entry in known}
