"""The sections of a report, in reading order. Each has one template for HTML and one for Markdown."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from workbench.report.case_section import ERRORS_DEFINED, CaseView, case_view, joint_heading
from workbench.report.figures import Plot, campaign_plot
from workbench.report.load import ErrorRow, Run, Series
from workbench.report.manifest import FigureRecord
from workbench.report.tables import (
    CASE_STATUS,
    CLAIM_STATUS,
    ERROR,
    FAILED,
    PASSED,
    Cell,
    Status,
    Table,
    columns,
    verdict_status,
)
from workbench.report.text import error_fraction, exact, percent, scientific, slug, with_unit

WORST_ROWS = 12
"""How many verification rows the table of worst errors shows; the cases' own tables show all."""


@dataclass(frozen=True)
class Section:
    """One section: ``template`` names a pair of files, ``template.html.j2`` and ``template.md.j2``."""

    key: str
    title: str
    template: str
    context: Mapping[str, Any]
    plots: tuple[Plot, ...] = field(default=())


@dataclass(frozen=True)
class FigureView:
    """A figure of the campaign: its plot, or the sentence that says why there is none."""

    record: FigureRecord
    case_anchor: str | None
    plot: Plot | None
    missing: str = ""


def build_sections(run: Run) -> list[Section]:
    """Return all sections of the report in reading order; series are read once per case.

    Raises
    ------
    OutputError
        A series file is missing or unreadable.
    """
    anchors = unique_keys("case", run.manifest.cases)
    wanted: dict[str, list[int]] = {}
    for index, figure in enumerate(run.manifest.figures):
        wanted.setdefault(figure.case, []).append(index)
    figure_keys = list(unique_keys("figure", [f"{i}\n{f.id}" for i, f in enumerate(run.manifest.figures)]).values())
    drawn: dict[int, Plot | str] = {}
    views = []
    for name, record in run.manifest.cases.items():
        series: Series | None = None if record.status == "error" else run.series(name)
        views.append(case_view(run, name, anchors[name], series))
        for index in wanted.get(name, []):
            figure = run.manifest.figures[index]
            drawn[index] = (
                campaign_plot(run, figure, figure_keys[index], series)
                if series is not None
                else f"Not drawn: case {name} ended in an error."
            )
    sections = [
        verdict_section(run),
        claims_section(run),
        worst_section(run, anchors),
        cases_section(run, views),
        figures_section(run, drawn, anchors),
        parameters_section(run),
        reproduce_section(run),
        limits_section(run),
    ]
    return [section for section in sections if section is not None]


def unique_keys(prefix: str, names: Any) -> dict[str, str]:
    """Give each name a key that is safe in file names and anchors, and different from the others' keys.

    A name may carry a number and a line break in front, which tell equal names apart and do not show in the key.
    """
    keys: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        base = f"{prefix}-{slug(name.partition(chr(10))[2] or name)}"
        key, number = base, 2
        while key in taken:
            key, number = f"{base}-{number}", number + 1
        taken.add(key)
        keys[name] = key
    return keys


def verdict_section(run: Run) -> Section:
    """Say in one sentence whether every bound holds."""
    status, sentence = verdict(run)
    context = {"status": status, "sentence": sentence, "manifest": run.manifest}
    return Section("verdict", "Verdict", "verdict", context)


def verdict(run: Run) -> tuple[Status, str]:
    """Return the overall status and the sentence; a failed row or case is never hidden by the manifest's own status."""
    checked = [row for row in run.rows if row.is_verification]
    failed = [row for row in checked if row.verdict == "fail"]
    broken = [name for name, record in run.manifest.cases.items() if record.status == "error"]
    cases = len(run.manifest.cases)
    errors = f"{len(broken)} of {cases} cases could not be computed ({', '.join(broken)})" if broken else ""
    if not checked:
        return (ERROR if broken else Status("undecided", "?", "UNDECIDED")), (
            (f"{errors}; " if errors else "") + "no formula was held against a bound, so nothing is verified."
        )
    worst = max(checked, key=lambda row: row.badness)
    where = f"{worst.candidate} on joint {worst.joint} in case {worst.case}"
    size = f"{scientific(worst.peak_error)} of the reference's peak against a bound of {exact(worst.bound)}"
    if failed or run.manifest.status == "failed":
        also = f", and {errors}" if errors else ""
        return FAILED, f"{len(failed)} of {len(checked)} verifications exceed their bound; worst is {where}: {size}{also}."
    if broken or run.manifest.status == "error":
        return Status("error", "⚠", "ERROR", loud=True), (
            f"{errors or 'the run ended in an error'}; the {len(checked)} verifications that were made hold their bounds."
        )
    return PASSED, (
        f"All {len(checked)} verifications in {cases} case{'s' if cases > 1 else ''} hold their bounds; worst is {where}: {size}."
    )


def claims_section(run: Run) -> Section | None:
    """Hold what the papers claim against what was measured."""
    if not run.manifest.claims:
        return None
    rows = []
    for claim in run.manifest.claims:
        limit = "at most " if claim.kind == "upper" else ""
        rows.append(
            (
                Cell(claim.text),
                Cell(claim.source),
                Cell(limit + with_unit(exact(claim.claimed), claim.unit), claim.claimed),
                Cell("–" if claim.measured is None else with_unit(exact(claim.measured), claim.unit), claim.measured),
                Cell(status=CLAIM_STATUS[claim.holds]),
                Cell(claim.note),
            )
        )
    table = Table(
        "claims",
        "What the papers claim, next to what this run measured.",
        columns(("Claim", "Source", "Claimed", "Measured", "Verdict", "Note"), numeric=("Claimed", "Measured")),
        tuple(rows),
        "A claim that does not hold is a finding about the paper, not a failure of this run; “cannot be decided” means that "
        "this run holds no measurement that could confirm or refute it.",
    )
    return Section("claims", "The papers' claims", "tables", {"tables": [table], "blocks": []})


def worst_section(run: Run, anchors: Mapping[str, str]) -> Section:
    """Show the worst verification rows and then all modelling errors, largest first."""
    checked = sorted((row for row in run.rows if row.is_verification), key=lambda row: -row.badness)
    tables = [_worst_table(run, checked, anchors), _modelling_table(run, anchors)]
    return Section("worst", "Worst errors first", "tables", {"tables": [table for table in tables if table.rows]})


def _worst_table(run: Run, checked: list[ErrorRow], anchors: Mapping[str, str]) -> Table:
    shown = checked[:WORST_ROWS]
    names = ("Case", "Candidate", "Reference", "Joint", "Peak error", "Bound", "Error / bound", "Worst at", "Verdict")
    rows = tuple(
        (
            Cell(row.case, link=anchors[row.case]),
            Cell(row.candidate),
            Cell(row.reference),
            Cell(joint_heading(run, row.joint)),
            Cell(error_fraction(row.peak_error), row.peak_error, emphasis=True),
            Cell(exact(row.bound), row.bound),
            Cell(exact(row.peak_error / row.bound, 3) if row.bound else "–", row.peak_error),
            Cell(f"{exact(row.worst_time_s)} s", row.worst_time_s),
            Cell(status=verdict_status(row.verdict)),
        )
        for row in shown
    )
    rest = len(checked) - len(shown)
    more = f" The other {rest} rows are smaller and stand in the sections of their cases." if rest else ""
    return Table(
        "worst-verification",
        f"Verification: the {len(shown)} largest errors of a closed form against the reference with the same mass model, "
        "measured in their bounds.",
        columns(names, numeric=("Peak error", "Bound", "Error / bound", "Worst at")),
        rows,
        f"Peak error is max|Δτ| / max|τ_ref| of that joint over the case; below 1 in “Error / bound” the row passes.{more}",
    )


def _modelling_table(run: Run, anchors: Mapping[str, str]) -> Table:
    grouped: dict[tuple[str, str, str], dict[str, ErrorRow]] = {}
    for row in run.rows:
        if not row.is_verification:
            grouped.setdefault((row.case, row.candidate, row.reference), {})[row.joint] = row
    order = sorted(grouped.items(), key=lambda item: -max(row.badness for row in item[1].values()))
    rows = []
    for (case, candidate, reference), by_joint in order:
        largest = max(by_joint.values(), key=lambda row: row.badness)
        cells = [
            Cell(percent(row.peak_error), row.peak_error, emphasis=row is largest) if (row := by_joint.get(joint)) else Cell("–")
            for joint in run.manifest.joints
        ]
        rows.append((Cell(case, link=anchors[case]), Cell(candidate), Cell(reference), *cells))
    joints = [joint_heading(run, joint) for joint in run.manifest.joints]
    return Table(
        "worst-modelling",
        "Modelling error: how far a formula with one assumption about the masses is from a reference with another, largest first.",
        columns(("Case", "Candidate", "Reference", *joints), numeric=joints),
        tuple(rows),
        "Peak error max|Δτ| / max|τ_ref| per joint, in percent of the reference's peak on that joint, the row's largest in "
        "bold; percentages of forces and of torques are not comparable and are never averaged.",
    )


def cases_section(run: Run, views: list[CaseView]) -> Section:
    """List the cases and then show each."""
    rows = []
    for view in views:
        checked = [row for row in run.rows_of_case[view.name] if row.is_verification]
        worst = max(checked, key=lambda row: row.badness) if checked else None
        rows.append(
            (
                Cell(view.name, link=view.anchor),
                Cell(view.record.title),
                Cell(status=CASE_STATUS[view.record.status]),
                Cell("–" if view.record.samples is None else str(view.record.samples), view.record.samples),
                Cell(exact(view.record.peak_speed), view.record.peak_speed),
                Cell(exact(view.record.peak_acceleration), view.record.peak_acceleration),
                Cell(error_fraction(worst.peak_error) if worst else "–", worst.peak_error if worst else None),
            )
        )
    names = ("Case", "Title", "Status", "Samples", "Peak speed [m/s]", "Peak acceleration [m/s²]", "Worst verification")
    table = Table(
        "cases",
        "All cases of the campaign in its order.",
        columns(names, numeric=names[3:]),
        tuple(rows),
        "Speed and acceleration are the platform's; the last column is the largest peak error among the case's verifications.",
    )
    plots = tuple(plot for view in views for plot in view.plots)
    return Section("cases", "Cases", "cases", {"tables": [table], "views": views, "defined": ERRORS_DEFINED}, plots)


def figures_section(run: Run, drawn: Mapping[int, Plot | str], anchors: Mapping[str, str]) -> Section | None:
    """Redraw the figures that the campaign declares."""
    if not run.manifest.figures:
        return None
    views = []
    for index, record in enumerate(run.manifest.figures):
        found = drawn.get(index, f"Not drawn: case {record.case} is not part of this run.")
        plot, missing = (None, found) if isinstance(found, str) else (found, "")
        views.append(FigureView(record, anchors.get(record.case), plot, missing))
    plots = tuple(view.plot for view in views if view.plot is not None)
    return Section("figures", "Figures of the papers, redrawn", "figures", {"views": views}, plots)


def parameters_section(run: Run) -> Section:
    """List the model's parameters with units and sources."""
    rows = tuple(
        (
            Cell(parameter.name),
            Cell(exact(parameter.value, 10), parameter.value),
            Cell("–" if parameter.unit in ("", "1") else with_unit("", parameter.unit).strip()),
            Cell(parameter.meaning),
            Cell(parameter.source),
        )
        for parameter in run.manifest.parameters
    )
    table = Table(
        "parameters",
        "The mechanism's parameters as read from the compiled model, SI.",
        columns(("Parameter", "Value", "Unit", "Meaning", "Source"), numeric=("Value",)),
        rows,
        "A case may change some of them; its section then says so. Closed form and reference always use the same values.",
    )
    return Section("parameters", "Parameters", "tables", {"tables": [table] if rows else []})


def reproduce_section(run: Run) -> Section:
    """Say how to get the same numbers again."""
    manifest = run.manifest
    rows = [
        ("Campaign", manifest.spec_file or manifest.campaign),
        ("Model", manifest.model.file),
        ("Model SHA-256", manifest.model.sha256),
        ("Mechanism", manifest.model.mechanism),
        ("Git commit", manifest.git_commit or "not a git checkout"),
        ("Started", manifest.started),
        ("Finished", manifest.finished),
        ("Run time", "–" if manifest.seconds is None else f"{manifest.seconds:.1f} s"),
        ("Machine", ", ".join(f"{key} {value}" for key, value in manifest.machine.items())),
        *((f"Version of {name}", version) for name, version in manifest.versions.items()),
    ]
    table = Table(
        "reproduce",
        "What the command needs to give the same numbers again.",
        columns(("Item", "Value")),
        tuple((Cell(what), Cell(value)) for what, value in rows),
        "Same command, model and versions: same numbers, bit for bit; another version of a library may move the last digits.",
    )
    spec = json.dumps(manifest.spec, indent=1, ensure_ascii=False, default=str) if manifest.spec else ""
    return Section("reproduce", "How to reproduce", "reproduce", {"command": manifest.command, "tables": [table], "spec": spec})


def limits_section(run: Run) -> Section:
    """Say what the numbers do not prove."""
    records = [record for record in run.manifest.cases.values() if record.closure_residual is not None]
    closure = max((record.closure_residual or 0.0 for record in records), default=math.nan)
    warned = sum(len(record.warnings) for record in run.manifest.cases.values())
    broken = sum(record.status == "error" for record in run.manifest.cases.values())
    points = [
        "This verifies formulas against a simulator. It does not validate either against a real robot: friction, clearance, "
        "elasticity and everything else that the model leaves out is left out on both sides.",
        "Both sides read their parameters from the same model file, so a wrong mass in that file is invisible here.",
        "The reference is a numerical calculation of its own: "
        + (
            f"its loops close to {scientific(closure)} m at worst over all cases, and "
            if math.isfinite(closure)
            else "its loop closure was not recorded, and "
        )
        + "double precision carries about 16 digits, so errors near 1e-15 are round-off and their order means nothing.",
        "Verification covers the motions, payloads and poses of these cases and no others; the largest error is the largest "
        "at the stored samples.",
        "A modelling error depends on the motion; a number measured here does not carry over to another one.",
    ]
    if warned:
        points.append(f"{warned} warning{'s' if warned > 1 else ''} about poses near a singularity stand with their cases.")
    if broken:
        points.append(f"{broken} case{'s' if broken > 1 else ''} could not be computed; nothing is known about them.")
    return Section("limits", "Limits and caveats", "limits", {"points": points})
