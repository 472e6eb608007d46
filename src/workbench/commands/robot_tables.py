"""What ``workbench robots`` prints."""

from __future__ import annotations

import json
from collections.abc import Sequence

from rich import box
from rich.table import Table
from rich.text import Text

from workbench.library.page import freedoms, small, verified, workspace
from workbench.library.record import LibraryRecord, RobotFigures
from workbench.library.shelf import Entry
from workbench.terminal import out


def print_list(entries: Sequence[Entry], record: LibraryRecord) -> None:
    """Print a row per robot."""
    table = Table("robot", "topology", "freedoms", "verified", "error", "engines", box=box.SIMPLE_HEAD)
    for entry in entries:
        figures = record.robots.get(entry.name)
        error = small(figures.error) if figures else "–"
        engines = small(figures.spread) if figures else "–"
        cells = (entry.name, entry.card.topology, freedoms(entry), verified(figures), error, engines)
        table.add_row(*map(Text, cells))
    out.print(table)
    lines = (
        "error: exact closed form against MuJoCo, of a joint's peak; engines: Pinocchio against MuJoCo.",
        "workbench robots NAME shows one, with its picture and folder; workbench run --robots NAME checks it.",
    )
    for line in lines:
        out.print(Text(line), soft_wrap=True)


def print_card(entry: Entry, figures: RobotFigures | None) -> None:
    """Print everything that is known of a robot."""
    card, mobility = entry.card, entry.card.mobility
    rows = [
        ("title", entry.robot.spec.title),
        ("topology", card.topology),
        ("driven", " ".join(entry.robot.spec.actuated)),
        ("freedoms", freedoms(entry)),
        ("numbers", card.numbers),
        ("folder", str(entry.folder)),
        ("picture", str(entry.picture or "none")),
        ("campaign", str(entry.campaign)),
        ("formulas", " ".join(map(str, entry.formulas))),
        ("mobility, Gogu", f"{mobility.joints} - {mobility.lost} - {mobility.idle} idle = {mobility.mobility}"),
    ]
    if figures is not None:
        rows += [
            ("mobility, rank", f"{figures.mobility}; {figures.rank} of {figures.rows} rows independent"),
            ("verified", verified(figures)),
            ("error", f"{small(figures.error)} of MuJoCo, {figures.exact}, bound {figures.bound:.0e}"),
            ("engines", f"{small(figures.spread)} between Pinocchio and MuJoCo"),
            ("power balance", small(figures.power)),
            ("replay", "–" if figures.replay is None else "order {:.2f} to {:.2f}".format(*figures.replay)),
            ("cost", "–" if figures.cost_us is None else f"{figures.cost_us:.2g} µs a sample"),
            ("workspace", workspace(figures)),
        ]
        rows += [
            (f"approximation {name}", f"{low:.2g} to {high:.2g} of a joint's peak")
            for name, (low, high) in figures.approximations.items()
        ]
    rows += [("singular", sentence) for sentence in card.singular]
    table = Table.grid(padding=(0, 2))
    for what, text in rows:
        table.add_row(Text(what, style="bold"), Text(text, overflow="fold"))
    out.print(table)


def print_json(entries: Sequence[Entry], record: LibraryRecord) -> None:
    """Print cards and figures, robot by robot."""
    found = [
        {
            "name": entry.name,
            "title": entry.robot.spec.title,
            "folder": str(entry.folder),
            "picture": str(entry.picture) if entry.picture else None,
            "coordinates": list(entry.robot.spec.platform.task),
            "actuated": entry.robot.spec.actuated,
            "card": entry.card.model_dump() | {"mobility_gogu": entry.card.mobility.mobility},
            "figures": figures.model_dump() if (figures := record.robots.get(entry.name)) else None,
        }
        for entry in entries
    ]
    out.print(json.dumps(found, indent=1, ensure_ascii=False), soft_wrap=True, markup=False)
