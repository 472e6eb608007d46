"""A campaign's cases, run and printed; a process draws figures of a case meanwhile, and writes the report."""

from __future__ import annotations

import dataclasses
import gc
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from workbench.drawing_process import DrawingProcess
from workbench.processes import cores

if TYPE_CHECKING:
    from workbench.campaign.cases import Case
    from workbench.campaign.evidence import Effort
    from workbench.campaign.spec import Campaign

WORTH_IT = 4
"""Cases from which on a process that draws meanwhile pays: what it draws with takes a second to load."""


def run_cases_and_print(
    spec: Campaign,
    campaign: str | Path,
    effort: Callable[[], Effort],
    *,
    pictures: bool,
    only: Sequence[str],
    **options: Any,
) -> int:
    """Run a campaign without a sweep, or cases of one with a sweep, and print its outcome.

    Parameters
    ----------
    spec, campaign
        The campaign, and what it was read from.
    effort
        Says how much evidence is gathered; called when the process that draws has begun.
    pictures
        Whether the robot is drawn.
    only, options
        As of `workbench.campaign.run.run_campaign`.

    Returns
    -------
    int
        The exit code.
    """
    # begun before what computes is loaded, which takes as long as to load what draws
    worth = cores() > 1 and len(only or spec.case) >= WORTH_IT
    with ExitStack() as stack:
        drawing = stack.enter_context(closing(DrawingProcess())) if worth else None
        # what modules hold stays: to look through it again and again takes a thirtieth of a run
        stack.callback(gc.unfreeze)
        stack.callback(gc.enable)
        gc.disable()
        from workbench.campaign.run import run_campaign
        from workbench.console import print_outcome
        from workbench.rendering.run_pictures import RunPictures
        from workbench.terminal import CaseProgress

        gc.freeze()
        gc.enable()

        # loaded only where they are called
        def pick(*given: Any) -> Campaign:
            from workbench.sweep.pick import pick_cases

            return pick_cases(*given)

        def explain(cases: Sequence[Case], candidate: str, reference: str) -> list[str]:
            from workbench.diagnosis.brief import brief

            return brief(cases, candidate, reference)

        def report(stage: Path) -> None:
            if drawing is None or not drawing.report(stage):
                from workbench.report import build_report

                build_report(stage)

        with CaseProgress() as progress:
            outcome = run_campaign(
                campaign,
                only=only,
                progress=progress,
                report=report,
                pictures=RunPictures() if pictures else None,
                drawing=drawing,
                effort=dataclasses.replace(effort(), threads=cores()),  # one case after the other: each may take all
                pick=pick,
                explain=explain,
                **options,
            )
        print_outcome(outcome)
    return outcome.conclusion.exit_code
