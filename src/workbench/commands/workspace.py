"""``workbench workspace``: the reachable set of a robot, its volume and figures."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from workbench.commands.assignments import ranges, settings


def workspace(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="MJCF file, or models/NAME.xml that comes along.")],
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
    campaign: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Mark where the cases of this campaign run in it.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Where it is written. Default: reports/workspace_MECHANISM.")
    ] = None,
) -> None:
    """Compute the reachable workspace by discretisation: volume with its error, cells as Parquet, figures."""
    from workbench.campaign.cases import layered, resolve_cases
    from workbench.campaign.lock import locked
    from workbench.campaign.spec import load_campaign
    from workbench.console import Steps, print_workspace
    from workbench.report.workspace import draw_workspace
    from workbench.robots.assignments import resolve_changes
    from workbench.robots.load import load_mechanism
    from workbench.staging import check_output, staged
    from workbench.workspace.grid import compute_workspace
    from workbench.workspace.store import WORKSPACE, workspace_facts, write_workspace

    values, relative = settings(set_ or [])
    mechanism = load_mechanism(model, **values)
    if relative:
        changes = resolve_changes(type(mechanism), asdict(mechanism.parameters), relative)
        mechanism = load_mechanism(model, **layered(values, changes))
    directory = out or Path("reports") / f"workspace_{mechanism.name}"
    check_output(directory, WORKSPACE)
    paths = {}
    if campaign:
        spec, file = load_campaign(campaign)
        paths = {case.name: case.x for case in resolve_cases(spec, file, model)}
    with Steps("computing and drawing the workspace") as show:
        show(0, 2)
        computed = compute_workspace(mechanism, grid, ranges(limit or []))
        show(1, 2)
        with locked(directory), staged(directory, alone=True) as stage:
            write_workspace(stage, computed, mechanism)
            draw_workspace(stage, paths)
    print_workspace(workspace_facts(computed, mechanism), directory)
