"""``docs/library.md``: the sum table and a card per robot, made from cards, robot files and the record."""

from __future__ import annotations

from collections.abc import Sequence

from workbench.library.record import LibraryRecord, RobotFigures
from workbench.library.shelf import Entry

HEAD = """# Library of robots

Robots that come with the workbench, each a folder as [robots.md](robots.md) explains, with the derivation in its
README. This page is generated (`make library`); the figures stand in [library.json](../examples/library.json) too.

```
workbench robots                     this table, on a terminal
workbench robots NAME                one of them
workbench robots NAME --copy DIR     its folder, to change
workbench run --robots all           check the whole library: exit code 0 where every bound holds
```
"""

TABLE = """
Errors are of the exact closed form, the largest over joints and cases, as a share of a joint's peak. *Engines* is the
largest difference of Pinocchio's torques from MuJoCo's. *Power* is what is left of the power balance, of peak power;
*replay* the order at which a forward simulation with the formula's torques converges with the time step. *Cost* is the
exact form's, in numpy. *Mobility* is by Gogu's count and by rank; *rank* is independent rows of all rows of the model's
loop constraints. *Nearest to singular* is the smallest scaled determinant over the campaign, 1 far away, 0 singular.
*Workspace* is at the home attitude within the joints' ranges, its error half of the border cells.
"""

COLUMNS = (
    "robot", "topology", "freedoms", "verified", "error, MuJoCo", "engines", "power", "replay", "cost, µs a sample",
    "mobility, Gogu = rank", "rank", "nearest to singular", "workspace",
)  # fmt: skip

WORDS = {
    "forward kinematics": "forward kinematics",
    "inverse kinematics": "inverse kinematics",
    "jacobian": "Jacobian",
}


def freedoms(entry: Entry) -> str:
    """The task coordinates of a robot, or that it has one freedom."""
    return "one" if entry.card.kind == "one freedom" else " ".join(entry.robot.spec.platform.task)


def verified(figures: RobotFigures | None) -> str:
    """What of a robot is held against MuJoCo."""
    if figures is None:
        return "not yet"
    return ", ".join(["torques", *(WORDS[kind] for kind in WORDS if kind in figures.kinematics)])


def small(value: float | None) -> str:
    """A small number in two digits, or a dash."""
    return "–" if value is None else f"{value:.1e}"


def workspace(figures: RobotFigures | None) -> str:
    """Volume, area or length with its error."""
    found = figures.workspace if figures else None
    return "–" if found is None else f"{found.amount:.3g} ± {found.error:.1g} {found.unit}"


def row(entry: Entry, figures: RobotFigures | None) -> tuple[str, ...]:
    """The cells of a robot, in the order of `COLUMNS`."""
    count = entry.card.mobility.mobility
    if figures is None:
        return (entry.name, entry.card.topology, freedoms(entry), "not yet", *["–"] * 5, f"{count}", "–", "–", "–")
    replay = "–" if figures.replay is None else "{:.2f} to {:.2f}".format(*figures.replay)
    cost = "–" if figures.cost_us is None else f"{figures.cost_us:.2g}"
    agree = "=" if count == figures.mobility else "≠"
    return (
        entry.name, entry.card.topology, freedoms(entry), verified(figures), small(figures.error),
        small(figures.spread), small(figures.power), replay, cost, f"{count} {agree} {figures.mobility}",
        f"{figures.rank} of {figures.rows}", "–" if figures.singular is None else f"{figures.singular:.2g}",
        workspace(figures),
    )  # fmt: skip


def page(entries: Sequence[Entry], record: LibraryRecord) -> str:
    """The whole page, Markdown."""
    lines = [HEAD, _table(entries, record), TABLE]
    if record.versions:
        lines.append("With " + ", ".join(f"{name} {version}" for name, version in record.versions.items()) + ".\n")
    lines += [_card(entry, record.robots.get(entry.name)) for entry in entries]
    return "\n".join(lines)


def _table(entries: Sequence[Entry], record: LibraryRecord) -> str:
    cells = [row(entry, record.robots.get(entry.name)) for entry in entries]
    linked = [(f"[{first}](#{first})", *rest) for first, *rest in cells]
    head = [" | ".join(COLUMNS), " | ".join("---" for _ in COLUMNS)]
    body = [" | ".join(cells).replace("*", r"\*") for cells in linked]
    return "\n".join(f"| {line} |" for line in [*head, *body])


def _card(entry: Entry, figures: RobotFigures | None) -> str:
    card, spec = entry.card, entry.robot.spec
    mobility = card.mobility
    limbs = " + ".join(map(str, mobility.limbs))
    inside = f" + {mobility.inside} inside of limbs" if mobility.inside else ""
    idle = f", less {mobility.idle} idle spins" if mobility.idle else ""
    gogu = (
        f"{mobility.joints} joint freedoms, r = {limbs} - {mobility.platform}{inside} = {mobility.lost}{idle}:"
        f" M = {mobility.mobility}"
    )
    facts = [
        ("topology", card.topology.replace("*", r"\*")),
        ("driven", " ".join(spec.actuated)),
        ("freedoms", freedoms(entry)),
        ("numbers", card.numbers),
        ("mobility", f"{gogu}{f' ({mobility.note})' if mobility.note else ''}"),
    ]
    if figures is not None:
        facts.append(("rank", f"{figures.rank} of {figures.rows} rows, {figures.redundant} redundant"))
        facts.append(("verified", _verified(figures)))
        facts += [
            ("approximation", f"`{name}`: {_percent(low)} to {_percent(high)} off, of a joint's peak")
            for name, (low, high) in figures.approximations.items()
        ]
        if figures.workspace is not None:
            facts.append(("workspace", workspace(figures)))
        if figures.singular is not None:
            facts.append(("singular", f"smallest scaled determinant over the campaign: {figures.singular:.2g}"))
    facts += [("singular", sentence) for sentence in card.singular]
    folder = f"../examples/{entry.name}"
    picture = f"\n![{spec.title}]({folder}/{card.picture})\n" if card.picture else ""
    rows = "\n".join(f"| {what} | {text} |" for what, text in facts)
    title = f"[{spec.title or entry.name}]({folder}/README.md)"
    return f"\n## {entry.name}\n\n{title}: derivation, sources, findings.\n{picture}\n| | |\n|---|---|\n{rows}\n"


def _verified(figures: RobotFigures) -> str:
    parts = [
        f"`{figures.exact}` within {small(figures.error)} of MuJoCo over {figures.cases} cases,"
        f" {figures.samples} samples (bound {figures.bound:.0e})"
    ]
    if figures.spread is not None:
        parts.append(f"{figures.engine.capitalize()} within {small(figures.spread)} of MuJoCo")
    if figures.power is not None:
        parts.append(f"power balance {small(figures.power)}")
    if figures.replay is not None:
        parts.append("replay {}, order {:.2f} to {:.2f}".format(figures.replay_verdict, *figures.replay))
    parts += [f"{WORDS[kind]} {small(error)}" for kind, error in figures.kinematics.items()]
    return "; ".join(parts)


def _percent(value: float) -> str:
    return f"{100 * value:.2g} %" if value >= 1e-6 else small(value)
