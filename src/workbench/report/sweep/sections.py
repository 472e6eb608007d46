"""The sections of a sweep's report, in reading order."""

from __future__ import annotations

import dataclasses

import numpy as np

from workbench.campaign.conclusion import GOOD
from workbench.campaign.margins import IN_SWEEPS
from workbench.report.section import Section
from workbench.report.sections import NO_REAL_ROBOT, parameters_section, reproduce_section
from workbench.report.sweep.cases import trouble_section, worst_section
from workbench.report.sweep.drivers import drivers_section
from workbench.report.sweep.errors import errors_section
from workbench.report.sweep.heat import heat_section
from workbench.report.sweep.load import SweepRun
from workbench.report.sweep.picker import picker_data
from workbench.report.sweep.varied import varied_section
from workbench.report.sweep.verdict import number, verdict_section


def sweep_sections(run: SweepRun) -> list[Section]:
    """Return all sections of a sweep's report; figures are drawn when they are asked for."""
    sections = [
        verdict_section(run),
        varied_section(run),
        errors_section(run),
        drivers_section(run),
        _maps_section(run),
        worst_section(run),
        trouble_section(run),
        parameters_section(run.manifest),
        reproduce_section(run.manifest),
        _limits_section(run),
    ]
    return [section for section in sections if section is not None]


def _maps_section(run: SweepRun) -> Section | None:
    """Show maps over the strongest drivers, and let the reader choose any other two numbers where scripts run."""
    section = heat_section(run)
    if section is None:
        return None
    pairs = dict.fromkeys((d.candidate, d.reference) for d in run.summary.drivers)
    pickers = [(f"{candidate} against the {reference} reference", picker_data(run, (candidate, reference)))
               for candidate, reference in pairs]  # fmt: skip
    told = [picker for picker in pickers if picker[1]]
    return dataclasses.replace(section, context={**section.context, "pickers": told})


def _limits_section(run: SweepRun) -> Section:
    known = max((int(np.isfinite(errors).sum()) for errors in run.worst.values()), default=0)
    lost = sum(count for name, count in run.summary.counts.items() if name not in GOOD)
    points = [
        NO_REAL_ROBOT,
        *([IN_SWEEPS] if run.manifest.actuators else []),
        "Shares and quantiles are of these designs: they say how the error is spread over the ranges that the campaign "
        "chose, with the weight that it gave them, and not how likely a design is.",
        "Every design follows the case's motion, made faster or slower where the campaign says so. On another path the "
        "error of a model is another one.",
        "A rank correlation sees what rises or falls throughout; an error that is largest in the middle of a range can "
        "have a correlation of nought. The maps show such courses.",
        "The largest error of a design is the largest at its samples, and the largest over the designs is a lower "
        "limit of what the ranges hold: more designs find larger ones.",
    ]
    if known < run.summary.cases:
        also = f", or did not pass ({number(lost)})" if lost else ""
        points.append(
            f"{number(run.summary.cases - known)} of {number(run.summary.cases)} cases have no error: they were left "
            f"out{also}. What is said of the others does not hold for them."
        )
    return Section("limits", "Limits and caveats", "limits", {"points": points})
