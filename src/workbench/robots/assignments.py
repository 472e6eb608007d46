"""Changes of parameters as a user writes them: ``a2=0.31``, ``a2_left*=1.1``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from workbench.errors import ParameterError
from workbench.robots.parameters import ParameterTable

ASSIGNMENT = re.compile(r"\s*([A-Za-z_]\w*)\s*([*/+-]?=)\s*(\S+)\s*")
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
OPERATIONS = {
    "=": lambda old, number: number,
    "*=": lambda old, number: old * number,
    "/=": lambda old, number: old / number,
    "+=": lambda old, number: old + number,
    "-=": lambda old, number: old - number,
}


@dataclass(frozen=True)
class Assignment:
    """One change as a user writes it: ``a2=0.31``, ``a2_left*=1.1``."""

    name: str
    operator: str
    number: float


def parse_assignment(text: str) -> Assignment:
    """Read ``NAME=VALUE``, ``NAME*=FACTOR``, and the like with ``/=``, ``+=``, ``-=``.

    Raises
    ------
    ParameterError
        One line that says what is wrong and what is allowed.
    """
    match = ASSIGNMENT.fullmatch(text)
    if match is None:
        raise ParameterError(f'"{text}" is no change of a parameter; allowed: NAME=VALUE, NAME*=FACTOR, /=, +=, -=')
    name, operator, value = match.groups()
    number = float(value) if NUMBER.fullmatch(value) else float("nan")
    if not abs(number) < float("inf"):
        raise ParameterError(f'parameter {name}: "{value}" is not a finite number, SI without unit', parameter=name)
    if operator == "/=" and number == 0:
        raise ParameterError(f"parameter {name}: {text.strip()} divides by zero", parameter=name)
    return Assignment(name, operator, number)


def resolve_changes(table: ParameterTable, values: Mapping[str, float], changes: Sequence[str]) -> dict[str, float]:
    """Turn changes as a user writes them into new values by parameter (``a2_left``).

    Parameters
    ----------
    table, values
        The robot's parameters, and their values as they stand.
    changes
        Each as for `parse_assignment`. The name of a group changes all its members, each from its own value; a member
        that is given too follows that.

    Raises
    ------
    ParameterError
        Unknown name, the same name twice, or not a change.
    """
    parsed = [parse_assignment(text) for text in changes]
    seen: set[str] = set()
    result: dict[str, float] = {}
    for change in sorted(parsed, key=lambda c: c.name in table.infos):
        if change.name in seen:
            raise ParameterError(f"parameter {change.name} is given twice", parameter=change.name)
        seen.add(change.name)
        for name in table.members(change.name):
            result[name] = OPERATIONS[change.operator](values[name], change.number) + 0.0
    return result
