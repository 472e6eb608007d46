"""Arguments and options that several commands take, said once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

CampaignArgument = Annotated[
    Path, typer.Argument(metavar="CAMPAIGN", help="Campaign file (TOML), or the name of one that comes along.")
]
CampaignOrNone = Annotated[
    Path | None,
    typer.Argument(metavar="CAMPAIGN", help="Campaign file (TOML), or the name of one that comes along; none: a list."),
]
RobotArgument = Annotated[
    Path,
    typer.Argument(
        metavar="ROBOT", help="Folder with a robot.toml, MJCF file, models/NAME.xml, or a name that comes along."
    ),
]
SetInCases = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Set a parameter in every case, SI; a2*=1.1 scales."),
]
OtherModel = Annotated[Path | None, typer.Option(metavar="FILE", help="MJCF file in place of the campaign's own.")]
