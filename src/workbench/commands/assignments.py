"""``NAME=VALUE`` and ``NAME=LOW:HIGH`` as they stand on a command line."""

from __future__ import annotations

from collections.abc import Iterable

from workbench.errors import ParameterError

SETTING = "NAME=VALUE with a number in SI units"
RELATIVE = ("*=", "/=", "+=", "-=")


def settings(assignments: Iterable[str], option: str = "--set") -> tuple[dict[str, float], list[str]]:
    """Read ``--set NAME=VALUE`` options, SI units, and ``NAME*=FACTOR`` with its like.

    Returns
    -------
    dict, list
        New values by name, and the changes (``a2*=1.1``) that are relative to what a parameter is without them.

    Raises
    ------
    ParameterError
        No ``=``, a value that is not a number, or a name given twice.
    """
    # here, because it brings NumPy along, which `workbench --help` need not wait for
    from workbench.robots.assignments import parse_assignment

    found: dict[str, float] = {}
    relative: list[str] = []
    names: set[str] = set()
    for assignment in assignments:
        name, value = _split(assignment, option, SETTING)
        if any(operator in assignment for operator in RELATIVE):
            name = parse_assignment(assignment).name
            relative.append(assignment)
        else:
            try:
                if "_" in value:
                    raise ValueError  # Python reads 1_000 as a number; here it is a slip
                found[name] = float(value)
            except ValueError:
                raise ParameterError(f'{option} "{assignment}": expected {SETTING}') from None
        if name in names:
            raise ParameterError(f"{option} {name} is given twice")
        names.add(name)
    return found, relative


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
