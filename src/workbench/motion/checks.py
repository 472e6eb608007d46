"""Checks of the plain numbers that describe a motion; every refusal is one `MotionError`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from workbench.errors import MotionError


def as_number(what: str, value: Any, unit: str, minimum: float = -math.inf, minimum_allowed: bool = True) -> float:
    """Return *value* as a finite float that is not below *minimum*.

    Parameters
    ----------
    what
        Name of the number in the message.
    value
        The number; a bool or a text is refused.
    unit
        Its unit, for the message; empty for none.
    minimum, minimum_allowed
        Smallest value, and whether it is allowed itself.

    Raises
    ------
    MotionError
        Not a number, not finite, or too small; the facts hold ``value``.
    """
    if type(value) is float and minimum < value < math.inf:
        return value
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.integer | np.floating):
        raise MotionError(f"{what} = {value!r}; allowed: a number", value=value)
    try:
        number = float(value)
    except OverflowError:  # a whole number too long for a float
        number = math.inf
    if not math.isfinite(number) or number < minimum or (number == minimum and not minimum_allowed):
        bound = "a finite number" if minimum == -math.inf else f"{'>=' if minimum_allowed else '>'} {minimum:g}"
        raise MotionError(f"{what} = {number:g}{f' {unit}' if unit else ''}; allowed: {bound}", value=number)
    return number


def as_list(what: str, value: Any, entries: str = "numbers") -> list[Any]:
    """Return a sequence or array as a list.

    Raises
    ------
    MotionError
        Anything else, a text included.
    """
    if type(value) in (list, tuple):
        return list(value)
    if isinstance(value, str) or not isinstance(value, Sequence | np.ndarray) or getattr(value, "ndim", 1) == 0:
        raise MotionError(f"{what} = {value!r}; allowed: a list of {entries}", value=value)
    return list(value)


def as_vector(what: str, value: Any, unit: str, length: int | None = None) -> list[float]:
    """Return *value* as a list of finite floats, of *length* entries unless that is None.

    Raises
    ------
    MotionError
        Not a sequence, wrong length, or an entry that is not a finite number.
    """
    entries = as_list(what, value)
    if not entries or (length is not None and len(entries) != length):
        allowed = "one or more" if length is None else length
        raise MotionError(f"{what} has {len(entries)} entries; allowed: {allowed}", value=len(entries))
    if all(type(entry) is float and math.isfinite(entry) for entry in entries):
        return entries
    return [as_number(f"{what}, entry {number}", entry, unit) for number, entry in enumerate(entries, start=1)]
