"""``workbench model``: look at a robot's MJCF, change it, check it, and see it move."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from workbench.commands.options import RobotArgument

model = typer.Typer(
    name="model", help="Look at a robot's MJCF, change it, check it, see it move.", no_args_is_help=True
)

Json = Annotated[bool, typer.Option("--json", help="Print JSON in place of tables.")]
CampaignFile = Annotated[
    Path | None, typer.Option("--campaign", metavar="FILE", help="Campaign file with the motion to show.")
]
CaseName = Annotated[
    str | None, typer.Option("--case", metavar="NAME", help="Case of the campaign. Default: its first one.")
]
Start = Annotated[float | None, typer.Option("--start", metavar="T", help="Second of the motion to begin with.")]
Stop = Annotated[float | None, typer.Option("--stop", metavar="T", help="Second of the motion to end with.")]
Speed = Annotated[float, typer.Option("--speed", metavar="X", help="1: the motion's own time; 0.1: ten times slower.")]


@model.command()
def show(path: RobotArgument, json: Json = False) -> None:
    """List every parameter: value, unit, meaning, and the element and attribute of the MJCF that it is read from."""
    from workbench.commands.model_tables import print_json, print_parameters
    from workbench.robots.show import show_parameters

    rows = show_parameters(path)
    if json:
        print_json(rows)
    else:
        print_parameters(rows)


@model.command("set")
def set_(
    path: RobotArgument,
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
    from workbench.reference import MujocoReference
    from workbench.reference.check import refuse_elsewhere
    from workbench.robots.edit import edit_file
    from workbench.robots.load import LoadedModel

    def accept(loaded: LoadedModel) -> None:
        MujocoReference(loaded.file, loaded=loaded)  # raises where it cannot be assembled at home
        refuse_elsewhere(loaded)

    print_edit(edit_file(path, changes, out, in_place, accept))


@model.command()
def check(
    path: RobotArgument,
    campaign: Annotated[
        Path | None,
        typer.Option(
            "--campaign", metavar="FILE", help="Campaign that names the actuated joints and platform of this MJCF."
        ),
    ] = None,
    actuated: Annotated[
        list[str] | None,
        typer.Option("--actuated", metavar="A,B", help="Joints to drive, of a file that names no closed form."),
    ] = None,
    everything: Annotated[bool, typer.Option("--all", help="Print every line, not only what fails.")] = False,
    json: Json = False,
) -> None:
    """Compile, close the loops, and check every assumption of the closed form; of any other file, propose a campaign.

    Exit code 0: all is well; 1: something is broken or not covered; 2: the file cannot be read.
    """
    from workbench.campaign.cases import robot_of
    from workbench.campaign.spec import load_campaign
    from workbench.commands.model_tables import print_check, print_json
    from workbench.reference.check import check_model, names_itself

    if campaign is None and (actuated or not names_itself(path)):
        from workbench.commands.import_model import names_of, print_proposal

        raise typer.Exit(print_proposal(path, names_of(tuple(actuated or ())), everything, json))
    found = check_model(path, robot=robot_of(*load_campaign(campaign), path)[0] if campaign else None)
    if json:
        print_json(found)
    else:
        print_check(found, everything)
    if found.exit_code:
        raise typer.Exit(found.exit_code)


@model.command()
def view(
    path: RobotArgument,
    campaign: CampaignFile = None,
    case: CaseName = None,
    start: Start = None,
    stop: Stop = None,
    speed: Speed = 1.0,
) -> None:
    """Show the robot in MuJoCo's interactive viewer, in its home pose or replaying a case, until the window closes."""
    from workbench.commands.pictures import poses_of, positive
    from workbench.rendering.system import refuse_without_display
    from workbench.rendering.viewer import REFRESH_S
    from workbench.rendering.viewer import view as open_viewer

    positive("speed", speed)
    refuse_without_display()
    open_viewer(poses_of(path, campaign, case, start, stop, REFRESH_S * speed), speed)


@model.command()
def render(
    path: RobotArgument,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Picture (.png) or film (.gif, .mp4).")],
    campaign: CampaignFile = None,
    case: CaseName = None,
    start: Start = None,
    stop: Stop = None,
    speed: Speed = 1.0,
    fps: Annotated[float, typer.Option(metavar="RATE", help="Pictures of a film a second.")] = 25.0,
    size: Annotated[str, typer.Option(metavar="WxH", help="Pixels.")] = "640x480",
    camera: Annotated[
        str | None, typer.Option(metavar="NAME", help="Camera of the model. Default: as the viewer begins.")
    ] = None,
) -> None:
    """Draw the robot without a screen: a picture of a pose, or a film of a case."""
    from workbench.commands.pictures import poses_of, positive, size_of
    from workbench.rendering.files import check_target, write_pictures
    from workbench.rendering.offscreen import draw
    from workbench.terminal import out as console

    positive("speed", speed)
    positive("fps", fps)
    width, height = size_of(size)
    check_target(out, campaign is not None)
    film = out.suffix.lower() != ".png"
    poses = poses_of(path, campaign, case, start, stop if film else start, speed / fps)
    write_pictures(out, draw(poses, width, height, camera), (width, height), fps)
    pictures = f"{len(poses.qpos)} pictures" if film else "1 picture"
    console.print(f"{out}: {pictures} of {poses.title}", soft_wrap=True, markup=False)
