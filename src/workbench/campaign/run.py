"""Run a campaign: resolve everything, compute case by case, write the run directory."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from workbench.campaign import store
from workbench.campaign.actuators import limits_of
from workbench.campaign.asked import check_asked, with_good
from workbench.campaign.cases import Case, resolve_cases, with_unit_hint
from workbench.campaign.changes import IN_CAMPAIGN, Changes, Variant, changes_of
from workbench.campaign.claims import judge_claims
from workbench.campaign.compare import RAW_DESCRIPTION, RAW_INVERSE, CaseResult, Row, compute_case
from workbench.campaign.conclusion import CaseOutcome, Conclusion, case_status, conclude
from workbench.campaign.cost import cost_us
from workbench.campaign.drawn import CaseDrawing, case_to_draw
from workbench.campaign.evidence import FULL, Effort, check_engines
from workbench.campaign.figure_spec import FigureSpec
from workbench.campaign.lock import locked
from workbench.campaign.manifest import Begun, describe
from workbench.campaign.margins import Margin, margins_of_facts
from workbench.campaign.not_driven import NotDriven, refuse_none
from workbench.campaign.replacing import refuse_loss, request_of
from workbench.campaign.spec import Campaign, load_campaign
from workbench.campaign.user_candidates import Formula, UserCandidate, load_candidates, with_rows
from workbench.campaign.verdict import FAIL, VERIFICATION
from workbench.capabilities.robot import Robot
from workbench.errors import MotionError, OutputError, SpecError, WorkbenchError
from workbench.staging import check_output, staged


@dataclass(frozen=True)
class Outcome:
    """A finished run: where it lies, the verdict on it, and the rows."""

    directory: Path
    conclusion: Conclusion
    rows: list[Row]
    manifest: dict[str, Any]

    @property
    def margins(self) -> list[Margin]:
        """Every case held against every limit of an actuator; empty where nobody gave limits."""
        return margins_of_facts(self.manifest)

    @property
    def passed(self) -> bool:
        """Whether every bound holds; not where nothing was held against one."""
        return self.conclusion.passed


class Pictures(Protocol):
    """What draws the robot while a run computes; it never fails a run."""

    def start(self, result: CaseResult) -> None:
        """Begin with a case that has just been computed."""

    def finish(self, stage: Path) -> None:
        """Put what there is into a run directory that has its manifest."""

    def close(self) -> None:
        """End what was begun."""


Progress = Callable[[str, int, int], None]
"""Called with a case's name, its number from 0, and the number of cases; at the end with an empty name."""


Explain = Callable[[Sequence[Case], str, str], list[str]]
"""From cases, a candidate and the mass model that it is held against to sentences about what is wrong with it."""

Pick = Callable[[Campaign, Path, Path | None, Mapping[str, float], Sequence[str], Sequence[UserCandidate]], Campaign]
"""From a campaign with a sweep to one with some of its cases: campaign, file, model, settings, names, candidates."""


def run_campaign(
    path: str | Path,
    out: str | Path | None = None,
    *,
    model: str | Path | None = None,
    only: Sequence[str] = (),
    settings: Mapping[str, float] | None = None,
    relative: Sequence[str] = (),
    command: Sequence[str] = (),
    progress: Progress | None = None,
    report: Callable[[Path], object] | None = None,
    pictures: Pictures | None = None,
    drawing: CaseDrawing | None = None,
    effort: Effort = FULL,
    candidates: Sequence[Formula] = (),
    pick: Pick | None = None,
    explain: Explain | None = None,
    keep_going: bool = False,
    replace: bool = False,
    good: float | None = None,
) -> Outcome:
    """Run a campaign and write its run directory.

    Parameters
    ----------
    path
        Campaign file, or the name of a bundled one.
    out
        Run directory; None is ``reports/<campaign name>``, with ``-cases`` for cases of a sweep.
    model
        A model in place of the campaign's.
    only
        Names of the cases to run; empty is all. Of a sweep some have to be named.
    settings
        Parameters that go over those of campaign and cases.
    relative
        Changes like ``a2*=1.1`` of what a parameter then is, case by case.
    command
        The command line, for the manifest.
    progress
        Called before each case.
    report
        Called with the directory when the results stand in it, before it is moved to its place.
    pictures
        Draws the robot of the first case while the others are computed.
    drawing
        Draws the figures of each case while the next ones are computed; *report* then takes them from it.
    effort
        How much evidence is gathered beside the errors, and with which engines.
    candidates
        Python files, or installed entry points, with formulas of the user's own, or functions.
    pick
        Makes a campaign of named cases from one with a sweep, `workbench.sweep.pick.pick_cases`.
    explain
        Says what is wrong with a formula that fails its verification, `workbench.diagnosis.brief.brief`.
    keep_going
        Record cases that cannot be driven, each with the nearest pose that can, and compute the others.
    replace
        Put the run in the place of an earlier one that holds what this one does not: cases, pictures, another robot.
    good
        Wanted accuracy of formulas without a bound, in place of the campaign's: a fraction, 0.02 is 2 %.

    Raises
    ------
    WorkbenchError
        Bad input, in one line; then nothing was written.
    """
    begun = Begun()
    campaign, file = load_campaign(path)
    model = None if model is None else Path(model)
    directory = (
        Path(out)
        if out is not None
        else Path("reports") / (f"{campaign.name}-cases" if campaign.sweep else campaign.name)
    )
    if campaign.control:
        raise SpecError(f"{file}: has [control]; workbench run, or workbench.control.run.run_study, runs it")
    users = load_candidates(candidates)
    own = {candidate.name for candidate in campaign.candidate}
    campaign = with_good(with_rows(campaign, users), good)
    if campaign.sweep:
        if not only or pick is None:
            raise SpecError(f"{file}: has a sweep; workbench.sweep.run.run_sweep runs it")
        campaign = pick(campaign, file, model, settings or {}, only, users)
    check_output(directory, store.RUN)
    request = request_of(model, settings or {}, relative, only, candidates)
    if not replace:
        names = [case.name for case in campaign.case if not only or case.name in only]
        formulas = {candidate.name for candidate in campaign.candidate}
        refuse_loss(directory, campaign.name, request, names, formulas, effort, drawn=pictures is not None)
    check_engines(effort.engines)
    check_asked(campaign, str(file))
    missing: list[NotDriven] = []
    left_out = missing.append if keep_going else None
    try:
        cases = resolve_cases(campaign, file, model, tuple(only), settings, relative, users, left_out)
    except MotionError as error:
        alone = len(only or campaign.case) == 1
        hint = "" if alone else "; --keep-going (keep_going=True) records such cases and computes the others"
        raise MotionError(f"{error}{hint}", **error.facts) from error
    refuse_none(cases, missing)
    results: list[CaseResult] = []
    with (
        locked(directory),
        staged(directory, alone=True) as stage,
        closing(pictures) if pictures else nullcontext(),
        closing(drawing) if drawing else nullcontext(),
    ):
        known = {case.name for case in cases} | {one.spec.name for one in missing}
        names = [case.name for case in campaign.case if case.name in known]
        for number, case in enumerate(cases):
            if progress:
                progress(case.name, number, len(cases))
            try:
                result = compute_named_case(campaign, case, file, effort)
            except MotionError as error:
                if not keep_going:
                    raise
                missing.append(NotDriven(case.spec, error, case.overrides, case.robot))
                continue
            results.append(result)
            store.write_series(stage, case.name, result.series)
            if drawing:
                drawing.case(case_to_draw(campaign, case.robot, names, _judged(result), result.rows, stage))
            if pictures and len(results) == 1:
                pictures.start(result)
        if progress:
            progress("", len(cases), len(cases))
        computed = {result.name for result in results}
        cases = [case for case in cases if case.name in computed]
        refuse_none(cases, missing)
        rows = [row for result in results for row in result.rows]
        found = {result.name: _judged(result) for result in results} | {m.spec.name: m.facts() for m in missing}
        facts = {case.name: found[case.name] for case in campaign.case if case.name in found}
        conclusion = conclude(rows, {name: _outcome(said) for name, said in facts.items()})
        robots = {case.name: case.robot for case in cases}
        robots |= {one.spec.name: one.robot for one in missing if one.robot is not None}
        ordered = [spec for spec in campaign.case if spec.name in robots]
        variants = [Variant(spec.name, robots[spec.name], spec.parameters) for spec in ordered]
        changes = changes_of(campaign, file, model, settings or {}, relative, variants)
        manifest = _manifest(campaign, file, cases, robots, facts, rows, changes, own) | {
            **begun.ended(command),
            "request": request,
            "status": conclusion.status,
            "verdict": conclusion.sentence,
            "engines": list(effort.engines),
            "budget": effort.budget,
            "good": campaign.good,
        }
        if explain:
            manifest["diagnosis"] = _explained(cases, rows, path, candidates, explain)
        changed = [case.name for case in cases if changes.why_not(case.name)]
        store.write_summary(stage, rows, changed, campaign.good)
        store.write_manifest(stage, manifest)
        if pictures:
            pictures.finish(stage)
        failure = _report(report, stage) if report else None
    if failure is not None:
        said = f"{failure}" if isinstance(failure, WorkbenchError) else f"{type(failure).__name__}: {failure}"
        raise OutputError(
            f"{directory}: the results stand there, its report could not be written:"
            f" {said.replace(str(stage), str(directory))}; workbench report {directory} tries again",
            path=str(directory),
        ) from failure
    return Outcome(directory, conclusion, rows, manifest)


def _figure(figure: FigureSpec, changes: Changes) -> dict[str, Any]:
    """A figure, with the reason where it is not drawn for the robot that its source shows."""
    over = figure.kind == "error_over"  # its cases differ on purpose
    reasons = [changes.why_not(case, IN_CAMPAIGN if over else ()) for case in figure.needs]
    return figure.model_dump() | {"not_about": next((why for why in reasons if why), "")}


def _judged(result: CaseResult) -> dict[str, Any]:
    """A case's facts; it did not pass where nothing was judged."""
    verdicts = [row.verdict for row in result.rows] + [*_kinematics(result.facts)]
    return result.facts | {"status": case_status(result.facts["status"], verdicts)}


def _outcome(facts: Mapping[str, Any]) -> CaseOutcome:
    return CaseOutcome(facts["status"], _kinematics(facts))


def _kinematics(facts: Mapping[str, Any]) -> list[str]:
    return [check["verdict"] for check in facts.get("kinematics_checks", ())]


def _explained(
    cases: Sequence[Case], rows: Sequence[Row], path: str | Path, files: Sequence[Formula], explain: Explain
) -> dict[str, Any]:
    """What is wrong with each formula that fails a verification, and the command that says more."""
    failing: dict[tuple[str, str], list[str]] = {}
    for row in rows:
        if row.kind == VERIFICATION and row.verdict == FAIL:
            failing.setdefault((row.candidate, row.reference), []).append(row.case)
    found = {}
    for (candidate, reference), names in failing.items():
        first = [case for case in cases if case.name in names]
        sentences = explain([*first, *(case for case in cases if case.name not in names)], candidate, reference)
        options = [word for file in files for word in ("--candidates", str(file))]
        command = shlex.join(["workbench", "diagnose", str(path), *options, "--candidate", candidate])
        found[candidate] = {"reference": reference, "findings": sentences, "command": command}
    return found


def _report(report: Callable[[Path], object], stage: Path) -> Exception | None:
    """Write the report; what is wrong with it must not cost the results, which may have taken hours."""
    try:
        report(stage)
    except Exception as error:
        return error
    return None


def compute_named_case(campaign: Campaign, case: Case, file: Path, effort: Effort) -> CaseResult:
    """Compute one case; whatever is wrong names the campaign's file and the case.

    Raises
    ------
    WorkbenchError
        As `compute_case`.
    """
    try:
        return compute_case(campaign, case, effort)
    except WorkbenchError as found:
        error = with_unit_hint(found, case.robot)
        raise type(error)(f'{file}: case "{case.name}": {error}', **{**error.facts, "case": case.name}) from found


def _manifest(
    campaign: Campaign,
    file: Path,
    cases: list[Case],
    robots: Mapping[str, Robot],
    facts: Mapping[str, Mapping[str, Any]],
    rows: list[Row],
    changes: Changes,
    own: set[str],
) -> dict[str, Any]:
    robot, computed = cases[0].robot, {case.name for case in cases}
    candidates = {c.name: robot.candidates[c.name] for c in campaign.candidate}
    printed = {c.name: c.printed_cost for c in campaign.candidate if c.printed_cost}
    return describe(campaign, file, cases[0].model, robot, cases[0].name, changes) | {
        "format": store.FORMAT,
        "candidates": {
            name: {
                "mass_model": c.mass_model,
                "description": c.description,
                "source": c.source,
                "cost_us": cost_us(cases[0], name),
            }
            | ({"printed_cost": printed[name].model_dump()} if name in printed else {})
            for name, c in candidates.items()
        }
        | ({RAW_INVERSE: RAW_DESCRIPTION} if any(row.candidate == RAW_INVERSE for row in rows) else {}),
        "claims": judge_claims(campaign, own, rows, facts, robots, changes),
        "figures": [_figure(kept, changes) for figure in campaign.figure if (kept := figure.among(computed))],
        "actuators": limits_of(campaign, robot, str(file)),
        "cases": dict(facts),
    }
