"""Actuators that are held against what they can give: margins, and sentences about those that are too small.

An actuator that is too small is no failure of a formula: it changes no verdict and no exit code, and stands under
"needs attention" in terminal, report and comparison.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Protocol


class Limits(Protocol):
    """What one actuator can give, from a robot file or a stored run; None where nobody said."""

    @property
    def peak(self) -> float | None: ...  # noqa: D102
    @property
    def rms(self) -> float | None: ...  # noqa: D102
    @property
    def speed(self) -> float | None: ...  # noqa: D102
    @property
    def power(self) -> float | None: ...  # noqa: D102
    @property
    def source(self) -> str: ...  # noqa: D102


@dataclass(frozen=True)
class Measure:
    """A figure that an actuator is held against."""

    key: str
    words: str
    moment: str = ""
    """key of the demand that says when; empty for a figure of the whole case"""


MEASURES = (
    Measure("peak", "peak", "peak_at_s"),
    Measure("rms", "rms"),
    Measure("speed", "speed", "speed_at_s"),
    Measure("power", "power", "power_at_s"),
)


@dataclass(frozen=True)
class Margin:
    """One figure of one actuator in one case, and its limit."""

    case: str
    joint: str
    measure: Measure
    demanded: float
    """N, N m, m/s, rad/s or W; NaN where it is not known"""
    allowed: float
    unit: str
    at_s: float | None
    source: str = ""

    @property
    def used(self) -> float:
        """Share of the limit that the case takes; 1 is all of it."""
        return self.demanded / self.allowed

    @property
    def too_much(self) -> bool:
        """Whether the actuator is too small, or nobody can tell."""
        return not self.used <= 1.0

    @property
    def sentence(self) -> str:
        """Case, joint, moment and by how much, where it is too small."""
        when = f" at {self.at_s:.4g} s" if self.at_s is not None else " over the case"
        if math.isnan(self.demanded):
            return f"{self.joint}: whether its actuator is big enough in case {self.case} is not known"
        by = self.used - 1.0
        share = f"{100 * by:.2g} %" if by < 0.995 else f"{self.used:.3g} times what is allowed"
        source = f" ({self.source})" if self.source else ""
        return (
            f"{self.joint}: its actuator is too small in case {self.case}: {self.measure.words}"
            f" {self.demanded:.4g} {self.unit}{when}, allowed {self.allowed:.4g} {self.unit}{source},"
            f" {f'{share} too much' if by < 0.995 else share}"
        )


def unit_of(measure: str, force: str, coordinate: str) -> str:
    """Unit of a figure: that of the force, of the coordinate's rate, or W."""
    return {"speed": f"{coordinate}/s", "power": "W"}.get(measure, force)


def margins(
    limits: Mapping[str, Limits], demands: Mapping[str, Mapping[str, Any]], forces: Mapping[str, tuple[str, str]]
) -> list[Margin]:
    """Hold every case against every limit, in the order of cases, joints and `MEASURES`.

    Parameters
    ----------
    limits
        By joint.
    demands
        By case and joint, with the attributes of `workbench.demand.Demand`; None for a figure that is not known.
    forces
        By joint: unit of its force, unit of its coordinate.
    """
    found = []
    for case, joints in demands.items():
        for joint, demand in joints.items():
            for measure in MEASURES if joint in limits else ():
                allowed = getattr(limits[joint], measure.key)
                if allowed is not None:
                    value = getattr(demand, measure.key)
                    at = getattr(demand, measure.moment) if measure.moment else None
                    unit = unit_of(measure.key, *forces[joint])
                    value = math.nan if value is None else value
                    found.append(Margin(case, joint, measure, value, allowed, unit, at, limits[joint].source))
    return found


def margins_of_facts(manifest: Mapping[str, Any]) -> list[Margin]:
    """`margins` of a manifest that has just been made."""
    units = zip(manifest["force_units"], manifest["coordinate_units"], strict=True)
    return margins(
        {joint: SimpleNamespace(**one) for joint, one in manifest["actuators"].items()},
        {
            case: {joint: SimpleNamespace(**one) for joint, one in facts["demand"]["joints"].items()}
            for case, facts in manifest["cases"].items()
            if "demand" in facts
        },
        dict(zip(manifest["joints"], units, strict=True)),
    )


IN_SWEEPS = (
    "A sweep holds no design against the limits of actuators that this robot has: workbench run CAMPAIGN --only CASE"
    " does it for one."
)
"""What a sweep says of a robot with limits."""


def worst_of(found: Iterable[Margin]) -> list[Margin]:
    """The tightest case of each joint and figure, in the order in which they first come."""
    tightest: dict[tuple[str, str], Margin] = {}
    for margin in found:
        key = margin.joint, margin.measure.key
        if key not in tightest or not margin.used <= tightest[key].used:
            tightest[key] = margin
    return list(tightest.values())


def shortfalls(found: Sequence[Margin]) -> list[str]:
    """What needs attention, one sentence for each joint and figure that is too small: the worst case of each."""
    said = []
    for worst in worst_of(found):
        if worst.too_much:
            others = sum(m.too_much and m.joint == worst.joint and m.measure == worst.measure for m in found) - 1
            more = f"; too small in {others} other case{'s' if others > 1 else ''} too" if others else ""
            said.append(f"{worst.sentence}{more}")
    return said


def answer(found: Sequence[Margin], besides: str = "") -> str:
    """Whether the actuators are big enough, in a sentence; empty where nobody gave limits.

    *besides* says of which cases nothing is said.
    """
    return f"{_answer(found)}{besides}" if found else ""


def _answer(found: Sequence[Margin]) -> str:
    tight = max(found, key=lambda margin: math.inf if math.isnan(margin.used) else margin.used)
    small = list(dict.fromkeys(margin.joint for margin in found if margin.too_much))
    if small:
        names = ", ".join(small)
        return f"Actuators too small: {names}." if len(small) > 1 else f"The actuator of {names} is too small."
    return (
        f"Every actuator is big enough: the tightest is {tight.joint}, {tight.measure.words} {tight.demanded:.4g}"
        f" {tight.unit} in case {tight.case}, {100 * tight.used:.3g} % of what is allowed."
    )
