"""From a finished run of a robot's campaign to its figures in the library's record."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from workbench.campaign.compare import RAW_INVERSE
from workbench.campaign.run import Outcome
from workbench.campaign.verdict import VERIFICATION
from workbench.capabilities.load import load_robot
from workbench.errors import SpecError
from workbench.library.record import RobotFigures, WorkspaceFigure
from workbench.library.shelf import Entry
from workbench.workspace.grid import compute_workspace

CELLS = 24
"""Cells along the longest side of a workspace: its error stands beside it, and the whole library takes minutes."""

UNITS = {3: "m^3", 2: "m^2", 1: "m"}


def figures_of(entry: Entry, outcome: Outcome, with_workspace: bool = False) -> RobotFigures:
    """What the library's record holds of a robot, after its campaign.

    Parameters
    ----------
    entry
        The robot.
    outcome
        Its campaign with the formulas of its folder, with whatever evidence was asked for.
    with_workspace
        Compute its workspace too.

    Raises
    ------
    SpecError
        No formula of the robot is held against a bound: nothing of it is verified.
    """
    held = [row for row in outcome.rows if row.kind == VERIFICATION and row.bound is not None]
    if not held:
        raise SpecError(f"{entry.campaign}: no formula of {entry.name} has a bound, so nothing of it is verified")
    exact = held[0].candidate
    facts: list[Mapping[str, Any]] = list(outcome.manifest["cases"].values())
    measured: dict[str, list[float]] = {}
    for row in outcome.rows:
        if row.candidate != RAW_INVERSE and row.bound is None:
            measured.setdefault(row.candidate, []).append(row.peak_error)
    evidence = [case.get("evidence", {}) for case in facts]
    power = [one["relative"] for found in evidence for one in (found.get("power_balance") or {}).values()]
    second = [found["second_engine"] for found in evidence if found.get("second_engine")]
    replays = [
        replay["candidates"][exact]
        for found in evidence
        if (replay := found.get("replay")) and exact in replay.get("candidates", {})
    ]
    kinematics: dict[str, float] = {}
    for check in (check for case in facts for check in case.get("kinematics_checks", ())):
        kinematics[check["kind"]] = max(kinematics.get(check["kind"], 0.0), check["error"])
    measures = [one["min"] for case in facts for one in case.get("singularity", {}).values()]
    return RobotFigures(
        status=outcome.conclusion.status,
        cases=len(facts),
        samples=sum(case["samples"] for case in facts),
        exact=exact,
        error=max(row.peak_error for row in held if row.candidate == exact),
        bound=min(row.bound for row in held if row.candidate == exact and row.bound is not None),
        engine=second[0]["engine"] if second else "",
        spread=_largest(v for one in second for model in one["spread"].values() for v in model.values()),
        power=_largest(power),
        replay=_span(one["order"] for one in replays),
        replay_verdict=" and ".join(sorted({one["verdict"] for one in replays})),
        kinematics=kinematics,
        approximations={name: (min(values), max(values)) for name, values in measured.items()},
        cost_us=outcome.manifest["candidates"][exact]["cost_us"],
        mobility=_same(entry, "mobility", facts),
        idle=max(case.get("idle_freedoms") or 0 for case in facts),
        rows=_same(entry, "constraint_rows", facts),
        rank=_same(entry, "rank", facts),
        redundant=_same(entry, "redundant_rows", facts),
        worst_condition=_largest(case.get("condition") for case in facts),
        singular=min(_numbers(measures), default=None),
        workspace=workspace_figure(entry) if with_workspace and entry.card.workspace else None,
    )


def workspace_figure(entry: Entry) -> WorkspaceFigure:
    """Volume of the workspace, or area, at the attitude of the home pose.

    Raises
    ------
    WorkbenchError
        As `compute_workspace`.
    """
    robot = load_robot(entry.folder)
    low, high = robot.reach_box()
    turning = np.array([unit == "rad" for unit in robot.task_units])
    spans = (high - low)[~turning] if not turning.all() else high - low
    found = compute_workspace(robot, float(spans.max()) / CELLS)
    finite = found.condition[np.isfinite(found.condition)]
    return WorkspaceFigure(
        unit=UNITS[len(found.shape)],
        amount=found.volume,
        error=found.volume_error,
        worst_condition=float(finite.max()) if finite.size else None,
    )


def _numbers(values: Iterable[Any]) -> list[float]:
    return [float(value) for value in values if value is not None and math.isfinite(value)]


def _largest(values: Iterable[Any]) -> float | None:
    return max(_numbers(values), default=None)


def _span(values: Iterable[Any]) -> tuple[float, float] | None:
    found = _numbers(values)
    return (min(found), max(found)) if found else None


def _same(entry: Entry, key: str, facts: Iterable[Mapping[str, Any]]) -> int:
    """A count that may not differ from case to case: it belongs to the robot.

    Raises
    ------
    SpecError
        It differs: a case passes a singular pose, or the ranks are not clear.
    """
    found = {case[key] for case in facts}
    if len(found) != 1:
        raise SpecError(f"{entry.campaign}: {key} is {' and '.join(map(str, sorted(found)))}, unlike from case to case")
    return int(found.pop())
