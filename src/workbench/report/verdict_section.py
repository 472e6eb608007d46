"""The verdict in one sentence, and what was put to the test."""

from __future__ import annotations

from workbench.campaign.changed import sentences
from workbench.report.attention import attention
from workbench.report.concluded import LOOKS, conclusion_of
from workbench.report.load import Run
from workbench.report.manifest import Manifest
from workbench.report.section import Section
from workbench.report.tables import Cell, Status, Table, columns


def verdict_section(run: Run) -> Section:
    """Say in one sentence whether every bound holds, and list the formulas that were tested."""
    status, sentence = verdict(run)
    sentence = sentence[:1].upper() + sentence[1:]
    contrasts = {row.candidate for row in run.rows if row.kind == "contrast"}
    tested = sum(name not in contrasts for name in run.manifest.candidates)
    table = candidates_table(run.manifest)
    cases = _cases(len(run.manifest.cases))
    about = f"{model_text(run.manifest)}, {cases}, {tested} candidate{'s' if tested != 1 else ''}."
    context = {"status": status, "sentence": sentence, "about": about, "tables": [table]}
    context["attention"] = attention(run)
    context["diagnosis"] = {name: found for name, found in run.manifest.diagnosis.items() if found.findings}
    return Section("verdict", "Verdict", "verdict", context)


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


def _cases(number: int) -> str:
    return f"{number} case" if number == 1 else f"{number} cases"
