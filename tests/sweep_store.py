"""Stored results of a sweep that nobody computed: for tests of what is made of them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

JOINTS = ("q1", "q2", "q3")
STATUSES = ("passed", "failed", "invalid", "timeout", "killed", "filtered")
KEYS = ("parameters.m2", "parameters.payload", "speed")
Edit = Callable[[dict[str, Any], dict[str, Any], pd.DataFrame, pd.DataFrame], None]
"""Changes the manifest, sweep.json, the cases and the rows before they are stored."""

REASONS = {
    "failed": "distributed exceeds its bound on q2: 3e-07",
    "invalid": "peak_error of lumped is not a number",
    "timeout": "took longer than 20 s",
    "killed": "signal 9",
    "filtered": "t = 0.5 s: the rods cannot meet",
}


def make_sweep(folder: Path, count: int = 300, good: bool = False, edit: Edit | None = None) -> Path:
    """Write the run directory of a finished sweep; unless it is *good*, some cases end in every other way."""
    random = np.random.default_rng(7)
    cases = pd.DataFrame(
        {
            "index": np.arange(count),
            "case": [f"design-{i:06d}" for i in range(count)],
            "status": "passed", "reason": "", "key": "k", "series": "",
            KEYS[0]: np.geomspace(0.5, 2.0, count)[random.permutation(count)],
            KEYS[1]: np.linspace(0.0, 2.0, count)[random.permutation(count)],
            KEYS[2]: np.geomspace(0.25, 2.0, count)[random.permutation(count)],
        }
    )  # fmt: skip
    cases.loc[cases["index"] % 5 == 4, "status"] = "filtered"
    if not good:
        for place, status in enumerate(STATUSES[1:5]):
            cases.loc[cases["index"].isin([10 + place, 50 + place]), "status"] = status
    cases["reason"] = [REASONS.get(status, "") for status in cases.status]
    computed = cases[cases.status.isin(["passed", "failed"])]
    lumped = 0.02 * computed.speed * computed[KEYS[0]] ** 0.5 / (0.5 + computed[KEYS[1]])
    tables = []
    for place, joint in enumerate(JOINTS):
        for candidate, error in (
            ("distributed", np.where(computed.status == "failed", 3e-7, 1e-14 * (1 + random.random(len(computed))))),
            ("lumped", lumped * (1.0, 0.7, 0.9)[place]),
        ):
            modelling = candidate == "lumped"
            tables.append(
                pd.DataFrame(
                    {
                        "index": computed["index"],
                        "case": computed.case,
                        "candidate": candidate,
                        "reference": "distributed",
                        "joint": joint,
                        "peak_error": error,
                        "bound": np.nan if modelling else 1e-9,
                        "kind": "modelling" if modelling else "verification",
                        "verdict": "measured" if modelling else "pass",
                    }
                )
            )  # fmt: skip
    rows = pd.concat(tables).sort_values(["index", "candidate", "joint"], kind="stable").reset_index(drop=True)
    summary = {
        "format": 1, "campaign": "design_sweep", "case": "design", "method": "sobol", "seed": 7, "cases": count,
        "counts": {status: int((cases.status == status).sum()) for status in STATUSES},
        "keys": [
            {
                "key": key, "low": float(cases[key].min()), "high": float(cases[key].max()), "factor": place != 1,
                "unit": "1" if place != 1 else "kg",
                "meaning": ("mass of one rod", "load", "speed of the motion")[place],
                "base": {"m2_left": 0.3, "m2_right": 0.3} if place == 0 else {},
            }
            for place, key in enumerate(KEYS)
        ],
        "reasons": [
            {
                "status": status, "reason": reason, "cases": int((cases.status == status).sum()),
                "example": f"design-000010: {reason}",
            }
            for status, reason in REASONS.items()
            if (cases.status == status).any()
        ],
        "errors": [
            _distribution(rows[rows.candidate == candidate], candidate, joint)
            for candidate in ("distributed", "lumped")
            for joint in (*JOINTS, "any")
        ],
        "drivers": _drivers(computed, lumped),
        "bins": [b for key in KEYS for b in _bins(computed[key], lumped, key)],
    }  # fmt: skip
    manifest = {
        "format": 1,
        "campaign": "design_sweep",
        "title": "Many designs",
        "description": "When is the lumped model good enough?",
        "spec_file": "campaigns/design_sweep.toml",
        "spec": {
            "sweep": {
                "vary": [
                    {"key": KEYS[0], "low": 0.5, "high": 2.0, "scale": "log", "relative": True},
                    {"key": KEYS[1], "low": 0.0, "high": 2.0, "scale": "linear"},
                    {"key": KEYS[2], "low": 0.25, "high": 2.0, "scale": "log", "relative": True},
                ],
                "filter": {"inside_workspace": True, "singularity": None},
            }
        },
        "model": {"file": "models/asym.xml", "sha256": "0" * 64, "mechanism": "asym", "title": "A robot"},
        "joints": list(JOINTS),
        "coordinate_units": ["m", "rad", "rad"],
        "force_units": ["N", "N m", "N m"],
        "parameters": [{"name": "m2_left", "value": 0.3, "unit": "kg", "meaning": "mass", "source": "Table 1"}],
        "versions": {"workbench": "0"},
        "machine": {"system": "Linux"},
        "command": "workbench run campaigns/design_sweep.toml --jobs 4 --out=there --set a1=0.3 --fresh",
        "started": "2026-01-01T00:00:00+00:00",
        "seconds": 12.5,
        "status": "passed" if good else "failed",
        "candidates": {
            "distributed": {"mass_model": "distributed", "description": "all masses", "source": "here"},
            "lumped": {"mass_model": "lumped", "description": "half masses", "source": "there"},
        },
        "cases": {},
        "sweep": {"cases": count, "counts": summary["counts"]},
    }
    if edit:
        edit(manifest, summary, cases, rows)
    for name, table in (("cases", cases), ("summary", rows)):
        (folder / name).mkdir(parents=True)
        for number, first in enumerate(range(0, count, 2000)):
            kept = table[(table["index"] >= first) & (table["index"] < first + 2000)]
            kept.to_parquet(folder / name / f"part-{number:05d}.parquet", index=False)
    (folder / "sweep.json").write_text(json.dumps(summary), encoding="utf-8")
    (folder / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    return folder


def _distribution(rows: pd.DataFrame, candidate: str, joint: str) -> dict[str, Any]:
    known = rows if joint == "any" else rows[rows.joint == joint]
    errors = known.groupby("case").peak_error.max()
    return {
        "candidate": candidate, "reference": "distributed", "joint": joint, "cases": len(errors),
        "kind": "modelling" if candidate == "lumped" else "verification",
        "mean": errors.mean(), "max": errors.max(), "worst_case": errors.idxmax(),
        "quantiles": {f"{q:g}": errors.quantile(q) for q in (0.05, 0.5, 0.95, 0.99)},
        "below": {"0.01": float((errors < 0.01).mean()), "0.03": float((errors < 0.03).mean())},
    }  # fmt: skip


PAIR = {"candidate": "lumped", "reference": "distributed", "joint": "any"}


def _drivers(cases: pd.DataFrame, error: Any) -> list[dict[str, Any]]:
    found = [
        PAIR | {"key": key, "rank_correlation": cases[key].rank().corr(error.rank()), "p_value": 0.01} for key in KEYS
    ]
    return sorted(found, key=lambda driver: -abs(driver["rank_correlation"]))


def _bins(values: Any, error: Any, key: str) -> list[dict[str, Any]]:
    order = np.argsort(values.to_numpy(), kind="stable")
    return [
        PAIR
        | {
            "key": key, "low": values.iloc[m].min(), "high": values.iloc[m].max(), "cases": len(m),
            "median": error.iloc[m].median(), "p95": error.iloc[m].quantile(0.95),
        }
        for m in np.array_split(order, 10)
    ]  # fmt: skip
