"""Run a sweep: what is missing is computed by workers and kept case by case; at the end data sets and a summary."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.campaign import store
from workbench.campaign.actuators import limits_of
from workbench.campaign.changes import Variant, changes_of
from workbench.campaign.conclusion import Conclusion
from workbench.campaign.evidence import Effort
from workbench.campaign.manifest import Begun, describe
from workbench.campaign.replacing import lost_evidence, request_of
from workbench.campaign.spec import Campaign
from workbench.campaign.user_candidates import full_names, load_candidates, with_rows
from workbench.sweep import files, state
from workbench.sweep.computing import Pool, SweepInterrupted, Work, compute_missing, start_pool
from workbench.sweep.evaluate import Context, Task
from workbench.sweep.identity import case_key, common_key
from workbench.sweep.inputs import inputs_of
from workbench.sweep.journal import NAME as JOURNAL
from workbench.sweep.plan import Plan, plan_sweep
from workbench.sweep.progress import Show
from workbench.sweep.resumable import Asked, SweepOptions, resumed
from workbench.sweep.statistics import concluded, summarise


@dataclass(frozen=True)
class SweepOutcome:
    """A finished sweep: where it lies, the verdict on it, and its summary."""

    directory: Path
    conclusion: Conclusion
    summary: dict[str, Any]
    manifest: dict[str, Any]

    @property
    def passed(self) -> bool:
        """Whether every case that was not left out holds its bounds, and there is one that was held against any."""
        return self.conclusion.passed


def make_pool(context: Context, options: SweepOptions, tasks: int) -> Pool:
    """Start what computes the cases of a sweep.

    Raises
    ------
    WorkbenchError
        The cluster cannot be reached, or its extra is not installed.
    """
    sweep = context.campaign.sweep
    assert sweep is not None
    return start_pool(context.setup, (sweep.time_limit, sweep.memory_limit, sweep.retries), options, tasks)


def run_sweep(
    campaign: Campaign,
    file: Path,
    directory: Path,
    *,
    model: Path | None = None,
    settings: Mapping[str, float] | None = None,
    command: Sequence[str] = (),
    show: Show | None = None,
    report: Callable[[Path], object] | None = None,
    effort: Effort,
    options: SweepOptions,
    candidates: Sequence[str | Path] = (),
) -> SweepOutcome:
    """Run a sweep, or what is missing of it.

    Parameters
    ----------
    campaign, file
        From `load_campaign`, with a sweep.
    directory
        Run directory; finished cases in it are taken over.
    model, settings, command, report
        As for `run_campaign`.
    show
        Called with a `Snapshot` a few times a second.
    effort
        Engines; the budget is the sweep's own.
    options
        Workers, and what is done with an earlier run.
    candidates
        As for `run_campaign`; each worker loads them for itself.

    Raises
    ------
    WorkbenchError
        Bad input, results of other versions, another run in the directory, a full disk: one line.
    SweepInterrupted
        Ctrl-C; finished cases are kept.
    """
    begun = Begun()
    assert campaign.sweep is not None
    keep_series = campaign.sweep.keep_series
    effort = Effort.of_many(effort.engines, campaign.sweep.budget)
    names = full_names(candidates)
    users = load_candidates(names)
    campaign = with_rows(campaign, users)
    plan = plan_sweep(campaign, file, model, settings or {}, users)
    inputs = inputs_of(campaign, file, plan.model)
    common = common_key(campaign, file, plan.model, settings or {}, effort, keep_series, users)
    context = Context(
        campaign, file.resolve(), plan.model.resolve(), dict(settings or {}), effort, plan.recipe, common, names
    )
    request = request_of(model, settings or {}, (), (), candidates)
    lost = lost_evidence(files.read_json(directory / store.MANIFEST) or {}, effort)
    with resumed(state.SWEEP, directory, plan.count, Asked(campaign.name, request), options, lost) as held:
        work = Work(
            start=lambda tasks: make_pool(context, options, tasks),
            task=lambda index: task_of(plan, index),
            key=lambda index: case_key(common, plan.case_dict(index)),
            keep=lambda answer: state.keep_series(directory, plan, answer.index, answer.series),
        )
        with state.open_journal(directory, plan, common, options.retry_failed) as journal:
            state.remove_stray_series(directory, plan, journal.__contains__)
            held.done = sum(journal.counts().values())
            (directory / store.MANIFEST).unlink(missing_ok=True)
            computed = compute_missing(held, work, journal, inputs, show)
            files.write_parts(directory, plan, journal)
        summary = summarise(directory, plan, campaign)
        manifest = _manifest(campaign, file, plan, summary, model, settings or {}) | {
            **begun.ended(command),
            "request": request,
            "computed": computed,
            "engines": list(effort.engines),
            "budget": effort.budget,
        }
        files.write_json(directory / files.SWEEP, summary)
        files.write_json(directory / store.MANIFEST, manifest)
        held.complete((files.PROGRESS, JOURNAL))
        if report:
            report(directory)
    return SweepOutcome(directory, concluded(summary), summary, manifest)


def task_of(plan: Plan, index: int) -> Task:
    """Return what a worker needs to know of one case."""
    return index, plan.numbers(index)


def _manifest(
    campaign: Campaign,
    file: Path,
    plan: Plan,
    summary: Mapping[str, Any],
    model: Path | None,
    settings: Mapping[str, float],
) -> dict[str, Any]:
    name = campaign.case[0].name
    variant = Variant(name, plan.robot, campaign.case[0].parameters)
    changes = changes_of(campaign, file, model, settings, (), [variant])
    return describe(campaign, file, plan.model, plan.robot, name, changes) | {
        "format": store.FORMAT,
        "status": concluded(summary).status,
        "verdict": concluded(summary).sentence,
        "candidates": {
            c.name: {
                "mass_model": plan.robot.candidates[c.name].mass_model,
                "description": plan.robot.candidates[c.name].description,
                "source": plan.robot.candidates[c.name].source,
            }
            for c in campaign.candidate
        },
        "actuators": limits_of(campaign, plan.robot, str(file)),
        "claims": [],
        "figures": [],
        "cases": {},
        "sweep": {"cases": plan.count, "counts": summary["counts"], "keys": list(plan.keys)},
    }


__all__ = ["SweepInterrupted", "SweepOptions", "SweepOutcome", "run_sweep"]
