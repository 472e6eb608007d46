"""What a model file may not do: load code, or make the compiler run out of memory or time.

What it may read of other files is in `workbench.mjcf.files`.

A model is refused for it before MuJoCo sees it, in one line that names the file's line.
"""

from __future__ import annotations

import re
from functools import lru_cache

from workbench.errors import ModelError

MAX_ELEMENTS = 20_000
"""with all copies that ``<replicate>`` and ``<attach>`` make"""

MAX_DEPTH = 100
"""Elements inside elements; MuJoCo's own parser gives up at 500."""

REFUSED_TAGS = {
    "plugin": "loads code into MuJoCo",
    "extension": "loads code into MuJoCo",
    "composite": "makes deformable bodies; none is covered",
    "flexcomp": "makes deformable bodies; none is covered",
    "flex": "is a deformable body; none is covered",
    "skin": "is a deformable body; none is covered",
}
"""tag -> why it is refused"""

READERS = ("include", "model", "mesh", "texture", "hfield")
"""tags that may name a file; attributes that do begin with ``file``"""

LARGEST = {
    "width": 4096,
    "height": 4096,
    "nrow": 4096,
    "ncol": 4096,
    "params": 256,
    "nsample": 10_000,
    "nuserdata": 1_000_000,
    "nkey": 10_000,
    "njmax": 1_000_000,
    "nconmax": 1_000_000,
    "nstack": 10_000_000,
    "offwidth": 8192,
    "offheight": 8192,
    "shadowsize": 16384,
    "offsamples": 64,
}
"""attribute -> largest number allowed in it; each of them makes MuJoCo take memory in proportion"""

LARGEST_OF_TAG = {("numeric", "size"): 1_000_000}
LARGEST_USER = 1_000
"""for ``nuser_body`` and its like, numbers kept for every body, joint ..."""

LARGEST_MEMORY = 2**30
"""bytes that ``<size memory=...>`` may ask for"""

MEMORY_UNITS = {"K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40, "P": 2**50, "E": 2**60}
NOT_FINITE = re.compile(r"[+-]?(?:nan(?:\([^)]*\))?|inf(?:inity)?)", re.IGNORECASE)
NAMING = ("name", "class", "childclass", "data", "model")
"""attributes of free text, where the word "inf" is no number"""


def refuse_element(tag: str, attributes: dict[str, str], depth: int, count: int, where: str) -> None:
    """Refuse one start tag.

    Parameters
    ----------
    tag, attributes
        As the parser decoded them.
    depth, count
        Elements that hold this one, and elements so far.
    where
        ``file:line``, for the message.

    Raises
    ------
    ModelError
        It loads code, names a file where none is read, or asks for more memory than a model of a robot needs.
    """
    if depth == 0 and tag != "mujoco":
        raise ModelError(f"{where}: the file's root is <{_short(tag)}>; an MJCF model begins with <mujoco>")
    if depth > MAX_DEPTH:
        raise ModelError(f"{where}: elements nest deeper than {MAX_DEPTH}")
    if count > MAX_ELEMENTS:
        raise ModelError(f"{where}: more than {MAX_ELEMENTS} elements")
    if tag in REFUSED_TAGS:
        raise ModelError(f"{where}: <{tag}> {REFUSED_TAGS[tag]}", element=tag)
    for key, value in attributes.items():
        if not _watched(tag, key):
            continue
        if key.startswith("file") and tag not in READERS:
            raise ModelError(f'{where}: <{tag} {key}="{_short(value)}"> reads another file', element=tag, attribute=key)
        limit = LARGEST.get(key) or LARGEST_OF_TAG.get((tag, key)) or (LARGEST_USER if key[:6] == "nuser_" else None)
        if limit is not None and any(number_in(token) > limit for token in value.split()):
            raise ModelError(
                f'{where}: <{tag} {key}="{_short(value)}">; allowed: at most {limit}', element=tag, attribute=key
            )
        if (tag, key) == ("size", "memory") and _memory(value) > LARGEST_MEMORY:
            raise ModelError(f'{where}: <size memory="{_short(value)}">; allowed: at most 1G', element=tag)


@lru_cache(maxsize=4096)
def _watched(tag: str, key: str) -> bool:
    """Whether `refuse_element` looks at the values of an attribute."""
    limited = key in LARGEST or (tag, key) in LARGEST_OF_TAG or key[:6] == "nuser_"
    return limited or key.startswith("file") or (tag, key) == ("size", "memory")


def not_finite(attributes: dict[str, str]) -> tuple[str, str] | None:
    """Return the first attribute and value that holds NaN or infinity as a number, or None."""
    for key, value in attributes.items():
        if key not in NAMING and any(NOT_FINITE.fullmatch(token) for token in value.split()):
            return key, value
    return None


def number_in(token: str) -> float:
    """A number as it is written; 0 where it is none."""
    try:
        return float(token)
    except ValueError:  # MuJoCo will say what is wrong with it
        return 0.0


def _memory(value: str) -> float:
    unit = value[-1:].upper()
    return number_in(value[:-1]) * MEMORY_UNITS[unit] if unit in MEMORY_UNITS else number_in(value)


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."
