"""All cases of a sweep, made one by one when needed: memory does not grow with their number but for a table."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.arrays import FloatArray
from workbench.campaign.cases import layered, locate, mechanism_with, resolve_cases
from workbench.campaign.spec import Campaign, CaseSpec
from workbench.campaign.user_candidates import UserCandidate
from workbench.errors import MotionError, SpecError
from workbench.robots.base import Mechanism
from workbench.sweep.samples import sweep_values
from workbench.sweep.vary import SPEED, Change, resolve_key

DIGITS = 6


@dataclass(frozen=True)
class Recipe:
    """How a row of numbers becomes a case: what a worker needs to know of a plan."""

    name: str
    case: Mapping[str, Any]
    changes: tuple[Change, ...]

    def case_name(self, index: int) -> str:
        """Name of a case, which is also its file's; counted from 0."""
        return f"{self.name}-{index:0{DIGITS}d}"

    def case_dict(self, index: int, numbers: tuple[float, ...]) -> dict[str, Any]:
        """Return the case as a plain dictionary, not validated."""
        case = copy.deepcopy(dict(self.case))
        pairs = zip(self.changes, numbers, strict=True)
        # what else varies may be a frequency or a time, which the speed is a factor of
        for change, number in sorted(pairs, key=lambda pair: pair[0].key == SPEED):
            change.apply(case, number)
        case["name"] = self.case_name(index)
        return case

    def case_spec(self, index: int, numbers: tuple[float, ...]) -> CaseSpec:
        """Return the case, validated."""
        return CaseSpec.model_validate(self.case_dict(index, numbers))


@dataclass(frozen=True)
class Plan:
    """The cases of a sweep."""

    recipe: Recipe
    values: FloatArray
    """``(cases, keys)``"""
    mechanism: Mechanism
    """the robot before the sweep changes it"""
    model: Path

    @property
    def count(self) -> int:
        """Number of cases before filters."""
        return len(self.values)

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys that vary."""
        return tuple(change.key for change in self.recipe.changes)

    def numbers(self, index: int) -> tuple[float, ...]:
        """The varied numbers of one case."""
        return tuple(self.values[index].tolist())

    def case_dict(self, index: int) -> dict[str, Any]:
        """One case as a plain dictionary."""
        return self.recipe.case_dict(index, self.numbers(index))


def plan_sweep(
    campaign: Campaign,
    file: Path,
    model: Path | None,
    settings: Mapping[str, float],
    users: Sequence[UserCandidate] = (),
) -> Plan:
    """Resolve a campaign with a sweep: every key, every name; nothing is computed.

    Raises
    ------
    SpecError, ModelError, ParameterError, MotionError
        One line that names the file and the key.
    """
    assert campaign.sweep is not None
    base = campaign.case[0]
    path = model or locate(file, campaign.model, "model")
    try:
        mechanism = resolve_cases(campaign, file, model, (), settings, (), users)[0].mechanism
    except MotionError:  # the case as it stands need not be within reach; its variants may be
        mechanism = mechanism_with(path, layered(campaign.parameters, base.parameters, settings), campaign)
    values = {name: float(value) for name, value in vars(mechanism.parameters).items()}
    case = base.model_dump()
    changes: list[Change] = []
    for vary in campaign.sweep.vary:
        if campaign.setup and vary.key.startswith("parameters."):
            raise SpecError(
                f'{file}: sweep: key "{vary.key}": parameters of this MJCF cannot be set; allowed: motion,'
                " external_force, speed",
                key=vary.key,
            )
        try:
            change = resolve_key(vary, case, mechanism.parameter_table, values)
        except SpecError as error:
            raise SpecError(f"{file}: {error}", **error.facts) from error
        clash = sorted(change.parameters.keys() & _stored(mechanism, settings))
        if clash:
            raise SpecError(f'{file}: sweep: key "{vary.key}": --set sets {clash[0]} in every case', key=vary.key)
        hidden = next((c for c in changes if c.parameters and c.parameters.keys() <= change.parameters.keys()), None)
        if hidden:
            raise SpecError(
                f'{file}: sweep: key "{hidden.key}" has no effect: "{change.key}" sets it too, after it', key=hidden.key
            )
        changes.append(change)
    return Plan(Recipe(base.name[:80], case, tuple(changes)), sweep_values(campaign.sweep), mechanism, path)


def _stored(mechanism: Mechanism, settings: Mapping[str, float]) -> set[str]:
    from workbench.robots.parameters import expand_names

    return set(expand_names(mechanism.parameter_table, settings))
