"""``workbench diagnose``: which term of a formula is wrong, and what would mend it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from workbench.commands.options import CampaignArgument, OtherModel
from workbench.errors import OutputError

if TYPE_CHECKING:
    from workbench.diagnosis.result import Diagnosis

FOUND = 1


def diagnose(
    campaign: CampaignArgument,
    candidates: Annotated[
        list[str] | None,
        typer.Option(metavar="FILE", help="Python file with formulas of your own, which is run; may be repeated."),
    ] = None,
    candidate: Annotated[
        str | None, typer.Option(metavar="NAME", help="Diagnose this formula only. Default: all that have a bound.")
    ] = None,
    case: Annotated[
        str | None, typer.Option(metavar="CASE", help="Whose robot is looked at. Default: the first case's.")
    ] = None,
    model: OtherModel = None,
    mend: Annotated[
        bool, typer.Option(help="Look for edits of the formula's source that bring parts to round-off.")
    ] = True,
    time_limit: Annotated[
        float, typer.Option("--time", min=1.0, metavar="SECONDS", help="Longest search for edits, for each formula.")
    ] = 60.0,
    jobs: Annotated[int | None, typer.Option(min=1, help="Workers of the search. Default: one per core.")] = None,
    json_: Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write everything as JSON, too.")] = None,
    apply: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a copy of the formula's file with the first mend in it.")
    ] = None,
) -> None:
    """Name the wrong term of a formula: part, joint, parameter, body, and the edit that would mend it.

    Exit code 0: nothing is wrong; 1: there are findings; 2: bad input.
    """
    from workbench.commands.diagnose_screen import print_diagnosis
    from workbench.diagnosis.surface import each_diagnosis, write_mended
    from workbench.output_file import refuse_target
    from workbench.sweep.files import write_bytes

    for file in (json_, apply):
        if file is not None:
            refuse_target(file)
    found: list[Diagnosis] = []
    for diagnosis in each_diagnosis(
        campaign,
        candidates=candidates or (),
        candidate=candidate,
        case=case,
        model=model,
        mend=mend,
        time_limit=time_limit,
        jobs=jobs,
        first=lambda early: print_diagnosis(early, searching=True),
    ):
        print_diagnosis(diagnosis, only_mends=True)
        found.append(diagnosis)
    if json_:
        data: Any = {"format": 1, "diagnoses": [diagnosis.as_data() for diagnosis in found]}
        write_bytes(json_, (json.dumps(data, indent=1) + "\n").encode())
    if apply:
        mended = [diagnosis for diagnosis in found if diagnosis.suggestions]
        if not mended:
            raise OutputError(f"{apply}: nothing to apply, no edit was found that mends anything")
        write_mended(mended[0], apply)
        typer.echo(f"mended copy: {apply}")
    if any(not diagnosis.right for diagnosis in found):
        raise typer.Exit(FOUND)
