"""What ``workbench model`` prints."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from workbench.reference.check import JointRange, ModelCheck
from workbench.robots.edit import EditResult
from workbench.robots.show import ParameterRow
from workbench.terminal import out

LINES_SHOWN = 12
"""Numbers of changed lines that are listed one by one."""


def print_json(what: Any) -> None:
    """Print a record, or a list of records, as JSON; numbers read back bit-equal."""
    records = [dataclasses.asdict(r) for r in what] if isinstance(what, list) else dataclasses.asdict(what)
    out.print(json.dumps(records, indent=1, ensure_ascii=False), soft_wrap=True, markup=False)


def print_parameters(rows: Sequence[ParameterRow]) -> None:
    """Print the table of parameters."""
    table = _table("name", "value", "unit", "meaning", "MJCF")
    for row in rows:
        place = f"{row.element} {row.attribute}" + (f", line {row.line}" if row.line else "")
        if row.rule != row.name:
            place += f" = {row.rule}"
        table.add_row(Text(row.name), Text(f"{row.value!r}"), Text(row.unit), Text(row.meaning), Text(place))
    out.print(table)


def print_edit(result: EditResult) -> None:
    """Print what an edit changed, and where it was written."""
    if not result.changes:
        out.print(Text(f"Nothing changes: {result.source} has these values already."), soft_wrap=True)
        return
    table = _table("parameter", "before", "after", "unit", "by")
    for change in result.changes:
        by = f"x {change.after / change.before:.6g}" if change.before else ""
        table.add_row(*map(Text, (change.name, f"{change.before!r}", f"{change.after!r}", change.unit, by)))
    out.print(table)
    lines = ", ".join(str(line) for line in result.lines[:LINES_SHOWN])
    more = f" and {len(result.lines) - LINES_SHOWN} more" if len(result.lines) > LINES_SHOWN else ""
    word = "line" if len(result.lines) == 1 else "lines"
    out.print(Text(f"{result.written}: {len(result.lines)} {word} changed ({lines}{more})"), soft_wrap=True)
    if result.stale:
        where = f"line{'s' if len(result.stale) > 1 else ''} {', '.join(map(str, result.stale))}"
        out.print(
            Text(f"comments in {where} still name a number as it was before; change them by hand", style="yellow"),
            soft_wrap=True,
        )
    for warning in result.warnings:
        out.print(Text(f"warning: {warning}", style="yellow"), soft_wrap=True)


def print_check(found: ModelCheck, everything: bool = False) -> None:
    """Print what was found out about a model; what is broken comes last, one line each.

    Assumptions that hold are counted, and listed with *everything* only.
    """
    out.print(Text(f"{found.file}: {found.mechanism or 'no closed form named'}", style="bold"), soft_wrap=True)
    facts = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    facts.add_column(no_wrap=True)
    facts.add_column()
    for name, value in _facts(found):
        facts.add_row(Text(name), Text(value))
    out.print(facts)
    shown = [a for a in found.assumptions if everything or not a.ok]
    if shown:
        table = _table("", "assumption", "where", "value", "needed")
        for a in shown:
            mark = Text("ok", style="green") if a.ok else Text("BROKEN", style="bold red")
            table.add_row(mark, Text(a.name), Text(a.where), Text(a.value), Text(a.limit))
        out.print(table)
    for line in found.broken:
        out.print(Text(f"broken: {line}", style="red"), soft_wrap=True)
    count = sum(a.ok for a in found.assumptions)
    if found.broken:
        out.print(Text(f"BROKEN: {len(found.broken)}; {count} assumptions hold.", style="bold red"))
    else:
        kept = f"{count} assumptions hold" if found.assumptions else "there is no closed form to hold it against"
        out.print(Text(f"OK: the loops close, {kept}.", style="bold green"))


def _facts(found: ModelCheck) -> list[tuple[str, str]]:
    facts = []
    mobility = found.mobility
    if mobility is not None:
        spin = f" - {mobility.idle_freedoms} idle" if mobility.idle_freedoms else ""
        facts.append(
            (
                "mobility by rank",
                f"{mobility.mobility} = {mobility.joint_freedoms} joint freedoms - rank {mobility.rank}{spin}",
            )
        )
        if found.mechanism:
            formula = "; ".join(f"{name}: {value}" for name, value in found.mobility_count.items())
            facts.append(("mobility by formula", formula or "the paper gives none"))
        facts.append(
            ("redundant rows", f"{mobility.redundant_rows} of {mobility.constraint_rows} rows of the loop closures")
        )
        bodies = f": spin of {', '.join(found.idle_bodies)}" if found.idle_bodies else ""
        facts.append(("idle freedoms", f"{mobility.idle_freedoms}{bodies}"))
    if found.closure_residual is not None:
        facts.append(("loops at home", f"open by {found.closure_residual:.2g} m at most"))
    if found.platform_gap is not None:
        facts.append(("platform", f"{found.platform_gap:.2g} m from where the closed form puts it at most"))
    facts += [(f"range of {r.joint}", _range(r)) for r in found.ranges]
    facts += [("MuJoCo warns", warning) for warning in found.warnings] or [("MuJoCo warns", "of nothing")]
    return facts


def _range(found: JointRange) -> str:
    lower, upper = f"{found.lower:.4f}", f"{found.upper:.4f}"
    unit = f"{found.unit}, the others at home"
    if found.lower_open and found.upper_open:
        return f"no end found in {lower} to {upper} {unit}"
    if found.lower_open or found.upper_open:
        return f"up to {upper} {unit}" if found.lower_open else f"from {lower} {unit}"
    return f"{lower} to {upper} {unit}"


def _table(*columns: str) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        number = column in ("value", "before", "after") and columns[0] != ""
        table.add_column(column, overflow="fold", justify="right" if number else "left")
    return table
