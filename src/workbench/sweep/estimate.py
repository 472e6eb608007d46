"""What a campaign would cost, before it is run: cases, samples, and from a few cases computed, time and disk."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from workbench.campaign.actuators import limits_of
from workbench.campaign.asked import check_asked
from workbench.campaign.cases import base_robot, resolve_cases
from workbench.campaign.compare import compute_case
from workbench.campaign.evidence import Effort
from workbench.campaign.not_driven import NotDriven, refuse_none
from workbench.campaign.spec import Campaign
from workbench.campaign.user_candidates import UserCandidate, full_names, load_candidates, with_rows
from workbench.processes import cores
from workbench.sweep.evaluate import Context, evaluate, series_bytes
from workbench.sweep.identity import common_key
from workbench.sweep.pick import pick_cases
from workbench.sweep.plan import plan_sweep
from workbench.sweep.record import FILTERED, GOOD
from workbench.sweep.run import task_of

TRIED = 24
"""Cases of a sweep that are computed for an estimate, spread over it."""

LONG_ENOUGH_S = 5.0

BYTES_KEPT = 0.2
"""A case's record takes this share of its journal line in the Parquet data sets."""


@dataclass(frozen=True)
class Estimate:
    """What running a campaign would take."""

    cases: int
    samples: int
    seconds: float
    jobs: int
    bytes_while_running: float
    bytes_at_end: float
    tried: int = 0
    tried_filtered: int = 0
    tried_failed: int = 0
    limited: tuple[str, ...] = ()
    """joints whose actuators have limits to be held against; of a sweep none"""
    measured: tuple[str, ...] = ()
    """formulas without a bound, which a wanted accuracy is held against"""
    left_out: tuple[str, ...] = ()
    """of cases that cannot be driven and that a run would go on past, the line that each would end it with"""


def estimate(
    campaign: Campaign,
    file: Path,
    model: Path | None,
    settings: Mapping[str, float],
    effort: Effort,
    jobs: int | None,
    candidates: Sequence[str | Path] = (),
    only: Sequence[str] = (),
    keep_going: bool = False,
) -> Estimate:
    """Estimate a campaign; everything in it is resolved and checked as for a run, and nothing is written.

    *only* names the cases that would be run, of a sweep too; none is all. With *keep_going* cases that cannot be driven
    are told, and the others estimated.

    Raises
    ------
    WorkbenchError
        As for a run.
    """
    names = full_names(candidates)
    users = load_candidates(names)
    campaign = with_rows(campaign, users)
    if campaign.sweep is not None and only:
        campaign = pick_cases(campaign, file, model, settings, only, users)
    if campaign.sweep is None:
        return _of_cases(campaign, file, model, settings, effort, users, only, keep_going)
    effort = Effort.of_many(effort.engines, campaign.sweep.budget)
    plan = plan_sweep(campaign, file, model, settings, users)
    common = common_key(campaign, file, plan.model, settings, effort, campaign.sweep.keep_series, users)
    context = Context(campaign, file, plan.model, settings, effort, plan.recipe, common, names)
    indices = np.unique(np.linspace(0, plan.count - 1, TRIED).astype(int)).tolist()
    base = base_robot(campaign, file, plan.model, users)[0]
    evaluate(context, base, task_of(plan, indices[0]))  # the first one compiles
    taken: list[float] = []
    lines = series = filtered = failed = 0
    for index in indices:
        begun = time.perf_counter()
        answer = evaluate(context, base, task_of(plan, index))
        taken.append(time.perf_counter() - begun)
        lines += len(answer.record.line())
        series += len(answer.series or b"")
        filtered += answer.record.status == FILTERED
        failed += answer.record.status not in GOOD
        if sum(taken) > LONG_ENOUGH_S:
            break
    tried = len(taken)
    workers = jobs or cores()
    return Estimate(
        cases=plan.count,
        samples=plan.count * _samples(campaign),
        seconds=sum(taken) / tried * plan.count / workers,
        jobs=workers,
        bytes_while_running=(lines * (1 + BYTES_KEPT) + series) / tried * plan.count,
        bytes_at_end=(lines * BYTES_KEPT + series) / tried * plan.count,
        tried=tried,
        tried_filtered=filtered,
        tried_failed=failed,
    )


def _samples(campaign: Campaign) -> int:
    motion = campaign.case[0].motion
    samples = getattr(motion, "samples", None)
    if samples is not None:
        return int(samples)
    rate, stop = getattr(motion, "rate", None), getattr(motion, "stop", None)
    return round((stop - motion.start) * rate) + 1 if rate and stop is not None else 0  # type: ignore[union-attr]


def _of_cases(
    campaign: Campaign,
    file: Path,
    model: Path | None,
    settings: Mapping[str, float],
    effort: Effort,
    users: Sequence[UserCandidate],
    only: Sequence[str],
    keep_going: bool,
) -> Estimate:
    check_asked(campaign, str(file))
    missing: list[NotDriven] = []
    left_out = missing.append if keep_going else None
    cases = resolve_cases(campaign, file, model, tuple(only), settings, (), users, left_out)
    refuse_none(cases, missing)
    samples = sum(len(case.motion.t) for case in cases)
    short = min(cases, key=lambda case: len(case.motion.t))
    begun = time.perf_counter()
    result = compute_case(campaign, short, effort)
    seconds = (time.perf_counter() - begun) * len(cases)
    size = len(series_bytes(result.series)) * samples / len(short.motion.t)
    limits = limits_of(campaign, cases[0].robot, str(file))
    asked = tuple(f"{one.name} against {one.reference}" for one in campaign.candidate if one.bound is None)
    told = tuple(str(one.error) for one in missing)
    return Estimate(
        len(cases), samples, seconds, 1, size, size, tried=1, limited=tuple(limits), measured=asked, left_out=told
    )
