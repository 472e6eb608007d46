"""``workbench new DIR --from FILE``: a robot folder from a real file."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.errors import ModelError, SpecError

if TYPE_CHECKING:
    from workbench.importing.proposal import Proposal

NAME_OF_FILE = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,39}")


def names_of(given: tuple[str, ...]) -> tuple[str, ...]:
    """Joint names of repeated options, each of which may list several with commas."""
    return tuple(name.strip() for one in given for name in one.split(",") if name.strip())


def import_model(source: Path, directory: Path, actuated: tuple[str, ...]) -> None:
    """Write the folder and say what was found.

    Raises
    ------
    SpecError
        A folder's name that cannot name a campaign.
    ModelError
        The reference refuses the file; the message is the reference's, and `workbench model check` lists all of it.
    """
    from rich.text import Text

    from workbench.commands.new import NAME
    from workbench.importing.proposal import propose
    from workbench.importing.write import write_folder
    from workbench.terminal import out

    if not NAME.fullmatch(directory.name):
        raise SpecError(f'DIR "{directory.name}"; allowed: letters, digits and _, first a letter, at most 40')
    found = propose(source, names_of(actuated))
    if found.problem:
        raise ModelError(f"{found.problem}; everything that was found: workbench model check {source}")
    campaign = write_folder(found, directory)
    for note in (*found.notes, *found.prepared.notes):
        out.print(Text(f"note: {note}"), soft_wrap=True)
    out.print(Text(f"{directory}: {found.model.name}, {campaign.name}; now"), soft_wrap=True)
    out.print(Text(f"  workbench run {campaign}"), soft_wrap=True)


def print_proposal(path: Path, actuated: tuple[str, ...], everything: bool, json: bool) -> int:
    """Print what was understood of a file, all that is refused, and a robot file to copy; returns the exit code."""
    import dataclasses
    from json import dumps

    from rich.table import Table
    from rich.text import Text

    from workbench.importing.proposal import propose
    from workbench.importing.write import robot_text
    from workbench.terminal import out

    found = propose(path, actuated)
    if json:
        record = {
            "file": str(path),
            "survey": dataclasses.asdict(found.survey) | {"qpos": found.survey.qpos.tolist()},
            "setup": dataclasses.asdict(found.setup),
            "notes": [*found.notes, *found.prepared.notes],
            "problem": found.problem,
            "refusals": [dataclasses.asdict(refusal) for refusal in found.refusals],
        }
        out.print(dumps(record, indent=1, ensure_ascii=False), soft_wrap=True, markup=False)
        return 1 if found.problem else 0
    out.print(Text(f"{path}: no closed form named", style="bold"), soft_wrap=True)
    facts = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    facts.add_column(no_wrap=True)
    facts.add_column()
    for name, value in understood(found, everything):
        facts.add_row(Text(name), Text(value))
    out.print(facts)
    for note in (*found.notes, *found.prepared.notes, *found.left_out):
        out.print(Text(f"note: {note}"), soft_wrap=True)
    for refusal in found.refusals:
        out.print(Text(f"refused: {refusal.message}; {refusal.way}", style="red"), soft_wrap=True)
    if found.problem:
        if not found.refusals:
            out.print(Text(f"refused: {found.problem}", style="red"), soft_wrap=True)
        out.print(Text("With these mended or left out, this robot.toml would begin:", style="bold"), soft_wrap=True)
    else:
        out.print(
            Text(f"OK: it runs with this robot.toml (workbench new DIR --from {path} writes it):", style="bold green"),
            soft_wrap=True,
        )
    name = path.stem if NAME_OF_FILE.fullmatch(path.stem) else "robot"
    out.print(Text(robot_text(found, name)), soft_wrap=True, end="")
    return 1 if found.problem else 0


def understood(found: Proposal, everything: bool) -> list[tuple[str, str]]:
    """The facts of a file, one line each."""
    seen = found.survey
    spins = f"; {seen.undriven} of them no joint can drive (spins of rods)" if seen.undriven else ""
    freedoms = seen.mobility + seen.rank
    facts = [
        ("bodies, joints, loops", f"{seen.bodies}, {seen.joints}, {seen.loops}"),
        ("mobility by rank", f"{seen.mobility} = {freedoms} joint freedoms - rank {seen.rank} of {seen.rows}{spins}"),
        ("loops", f"open by {seen.residual:.2g} after closing from the file's own pose"),
        ("driven", ", ".join(found.setup.actuated) or "nothing"),
        ("platform", found.setup.platform_site or f"body {found.setup.platform_body}"),
    ]
    if found.motion and everything:
        facts += [
            (f"motion of {joint}", f"{offset:.6g} +- {amplitude:.3g}")
            for joint, offset, amplitude in zip(
                found.setup.actuated, found.motion.offset, found.motion.amplitude, strict=True
            )
        ]
        facts += [("parameter", f"{name}: {place}") for name, place in found.parameters]
    return facts
