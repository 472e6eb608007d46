"""Run a sweep: what is missing is computed by workers and kept case by case; at the end data sets and a summary."""

from __future__ import annotations

import os
import shlex
import shutil
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol

from workbench.campaign import store
from workbench.campaign.actuators import limits_of
from workbench.campaign.changes import Variant, changes_of
from workbench.campaign.conclusion import Conclusion
from workbench.campaign.evidence import Effort
from workbench.campaign.lock import locked
from workbench.campaign.manifest import describe
from workbench.campaign.replacing import Request, asked_for, lost_evidence, request_of
from workbench.campaign.spec import Campaign
from workbench.campaign.user_candidates import full_names, load_candidates, with_rows
from workbench.errors import OutputError, SpecError, WorkbenchError
from workbench.staging import check_output
from workbench.sweep import files, state
from workbench.sweep.evaluate import Answer, Context, Packed, Task
from workbench.sweep.identity import case_key, common_key
from workbench.sweep.inputs import Inputs, inputs_of
from workbench.sweep.journal import Journal
from workbench.sweep.plan import Plan, plan_sweep
from workbench.sweep.progress import Meter, Show
from workbench.sweep.record import lost
from workbench.sweep.statistics import concluded, summarise
from workbench.sweep.supervisor import Lost, Setup, Supervisor

SYNC_EVERY_S = 5.0
"""A power cut costs no more than the cases of so many seconds; a killed process costs none."""


class SweepInterrupted(KeyboardInterrupt):
    """Ctrl-C during a sweep; the message says what is kept and how to go on."""


@dataclass(frozen=True)
class SweepOptions:
    """How a sweep is computed; none of it changes a number."""

    jobs: int | None = None
    """local workers; None is one per core that this process may use"""
    scheduler: str | None = None
    """address of a Dask scheduler in place of local workers"""
    fresh: bool = False
    """start over, dropping what is finished"""
    retry_failed: bool = False
    """compute again what failed, was killed or ran out of time"""
    replace: bool = False
    """put the sweep in the place of an earlier run of another robot, of other cases or candidates"""


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


class Pool(Protocol):
    """What computes tasks: local workers, or a cluster."""

    def run(self, tasks: Iterator[tuple[int, Any]]) -> Iterator[tuple[int, Packed | Lost]]:
        """Yield each task's number with its answer, in the order they finish."""

    def close(self) -> None:
        """End what was started."""


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def make_pool(context: Context, options: SweepOptions, tasks: int) -> Pool:
    """Start what computes the cases of a sweep.

    Raises
    ------
    WorkbenchError
        The cluster cannot be reached, or its extra is not installed.
    """
    sweep = context.campaign.sweep
    assert sweep is not None
    setup: Setup = context.setup
    limits = (sweep.time_limit, sweep.memory_limit, sweep.retries)
    if options.scheduler:
        from workbench.sweep.cluster import ClusterPool

        return ClusterPool(options.scheduler, setup, *limits)
    return Supervisor(max(1, min(options.jobs or cores(), tasks)), setup, *limits)


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
    started, clock = datetime.now(UTC), time.perf_counter()
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
    with locked(directory):
        try:
            aside = _put_aside(directory, campaign, request, options, effort)
        except OSError as error:
            raise _refused(directory, error, 0, plan.count) from error
        done, new = 0, not directory.exists()
        try:
            _prepare(directory, campaign, request, options)
            with state.open_journal(directory, plan, common, options.retry_failed) as journal:
                state.remove_stray_series(directory, plan, journal.__contains__)
                done = sum(journal.counts().values())
                (directory / store.MANIFEST).unlink(missing_ok=True)
                computed = _compute(context, plan, journal, directory, options, show, inputs)
                done += computed
                files.write_parts(directory, plan, journal)
            summary = summarise(directory, plan, campaign)
            manifest = _manifest(campaign, file, plan, summary, model, settings or {}) | {
                "command": shlex.join(command),
                "request": request,
                "started": started.isoformat(timespec="seconds"),
                "finished": datetime.now(UTC).isoformat(timespec="seconds"),
                "seconds": round(time.perf_counter() - clock, 3),
                "computed": computed,
                "engines": list(effort.engines),
                "budget": effort.budget,
            }
            files.write_json(directory / files.SWEEP, summary)
            files.write_json(directory / store.MANIFEST, manifest)
            for name in files.WORKING:
                (directory / name).unlink(missing_ok=True)
            shutil.rmtree(aside, ignore_errors=True)
            if report:
                report(directory)
        except OSError as error:
            raise _refused(directory, error, done, plan.count) from error
        except WorkbenchError:
            if new and not state.holds_cases(directory):
                shutil.rmtree(directory, ignore_errors=True)
                if aside.exists():
                    aside.rename(directory)
            raise
    return SweepOutcome(directory, concluded(summary), summary, manifest)


def _refused(directory: Path, error: OSError, done: int, total: int) -> OutputError:
    kept = f"; {done} of {total} cases were finished before and are kept" if done else ""
    return OutputError(f"{directory}: cannot be written: {error.strerror or error}{kept}", path=str(directory))


def _put_aside(directory: Path, campaign: Campaign, request: Request, options: SweepOptions, effort: Effort) -> Path:
    """Where a finished earlier run is kept until the one that takes its place is finished; it may be empty.

    Raises
    ------
    OutputError
        The earlier run is of another robot or other candidates, and nobody said that it may be replaced.
    """
    place = directory.resolve()
    aside = place.parent / f".{place.name[:100]}.before"
    if os.access(directory, os.W_OK):
        state.repair(directory)
    check_output(directory, files.RUN)
    old = files.read_json(directory / files.STATE) or {}
    before = old.get("request")
    other = state.holds_cases(directory) and (
        old.get("campaign") not in (campaign.name, "") or (before is not None and before != request)
    )
    finished = files.read_json(directory / store.MANIFEST) or {}
    less = lost_evidence(finished, effort)
    if less and not other and not (options.replace or options.fresh):
        raise OutputError(
            f"{directory}: holds an earlier sweep {'; '.join(less)}; --replace puts this one in its place, --out names"
            " another directory",
            path=str(directory),
        )
    other = other or bool(less)
    if other and not (options.replace or options.fresh):
        raise OutputError(
            f"{directory}: holds cases of another sweep ({asked_for(old)}; here {asked_for({'request': request})});"
            " --replace puts this one in its place, --out names another directory",
            path=str(directory),
        )
    if (other or options.fresh) and (directory / store.MANIFEST).is_file() and not aside.exists():
        place.rename(aside)
    return aside


def _prepare(directory: Path, campaign: Campaign, request: Request, options: SweepOptions) -> None:
    if options.fresh:
        state.clear(directory)
    else:
        state.refuse_other_versions(directory)
    state.begin(directory, {"campaign": campaign.name, "request": request})


def _compute(
    context: Context,
    plan: Plan,
    journal: Journal,
    directory: Path,
    options: SweepOptions,
    show: Show | None,
    inputs: Inputs,
) -> int:
    """Compute what the journal does not hold; return how many cases that was."""
    counts = journal.counts()
    before = sum(counts.values())
    meter = Meter(directory, before, plan.count, counts, show)
    if before == plan.count:
        return 0
    tasks = ((index, task_of(plan, index)) for index in journal.missing())
    pool: Pool | None = None
    synced = time.monotonic()
    try:
        pool = make_pool(context, options, plan.count - before)
        for index, found in pool.run(tasks):
            _refuse_changed(inputs, plan, journal, directory)
            answer = found if isinstance(found, Packed) else _lost(context, plan, index, found)
            if answer.series is not None:
                path = state.series_path(directory, plan, index)
                path.parent.mkdir(exist_ok=True)
                files.write_bytes(path, answer.series)
            journal.add(answer.index, answer.status, answer.line)
            meter.count(answer.status)
            if time.monotonic() - synced > SYNC_EVERY_S:
                journal.sync()
                synced = time.monotonic()
    except KeyboardInterrupt:
        done = sum(journal.counts().values())
        journal.sync()
        raise SweepInterrupted(
            f"{done} of {plan.count} cases are finished and kept in {directory}; the same command goes on with the rest"
        ) from None
    except OSError as error:
        raise _refused(directory, error, sum(journal.counts().values()), plan.count) from error
    finally:
        if pool is not None:
            pool.close()
    meter.tell(force=True)
    return plan.count - before


def _refuse_changed(inputs: Inputs, plan: Plan, journal: Journal, directory: Path) -> None:
    path = inputs.changed()
    if path is not None:
        done = sum(journal.counts().values())
        raise SpecError(
            f"{path}: was changed while the sweep ran; {done} of {plan.count} cases, of the file as it was, are kept in"
            f" {directory}; the same command goes on with them if the file is put back, and else starts anew",
            file=str(path),
        )


def task_of(plan: Plan, index: int) -> Task:
    """Return what a worker needs to know of one case."""
    return index, plan.numbers(index)


def _lost(context: Context, plan: Plan, index: int, found: Lost) -> Packed:
    key = case_key(context.common, plan.case_dict(index))
    return Answer(lost(index, key, found.status, found.reason)).packed()


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
