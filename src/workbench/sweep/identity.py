"""What determines a case's numbers, as a hash: a finished case is taken over only where all of it is the same."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from workbench.campaign import provenance
from workbench.campaign.cases import robot_files, tables_of
from workbench.campaign.evidence import Effort
from workbench.campaign.robot_spec import RobotKeys
from workbench.campaign.spec import Campaign
from workbench.campaign.user_candidates import UserCandidate
from workbench.robots.registration import TORQUE

FORMAT = 1
"""Version of the files of a sweep and of its keys."""

CODE = (
    "mjcf",
    "robots",
    "capabilities",
    "motion",
    "delimited",
    "reference",
    "campaign",
    "control",
    "sweep",
    "metrics.py",
    "arrays.py",
    "dry_friction.py",
)
"""The workbench's own code that makes numbers: two states of it may carry the same version number."""

DESCRIBING = ("name", "title", "description")


def _name(user: UserCandidate) -> str:
    return user.name if user.kind == TORQUE else f"{user.kind} {user.name}"


@lru_cache(maxsize=1)
def code_hash() -> str:
    """Hash of the workbench's sources that make numbers."""
    root = Path(provenance.__file__).resolve().parents[1]
    digest = hashlib.sha256()
    for pattern in CODE:
        for found in sorted(root.glob(pattern)):
            for path in sorted([*found.rglob("*.py"), *found.rglob("*.toml")]) if found.is_dir() else [found]:
                digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def versions() -> dict[str, str]:
    """Versions that results may not be mixed across."""
    return {"format": str(FORMAT), **provenance.versions(), "code": code_hash()}


def common_key(
    campaign: Campaign,
    file: Path,
    model: Path,
    settings: Mapping[str, float],
    effort: Effort,
    keep_series: str,
    users: Sequence[UserCandidate] = (),
) -> str:
    """Hash of everything that the cases of a sweep share."""
    filters = campaign.sweep.filter.model_dump() if campaign.sweep else {}
    return _digest(
        {
            "versions": versions(),
            "robot": [provenance.sha256(path.read_bytes()) for path in robot_files(campaign, file, model)],
            "tables": [provenance.sha256(path.read_bytes()) for path in tables_of(campaign, file)],
            "candidates": [candidate.model_dump(exclude={"printed_cost"}) for candidate in campaign.candidate],
            "parameters": campaign.parameters,
            "settings": dict(settings),
            "engines": list(effort.engines),
            "budget": effort.budget,
            "filter": filters,
            "keep_series": keep_series,
            "keys": campaign.model_dump(include=set(RobotKeys.model_fields) - {"model", "robot"}),
            "users": {
                _name(user): provenance.sha256(b"".join(file.read_bytes() for file in user.files)) for user in users
            },
        }
    )


def case_key(common: str, case: Mapping[str, Any]) -> str:
    """Hash of one case; its name and texts determine no number and are left out."""
    return _digest({"common": common, **{k: v for k, v in case.items() if k not in DESCRIBING}})


def _digest(content: Mapping[str, Any]) -> str:
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:32]
