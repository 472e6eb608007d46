"""``NAME=VALUE`` and ``NAME=LOW:HIGH`` as they stand on a command line."""

from __future__ import annotations

from collections.abc import Iterable

from workbench.errors import ParameterError


def settings(assignments: Iterable[str]) -> dict[str, float]:
    """Read ``--set NAME=VALUE`` options, SI units.

    Raises
    ------
    ParameterError
        No ``=``, a value that is not a number, or a name given twice.
    """
    found: dict[str, float] = {}
    for assignment in assignments:
        name, value = _split(assignment, "--set", "NAME=VALUE with a number in SI units")
        try:
            number = float(value)
        except ValueError:
            raise ParameterError(f'--set "{assignment}": expected NAME=VALUE with a number in SI units') from None
        if name in found:
            raise ParameterError(f"--set {name} is given twice")
        found[name] = number
    return found


def ranges(assignments: Iterable[str]) -> dict[str, tuple[float, float]]:
    """Read ``--limit JOINT=LOW:HIGH`` options, m or rad.

    Raises
    ------
    ParameterError
        Anything else than two numbers, or a joint given twice.
    """
    found: dict[str, tuple[float, float]] = {}
    for assignment in assignments:
        expected = "JOINT=LOW:HIGH with numbers in m or rad"
        name, value = _split(assignment, "--limit", expected)
        low, _, high = value.partition(":")
        try:
            bounds = float(low), float(high)
        except ValueError:
            raise ParameterError(f'--limit "{assignment}": expected {expected}') from None
        if name in found:
            raise ParameterError(f"--limit {name} is given twice")
        found[name] = bounds
    return found


def _split(assignment: str, option: str, expected: str) -> tuple[str, str]:
    name, equals, value = (part.strip() for part in assignment.partition("="))
    if not name or not equals:
        raise ParameterError(f'{option} "{assignment}": expected {expected}')
    return name, value
