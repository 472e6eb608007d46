"""What a reader has to look at though it changes no verdict: actuators that are too small, formulas not good enough."""

from __future__ import annotations

from workbench.campaign.changed import not_known
from workbench.campaign.good import YES, answers
from workbench.campaign.margins import Margin, margins, shortfalls
from workbench.report.load import Run
from workbench.report.manifest import Manifest
from workbench.report.tables import NOT_COMPUTED


def attention(run: Run) -> list[str]:
    """Say what needs attention, a sentence each; empty where nothing does.

    None of it is a failure of a formula against MuJoCo: the verdict stands beside it.
    """
    answered = answers(run.rows, run.manifest.good, unknown_cases(run.manifest))
    return [
        *shortfalls(margins_of(run.manifest)),
        *(found.sentence for found in answered if found.answer != YES),
    ]


def unknown_cases(manifest: Manifest) -> str:
    """Say of which cases nothing is known, since they were not computed; empty where there are none."""
    return not_known([name for name, record in manifest.cases.items() if record.status in NOT_COMPUTED])


def margins_of(manifest: Manifest) -> list[Margin]:
    """Every case held against every limit that the run knows."""
    units = zip(manifest.force_units, manifest.coordinate_units, strict=True)
    return margins(
        manifest.actuators,
        {name: record.demand.joints for name, record in manifest.cases.items()},
        dict(zip(manifest.joints, units, strict=True)),
    )
