"""The papers' printed figures against what a campaign measured."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np

from workbench.campaign.changes import Changes
from workbench.campaign.compare import Row
from workbench.campaign.spec import Campaign, ClaimSpec, Measure
from workbench.campaign.verdict import CONTRAST, RECORDED
from workbench.capabilities.robot import Robot

ERRORS = ("peak_error", "rms_error", "pointwise_error")


def judge_claims(
    campaign: Campaign,
    own: Collection[str],
    rows: Iterable[Row],
    facts: Mapping[str, Mapping[str, Any]],
    robots: Mapping[str, Robot],
    changes: Changes,
) -> list[dict[str, Any]]:
    """Measure every claim; judge those that are about the robot of their case.

    Parameters
    ----------
    campaign
        With its claims.
    own
        Names of the candidates that the campaign itself names: a claim that names none is about those.
    rows, facts
        Results, and the facts of each case.
    robots, changes
        The robot of each case that was computed, and in what robots differ from the one that was published.

    Returns
    -------
    list of dict
        ``holds`` is None where the claim is about another robot (then ``not_about`` says why, and the note for the
        published result is left away), or where the campaign holds nothing to decide it.
    """
    listed = [row for row in rows if row.candidate in own and row.kind not in (CONTRAST, RECORDED)]
    return [_judge(claim, listed, facts, _not_about(claim, robots, changes)) for claim in campaign.claim]


def _not_about(claim: ClaimSpec, robots: Mapping[str, Robot], changes: Changes) -> str:
    case = claim.measure.case
    if case not in robots:
        return ""
    if changes.model or not claim.parameters:
        return changes.why_not(case)
    # the robot that the claim names is the published one with the claim's own parameters
    robot = robots[case]
    base = dict(robot.values) | {change.name: change.before for change in changes.of(case)}
    named = robot.description.table.changed(base, claim.parameters)
    return ", ".join(f"{n} is {robot.values[n]:.6g}, not {named[n]:.6g}" for n in named if robot.values[n] != named[n])


def _judge(claim: ClaimSpec, rows: list[Row], facts: Mapping[str, Mapping[str, Any]], not_about: str) -> dict[str, Any]:
    measured = _measure(claim.measure, rows, facts)
    holds: bool | None = None
    if measured is not None and not not_about:
        upper = claim.kind == "upper"
        holds = measured < claim.claimed if upper else abs(measured - claim.claimed) <= claim.within
    return {
        "id": claim.id,
        "text": claim.text,
        "source": claim.source,
        "kind": claim.kind,
        "claimed": claim.claimed,
        "within": claim.within,
        "unit": claim.unit,
        "measured": measured,
        "holds": holds,
        "not_about": not_about,
        "note": "" if not_about else claim.note,
    }


def _measure(measure: Measure, rows: list[Row], facts: Mapping[str, Mapping[str, Any]]) -> float | None:
    if "closure_residual" not in facts.get(measure.case, {}):  # not run, or not driven
        return None
    if measure.quantity == "solution_distance":
        solutions = np.array(facts[measure.case]["solutions_at_start"])
        return float(np.abs(solutions - np.array(measure.point)).max(axis=1).min())
    if measure.quantity not in ERRORS:
        value = facts[measure.case].get(measure.quantity)
        return None if value is None else float(value)
    values = [
        float(getattr(row, measure.quantity))
        for row in rows
        if row.case == measure.case
        and measure.candidate in (None, row.candidate)
        and measure.reference in (None, row.reference)
        and measure.joint in (None, row.joint)
    ]
    return max(values, default=None)
