"""The sliders of a robot: one for each parameter, or for a group whose members are equal, sorted by body."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from workbench.capabilities.robot import Robot
from workbench.robots.parameters import ParameterInfo, Target

SPANS = {"m": 0.1, "kg": 1.0, "kg m^2": 0.01, "m/s^2": 10.0, "N s/m": 5.0, "N m s/rad": 0.5, "N": 5.0, "N m": 0.5}
"""How far the slider of a parameter that stands at zero reaches, by unit."""

SIDE = re.compile(r"[ _.-]*(?:left|right|upper|lower|at|of|[0-9]+)(?=_|$)|[ _.-]*[0-9]+$")
WORLD = "world"
JOINTS = "friction and rotors"
"""Heading of what stands at joints: damping, dry friction, armature; mostly zero, and many."""
NOTHING = 1e-9
"""SI; a number that is smaller is the zero that a computation left."""


ALMOST = 1e-9
"""Of a step: what rounding leaves of a whole number of them."""


@dataclass(frozen=True)
class Knob:
    """One slider."""

    name: str
    """a parameter, or a group"""
    members: tuple[str, ...]
    unit: str
    meaning: str
    source: str
    low: float
    """ends of the slider, SI"""
    high: float
    step: float
    body: str
    """heading under which it stands"""
    minimum: float
    maximum: float
    settable: bool = True
    """False: MuJoCo computes it from other numbers of the file"""
    part: bool = False
    """a member of a group that has a slider, too"""

    def value(self, values: Mapping[str, float]) -> float:
        """Where it stands; of a group whose members differ, their mean."""
        own = [values[name] for name in self.members]
        return own[0] if len(set(own)) == 1 else sum(own) / len(own)

    def differs(self, values: Mapping[str, float]) -> bool:
        """Whether the members of the group are not equal."""
        return len({values[name] for name in self.members}) > 1


def knobs_of(robot: Robot) -> tuple[Knob, ...]:
    """Make the sliders of a robot as its files have it, in the order of its robot file."""
    table = robot.description.table
    member_of = {member: group for group, members in table.groups.items() for member in members}
    values, computed = robot.values, robot.computed
    found: list[Knob] = []
    for name, info in table.infos.items():
        group = member_of.get(name)
        if group and all(knob.name != group for knob in found):
            members = table.groups[group]
            whole = _knob(group, members, info, robot, values, not computed & set(members), False)
            found.append(whole)
        found.append(_knob(name, (name,), info, robot, values, name not in computed, group is not None))
    return tuple(found)


def _knob(
    name: str, members: tuple[str, ...], info: ParameterInfo, robot: Robot, values: Mapping[str, float],
    settable: bool, part: bool,
) -> Knob:  # fmt: skip
    own = [values[member] for member in members]
    low, high = _ends(min(own), max(own), info)
    step = _step(high - low)
    if low > info.minimum:  # whole steps, outwards: ends that can be read
        low = max(math.floor(low / step + ALMOST) * step, info.minimum) if low > step else low
    if high < info.maximum:
        high = min(math.ceil(high / step - ALMOST) * step, info.maximum)
    meaning = re.sub(r",? *(?:of the )?(?:left|right)\b.*$", "", info.meaning) if len(members) > 1 else info.meaning
    return Knob(
        name, members, info.unit, meaning, info.source, low, high, step, _body(robot, members[0]),
        info.minimum, info.maximum, settable, part,
    )  # fmt: skip


def _ends(least: float, most: float, info: ParameterInfo) -> tuple[float, float]:
    """Half to twice the value; about zero by the unit; within what is allowed."""
    if max(abs(least), abs(most)) < NOTHING:
        span = SPANS.get(info.unit, 1.0)
        low, high = -span, span
    elif most > 0.0:
        low, high = (0.5 * least if least > 0.0 else least), 2.0 * most
    else:
        low, high = 2.0 * least, 0.5 * most
    tiny = 1e-3 * (high - low)
    if info.minimum > low or (info.minimum == low and not info.minimum_allowed):
        low = info.minimum if info.minimum_allowed else info.minimum + tiny
    if info.maximum < high or (info.maximum == high and not info.maximum_allowed):
        high = info.maximum if info.maximum_allowed else info.maximum - tiny
    return low, max(high, low + tiny)


def _step(span: float) -> float:
    """A round step, some 500 to a slider."""
    rough = span / 500
    power = 10.0 ** math.floor(math.log10(rough))
    return float(next(f * power for f in (1, 2, 5, 10) if f * power >= rough * (1 - 1e-12)))


def _body(robot: Robot, name: str) -> str:
    """The body that the number belongs to, without left, right and numbers: ``rod``."""
    target = next((t for t in robot.description.targets if t.reads == name), None)
    if target is None:
        return WORLD
    body = _body_of(robot, target)
    return SIDE.sub("", body).replace("_", " ").strip() or body


def _body_of(robot: Robot, target: Target) -> str:
    model = robot.reference.compiled()
    element, first = target.element, target.name.split("\n")[0]
    if element == "joint":
        return JOINTS
    if element == "inertial":
        return first
    if element == "body":  # where it sits in its parent is a length of the parent
        return str(model.body(int(model.body(first).parentid[0])).name)
    if element == "option":
        return WORLD
    lookup = {"site": (model.site, "bodyid"), "distance": (model.site, "bodyid"), "geom": (model.geom, "bodyid")}
    try:
        find, attribute = lookup[element]
        return str(model.body(int(getattr(find(first), attribute)[0])).name)
    except KeyError:  # a geom without a name, of a body with that name
        return first
