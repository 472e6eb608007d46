"""Dotted keys of a sweep: which numbers of a case they name, and a case with those numbers changed."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from workbench.campaign.sweep_spec import Vary
from workbench.errors import ParameterError, SpecError, did_you_mean
from workbench.robots.parameters import ParameterTable

SPEED = "speed"
PATH = re.compile(r"(motion|external_force)(?:\.([A-Za-z_]+))?((?:\[\d+\])*)")

FASTER: Mapping[str, Callable[[dict[str, Any], float], None]]
"""By kind of motion: make the whole motion faster by a factor, along the same path, through the same samples."""


def _faster_window(motion: dict[str, Any], factor: float) -> None:
    for key in ("start", "stop"):
        motion[key] /= factor
    if motion["rate"] is not None:
        motion["rate"] *= factor


def _faster_sine(motion: dict[str, Any], factor: float) -> None:
    _faster_window(motion, factor)
    motion["frequency"] = [frequency * factor for frequency in motion["frequency"]]


def _faster_multi_sine(motion: dict[str, Any], factor: float) -> None:
    _faster_window(motion, factor)
    motion["terms"] = [[[t[0], t[1] * factor, *t[2:]] for t in terms] for terms in motion["terms"]]


def _faster_cycle(motion: dict[str, Any], factor: float) -> None:
    for key in ("lift_time", "traverse_time", "lower_time", "dwell"):
        if motion[key] is not None:
            motion[key] /= factor
    if motion["rate"] is not None:
        motion["rate"] *= factor


FASTER = {
    "sine": _faster_sine, "multi_sine": _faster_multi_sine, "pick_and_place": _faster_cycle,
    "platform_sine": _faster_sine, "platform_multi_sine": _faster_multi_sine,
}  # fmt: skip


@dataclass(frozen=True)
class Change:
    """One key of a sweep, resolved: what a number does to a case (a plain dictionary, changed in place)."""

    key: str
    relative: bool
    parameters: Mapping[str, float]
    """stored names and base values of the parameters that the key changes; empty for other keys"""
    path: tuple[str | int, ...] = ()

    def apply(self, case: dict[str, Any], number: float) -> None:
        """Change the case."""
        if self.key == SPEED:
            FASTER[case["motion"]["kind"]](case["motion"], number)
        elif self.parameters:
            new = {name: base * number if self.relative else number for name, base in self.parameters.items()}
            case["parameters"] = {**case["parameters"], **new}
        else:
            node: Any = case
            for part in self.path[:-1]:
                node = node[part]
            node[self.path[-1]] = node[self.path[-1]] * number if self.relative else number


def resolve_key(vary: Vary, case: Mapping[str, Any], table: ParameterTable, values: Mapping[str, float]) -> Change:
    """Find what a key names.

    Parameters
    ----------
    vary
        The key with its numbers.
    case
        The case that is varied, as a plain dictionary.
    table, values
        The robot's parameters, and their values before the sweep changes them, by name.

    Raises
    ------
    SpecError
        The case holds no such number; the message names the nearest.
    """
    where = f'sweep: key "{vary.key}"'
    if vary.key == SPEED:
        if case["motion"]["kind"] not in FASTER:
            raise SpecError(f"{where}: a motion of kind {case['motion']['kind']} has no formula to be made faster")
        if (vary.low is not None and vary.low <= 0) or (vary.values and min(vary.values) <= 0):
            raise SpecError(f"{where}: allowed: factors > 0")
        return Change(vary.key, True, {})
    section, _, name = vary.key.partition(".")
    if section == "parameters" and name:
        try:
            stored = table.members(name)
        except ParameterError as error:
            raise SpecError(f"{where}: {error}") from error
        return Change(vary.key, vary.relative, {each: values[each] for each in stored})
    match = PATH.fullmatch(vary.key)
    if match is None:
        allowed = "parameters.NAME, motion.NAME, motion.NAME[0], external_force[0] or speed"
        raise SpecError(f"{where}: allowed: {allowed}")
    head, field, brackets = match.groups()
    path: list[str | int] = [head, *([field] if field else []), *(int(i) for i in re.findall(r"\d+", brackets))]
    node: Any = case
    for part in path:
        try:
            node = node[part]
        except (KeyError, TypeError, IndexError):
            valid = [k for k, v in node.items() if _holds_numbers(v)] if isinstance(node, dict) else []
            hint = did_you_mean(str(part), valid) if valid else "; numbers in brackets count from 0"
            raise SpecError(f"{where}: the case has no {part!r} there{hint}") from None
    if isinstance(node, bool) or not isinstance(node, float):
        raise SpecError(f"{where}: names no real number of the case; a list needs the number of its entry, [0]")
    return Change(vary.key, vary.relative, {}, tuple(path))


def _holds_numbers(value: Any) -> bool:
    return isinstance(value, float) or (isinstance(value, list) and bool(value) and _holds_numbers(value[0]))
