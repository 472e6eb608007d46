"""Units as tables write them, what they measure, and what a number in them is worth in SI."""

from __future__ import annotations

import math
import re

_DEGREE = math.pi / 180.0
_TURN_PER_MINUTE = 2.0 * math.pi / 60.0

_LENGTHS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6}
_ANGLES = {"rad": 1.0, "deg": _DEGREE, "degree": _DEGREE, "degrees": _DEGREE, "°": _DEGREE, "mrad": 1e-3}
_TIMES = {"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0}

UNITS: dict[str, tuple[str, float]] = {
    **{unit: ("s", factor) for unit, factor in _TIMES.items()},
    **{
        f"{unit}{per}": (f"{kind}{order}", factor)
        for kind, units in (("m", _LENGTHS), ("rad", _ANGLES))
        for unit, factor in units.items()
        for order, spellings in (
            ("", ("",)),
            ("/s", ("/s", "/sec", " s^-1")),
            ("/s^2", ("/s^2", "/s2", "/s²", "/s**2", "/s/s", "/sec^2", " s^-2")),
        )
        for per in spellings
    },
    "rpm": ("rad/s", _TURN_PER_MINUTE),
    "N": ("N", 1.0), "kN": ("N", 1e3), "mN": ("N", 1e-3),
    **{
        f"{force}{times}{length}": ("N m", worth * arm)
        for force, worth in (("N", 1.0), ("kN", 1e3), ("mN", 1e-3))
        for times in ("", " ", "*", ".", "·")
        for length, arm in (("m", 1.0), ("mm", 1e-3), ("cm", 1e-2))
    },
    "-": ("1", 1.0),
}  # fmt: skip
"""Spelling -> (what it measures, in SI; worth of one in SI). ``mN`` is a millinewton; ``mNm`` a millinewton-metre."""

_BRACKETS = re.compile(r"(?P<name>.*?)\s*(?:\[(?P<a>[^\[\]]*)\]|\((?P<b>[^()]*)\)|<(?P<c>[^<>]*)>)")
_SLASH = re.compile(r"(?P<name>.+?)\s+/\s+(?P<unit>.+)|(?P<t>t|time)/(?P<s>\w+)", re.IGNORECASE)
_SUFFIX = re.compile(r"(?P<name>.*[^_])_(?P<unit>[^_]+)")


def split_unit(header: str) -> tuple[str, str | None]:
    """Take a unit off a column's header: ``Time [s]``, ``t (s)``, ``t / s``, ``time_s`` become a name and ``s``.

    Behind an underscore only units that `UNITS` knows are taken off; in brackets everything is a unit, so that an
    unknown one can be named. Without one the unit is None.
    """
    header = header.strip()
    found = _BRACKETS.fullmatch(header)
    if found:
        unit = next(text for text in found.group("a", "b", "c") if text is not None)
        return found["name"].strip(), unit.strip()
    found = _SLASH.fullmatch(header)
    if found:
        return (found["name"], found["unit"].strip()) if found["name"] else (found["t"], found["s"])
    found = _SUFFIX.fullmatch(header)
    if found and found["unit"] in UNITS:
        return found["name"], found["unit"]
    return header, None


def factor_of(unit: str, measures: str) -> float | None:
    """Return the SI worth of one *unit* where it measures *measures* (``s``, ``rad/s``, ``N m`` ...), else None."""
    kind, factor = UNITS.get(unit, ("", 0.0))
    return factor if kind == measures else None


def spellings_of(measures: str) -> str:
    """The plainest spellings of what *measures* may be written in, for a message."""
    known = [unit for unit, (kind, _) in UNITS.items() if kind == measures and unit.isascii()]
    return ", ".join(known[:6])
