"""``workbench workspace``: the reachable set of a robot, its volume and figures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from workbench.commands.assignments import ranges, settings
from workbench.commands.options import RobotArgument


def workspace(
    model: RobotArgument,
    grid: Annotated[
        float | None, typer.Option(metavar="METRES", help="Edge of a cell. Default: 60 cells along the longest side.")
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(metavar="JOINT=LOW:HIGH", help="Range of an active joint, m or rad; may be repeated."),
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Set a parameter, SI; a2*=1.1 scales."),
    ] = None,
    at: Annotated[
        list[str] | None,
        typer.Option("--at", metavar="COORDINATE=VALUE", help="Hold a rotation, rad. Default: as in the home pose."),
    ] = None,
    campaign: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Mark where the cases of this campaign run in it.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Where it is written. Default: reports/workspace_MECHANISM.")
    ] = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Replace an earlier workspace of another robot, grid, range or campaign.")
    ] = False,
) -> None:
    """Compute the reachable workspace by discretisation: volume with its error, cells as Parquet, figures."""
    from workbench.campaign.cases import resolve_cases
    from workbench.campaign.lock import locked
    from workbench.campaign.spec import load_campaign
    from workbench.capabilities.load import robot_with
    from workbench.console import print_workspace
    from workbench.report.workspace import draw_workspace
    from workbench.robots.assignments import resolve_changes
    from workbench.robots.catalogue import find_source
    from workbench.staging import check_output, staged
    from workbench.terminal import Steps
    from workbench.workspace.grid import compute_workspace
    from workbench.workspace.store import WORKSPACE, refuse_other, workspace_facts, write_workspace

    values, relative = settings(set_ or [])
    robot = robot_with(model, values)
    if relative:
        table = robot.description.table
        robot = robot_with(model, table.layered(values, resolve_changes(table, robot.values, relative)))
    directory = out or Path("reports") / f"workspace_{robot.name}"
    check_output(directory, WORKSPACE)
    paths = {}
    if campaign:
        spec, file = load_campaign(campaign)
        paths = {case.name: case.x for case in resolve_cases(spec, file, find_source(model).model)}
    if not replace:
        refuse_other(directory, {"mechanism": robot.name, "parameters": dict(robot.values), "marked": list(paths)})
    with Steps("computing and drawing the workspace") as show:
        show(0, 2)
        computed = compute_workspace(robot, grid, ranges(limit or []), settings(at or [], "--at")[0])
        show(1, 2)
        facts = workspace_facts(computed, robot, paths)
        if not replace:
            refuse_other(directory, facts)
        with locked(directory), staged(directory, alone=True) as stage:
            write_workspace(stage, computed, facts, robot)
            draw_workspace(stage, paths)
    print_workspace(facts, directory)
