"""What actuators and joints have to bear in one run and in the other: the stored figures side by side."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from workbench.campaign.margins import Margin, margins, unit_of
from workbench.report.manifest import Manifest
from workbench.report.tables import NOT_COMPUTED


@dataclass(frozen=True)
class Asked:
    """One figure of one case, before and after; None where a run does not have it."""

    case: str
    item: str
    """an actuator, or a joint that bears a reaction"""
    key: str
    unit: str
    before: float | None
    after: float | None

    @property
    def ratio(self) -> float:
        """After over before; NaN where one of them is not known, or where both are zero."""
        if self.before is None or self.after is None:
            return math.nan
        if self.before == 0.0:
            return math.nan if self.after == 0.0 else math.inf
        return self.after / self.before


WORDS = {
    "peak": "peak",
    "rms": "rms",
    "speed": "speed",
    "power": "power",
    "braking": "braking power",
    "work": "work",
    "returned": "returned",
}
"""Figures of an actuator that are compared, and what they are called."""


def shared_cases(old: Manifest, new: Manifest) -> list[str]:
    """Cases that both runs have computed, in the order of the second."""
    both = [name for name in new.cases if name in old.cases]
    return [name for name in both if not {old.cases[name].status, new.cases[name].status} & NOT_COMPUTED]


def demands(old: Manifest, new: Manifest) -> list[Asked]:
    """What every actuator of both runs has to give, by case, actuator and figure."""
    units = {"braking": "W", "work": "J", "returned": "J"}
    found = []
    for case in shared_cases(old, new):
        before, after = old.cases[case].demand.joints, new.cases[case].demand.joints
        for joint, force, coordinate in zip(new.joints, new.force_units, new.coordinate_units, strict=True):
            if joint not in before or joint not in after:
                continue
            for key in WORDS:
                unit = units.get(key) or unit_of(key, force, coordinate)
                found.append(Asked(case, joint, key, unit, getattr(before[joint], key), getattr(after[joint], key)))
    return found


def reactions(old: Manifest, new: Manifest) -> list[Asked]:
    """Peak of every joint's reaction, by case."""
    return [
        Asked(case, joint, "reaction", "N", old.cases[case].peak_reactions[joint], value)
        for case in shared_cases(old, new)
        for joint, value in new.cases[case].peak_reactions.items()
        if joint in old.cases[case].peak_reactions
    ]


@dataclass(frozen=True)
class Worst:
    """The largest of one figure over the shared cases, in either run, each with its case."""

    item: str
    key: str
    unit: str
    before: float | None
    before_in: str
    after: float | None
    after_in: str

    @property
    def ratio(self) -> float:
        """After over before."""
        return Asked("", self.item, self.key, self.unit, self.before, self.after).ratio

    @property
    def same(self) -> bool:
        """Whether nothing changed, bit for bit."""
        return self.before == self.after


def worst_over_cases(found: Sequence[Asked]) -> Iterator[Worst]:
    """Yield the largest of each item and figure."""
    groups: dict[tuple[str, str], list[Asked]] = {}
    for one in found:
        groups.setdefault((one.item, one.key), []).append(one)
    for (item, key), members in groups.items():
        before = max(members, key=lambda one: size_of(one.before))
        after = max(members, key=lambda one: size_of(one.after))
        yield Worst(item, key, members[0].unit, before.before, before.case, after.after, after.case)


def size_of(value: float | None) -> float:
    """Order of figures: what no run has is least, what is no number largest."""
    return -math.inf if value is None else math.inf if math.isnan(value) else value


def margins_of_both(old: Manifest, new: Manifest) -> tuple[list[Margin], list[Margin]]:
    """Both runs' shared cases against the same limits: the second run's, or the first's where that has none."""
    limits = new.actuators or old.actuators
    units = dict(zip(new.joints, zip(new.force_units, new.coordinate_units, strict=True), strict=True))
    shared = shared_cases(old, new)
    one, two = (
        margins(
            {joint: limit for joint, limit in limits.items() if joint in units},
            {case: run.cases[case].demand.joints for case in shared},
            units,
        )
        for run in (old, new)
    )
    return one, two
