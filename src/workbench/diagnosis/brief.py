"""A short diagnosis for a run with a failing verification: by part only, and never the reason that a run fails."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence

from workbench.campaign.cases import Case
from workbench.diagnosis.case_subject import CaseSubject
from workbench.diagnosis.examine import about_terms, examine

POSES = 10
MOST = 4
"""Sentences; ``workbench diagnose`` has the rest."""


def brief(cases: Sequence[Case], candidate: str, mass_model: str) -> list[str]:
    """Say in a few sentences what is wrong with a formula, on the first of *cases* and within the motions of all.

    Returns
    -------
    list of str
        Findings; empty where nothing can be said.
    """
    # whatever a formula does here, its run has been judged already
    with contextlib.suppress(Exception):
        alike = [case for case in cases[1:] if case.overrides == cases[0].overrides]
        subject = CaseSubject(cases[0], candidate, mass_model, alike)
        seen, notes, failures = examine(subject, POSES, parameters=False)
        if failures:
            return [f"it fails on some states: {next(iter(failures.values()))}"]
        found = [finding.sentence for finding in about_terms(subject, seen, notes, structure=False)]
        return [sentence.replace("; through no parameter that could be varied", "") for sentence in found[:MOST]]
    return []
