"""The sections of a report, in reading order. Each has one template for HTML and one for Markdown."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from workbench.report.actuator_section import actuator_section
from workbench.report.budget import budget_section
from workbench.report.campaign_figures import campaign_plot, error_over_plot
from workbench.report.case_section import CaseView, case_view
from workbench.report.error_sections import claims_section, worst_section
from workbench.report.good_section import good_section
from workbench.report.load import Run, Series
from workbench.report.manifest import FigureRecord, Manifest
from workbench.report.mechanism import robot_sketch
from workbench.report.pictures import film_of
from workbench.report.plot import Plot
from workbench.report.section import Section
from workbench.report.tables import CHECKED, NOT_COMPUTED, Cell, Table, columns
from workbench.report.text import error_fraction, exact, pretty_unit, scientific, slug
from workbench.report.verdict_section import verdict_section


@dataclass(frozen=True)
class FigureView:
    """A figure of the campaign: its plot, or the sentence that says why there is none."""

    record: FigureRecord
    cases: tuple[tuple[str, str | None], ...]
    """the cases that it shows, each with its anchor in the report"""
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
    figures = run.manifest.figures
    keys = _figure_keys(figures)
    drawn: dict[int, Plot | str] = {}
    views = []
    film = film_of(run)
    sketch: Plot | None = None
    for name, record in run.manifest.cases.items():
        series: Series | None = None if record.status in NOT_COMPUTED else run.series(name)
        views.append(case_view(run, name, anchors[name], series, film))
        if sketch is None and series is not None:
            sketch = robot_sketch(run, name, series)
        for index, figure in enumerate(figures):
            if figure.case == name and figure.kind != "error_over":
                drawn[index] = (
                    campaign_plot(run, figure, keys[index], series, anchors[name])
                    if series is not None
                    else f"Not drawn: case {name} was not computed."
                )
    for index, figure in enumerate(figures):
        if figure.kind == "error_over":
            drawn[index] = error_over_plot(run, figure, keys[index])
    sections = [
        verdict_section(run, anchors, film, sketch),
        good_section(run, anchors),
        claims_section(run),
        worst_section(run, anchors),
        actuator_section(run, anchors),
        budget_section(run, anchors),
        cases_section(run, views),
        figures_section(run, drawn, anchors),
        parameters_section(run.manifest),
        reproduce_section(run.manifest),
        limits_section(run),
    ]
    return [section for section in sections if section is not None]


def plots_of_case(run: Run, case: str, names: Sequence[str]) -> list[Plot]:
    """Return the figures of one case as `build_sections` has them in a run whose cases have all these *names*.

    Raises
    ------
    OutputError
        The series is missing or unreadable.
    """
    series = run.series(case)
    anchor = unique_keys("case", names)[case]
    found: list[Plot | str] = [*case_view(run, case, anchor, series).plots]
    figures = [figure for figure in run.manifest.figures if figure.case == case and figure.kind != "error_over"]
    found += [
        campaign_plot(run, figure, key, series, anchor)
        for figure, key in zip(figures, _figure_keys(figures), strict=True)
    ]
    return [plot for plot in found if isinstance(plot, Plot)]


def _figure_keys(figures: Sequence[FigureRecord]) -> list[str]:
    return list(unique_keys("figure", [f"{i}\n{figure.id}" for i, figure in enumerate(figures)]).values())


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


def cases_section(run: Run, views: list[CaseView]) -> Section:
    """List the cases and then show each."""
    rows = []
    for view in views:
        checked = [row for row in run.rows_of_case[view.name] if row.verdict in CHECKED]
        worst = max(checked, key=lambda row: row.badness) if checked else None
        rows.append(
            (
                Cell(view.name, link=view.anchor),
                Cell(view.record.title),
                Cell(status=view.status),
                Cell("–" if view.record.samples is None else str(view.record.samples), view.record.samples),
                Cell(exact(view.record.peak_speed), view.record.peak_speed),
                Cell(exact(view.record.peak_acceleration), view.record.peak_acceleration),
                Cell(error_fraction(worst.peak_error) if worst else "–", worst.peak_error if worst else None),
            )
        )
    names = ("Case", "Title", "Status", "Samples", "Peak speed [m/s]", "Peak acceleration [m/s²]", "Worst check")
    table = Table(
        "cases",
        "All cases of the campaign in its order.",
        columns(names, numeric=names[3:]),
        tuple(rows),
        "Speed and acceleration are the platform's; the last column is the largest peak error among the errors "
        "of the case that have a bound to keep.",
    )
    plots = tuple(plot for view in views for plot in view.plots)
    return Section("cases", "Cases", "cases", {"tables": [table], "views": views}, plots)


def figures_section(run: Run, drawn: Mapping[int, Plot | str], anchors: Mapping[str, str]) -> Section | None:
    """Redraw the figures that the campaign declares."""
    if not run.manifest.figures:
        return None
    views = []
    for index, record in enumerate(run.manifest.figures):
        found = drawn.get(index, f"Not drawn: case {record.case} is not part of this run.")
        plot, missing = (None, found) if isinstance(found, str) else (found, "")
        names = (record.case,) if record.case is not None else record.cases
        views.append(FigureView(record, tuple((name, anchors.get(name)) for name in names), plot, missing))
    plots = tuple(view.plot for view in views if view.plot is not None)
    return Section("figures", "Figures of the papers, redrawn", "figures", {"views": views}, plots)


def parameters_section(manifest: Manifest) -> Section:
    """List the model's parameters with units and sources."""
    rows = tuple(
        (
            Cell(parameter.name),
            Cell(exact(parameter.value, 10), parameter.value),
            Cell("–" if parameter.unit in ("", "1") else pretty_unit(parameter.unit)),
            Cell(parameter.meaning),
            Cell(parameter.source),
        )
        for parameter in manifest.parameters
    )
    table = Table(
        "parameters",
        "The mechanism's parameters as read from the compiled model, SI.",
        columns(("Parameter", "Value", "Unit", "Meaning", "Source"), numeric=("Value",)),
        rows,
        "A case may change some of them; its section then says so. Closed form and reference always use the same "
        "values.",
    )
    counted = Table(
        "mobility",
        "The mechanism's freedoms as counted on paper; the numerical count stands with each case.",
        columns(("Quantity", "Number"), numeric=("Number",)),
        tuple((Cell(name), Cell(str(value), value)) for name, value in manifest.mobility_count.items()),
        "Counted by the formula of the mechanism's source; it agrees when the mobility equals each case's.",
    )
    tables = [table for table in (table, counted) if table.rows]
    return Section("parameters", "Parameters", "tables", {"tables": tables}, is_open=False)


def reproduce_section(manifest: Manifest) -> Section:
    """Say how to get the same numbers again."""
    rows = [
        ("Campaign", manifest.spec_file or manifest.campaign),
        ("Model", manifest.model.file),
        ("Model SHA-256", manifest.model.sha256),
        ("Mechanism", manifest.model.mechanism),
        *([("Engines", ", ".join(manifest.engines))] if manifest.engines else []),
        ("Documents cited as docs/…", "workbench docs NAME prints them, without a checkout too"),
        *((f"Version of {name}", version) for name, version in manifest.versions.items()),
    ]
    table = Table(
        "reproduce",
        "What the command needs to give the same numbers again.",
        columns(("Item", "Value")),
        tuple((Cell(what), Cell(value)) for what, value in rows),
        "Same command, model and versions: same numbers, bit for bit; another version of a library may move the "
        "last digits. When and where this run was made stands at the top.",
    )
    spec = json.dumps(manifest.spec, indent=1, ensure_ascii=False, default=str) if manifest.spec else ""
    return Section(
        "reproduce",
        "How to reproduce",
        "reproduce",
        {"command": manifest.command, "tables": [table], "spec": spec},
        is_open=False,
    )


NO_REAL_ROBOT = (
    "This verifies formulas against a simulator. It does not validate either against a real robot: friction, "
    "clearance, elasticity and everything else that the model leaves out is left out on both sides."
)


def limits_section(run: Run) -> Section:
    """Say what the numbers do not prove."""
    records = [record for record in run.manifest.cases.values() if record.closure_residual is not None]
    closure = max((record.closure_residual or 0.0 for record in records), default=math.nan)
    warned = sum(len(record.warnings) for record in run.manifest.cases.values())
    broken = sum(record.status in NOT_COMPUTED for record in run.manifest.cases.values())
    points = [
        NO_REAL_ROBOT,
        "Both sides read their parameters from the same model file, so a wrong mass in that file is invisible here.",
        "The reference is a numerical calculation of its own: "
        + (
            f"its loops close to {scientific(closure)} m at worst over all cases, and "
            if math.isfinite(closure)
            else "its loop closure was not recorded, and "
        )
        + "double precision carries about 16 digits, so errors near 1e-15 are round-off and their order means nothing.",
        "Verification covers the motions, payloads and poses of these cases and no others; the largest error is "
        "the largest "
        "at the stored samples.",
        "A modelling error depends on the motion; a number measured here does not carry over to another one.",
    ]
    if warned:
        points.append(
            f"{warned} warning{'s' if warned > 1 else ''} about poses near a singularity stand with their cases."
        )
    if broken:
        points.append(f"{broken} case{'s' if broken > 1 else ''} could not be computed; nothing is known about them.")
    return Section("limits", "Limits and caveats", "limits", {"points": points})
