"""One compact table for a paper: of each formula the largest error on each joint over all cases."""

from __future__ import annotations

import math
from collections.abc import Sequence

from workbench.campaign.changed import ANOTHER, sentences
from workbench.report.load import ErrorRow, Run
from workbench.report.manifest import Manifest
from workbench.report.tables import FAILURES, Cell, Table, columns
from workbench.report.text import exact, torque_label

PERCENT_FROM = 1e-6
"""Smaller errors are powers of ten."""


def paper_table(run: Run) -> Table:
    """Return the table; formulas in the order of the campaign, each against each of its references."""
    groups: dict[tuple[str, str], list[ErrorRow]] = {}
    for row in run.rows:
        if row.kind != "contrast":
            groups.setdefault((row.candidate, row.reference), []).append(row)
    joints = run.manifest.joints
    rows = []
    for (candidate, reference), found in groups.items():
        cells = [_worst([row for row in found if row.joint == joint]) for joint in joints]
        rows.append((Cell(candidate), Cell(reference), *cells))
    titles = [torque_label(joint, run.manifest.unit_of(joint)) for joint in joints]
    computed = sum(record.samples is not None for record in run.manifest.cases.values())
    samples = sum(record.samples or 0 for record in run.manifest.cases.values())
    return Table(
        "paper",
        f"Largest errors of formulas for {_robot(run.manifest)} against MuJoCo [MuJoCo] over"
        f" {computed} {'case' if computed == 1 else 'cases'}, {samples} samples.",
        columns(("Formula", "MuJoCo masses", *titles), titles),
        tuple(rows),
        "max|Δτ| / max|τ_ref| of each joint, of the worst case. Equal masses on both sides verify a formula, others"
        " measure what its assumption costs." + _dagger(run.rows) + _changed(run.manifest),
    )


def _robot(manifest: Manifest) -> str:
    key = f" [{manifest.model.reference_key}]" if manifest.model.reference_key else ""
    return f"the robot “{manifest.model.title or manifest.model.mechanism}”{key}"


def _changed(manifest: Manifest) -> str:
    said = sentences(manifest.changes.model, manifest.changes.parameters, list(manifest.cases))
    return f" {ANOTHER}: {' '.join(said)}" if said else ""


def _dagger(rows: Sequence[ErrorRow]) -> str:
    return " Bold: beyond its bound." if any(row.verdict in FAILURES for row in rows) else ""


def _worst(rows: Sequence[ErrorRow]) -> Cell:
    if not rows:
        return Cell("–")
    row = max(rows, key=lambda one: math.inf if math.isnan(one.peak_error) else one.peak_error)
    value = row.peak_error
    if not math.isfinite(value):
        text = exact(value)
    elif value < PERCENT_FROM:
        text = f"{value:.0e}"
    else:
        text = f"{100 * value:.2g} %" if value < 0.1 else f"{100 * value:.0f} %"
    return Cell(text, value, emphasis=any(one.verdict in FAILURES for one in rows))
