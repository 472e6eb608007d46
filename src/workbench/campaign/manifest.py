"""What ``manifest.json`` says of a campaign, its model and its candidates, before a case is computed."""

from __future__ import annotations

import shlex
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from workbench.campaign import provenance
from workbench.campaign.changes import Changes
from workbench.campaign.commit import git_commit
from workbench.campaign.spec import Campaign
from workbench.capabilities.robot import Robot


@dataclass(frozen=True)
class Begun:
    """When a run began, by the calendar and by a clock that nobody sets back."""

    at: datetime = field(default_factory=lambda: datetime.now(UTC))
    clock: float = field(default_factory=time.perf_counter)

    def ended(self, command: Sequence[str]) -> dict[str, Any]:
        """Return what the manifest says of the command, and of when it ran until now."""
        return {
            "command": shlex.join(command),
            "started": self.at.isoformat(timespec="seconds"),
            "finished": datetime.now(UTC).isoformat(timespec="seconds"),
            "seconds": round(time.perf_counter() - self.clock, 3),
        }


def shown(path: Path, campaign_file: Path) -> str:
    """Return a path as others can follow it: from the directory above the campaign's, where it lies below that."""
    above = campaign_file.resolve().parent.parent
    found = path.resolve()
    return found.relative_to(above).as_posix() if found.is_relative_to(above) else path.name


def describe(campaign: Campaign, file: Path, model: Path, robot: Robot, case: str, changes: Changes) -> dict[str, Any]:
    """Return the keys that stand in the manifest of every run, with or without a sweep.

    *robot* is that of *case*, whose parameters are listed; *changes* says in what it is another than its sources'.
    """
    sources = changes.sources(case)
    values = robot.values
    return {
        "campaign": campaign.name,
        "title": campaign.title,
        "description": campaign.description,
        "spec_file": shown(file, file),
        "spec": campaign.model_dump(),
        "model": {
            "file": shown(model, file),
            "sha256": provenance.sha256(model.read_bytes()),
            "mechanism": robot.name,
            "title": robot.title,
            "reference_key": robot.reference_key,
        },
        "joints": list(robot.joints),
        "coordinate_units": list(robot.coordinate_units),
        "force_units": list(robot.force_units),
        "platform_axes": list(robot.position_axes),
        "mobility_count": robot.mobility_count(),
        "parameters": [
            {
                "name": name,
                "value": values[name],
                "unit": info.unit,
                "meaning": info.meaning,
                "source": sources.get(name, info.source),
            }
            for name, info in robot.description.table.infos.items()
        ],
        "changes": changes.facts(),
        "versions": provenance.versions(),
        "machine": provenance.machine(),
        "git_commit": git_commit(file.resolve().parent),
    }
