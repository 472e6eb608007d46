"""Single cases of a sweep: the worst designs with their numbers, and what did not pass, with reasons."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

import numpy as np

from workbench.campaign.conclusion import GOOD
from workbench.campaign.verdict import WITHOUT_BOUND
from workbench.report.section import Section
from workbench.report.sweep.load import SweepRun
from workbench.report.sweep.varied import label_of
from workbench.report.sweep.verdict import number, status_of
from workbench.report.tables import Cell, Table, columns
from workbench.report.text import exact, percent, scientific, torque_label

WORST = {True: 10, False: 5}
"""Designs listed: of a modelling error, of a verification."""
SHOWN = 30
"""Cases that did not pass, one by one; the table of reasons counts them all."""
ONE_ARGUMENT = ("--out", "--jobs", "--scheduler")
ALONE = ("--fresh", "--retry-failed")


def worst_section(run: SweepRun) -> Section | None:
    """List the designs with the largest errors, with what each of them is made of."""
    tables, names = [], []
    for place, (candidate, reference, kind) in enumerate(
        sorted(run.summary.pairs, key=lambda pair: pair[2] not in WITHOUT_BOUND)
    ):
        indices = worst_cases(run, (candidate, reference), WORST[kind in WITHOUT_BOUND])
        if indices:
            tables.append(_worst_table(run, place, candidate, reference, kind in WITHOUT_BOUND, indices))
            names.append(run.name(indices[0]))
    if not tables:
        return None
    command = rerun_command(run, names[0])
    context = {"paragraphs": [RERUN] if command else [], "command": command, "tables": tables, "figures": []}
    return Section("worst", "The worst designs", "sweep", context)


RERUN = (
    "One design alone, with all its curves, its budget and its own report: run the campaign with the design's name. "
    "This computes the first one below; put the name of another in its place."
)


def worst_cases(run: SweepRun, pair: tuple[str, str], count: int) -> list[int]:
    """Return the cases with the largest error on any joint, largest first."""
    errors = run.worst[pair]
    known = np.flatnonzero(np.isfinite(errors))
    order = known[np.argsort(-errors[known], kind="stable")][:count]
    return [int(index) for index in order]


def rerun_command(run: SweepRun, case: str) -> str:
    """Return the command that computes one case alone; empty where the run does not say how it was made."""
    try:
        words = shlex.split(run.manifest.command)
    except ValueError:
        return ""
    if words[1:2] != ["run"]:
        return f"workbench run {shlex.quote(run.manifest.spec_file)} --only {shlex.quote(case)}"
    kept: list[str] = []
    skip = False
    for word in words:
        if skip or word in ALONE or word.partition("=")[0] in ONE_ARGUMENT:
            skip = not skip and word in ONE_ARGUMENT
            continue
        kept.append(word)
    return shlex.join([*kept, "--only", case])


def _worst_table(
    run: SweepRun, place: int, candidate: str, reference: str, modelling: bool, indices: Sequence[int]
) -> Table:
    write = percent if modelling else scientific
    joints = run.manifest.joints
    keys = [label_of(key) for key in run.summary.keys]
    kept = any(run.series(index) for index in indices)
    headings = [torque_label(joint, run.manifest.unit_of(joint)) for joint in joints]
    names = ["Case", *(["Series"] if kept else []), *headings, *keys]
    rows = []
    for index in indices:
        errors = run.errors[candidate, reference][index]
        cells = [Cell(run.name(index))]
        if kept:
            cells.append(_series_cell(run, index))
        cells += [Cell(write(float(error)), float(error), emphasis=bool(error == errors.max())) for error in errors]
        cells += [Cell(exact(float(value)), float(value)) for value in run.values[index]]
        rows.append(tuple(cells))
    bound = run.bounds.get((candidate, reference))
    judged = f" Each has to stay below {exact(bound)}." if bound is not None else ""
    return Table(
        f"worst-{place + 1}",
        f"The {len(rows)} designs with the largest error of {candidate} against the {reference} reference.",
        columns(names, numeric=[*headings, *keys]),
        tuple(rows),
        f"Under each joint its peak error, max|Δτ| / max|τ_ref|, the design's largest in bold.{judged} Then "
        "the numbers that make the design.",
    )


def _series_cell(run: SweepRun, index: int) -> Cell:
    path = run.series(index)
    return Cell("series", file=path) if path else Cell("–")


def trouble_section(run: SweepRun) -> Section | None:
    """Say why cases did not pass or were left out; None where all passed."""
    tables = [table for table in (_reasons(run), _not_passed(run)) if table.rows]
    if not tables:
        return None
    return Section("reasons", "What did not pass, and what was left out", "tables", {"tables": tables})


def _reasons(run: SweepRun) -> Table:
    order = sorted(run.summary.reasons, key=lambda reason: reason.status in GOOD)
    return Table(
        "reasons",
        "Why cases did not pass or were left out, the most frequent reasons first.",
        columns(("Outcome", "Cases", "Reason", "Example"), numeric=("Cases",)),
        tuple(
            (
                Cell(status=status_of(reason.status)),
                Cell(number(reason.cases), reason.cases),
                Cell(reason.reason),
                Cell(reason.example),
            )
            for reason in order
        ),
        "Reasons that differ in their numbers alone are counted together, with # in place of each number.",
    )


def _not_passed(run: SweepRun) -> Table:
    found = np.flatnonzero(~np.isin(run.status.astype(str), GOOD))
    keys = [label_of(key) for key in run.summary.keys]
    shown = [int(index) for index in found[:SHOWN]]
    kept = any(run.series(index) for index in shown)
    rows = tuple(
        (
            Cell(run.name(index)),
            Cell(status=status_of(str(run.status[index]))),
            *([_series_cell(run, index)] if kept else []),
            Cell(run.reason(index)),
            *(Cell(exact(float(value)), float(value)) for value in run.values[index]),
        )
        for index in shown
    )
    more = f"the first {len(shown)} of {number(len(found))}" if len(found) > len(shown) else "all of them"
    return Table(
        "not-passed",
        f"The cases that did not pass, {more}.",
        columns(("Case", "Outcome", *(["Series"] if kept else []), "Reason", *keys), numeric=keys),
        rows,
        "After the reason stand the numbers that make the case; cases/ in the run directory holds every case.",
    )
