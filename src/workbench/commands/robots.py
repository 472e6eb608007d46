"""``workbench robots``: the library of robots that comes along."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def robots(
    name: Annotated[str, typer.Argument(metavar="NAME", help="One robot: all of its card. Without: the list.")] = "",
    copy: Annotated[
        Path | None, typer.Option("--copy", metavar="DIR", help="Copy the robot's folder to DIR, to run and change.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Cards and figures as JSON.")] = False,
) -> None:
    """List the robots of the library: freedoms, topology, what is verified and at what error.

    ``workbench run --robots NAME`` checks one, ``--robots all`` the whole library.
    """
    from workbench.commands.robot_tables import print_card, print_json, print_list
    from workbench.errors import SpecError
    from workbench.library.copy import copy_folder
    from workbench.library.record import read_record
    from workbench.library.shelf import entries, entry

    record = read_record()
    found = [entry(name)] if name else entries()
    if copy is not None:
        if not name:
            raise SpecError("--copy: of which robot? workbench robots NAME --copy DIR")
        copy_folder(found[0], copy)
        typer.echo(f"{copy}: workbench run {copy / found[0].campaign.name} " + _candidates(copy, found[0].formulas))
        return
    if as_json:
        print_json(found, record)
    elif name:
        print_card(found[0], record.robots.get(name))
    else:
        print_list(found, record)


def _candidates(folder: Path, formulas: tuple[Path, ...]) -> str:
    return " ".join(f"--candidates {folder / path.name}" for path in formulas)
