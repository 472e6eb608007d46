"""Run a study: what is missing is computed by workers and kept run by run, in the journal that sweeps keep."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from workbench.campaign import store
from workbench.campaign.changes import Changes, Variant, changes_of
from workbench.campaign.conclusion import FAILED, INCOMPLETE, NOTHING_JUDGED, PASSED, Conclusion
from workbench.campaign.control_spec import ControlClaim
from workbench.campaign.manifest import Begun, describe
from workbench.campaign.replacing import request_of
from workbench.campaign.spec import Campaign
from workbench.campaign.user_candidates import full_names, load_candidates
from workbench.capabilities.robot import Robot
from workbench.control import files as study_files
from workbench.control.claims import HOLDS, NOT_ABOUT, Known, Verdict, judged
from workbench.control.evaluate import Study, StudyContext, study_key
from workbench.control.figures import errors_in, is_decided, platform_row, uncertainty_of
from workbench.control.files import STUDY
from workbench.control.footage import Footage, footage_of
from workbench.control.names import CONTROL
from workbench.control.plan import StudyPlan, plan_study, torque_limits
from workbench.control.user_controller import load_controllers
from workbench.sweep import files
from workbench.sweep.computing import Work, compute_missing, start_pool
from workbench.sweep.identity import case_key
from workbench.sweep.inputs import inputs_of
from workbench.sweep.journal import NAME as JOURNAL
from workbench.sweep.journal import Journal
from workbench.sweep.progress import Show
from workbench.sweep.record import GOOD, Record, parse_line
from workbench.sweep.resumable import Asked, SweepOptions, resumed

NOTHING_CHANGED = Changes()

Film = Callable[[Callable[[], Footage | None], Path], object]
"""Draws into a run directory what its first argument makes."""


@dataclass(frozen=True)
class StudyOutcome:
    """A finished study: where it lies, what it says, whether every run could be computed."""

    directory: Path
    conclusion: Conclusion
    summary: dict[str, Any]
    manifest: dict[str, Any]


def run_study(
    campaign: Campaign,
    file: Path,
    directory: Path,
    *,
    model: Path | None = None,
    settings: Mapping[str, float] | None = None,
    command: Sequence[str] = (),
    show: Show | None = None,
    report: Callable[[Path], object] | None = None,
    film: Film | None = None,
    options: SweepOptions | None = None,
    candidates: Sequence[str | Path] = (),
    controllers: Sequence[str | Path] = (),
) -> StudyOutcome:
    """Run a campaign with ``[control]``, or what is missing of it.

    Parameters
    ----------
    campaign, file
        From `load_campaign`, with ``[control]``.
    directory
        Run directory; finished runs in it are taken over where all that determines them is the same.
    model, settings, command, show, report, options, candidates
        As for `run_sweep`.
    film
        Draws, before the report is written, from what makes the footage and the run directory; None is no film.
    controllers
        Python files with controllers of the user's own.

    Raises
    ------
    WorkbenchError
        Bad input, results of other versions, another run in the directory, a full disk: one line.
    SweepInterrupted
        Ctrl-C; finished runs are kept.
    """
    begun = Begun()
    options = options or SweepOptions()
    settings = dict(settings or {})
    names = full_names(candidates)
    own_files = full_names(controllers)
    users, own = load_candidates(names), load_controllers(own_files)
    plan = plan_study(campaign, file, model, settings, users, own)
    inputs = inputs_of(campaign, file, plan.model)
    common = study_key(plan, settings, users, own)
    context = StudyContext(campaign, file.resolve(), plan.model.resolve(), settings, common, names, own_files)
    request = {**request_of(model, settings, (), (), candidates), "controllers": sorted(map(str, controllers))}
    with resumed(STUDY, directory, len(plan.loops), Asked(campaign.name, request), options) as held:
        study_files.write_journal(directory, _still_valid(directory, plan, common, options.retry_failed))
        (directory / store.MANIFEST).unlink(missing_ok=True)
        work = Work(
            start=lambda tasks: start_pool(
                context.setup, (plan.spec.time_limit, plan.spec.memory_limit, plan.spec.retries), options, tasks
            ),
            task=lambda index: (index, plan.loops[index]),
            key=lambda index: case_key(common, vars(plan.loops[index])),
        )
        with Journal(directory / JOURNAL, len(plan.loops)) as journal:
            computed = compute_missing(held, work, journal, inputs, show)
            records = study_files.read_all(journal, len(plan.loops))
        study_files.write_journal(directory, records)
        study_files.write_tables(directory, plan.loops, records)
        robots = plan.robots(settings)
        variants = [Variant(case.name, robots[case.name], case.parameters) for case in campaign.case]
        changes = changes_of(campaign, file, model, settings, (), variants)
        summary = summarise(plan, records, changes)
        manifest = _manifest(plan, summary, robots[campaign.case[0].name], changes) | {
            **begun.ended(command),
            "request": request,
            "computed": computed,
            "engines": ["mujoco"],
            "budget": plan.spec.second_route == "all",
        }
        files.write_json(directory / CONTROL, summary)
        files.write_json(directory / store.MANIFEST, manifest)
        held.complete((files.PROGRESS,))
        if film:
            film(lambda: footage_of(Study(plan, settings, own), records), directory)
        if report:
            report(directory)
    return StudyOutcome(directory, conclusion_of(summary), summary, manifest)


def _still_valid(directory: Path, plan: StudyPlan, common: str, retry_failed: bool) -> list[Record]:
    """Finished runs of which all that determines them is the same, wherever in the study they now stand."""
    path = directory / JOURNAL
    if not path.exists():
        return []
    known = {}
    with path.open("rb") as stream:
        for line in stream:
            record = parse_line(line)
            if record is not None and not (retry_failed and record.status not in GOOD):
                known[record.key] = record
    keys = enumerate(case_key(common, vars(loop)) for loop in plan.loops)
    return [replace(known[key], index=index) for index, key in keys if key in known]


def known_runs(plan: StudyPlan, records: Sequence[Record]) -> list[Known]:
    """What the claims are judged by: finished runs, those that are unstable without errors."""
    found = []
    for loop, record in zip(plan.loops, records, strict=True):
        if record.status not in GOOD:
            continue
        found.append(Known(loop, errors_in(platform_row(record.rows) or {})))
    return found


def summarise(plan: StudyPlan, records: Sequence[Record], changes: Changes = NOTHING_CHANGED) -> dict[str, Any]:
    """What stands in ``control.json``: counts, how well errors are known, claims with their verdicts.

    A claim about a case whose robot is another than the published one, in more than the claim says, is not judged.
    """
    runs = known_runs(plan, records)

    def not_about(claim: ControlClaim) -> str:
        about = claim.cases or [case.name for case in plan.campaign.case]
        why = [changes.why_not(case, known=claim.parameters) for case in about]
        return "; ".join(dict.fromkeys(text for text in why if text))

    verdicts = judged(plan.spec, runs, not_about)
    unstable = [record for record in records if record.status in GOOD and not record.rows]
    undecided = [run for run in runs if run.errors and not _is_known(run, plan.spec.second_route == "all")]
    failed = [record for record in records if record.status not in GOOD]
    return {
        "format": 1,
        "runs": len(plan.loops),
        "tracked": len(runs) - len(unstable),
        "unstable": len(unstable),
        "undecided": len(undecided),
        "failed": len(failed),
        "reasons": sorted({record.reason for record in failed})[:10],
        "first_unstable": [{"run": r.index, "reason": r.reason} for r in unstable[:10]],
        "wanted_m": plan.spec.wanted,
        "enough": plan.spec.enough,
        "claims": [verdict.facts() for verdict in verdicts],
    }


def _is_known(run: Known, both: bool) -> bool:
    if both and "rms_second" not in run.errors:
        return False
    return is_decided(run.errors["rms"], uncertainty_of(run.errors))


def conclusion_of(summary: Mapping[str, Any]) -> Conclusion:
    """The verdict on a study: whether every run could be computed and any tracks; what it found stands beside it."""
    runs = f"{summary['tracked']} of {summary['runs']} runs tracked their motion, {summary['unstable']} unstable"
    known = f", {summary['undecided']} undecided" if summary["undecided"] else ""
    if summary["failed"]:
        status = FAILED if summary["failed"] == summary["runs"] else INCOMPLETE
        return Conclusion(status, f"{runs}{known}; {summary['failed']} could not be computed: {summary['reasons'][0]}")
    if not summary["tracked"]:
        first = summary["first_unstable"][0]["reason"]
        return Conclusion(NOTHING_JUDGED, f"none of {summary['runs']} runs tracked its motion, the first is {first}")
    claims: Sequence[Mapping[str, Any]] = summary["claims"]
    here = [claim["verdict"] for claim in claims if claim["verdict"] != NOT_ABOUT]
    said = f"; {here.count(HOLDS)} of {len(here)} claims hold" if here else ""
    apart = len(claims) - len(here)
    others = f"; {apart} {'claim is' if apart == 1 else 'claims are'} {NOT_ABOUT}" if apart else ""
    return Conclusion(PASSED, f"{runs}{known}{said}{others}")


def _manifest(plan: StudyPlan, summary: Mapping[str, Any], robot: Robot, changes: Changes) -> dict[str, Any]:
    campaign = plan.campaign
    found = conclusion_of(summary)
    return describe(campaign, plan.file, plan.model, robot, campaign.case[0].name, changes) | {
        "format": store.FORMAT,
        "status": found.status,
        "verdict": found.sentence,
        "candidates": {
            name: {
                "mass_model": plan.robot.candidates[name].mass_model,
                "description": plan.robot.candidates[name].description,
                "source": plan.robot.candidates[name].source,
            }
            for name in plan.spec.models
            if name in plan.robot.candidates
        },
        "actuators": {},
        "claims": [],
        "figures": [],
        "cases": {},
        "control": {"runs": len(plan.loops), "limits": torque_limits(campaign, plan.robot) if plan.spec.limits else {}},
    }


__all__ = ["StudyOutcome", "Verdict", "run_study"]
