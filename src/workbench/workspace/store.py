"""A workspace on disk: ``workspace.parquet`` (one row per cell in reach) and ``workspace.json`` (the facts)."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import pandas as pd

from workbench.robots.base import Mechanism
from workbench.staging import DirectoryKind
from workbench.workspace.grid import Workspace

FORMAT = 1
CELLS = "workspace.parquet"
FACTS = "workspace.json"
WORKSPACE = DirectoryKind(
    what="workspace",
    marker=FACTS,
    keys=frozenset({"format", "mechanism", "volume_m3"}),
    members=(CELLS, FACTS, "figures"),
)


def workspace_facts(workspace: Workspace, mechanism: Mechanism) -> dict[str, Any]:
    """What ``workspace.json`` holds; lengths in metres, keys documented in docs/workspace.md."""
    vertical = next(i for i, value in enumerate(mechanism.up) if value)
    axis = mechanism.platform_axes[vertical]
    return {
        "format": FORMAT,
        "mechanism": mechanism.name,
        "axes": list(mechanism.platform_axes),
        "up": axis if mechanism.up[vertical] > 0 else None,
        "down": axis if mechanism.up[vertical] < 0 else None,
        "spacing_m": workspace.spacing,
        "low_m": workspace.low.tolist(),
        "shape": list(workspace.shape),
        "cells": len(workspace.index),
        "volume_m3": workspace.volume,
        "volume_error_m3": workspace.volume_error,
        "border_cells": workspace.border_cells,
        "joint_limits": dict(zip(mechanism.joints, map(list, workspace.limits), strict=True)),
        "measures": list(workspace.measures),
        "extent_m": {
            name: [float(workspace.x[:, i].min()), float(workspace.x[:, i].max())]
            for i, name in enumerate(mechanism.platform_axes)
        },
        "parameters": dataclasses.asdict(mechanism.parameters),
    }


def write_workspace(stage: Path, workspace: Workspace, mechanism: Mechanism) -> None:
    """Write both files into a directory that exists."""
    columns: dict[str, Any] = {f"i{k + 1}": workspace.index[:, k] for k in range(3)}
    columns |= {f"x{k + 1}": workspace.x[:, k] for k in range(3)}
    columns |= {joint: workspace.q[:, k] for k, joint in enumerate(mechanism.joints)}
    columns |= {f"measure_{name}": values for name, values in workspace.measures.items()}
    columns["condition"] = workspace.condition
    pd.DataFrame(columns).to_parquet(stage / CELLS, index=False)
    text = json.dumps(workspace_facts(workspace, mechanism), indent=1)
    (stage / FACTS).write_text(text + "\n", encoding="utf-8")
