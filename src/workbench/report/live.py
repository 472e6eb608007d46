"""A campaign run from Python, with functions of one's own as candidates: for scripts and notebooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from workbench.campaign.evidence import FULL, Effort
from workbench.campaign.run import run_campaign
from workbench.campaign.user_candidates import Formula
from workbench.report.build import build_report
from workbench.report.frames import RunFrames, load_run


def run(
    campaign: str | Path,
    candidates: Sequence[Formula] = (),
    *,
    out: str | Path | None = None,
    model: str | Path | None = None,
    only: Sequence[str] = (),
    settings: Mapping[str, float] | None = None,
    quick: bool = False,
    keep_going: bool = False,
    replace: bool = False,
) -> RunFrames:
    """Run a campaign of cases, write its run directory with the report, and return its results.

    Parameters
    ----------
    campaign
        Campaign file, or the name of one that comes along.
    candidates
        Functions, as `workbench.candidate` takes them and registered or not, or Python files with such functions. One
        that is not registered is measured, not judged: it has no bound.
    out, model, only, settings
        As `workbench run`: run directory (``reports/NAME``), another model, cases, parameters over all others.
    quick
        Errors only: no power balance, no forward replay.
    keep_going, replace
        As `workbench run`: go on past cases that cannot be driven; replace an earlier run that holds more or another
        robot.

    Raises
    ------
    WorkbenchError
        Bad input, in one line; then nothing was written.
    """
    outcome = run_campaign(
        campaign, out, model=model, only=only, settings=settings, candidates=candidates,
        effort=Effort(budget=False) if quick else FULL, report=build_report,
        keep_going=keep_going, replace=replace,
    )  # fmt: skip
    return load_run(outcome.directory)
