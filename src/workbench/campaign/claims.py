"""The papers' printed figures against what a campaign measured."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from workbench.campaign.compare import Row
from workbench.campaign.spec import Campaign, ClaimSpec, Measure

ERRORS = ("peak_error", "rms_error", "pointwise_error")


def judge_claims(
    campaign: Campaign, rows: Iterable[Row], facts: Mapping[str, Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """Measure every claim; ``holds`` is None where the campaign holds nothing to decide it."""
    listed = list(rows)
    return [_judge(claim, listed, facts) for claim in campaign.claim]


def _judge(claim: ClaimSpec, rows: list[Row], facts: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    measured = _measure(claim.measure, rows, facts)
    holds: bool | None = None
    if measured is not None:
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
        "note": claim.note,
    }


def _measure(measure: Measure, rows: list[Row], facts: Mapping[str, Mapping[str, Any]]) -> float | None:
    if measure.case not in facts:
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
