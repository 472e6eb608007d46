"""A workspace on disk: ``workspace.parquet`` (one row per cell in reach) and ``workspace.json`` (the facts)."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from workbench.capabilities.robot import Robot
from workbench.errors import OutputError
from workbench.reading import read_json
from workbench.staging import DirectoryKind
from workbench.workspace.grid import Workspace

FORMAT = 1
CELLS = "workspace.parquet"
FACTS = "workspace.json"
OWN = {
    "mechanism": "a robot",
    "parameters": "parameters",
    "axes": "axes",
    "held": "coordinates held",
    "joint_limits": "ranges of joints",
    "spacing_m": "a grid",
}
"""What makes a workspace another one; the same one may be computed again and again over itself."""
WORKSPACE = DirectoryKind(
    what="workspace",
    marker=FACTS,
    keys=frozenset({"format", "mechanism", "spacing_m", "shape"}),
    members=(CELLS, FACTS, "figures"),
)


def workspace_facts(workspace: Workspace, robot: Robot, marked: Iterable[str] = ()) -> dict[str, Any]:
    """What ``workspace.json`` holds; lengths in metres, keys documented in docs/workspace.md.

    *marked*: cases of a campaign whose ways are drawn into the figures.
    """
    names = [robot.platform_axes[i] for i in workspace.axes]
    upright = {"xyz"[i]: value for i, value in enumerate(robot.up) if value}
    coordinate, sign = next(iter(upright.items()))
    column = robot.coordinates.index(coordinate) if coordinate in robot.coordinates else None
    axis = robot.platform_axes[column] if column in workspace.axes else None
    size = {3: ("volume_m3", "volume_error_m3"), 2: ("area_m2", "area_error_m2"), 1: ("length_m", "length_error_m")}
    amount, error = size[len(workspace.shape)]
    return {
        "format": FORMAT,
        "mechanism": robot.name,
        "axes": names,
        "held": workspace.fixed,
        "up": axis if sign > 0 else None,
        "down": axis if sign < 0 else None,
        "spacing_m": workspace.spacing,
        "low_m": workspace.low.tolist(),
        "shape": list(workspace.shape),
        "cells": len(workspace.index),
        amount: workspace.volume,
        error: workspace.volume_error,
        "border_cells": workspace.border_cells,
        "joint_limits": dict(zip(robot.joints, map(list, workspace.limits), strict=True)),
        "measures": list(workspace.measures),
        "extent_m": {
            name: [float(workspace.x[:, i].min()), float(workspace.x[:, i].max())] for i, name in enumerate(names)
        },
        "parameters": dict(robot.values),
        "marked": list(marked),
    }


def refuse_other(directory: Path, facts: Mapping[str, Any]) -> None:
    """Refuse to put a workspace in the place of one of another robot, or that was computed otherwise.

    Parameters
    ----------
    directory
        Where it would go.
    facts
        As `workspace_facts`, or as much of it as is known.

    Raises
    ------
    OutputError
        What differs, and the way on.
    """
    try:
        old = read_json(directory / FACTS)
    except (OSError, ValueError):
        return
    if not isinstance(old, Mapping):
        return
    now = json.loads(json.dumps({key: facts[key] for key in OWN if key in facts}))
    unlike = [OWN[key] for key, value in now.items() if key in old and old[key] != value]
    before = old.get("marked")
    if "marked" in facts and isinstance(before, list) and not {str(one) for one in before} <= set(facts["marked"]):
        unlike.append("marked cases")
    if unlike:
        raise OutputError(
            f"{directory}: holds an earlier workspace with {', '.join(unlike)} unlike this one's; --replace puts"
            " this one in its place, --out names another directory",
            path=str(directory),
        )


def write_workspace(stage: Path, workspace: Workspace, facts: Mapping[str, Any], robot: Robot) -> None:
    """Write both files into a directory that exists."""
    columns: dict[str, Any] = {f"i{k + 1}": workspace.index[:, k] for k in range(len(workspace.shape))}
    columns |= {f"x{k + 1}": workspace.x[:, k] for k in range(len(workspace.shape))}
    columns |= {joint: workspace.q[:, k] for k, joint in enumerate(robot.joints)}
    columns |= {f"measure_{name}": values for name, values in workspace.measures.items()}
    columns["condition"] = workspace.condition
    pd.DataFrame(columns).to_parquet(stage / CELLS, index=False, write_page_checksum=True)
    (stage / FACTS).write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
