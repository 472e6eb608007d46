"""What the figures of one case are drawn from, told to a process that draws while other cases are computed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from workbench.campaign import store
from workbench.campaign.compare import RAW_DESCRIPTION, RAW_INVERSE, Row
from workbench.campaign.spec import Campaign
from workbench.capabilities.robot import Robot


class CaseDrawing(Protocol):
    """What draws the figures of cases while others are computed; it never fails a run."""

    def case(self, told: Mapping[str, Any]) -> None:
        """Begin with the figures of a case, whose series stands in its place."""

    def close(self) -> None:
        """End what was begun."""


def case_to_draw(
    campaign: Campaign, robot: Robot, names: Sequence[str], facts: Mapping[str, Any], rows: Sequence[Row], stage: Path
) -> dict[str, Any]:
    """Return what a report will find of one case: the part of the manifest that figures need, and rows of the summary.

    *names* are all cases that the manifest will hold, in order, since a figure's key depends on them; *facts* are the
    case's own, and *stage* is the directory that holds its series.
    """
    name = rows[0].case if rows else ""
    candidates = {one.name: {"mass_model": robot.candidates[one.name].mass_model} for one in campaign.candidate}
    if any(row.candidate == RAW_INVERSE for row in rows):
        candidates[RAW_INVERSE] = {"mass_model": RAW_DESCRIPTION["mass_model"]}
    manifest = {
        "format": store.FORMAT,
        "campaign": campaign.name,
        "model": {"file": "", "sha256": "", "mechanism": robot.name},
        "joints": robot.joints,
        "coordinate_units": robot.coordinate_units,
        "force_units": robot.force_units,
        "platform_axes": robot.position_axes,
        "status": facts["status"],
        "candidates": candidates,
        "figures": [figure.model_dump() for figure in campaign.figure if figure.case == name],
        "cases": {name: facts},
    }
    return {
        "directory": str(stage.resolve()),
        "case": name,
        "names": list(names),
        "manifest": store.manifest_text(manifest),
        "summary": store.summary_text(rows),
    }
