"""The verdict in one sentence, and what was put to the test."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from workbench.campaign.changed import sentences
from workbench.report.attention import attention
from workbench.report.concluded import LOOKS, conclusion_of
from workbench.report.first_screen import compared, points
from workbench.report.load import Run
from workbench.report.manifest import Manifest
from workbench.report.overview import overview_plot
from workbench.report.pictures import Film
from workbench.report.plot import Plot
from workbench.report.section import Section
from workbench.report.tables import Cell, Status, Table, columns


def verdict_section(
    run: Run, anchors: Mapping[str, str], film: Film | None = None, sketch: Plot | None = None
) -> Section:
    """Say what was compared and in one sentence whether every bound holds; show the robot and all cases at a glance.

    *film* and *sketch* show the robot: rendered where there is a picture, else drawn from the reference's points.
    """
    status, sentence = verdict(run)
    sentence = sentence[:1].upper() + sentence[1:]
    table = candidates_table(run.manifest)
    context: dict[str, Any] = {"status": status, "sentence": sentence, "tables": [table], "compared": compared(run)}
    context["about"] = f"{model_text(run.manifest)}."
    context["findings"] = points(run, anchors)
    context["still"] = film if film is not None and film.still else None
    context["sketch"] = sketch if context["still"] is None else None
    context["glance"] = overview_plot(run)
    context["attention"] = attention(run)
    context["diagnosis"] = {name: found for name, found in run.manifest.diagnosis.items() if found.findings}
    plots = tuple(plot for plot in (context["sketch"], context["glance"]) if plot is not None)
    return Section("verdict", "Verdict", "verdict", context, plots)


def candidates_table(manifest: Manifest) -> Table:
    """List the formulas that a campaign puts to the test."""
    return Table(
        "candidates",
        "The candidates: the formulas that this campaign puts to the test.",
        columns(("Candidate", "Mass model", "What it is", "Source")),
        tuple(
            (Cell(name), Cell(candidate.mass_model), Cell(candidate.description), Cell(candidate.source))
            for name, candidate in manifest.candidates.items()
        ),
        "The mass model is the assumption about the bars' masses that a formula shares with its reference.",
    )


def model_text(manifest: Manifest) -> str:
    """Name the mechanism, its paper and the model's file."""
    key = f" [{manifest.model.reference_key}]" if manifest.model.reference_key else ""
    return f"{manifest.model.title or manifest.model.mechanism}{key}, model {manifest.model.file}"


def circumstances(manifest: Manifest) -> tuple[str, ...]:
    """Say when and where the run was made: with what its formulas cost there, all that differs from run to run."""
    machine = ", ".join(f"{key} {value}" for key, value in manifest.machine.items())
    seconds = "" if manifest.seconds is None else f", in {manifest.seconds:.1f} s"
    told = [
        f"Run {manifest.started or 'at an unknown time'}{seconds}" + (f", on {machine}" if machine else ""),
        f"Git commit {manifest.git_commit}" if manifest.git_commit else "",
    ]
    return tuple(f"{text}." for text in told if text)


def changes(manifest: Manifest) -> list[str]:
    """Say what was changed of the robot that the claims are about, a sentence each; empty where nothing was."""
    return sentences(manifest.changes.model, manifest.changes.parameters, list(manifest.cases))


def verdict(run: Run) -> tuple[Status, str]:
    """Return the look of the run's verdict and its sentence."""
    found = conclusion_of(run)
    return LOOKS[found.status], found.sentence
