"""``workbench model``: look at a robot's MJCF, change it, check it, and see it move."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

model = typer.Typer(
    name="model", help="Look at a robot's MJCF, change it, check it, see it move.", no_args_is_help=True
)

ModelFile = Annotated[Path, typer.Argument(metavar="MODEL", help="MJCF file, or models/NAME.xml that comes along.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON in place of tables.")]
CampaignFile = Annotated[
    Path | None, typer.Option("--campaign", metavar="FILE", help="Campaign file with the motion to show.")
]
CaseName = Annotated[
    str | None, typer.Option("--case", metavar="NAME", help="Case of the campaign. Default: its first one.")
]


@model.command()
def show(path: ModelFile, json: Json = False) -> None:
    """List every parameter: value, unit, meaning, and the element and attribute of the MJCF that it is read from."""
    from workbench.commands.model_tables import print_json, print_parameters
    from workbench.mjcf_show import show_parameters

    rows = show_parameters(path)
    if json:
        print_json(rows)
    else:
        print_parameters(rows)


@model.command("set")
def set_(
    path: ModelFile,
    changes: Annotated[
        list[str], typer.Argument(metavar="NAME=VALUE...", help="SI; a2*=1.1 scales, also /=, +=, -=; several at once.")
    ],
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="File to write.")] = None,
    in_place: Annotated[bool, typer.Option("--in-place", help="Write MODEL itself.")] = False,
) -> None:
    """Change parameters in the MJCF: bodies, sites, inertias and visible geoms move together, all else stays.

    NAME_left or NAME_right touches one limb. A bar stays uniform and slender unless its inertia is given too.
    """
    from workbench.commands.model_tables import print_edit
    from workbench.mjcf_edit import edit_file

    print_edit(edit_file(path, changes, out, in_place))


@model.command()
def check(path: ModelFile, json: Json = False) -> None:
    """Compile, close the loops, and check every assumption of the closed form.

    Exit code 0: all is well; 1: an assumption is broken or the loops do not close; 2: the file cannot be read.
    """
    from workbench.commands.model_tables import print_check, print_json
    from workbench.reference.check import check_model

    found = check_model(path)
    if json:
        print_json(found)
    else:
        print_check(found)
    if found.exit_code:
        raise typer.Exit(found.exit_code)
