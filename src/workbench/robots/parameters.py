"""The parameters of a mechanism: what each means and may be, where it lives in the MJCF, and what follows a change.

Nothing here knows MuJoCo. A mechanism *describes* where its parameters live in an MJCF (`Target`);
`workbench.robots.load` reads and writes them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from workbench.errors import ParameterError, did_you_mean
from workbench.limits import LARGEST_NUMBER

if TYPE_CHECKING:
    from workbench.robots.base import Mechanism

SIDES = ("left", "right")


@dataclass(frozen=True)
class ParameterInfo:
    """One parameter as a user meets it: name, unit, meaning, source and the values it may have."""

    name: str
    unit: str
    meaning: str
    source: str = ""
    sided: bool = False
    """True: stored as ``name_left`` and ``name_right``; the bare name sets both."""
    minimum: float = -math.inf
    minimum_allowed: bool = True
    """False: the minimum itself is refused (a length of zero)."""
    maximum: float = math.inf


@dataclass(frozen=True)
class Target:
    """One number in the MJCF: ``attribute[index]`` of an element is ``factor`` times the product of parameters.

    Parameters
    ----------
    element
        MJCF tag: ``body``, ``inertial`` (named by its body), ``site``, ``geom``, ``joint`` or ``option``.
    name
        The element's name; for ``inertial`` its body's; for ``option`` the empty string.
    attribute, index
        The attribute and the position of the number in it.
    factor
        Constant factor, a sign or a power of two, so that reading it back loses nothing.
    of
        The parameters whose product, times factor, is the number.
    reads
        The parameter that is read back from this number, by dividing the others out; None for targets that only follow
        (visible geoms, the second bar of a parallelogram).
    """

    element: str
    name: str
    attribute: str
    index: int
    factor: float
    of: tuple[str, ...]
    reads: str | None = None


@dataclass(frozen=True)
class UniformRule:
    """Changing a parameter in ``when`` sets those in ``sets``, unless they (or one in ``unless``) are given too.

    A bar whose mass or length changes stays a uniform slender bar.
    """

    when: tuple[str, ...]
    sets: Mapping[str, Callable[[Mapping[str, float]], float]]
    unless: tuple[str, ...] = ()


def stored_names(table: tuple[ParameterInfo, ...]) -> dict[str, ParameterInfo]:
    """Map each stored field name (``a2_left`` ...) to its description."""
    names: dict[str, ParameterInfo] = {}
    for info in table:
        for name in [f"{info.name}_{side}" for side in SIDES] if info.sided else [info.name]:
            names[name] = info
    return names


def expand_names(table: tuple[ParameterInfo, ...], changes: Mapping[str, float]) -> dict[str, float]:
    """Resolve ``NAME`` to ``NAME_left`` and ``NAME_right`` where the parameter is sided; one-sided names win.

    Raises
    ------
    ParameterError
        Unknown name (with the nearest valid one), or a value that is not a real number.
    """
    stored = stored_names(table)
    sided = {info.name for info in table if info.sided}
    result: dict[str, float] = {}
    for name in sorted(changes, key=lambda n: n in stored):
        if isinstance(changes[name], bool) or not isinstance(changes[name], int | float | np.floating | np.integer):
            raise ParameterError(f"parameter {name}: {changes[name]!r} is not a number", parameter=name)
        try:
            value = float(changes[name])
        except OverflowError:  # an integer with more than 308 digits
            value = math.inf if changes[name] > 0 else -math.inf
        if name in stored:
            result[name] = value
        elif name in sided:
            result |= {f"{name}_{side}": value for side in SIDES}
        else:
            raise ParameterError(f'unknown parameter "{name}"{did_you_mean(name, {*stored, *sided})}', parameter=name)
    return result


def check_parameters(table: tuple[ParameterInfo, ...], values: Mapping[str, float]) -> None:
    """Refuse values that are not finite, larger than `LARGEST_NUMBER`, or outside the table's range.

    Raises
    ------
    ParameterError
        Naming the parameter, its value, its unit and what is allowed.
    """
    for name, info in stored_names(table).items():
        value = values[name]
        low = value < info.minimum or (value == info.minimum and not info.minimum_allowed)
        if not abs(value) <= LARGEST_NUMBER or low or value > info.maximum:
            bounds = []
            if info.minimum > -math.inf:
                bounds.append(f"{'>=' if info.minimum_allowed else '>'} {info.minimum:g}")
            if info.maximum < math.inf:
                bounds.append(f"<= {info.maximum:g}")
            if not bounds or value > LARGEST_NUMBER:
                bounds.append(f"at most {LARGEST_NUMBER:g} in size")
            allowed = " and ".join(bounds)
            unit = f" {info.unit}" if info.unit not in ("", "1") else ""
            raise ParameterError(
                f"parameter {name} = {value:g}{unit}; allowed: {allowed} ({info.meaning})",
                parameter=name,
                value=value,
            )


def changed_parameters(
    mechanism: type[Mechanism], values: Mapping[str, float], changes: Mapping[str, float]
) -> dict[str, float]:
    """Apply *changes* to *values* with the uniform-bar rules, and check the result.

    Raises
    ------
    ParameterError
        Unknown name, or a value out of range.
    """
    given = expand_names(mechanism.parameter_table, changes)
    result = {**values, **given}
    check_parameters(mechanism.parameter_table, result)
    for rule in mechanism.uniform_rules:
        moved = any(name in given and given[name] != values[name] for name in rule.when)
        if not moved or any(name in given for name in rule.unless):
            continue
        for name, value in rule.sets.items():
            if name not in given:
                result[name] = value(result)
    check_parameters(mechanism.parameter_table, result)
    return result
