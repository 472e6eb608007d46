"""All cases of a sweep, made one by one when needed: memory does not grow with their number but for a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.arrays import FloatArray
from workbench.campaign.cases import base_robot, resolve_cases
from workbench.campaign.spec import Campaign, CaseSpec
from workbench.campaign.user_candidates import UserCandidate
from workbench.capabilities.robot import Robot
from workbench.errors import MotionError, SpecError
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
        case = {name: _copied(value) for name, value in self.case.items()}
        pairs = zip(self.changes, numbers, strict=True)
        # what else varies may be a frequency or a time, which the speed is a factor of
        for change, number in sorted(pairs, key=lambda pair: pair[0].key == SPEED):
            change.apply(case, number)
        case["name"] = self.case_name(index)
        return case

    def case_spec(self, index: int, numbers: tuple[float, ...]) -> CaseSpec:
        """Return the case, validated."""
        return CaseSpec.model_validate(self.case_dict(index, numbers))


def _copied(value: Any) -> Any:
    """Plain lists and dictionaries, to be changed: the same as `copy.deepcopy`, which takes ten times as long."""
    if isinstance(value, dict):
        return {name: _copied(entry) for name, entry in value.items()}
    return [_copied(entry) for entry in value] if isinstance(value, list) else value


@dataclass(frozen=True)
class Plan:
    """The cases of a sweep."""

    recipe: Recipe
    values: FloatArray
    """``(cases, keys)``"""
    robot: Robot
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
    plain, path = base_robot(campaign, file, model, users)
    table = plain.description.table
    try:
        robot = resolve_cases(campaign, file, model, (), settings, (), users)[0].robot
    except MotionError:  # the case as it stands need not be within reach; its variants may be
        robot = plain.with_parameters(**table.layered(campaign.parameters, base.parameters, settings))
    case = base.model_dump()
    changes: list[Change] = []
    for vary in campaign.sweep.vary:
        try:
            change = resolve_key(vary, case, table, robot.values)
        except SpecError as error:
            raise SpecError(f"{file}: {error}", **error.facts) from error
        clash = sorted(change.parameters.keys() & set(table.expand(settings)))
        if clash:
            raise SpecError(f'{file}: sweep: key "{vary.key}": --set sets {clash[0]} in every case', key=vary.key)
        hidden = next((c for c in changes if c.parameters and c.parameters.keys() <= change.parameters.keys()), None)
        if hidden:
            raise SpecError(
                f'{file}: sweep: key "{hidden.key}" has no effect: "{change.key}" sets it too, after it', key=hidden.key
            )
        changes.append(change)
    return Plan(Recipe(base.name[:80], case, tuple(changes)), sweep_values(campaign.sweep), robot, path)
