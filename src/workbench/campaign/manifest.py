"""What ``manifest.json`` says of a campaign, its model and its candidates, before a case is computed."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from workbench.campaign import provenance
from workbench.campaign.commit import git_commit
from workbench.campaign.spec import Campaign
from workbench.robots.base import Mechanism
from workbench.robots.parameters import stored_names


def shown(path: Path, campaign_file: Path) -> str:
    """Return a path as others can follow it: from the directory above the campaign's, where it lies below that."""
    above = campaign_file.resolve().parent.parent
    found = path.resolve()
    return found.relative_to(above).as_posix() if found.is_relative_to(above) else path.name


def describe(campaign: Campaign, file: Path, model: Path, mechanism: Mechanism) -> dict[str, Any]:
    """Return the keys that stand in the manifest of every run, with or without a sweep."""
    values = dataclasses.asdict(mechanism.parameters)
    return {
        "campaign": campaign.name,
        "title": campaign.title,
        "description": campaign.description,
        "spec_file": shown(file, file),
        "spec": campaign.model_dump(),
        "model": {
            "file": shown(model, file),
            "sha256": provenance.sha256(model.read_bytes()),
            "mechanism": mechanism.name,
            "title": mechanism.title,
            "reference_key": mechanism.reference_key,
        },
        "joints": list(mechanism.joints),
        "coordinate_units": list(mechanism.coordinate_units),
        "force_units": list(mechanism.force_units),
        "platform_axes": list(mechanism.platform_axes),
        "mobility_count": mechanism.mobility_count(),
        "parameters": [
            {"name": name, "value": values[name], "unit": info.unit, "meaning": info.meaning, "source": info.source}
            for name, info in stored_names(mechanism.parameter_table).items()
        ],
        "versions": provenance.versions(),
        "machine": provenance.machine(),
        "git_commit": git_commit(file.resolve().parent),
    }
