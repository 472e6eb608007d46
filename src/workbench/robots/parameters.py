"""The parameters of a robot: what each means and may be, where it lives in the MJCF, and what follows a change.

Nothing here knows MuJoCo. A robot file *describes* where its parameters live in an MJCF (`Target`);
`workbench.robots.load` reads and writes them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from workbench.errors import ParameterError, did_you_mean
from workbench.limits import LARGEST_NUMBER


@dataclass(frozen=True)
class ParameterInfo:
    """One parameter as a user meets it: name, unit, meaning, source and the values it may have."""

    name: str
    unit: str
    meaning: str
    source: str = ""
    minimum: float = -math.inf
    minimum_allowed: bool = True
    """False: the minimum itself is refused (a length of zero)."""
    maximum: float = math.inf
    maximum_allowed: bool = True

    @property
    def allowed(self) -> str:
        """The values that it may have, in words."""
        bounds = []
        if self.minimum > -math.inf:
            bounds.append(f"{'>=' if self.minimum_allowed else '>'} {self.minimum:g}")
        if self.maximum < math.inf:
            bounds.append(f"{'<=' if self.maximum_allowed else '<'} {self.maximum:g}")
        return " and ".join(bounds)


@dataclass(frozen=True)
class Target:
    """One number in the MJCF: ``attribute[index]`` of an element is ``factor`` times the product of parameters.

    Parameters
    ----------
    element
        MJCF tag: ``body``, ``inertial`` (named by its body), ``site``, ``geom``, ``joint`` or ``option``; or
        ``distance``, which is computed from two sites and stands nowhere.
    name
        The element's name; for ``inertial`` its body's; for ``option`` the empty string; for ``distance`` both
        sites, a line each.
    attribute, index
        The attribute and the position of the number in it; -1 is the length of the whole vector (gravity).
    factor
        Constant factor, a sign or a power of two where it is read, so that reading it back loses nothing.
    of
        The parameters whose product, times factor, is the number.
    reads
        The parameter that is read back from this number, by dividing the others out; None for targets that only follow
        (visible geoms, the second bar of a parallelogram).
    words
        The place as the robot file writes it.
    optional
        True: passed over where the file does not write it, as visible geoms may be.
    """

    element: str
    name: str
    attribute: str
    index: int
    factor: float
    of: tuple[str, ...]
    reads: str | None = None
    words: str = ""
    optional: bool = False

    def number(self, values: Mapping[str, float]) -> float:
        """The number that has to stand here for these parameters."""
        return self.factor * math.prod(values[name] for name in self.of)


@dataclass(frozen=True)
class Bar:
    """A bar that stays uniform and slender when its mass or length changes: parameters by name.

    Its mass centre then lies at half its length and its transverse inertia about it is mass length^2 / 12, unless an
    inertia of it is given too.
    """

    mass: str
    length: str
    half: bool = False
    """True: *length* names half of the bar's length"""
    inertia: tuple[str, ...] = ()
    centre: str | None = None
    """fraction of the length at which the mass centre lies"""
    own: tuple[tuple[str, Target, Target], ...] = ()
    """numbers of the bar's bodies that are parameters, too: name, what the bar makes of the number, where it stands"""

    @property
    def inertias(self) -> tuple[str, ...]:
        """Parameters that hold an inertia of the bar: one that is given says that the bar is uniform no longer."""
        return (*self.inertia, *(name for name, _, place in self.own if place.attribute == "diaginertia"))

    def follow(self, values: Mapping[str, float]) -> dict[str, float]:
        """What mass and length make of inertia and mass centre."""
        length = values[self.length] * (2.0 if self.half else 1.0)
        found = dict.fromkeys(self.inertia, values[self.mass] * length**2 / 12)
        found |= {self.centre: 0.5} if self.centre else {}
        for name, made, place in self.own:
            others = place.factor * math.prod(values[other] for other in place.of if other != name)
            if others:
                found[name] = made.number(values) / others
        return found


@dataclass(frozen=True)
class ParameterTable:
    """All parameters of a robot, names that set several at once, and what keeps bars uniform."""

    infos: Mapping[str, ParameterInfo]
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    bars: tuple[Bar, ...] = ()

    @cached_property
    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest value of each parameter that is allowed; where the bound itself is not, its neighbour."""
        infos = self.infos.values()
        least = [i.minimum if i.minimum_allowed else np.nextafter(i.minimum, math.inf) for i in infos]
        most = [i.maximum if i.maximum_allowed else np.nextafter(i.maximum, -math.inf) for i in infos]
        return np.maximum(least, -LARGEST_NUMBER), np.minimum(most, LARGEST_NUMBER)

    def expand(self, changes: Mapping[str, float]) -> dict[str, float]:
        """Resolve names of groups to their members; a member that is named itself goes over its group.

        Raises
        ------
        ParameterError
            Unknown name (with the nearest valid one), or a value that is not a real number.
        """
        result: dict[str, float] = {}
        for name in sorted(changes, key=lambda n: n in self.infos):
            if isinstance(changes[name], bool) or not isinstance(changes[name], int | float | np.floating | np.integer):
                raise ParameterError(f"parameter {name}: {changes[name]!r} is not a number", parameter=name)
            try:
                value = float(changes[name])
            except OverflowError:  # an integer with more than 308 digits
                value = math.inf if changes[name] > 0 else -math.inf
            result |= dict.fromkeys(self.members(name), value)
        return result

    def members(self, name: str) -> tuple[str, ...]:
        """The parameters that a name stands for.

        Raises
        ------
        ParameterError
            Unknown name, with the nearest valid one.
        """
        if name in self.infos:
            return (name,)
        if name in self.groups:
            return self.groups[name]
        if not self.infos:
            raise ParameterError(
                f'unknown parameter "{name}"; this robot has none: a robot file lists them, [parameters.{name}]',
                parameter=name,
            )
        hint = did_you_mean(name, {*self.infos, *self.groups})
        raise ParameterError(f'unknown parameter "{name}"{hint}', parameter=name)

    def check(self, values: Mapping[str, float]) -> None:
        """Refuse values that are not finite, larger than `LARGEST_NUMBER`, or outside a parameter's range.

        Raises
        ------
        ParameterError
            Naming the parameter, its value, its unit and what is allowed.
        """
        lowest, highest = self._bounds
        found = np.array([values[name] for name in self.infos], dtype=np.float64)
        if ((lowest <= found) & (found <= highest)).all():
            return
        for name, info in self.infos.items():
            value = values[name]
            low = value < info.minimum or (value == info.minimum and not info.minimum_allowed)
            high = value > info.maximum or (value == info.maximum and not info.maximum_allowed)
            if not abs(value) <= LARGEST_NUMBER or low or high:
                bounds = [info.allowed] if info.allowed else []
                if not bounds or value > LARGEST_NUMBER:
                    bounds.append(f"at most {LARGEST_NUMBER:g} in size")
                unit = f" {info.unit}" if info.unit not in ("", "1") else ""
                meaning = f" ({info.meaning})" if info.meaning else ""
                raise ParameterError(
                    f"parameter {name} = {value:g}{unit}; allowed: {' and '.join(bounds)}{meaning}",
                    parameter=name,
                    value=value,
                )

    def changed(self, values: Mapping[str, float], changes: Mapping[str, float]) -> dict[str, float]:
        """Apply *changes* to *values*, keep bars uniform, and check the result.

        Raises
        ------
        ParameterError
            Unknown name, or a value out of range.
        """
        given = self.expand(changes)
        result = {**values, **given}
        self.check(result)
        for bar in self.bars:
            moved = any(name in given and given[name] != values[name] for name in (bar.mass, bar.length))
            if moved and not any(name in given for name in bar.inertias):
                result |= {name: value for name, value in bar.follow(result).items() if name not in given}
        self.check(result)
        return result

    def layered(self, *layers: Mapping[str, float]) -> dict[str, float]:
        """Merge changes, later layers over earlier ones; a later group also goes over an earlier member of it."""
        merged: dict[str, float] = {}
        for layer in layers:
            for name in layer:
                for member in self.groups.get(name, ()):
                    merged.pop(member, None)
            merged |= layer
        return merged
