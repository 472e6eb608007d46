"""How the robots that a run computes differ from the one that its claims, sources and published figures are about."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from workbench.campaign import provenance
from workbench.campaign.cases import robot_of
from workbench.campaign.changed import CASE, Change, few, said_of
from workbench.campaign.spec import Campaign
from workbench.capabilities.load import robot_with
from workbench.capabilities.robot import Robot
from workbench.errors import WorkbenchError
from workbench.robots.assignments import parse_assignment
from workbench.robots.parameters import ParameterTable
from workbench.robots.published import published_values

SET, CAMPAIGN, MODEL, FILE, FOLLOWS = (
    "--set", "campaign parameters", "--model", "the file", "follows, a bar stays uniform",
)  # fmt: skip
"""By what a number was changed; it is the number's source from then on."""

IN_CAMPAIGN = (CASE,)
"""What the campaign says of single cases: it is no news to who reads it."""


@dataclass(frozen=True)
class Variant:
    """The robot of one case, and the parameters that the case itself gives."""

    case: str
    robot: Robot
    parameters: Mapping[str, float]


@dataclass(frozen=True)
class Changes:
    """Everything in which the robots of a run are others than the one that claims and figures are about."""

    model: str = ""
    """what another model says of itself, where one was named in place of the campaign's; else empty"""
    parameters: tuple[Change, ...] = ()
    every: tuple[str, ...] = ()
    """names of all cases"""

    def facts(self) -> dict[str, Any]:
        """For the manifest."""
        return {"model": self.model, "parameters": [asdict(change) for change in self.parameters]}

    def of(self, case: str) -> tuple[Change, ...]:
        """What is changed in one case."""
        return tuple(change for change in self.parameters if case in change.cases)

    def sources(self, case: str) -> dict[str, str]:
        """Sources of the changed numbers of one case, by parameter."""
        return {change.name: change.by for change in self.of(case)}

    def why_not(self, case: str, besides: Sequence[str] = (), known: Mapping[str, float] | None = None) -> str:
        """Why a statement about the robot is none about this case's, in words; empty where it is.

        *besides* holds ways of changing a number that the statement takes into account, *known* numbers that it names.
        """
        said = [self.model] if self.model else []
        named = known or {}
        said += [
            said_of(change)
            for change in self.of(case)
            if change.by not in besides and named.get(change.name) != change.after
        ]
        return few(said)


def changes_of(
    campaign: Campaign,
    file: Path,
    model: Path | None,
    settings: Mapping[str, float],
    relative: Sequence[str],
    variants: Sequence[Variant],
) -> Changes:
    """Compare the robots of a run with the one that the campaign's robot is published as.

    That is, for a robot that comes with the package, its bundled model; for any other, the model that the campaign
    or the robot file names.
    """
    robot = variants[0].robot
    table, units = robot.description.table, robot.description.table.infos
    named, other = _named(campaign, file, model, robot)
    if named is None:
        return Changes(other, every=tuple(variant.case for variant in variants))
    given = {
        SET: _names(table, [*settings, *(parse_assignment(text).name for text in relative)]),
        CAMPAIGN: _names(table, campaign.parameters),
    }
    found: dict[tuple[str, float, str], list[str]] = {}
    for variant in variants:
        own = {**given, CASE: _names(table, variant.parameters)}
        filed = variant.robot.file_values
        for name, value in variant.robot.values.items():
            if name in named and value != named[name]:
                by = next((by for by in (SET, CASE, CAMPAIGN) if name in own[by]), "")
                if not by:
                    by = (MODEL if model else FILE) if value == filed.get(name) else _cause(table, name, own)
                found.setdefault((name, value, by), []).append(variant.case)
    return Changes(
        other,
        tuple(
            Change(name, units[name].unit, named[name], value, by, tuple(cases))
            for (name, value, by), cases in found.items()
        ),
        tuple(variant.case for variant in variants),
    )


def _cause(table: ParameterTable, name: str, given: Mapping[str, set[str]]) -> str:
    """By what a number was changed that follows from its bar's mass or length."""
    for bar in table.bars:
        follows = {*bar.inertia, *([bar.centre] if bar.centre else []), *(one for one, _, _ in bar.own)}
        if name in follows:
            for by in (SET, CASE, CAMPAIGN):
                if given[by] & {bar.mass, bar.length}:
                    return by
    return FOLLOWS


def _names(table: ParameterTable, given: Sequence[str] | Mapping[str, float]) -> set[str]:
    return {member for name in given for member in table.members(name)}


def _named(campaign: Campaign, file: Path, model: Path | None, robot: Robot) -> tuple[Mapping[str, float] | None, str]:
    """Parameters of the robot that is spoken of, and what is said of another model in its place."""
    published = published_values(robot.description)
    if model is None:
        return published or robot.file_values, ""
    said = f"another model, {model.name} (--model)"
    try:
        described, path = robot_of(campaign, file)
        if provenance.sha256(path.read_bytes()) == provenance.sha256(model.read_bytes()):
            return published or robot.file_values, ""
        own = robot_with(path, {}, described)
    except (WorkbenchError, OSError):  # the campaign's own model is not there
        return published, "" if published else said
    if published is not None and own.name == robot.name:
        return published, ""  # its numbers say all that is not as published
    return (own.values if own.name == robot.name or not published else None), said
