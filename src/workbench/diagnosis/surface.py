"""Diagnosis of a campaign's formulas: what the command line and ``workbench.diagnose`` call."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from workbench.campaign.cases import resolve_cases
from workbench.campaign.spec import load_campaign
from workbench.campaign.user_candidates import load_candidates, with_rows
from workbench.diagnosis.case_subject import CaseSubject, subjects_of
from workbench.diagnosis.examine import Examined, diagnose_subject, with_suggestions
from workbench.diagnosis.result import Diagnosis
from workbench.errors import SpecError
from workbench.robots.registration import TORQUE

LIMIT_S = 60.0


def diagnose(
    campaign: str | Path,
    *,
    candidates: Sequence[str | Path] = (),
    candidate: str | None = None,
    case: str | None = None,
    model: Path | None = None,
    mend: bool = True,
    time_limit: float = LIMIT_S,
    jobs: int | None = None,
) -> list[Diagnosis]:
    """Name the wrong term of each formula of a campaign.

    Parameters
    ----------
    campaign
        Campaign file, or the name of one that comes with the package.
    candidates
        Python files with formulas of your own; they are run.
    candidate
        Diagnose this formula only; None: yours where *candidates* are given, else all of the campaign's that have a
        bound.
    case
        Whose robot is looked at; None is the first case's.
    model
        A model in place of the campaign's.
    mend
        Look for edits of the formula's source that mend it.
    time_limit
        Seconds of that search, for each formula.
    jobs
        Workers of that search; None is one per core.

    Returns
    -------
    list of Diagnosis
        One for each formula; `Diagnosis.right` says whether nothing is wrong.

    Raises
    ------
    WorkbenchError
        Bad input, in one line.
    """
    return list(
        each_diagnosis(
            campaign, candidates=candidates, candidate=candidate, case=case, model=model, mend=mend,
            time_limit=time_limit, jobs=jobs,
        )
    )  # fmt: skip


def each_diagnosis(
    campaign: str | Path,
    *,
    candidates: Sequence[str | Path] = (),
    candidate: str | None = None,
    case: str | None = None,
    model: Path | None = None,
    mend: bool = True,
    time_limit: float = LIMIT_S,
    jobs: int | None = None,
    first: Callable[[Diagnosis], object] | None = None,
) -> Iterator[Diagnosis]:
    """As `diagnose`, one after the other; *first* is called with each before the search for a mend begins."""
    for subject in subjects(campaign, candidates=candidates, candidate=candidate, case=case, model=model):
        diagnosis, seen = diagnose_subject(subject)
        if first:
            first(diagnosis)
        if mend and not diagnosis.right:
            diagnosis = _mended(subject, diagnosis, seen, time_limit, jobs)
        yield diagnosis


def subjects(
    campaign: str | Path,
    *,
    candidates: Sequence[str | Path] = (),
    candidate: str | None = None,
    case: str | None = None,
    model: Path | None = None,
) -> list[CaseSubject]:
    """Formulas of a campaign, each on the robot of a case.

    Raises
    ------
    WorkbenchError
        Bad input.
    """
    spec, file = load_campaign(campaign)
    users = load_candidates(candidates)
    spec = with_rows(spec, users)
    if spec.control:
        raise SpecError(f"{file}: has [control] and compares no formula; diagnose a campaign of cases")
    if spec.sweep:
        raise SpecError(f"{file}: has a sweep; diagnose a campaign of cases")
    cases = resolve_cases(spec, file, model, users=users)
    if case is not None:
        if case not in {one.name for one in cases}:
            raise SpecError(f'{file}: no case "{case}"')
        cases.sort(key=lambda one: one.name != case)
    own = {user.name for user in users if user.kind == TORQUE}
    rows = [
        (row.name, row.reference)
        for row in spec.candidate
        if (row.name == candidate if candidate else row.name in own if own else row.bound is not None)
    ]
    if candidate and not rows:
        rows = [(row.name, row.reference) for row in spec.candidate]
    if not rows:
        raise SpecError(f"{file}: no formula to diagnose; --candidate NAME, or --candidates FILE with one of your own")
    return subjects_of(cases, list(dict.fromkeys(rows)), candidate)


def _mended(
    subject: CaseSubject, diagnosis: Diagnosis, seen: Examined, time_limit: float, jobs: int | None
) -> Diagnosis:
    if subject.source is None:
        return replace(diagnosis, mend_notes=("No edits are looked for: this formula comes with the package.",))
    from workbench.diagnosis.search import search_mends

    begun = time.perf_counter()
    suggestions, notes = search_mends(subject, seen, time_limit, jobs)
    return replace(with_suggestions(diagnosis, suggestions, time.perf_counter() - begun), mend_notes=notes)


def write_mended(diagnosis: Diagnosis, path: Path) -> None:
    """Write a copy of the formula's file with the first mend of each step in it.

    Raises
    ------
    OutputError
        The file is the formula's own, which is never written.
    """
    from workbench.errors import OutputError
    from workbench.sweep.files import write_bytes

    steps = sorted({suggestion.step for suggestion in diagnosis.suggestions})
    chosen = next(s for s in diagnosis.suggestions if s.step == steps[-1])
    source = Path(chosen.path)
    if path.exists() and path.samefile(source):
        raise OutputError(f"{path}: is the formula's own file; a mended copy has to have another name")
    write_bytes(path, chosen.text.encode())
