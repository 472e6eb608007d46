"""What a study would cost, before it is run: how many runs, and from a few of them computed, time and disk."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from workbench.campaign.spec import Campaign
from workbench.campaign.user_candidates import full_names, load_candidates
from workbench.control.evaluate import Study, evaluate, study_key
from workbench.control.plan import Loop, StudyPlan, plan_study
from workbench.control.user_controller import load_controllers
from workbench.processes import cores
from workbench.sweep.estimate import BYTES_KEPT, LONG_ENOUGH_S
from workbench.sweep.record import GOOD


@dataclass(frozen=True)
class StudyEstimate:
    """What running a study would take."""

    plan: StudyPlan
    seconds: float
    jobs: int
    bytes_while_running: float
    bytes_at_end: float
    tried: tuple[Loop, ...]
    """one run at each rate, from the lowest on, while that did not take long"""
    tried_unstable: int
    tried_failed: int


def estimate_study(
    campaign: Campaign,
    file: Path,
    model: Path | None,
    settings: Mapping[str, float],
    jobs: int | None,
    candidates: Sequence[str | Path] = (),
    controllers: Sequence[str | Path] = (),
) -> StudyEstimate:
    """Estimate a study; everything in it is resolved and checked as for a run, and nothing is written.

    What a run takes grows with its rate, so one is computed at each; what rates beyond would take is in proportion.

    Raises
    ------
    WorkbenchError
        As for a run.
    """
    users, own = load_candidates(full_names(candidates)), load_controllers(full_names(controllers))
    plan = plan_study(campaign, file, model, settings, users, own)
    study, common = Study(plan, settings, own), study_key(plan, settings, users, own)
    by_rate: dict[float, list[Loop]] = {}
    for loop in plan.loops:
        by_rate.setdefault(loop.rate, []).append(loop)
    rates = sorted(by_rate)
    evaluate(study, common, (0, by_rate[rates[0]][-1]))  # the first one compiles
    tried: list[Loop] = []
    taken: dict[float, float] = {}
    lines = unstable = failed = 0
    for rate in rates:
        loop = by_rate[rate][-1]
        study.bench(loop)
        begun = time.perf_counter()
        record = evaluate(study, common, (0, loop)).record
        taken[rate] = time.perf_counter() - begun
        tried.append(loop)
        lines += len(record.line())
        unstable += record.status in GOOD and not record.rows
        failed += record.status not in GOOD
        if sum(taken.values()) > LONG_ENOUGH_S:
            break
    highest = max(taken)
    seconds = sum(taken.get(rate, taken[highest] * rate / highest) * len(by_rate[rate]) for rate in rates)
    workers = max(1, min(jobs or cores(), len(plan.loops)))
    size = lines / len(tried) * len(plan.loops)
    return StudyEstimate(
        plan, seconds / workers, workers, size * (1 + BYTES_KEPT), size * BYTES_KEPT, tuple(tried), unstable, failed
    )
