"""What a sweep says as a whole (``sweep.json``): how large the errors are, where, and which numbers drive them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

from workbench.arrays import FloatArray
from workbench.campaign.conclusion import Conclusion, conclude_sweep
from workbench.campaign.spec import Campaign
from workbench.campaign.verdict import CONTRAST, VERIFICATION, WITHOUT_BOUND, kind_of
from workbench.sweep import files
from workbench.sweep.identity import FORMAT
from workbench.sweep.plan import Plan
from workbench.sweep.record import STATUSES

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
BINS = 10
WORST = 10
REASONS = 20
ANY_JOINT = "any"
"""stands for the largest error over the joints"""

NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")


def summarise(directory: Path, plan: Plan, campaign: Campaign) -> dict[str, Any]:
    """Summarise ``cases/`` and ``summary/`` of a run directory.

    Memory: one number per case and row of the table of errors, whatever else the data sets hold.
    """
    assert campaign.sweep is not None
    statuses, reasons, examples = _statuses(directory)
    errors = _errors(directory, plan, campaign)
    own = {c.name: plan.robot.candidates[c.name].mass_model for c in campaign.candidate}
    kinds = {
        (c.name, c.reference): kind_of(c, own[c.name]) if c.bound is None else VERIFICATION for c in campaign.candidate
    }
    rows = [
        {"candidate": candidate, "reference": reference, "kind": kinds[candidate, reference], "joint": joint}
        | _distribution(values, plan, campaign.sweep.good)
        for (candidate, reference), table in errors.items()
        for joint, values in table.items()
    ]
    measured = {pair: table for pair, table in errors.items() if kinds[pair] in WITHOUT_BOUND}
    return {
        "format": FORMAT,
        "campaign": campaign.name,
        "case": campaign.case[0].name,
        "method": campaign.sweep.method,
        "seed": campaign.sweep.seed,
        "cases": plan.count,
        "counts": {status: statuses[status] for status in STATUSES},
        "keys": [_key(plan, i, campaign) for i in range(len(plan.keys))],
        "reasons": [
            {"status": status, "reason": text, "cases": n, "example": examples[status, text]}
            for (status, text), n in reasons.most_common(REASONS)
        ],
        "errors": rows,
        "drivers": [d for pair, table in measured.items() for d in _drivers(pair, table[ANY_JOINT], plan)],
        "bins": [b for pair, table in measured.items() for b in _bins(pair, table[ANY_JOINT], plan)],
        "worst": [w for pair, table in measured.items() for w in _worst(pair, table, plan)],
    }


def _statuses(directory: Path) -> tuple[Counter[str], Counter[tuple[str, str]], dict[tuple[str, str], str]]:
    statuses: Counter[str] = Counter()
    reasons: Counter[tuple[str, str]] = Counter()
    examples: dict[tuple[str, str], str] = {}
    for path in sorted((directory / files.CASES).glob("part-*.parquet")):
        table = pq.read_table(path, columns=["case", "status", "reason"], page_checksum_verification=True).to_pydict()
        statuses.update(table["status"])
        for case, status, reason in zip(table["case"], table["status"], table["reason"], strict=True):
            if reason:
                # reasons differ in their numbers; what they have in common is counted
                kind = (status, NUMBER.sub("#", reason))
                reasons[kind] += 1
                examples.setdefault(kind, f"{case}: {reason}")
    return statuses, reasons, examples


def _errors(directory: Path, plan: Plan, campaign: Campaign) -> dict[tuple[str, str], dict[str, FloatArray]]:
    """Peak errors by candidate and reference, then by joint, ``(cases,)``; NaN where a case has none."""
    joints = plan.robot.joints
    pairs = [(c.name, c.reference) for c in campaign.candidate]
    found = {pair: {joint: np.full(plan.count, np.nan) for joint in joints} for pair in pairs}
    for path in sorted((directory / files.SUMMARY).glob("part-*.parquet")):
        names = ["index", "candidate", "reference", "joint", "kind", "peak_error"]
        table = pq.read_table(path, columns=names, page_checksum_verification=True)
        index = table.column("index").to_numpy()
        value = table.column("peak_error").to_numpy()
        labels = [np.asarray(table.column(n).to_pylist(), dtype=object) for n in ("candidate", "reference", "joint")]
        judged = np.asarray(table.column("kind").to_pylist(), dtype=object) != CONTRAST
        for pair in pairs:
            for joint in joints:
                kept = (labels[0] == pair[0]) & (labels[1] == pair[1]) & (labels[2] == joint) & judged
                found[pair][joint][index[kept]] = value[kept]
    for table in found.values():
        table[ANY_JOINT] = np.max(np.stack([table[joint] for joint in joints]), axis=0)
    return found


def _distribution(values: FloatArray, plan: Plan, limits: Sequence[float]) -> dict[str, Any]:
    known = np.flatnonzero(np.isfinite(values))
    if not len(known):
        return {"cases": 0, "mean": None, "max": None, "worst_case": None, "quantiles": {}, "below": {}}
    finite = values[known]
    worst = int(known[int(np.argmax(finite))])
    return {
        "cases": len(known),
        "mean": float(finite.mean()),
        "max": float(finite.max()),
        "worst_case": plan.recipe.case_name(worst),
        "quantiles": {f"{q:g}": float(v) for q, v in zip(QUANTILES, np.quantile(finite, QUANTILES), strict=True)},
        "below": {f"{limit:g}": float(np.mean(finite < limit)) for limit in limits},
    }


def _key(plan: Plan, column: int, campaign: Campaign) -> dict[str, Any]:
    change, values = plan.recipe.changes[column], plan.values[:, column]
    infos = plan.robot.description.table.infos
    info = next((infos[name] for name in change.parameters), None)
    assert campaign.sweep is not None
    factor = change.relative
    return {
        "key": change.key,
        "low": float(values.min()),
        "high": float(values.max()),
        "factor": factor,
        "unit": "1" if factor else (info.unit if info else ""),
        "meaning": info.meaning if info else ("speed of the motion" if change.key == "speed" else ""),
        "base": dict(change.parameters),
    }


def _drivers(pair: tuple[str, str], error: FloatArray, plan: Plan) -> list[dict[str, Any]]:
    """Spearman's rank correlation of the error with each key, the strongest first."""
    from scipy.stats import spearmanr

    known = np.isfinite(error)
    found: list[dict[str, Any]] = []
    for column, key in enumerate(plan.keys):
        values = plan.values[known, column]
        if len(values) < 3 or np.ptp(values) == 0.0 or np.ptp(error[known]) == 0.0:
            continue
        result = spearmanr(values, error[known])
        found.append({"key": key, "rank_correlation": float(result.statistic), "p_value": float(result.pvalue)})
    found.sort(key=lambda driver: -abs(driver["rank_correlation"]))
    return [{"candidate": pair[0], "reference": pair[1], "joint": ANY_JOINT} | driver for driver in found]


def _bins(pair: tuple[str, str], error: FloatArray, plan: Plan) -> list[dict[str, Any]]:
    """Median and 95th percentile of the error over each key, in bins that hold as many cases each."""
    known = np.flatnonzero(np.isfinite(error))
    found = []
    for column, key in enumerate(plan.keys):
        order = known[np.argsort(plan.values[known, column], kind="stable")]
        for members in np.array_split(order, BINS):
            if len(members):
                values = plan.values[members, column]
                found.append(
                    {
                        "candidate": pair[0], "reference": pair[1], "joint": ANY_JOINT, "key": key,
                        "low": float(values.min()), "high": float(values.max()), "cases": len(members),
                        "median": float(np.median(error[members])),
                        "p95": float(np.quantile(error[members], 0.95)),
                    }
                )  # fmt: skip
    return found


def _worst(pair: tuple[str, str], table: dict[str, FloatArray], plan: Plan) -> list[dict[str, Any]]:
    error = table[ANY_JOINT]
    known = np.flatnonzero(np.isfinite(error))
    order = known[np.argsort(-error[known], kind="stable")][:WORST]
    return [
        {
            "candidate": pair[0],
            "reference": pair[1],
            "case": plan.recipe.case_name(int(i)),
            "peak_error": float(error[i]),
            "joint": max(plan.robot.joints, key=lambda joint: float(table[joint][i])),
            "values": dict(zip(plan.keys, plan.numbers(int(i)), strict=True)),
        }
        for i in order
    ]


def concluded(summary: Mapping[str, Any]) -> Conclusion:
    """The verdict on a sweep from its summary."""
    bounded = any(row["kind"] == VERIFICATION for row in summary["errors"])
    return conclude_sweep(summary["counts"], bounded)
