"""Cases of a sweep by name, as a campaign of their own: one design looked at with all evidence and a report."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from workbench.campaign.spec import Campaign
from workbench.campaign.user_candidates import UserCandidate
from workbench.documents import shorten
from workbench.errors import SpecError
from workbench.sweep.plan import DIGITS, Plan, plan_sweep


def pick_cases(
    campaign: Campaign,
    file: Path,
    model: Path | None,
    settings: Mapping[str, float],
    names: Sequence[str],
    users: Sequence[UserCandidate] = (),
) -> Campaign:
    """Return a campaign without a sweep that holds the named cases of it, with the numbers that they have there.

    Raises
    ------
    SpecError
        A name that the sweep does not have; or as `plan_sweep`.
    """
    plan = plan_sweep(campaign, file, model, settings, users)
    cases = []
    for index in dict.fromkeys(_index(plan, name, file) for name in names):
        numbers = plan.numbers(index)
        told = ", ".join(f"{key} {number:.6g}" for key, number in zip(plan.keys, numbers, strict=True))
        spec = plan.recipe.case_spec(index, numbers)
        cases.append(spec.model_copy(update={"description": f"{spec.description} Of the sweep: {told}.".strip()}))
    return campaign.model_copy(update={"sweep": None, "case": cases})


def _index(plan: Plan, name: str, file: Path) -> int:
    found = re.fullmatch(rf"{re.escape(plan.recipe.name)}-(\d{{{DIGITS},}})", name)
    if found is None or int(found[1]) >= plan.count:
        first, last = plan.recipe.case_name(0), plan.recipe.case_name(plan.count - 1)
        raise SpecError(
            f'{file}: no case "{shorten(name)}"; the sweep has {first} to {last}', file=str(file), case=name
        )
    return int(found[1])
