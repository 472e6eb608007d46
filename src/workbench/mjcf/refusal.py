"""What a model holds that cannot be counted: all of it at once, each with its element and the way on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from workbench.errors import ModelError


@dataclass(frozen=True)
class Refusal:
    """One thing in a model for which no right torque can be given."""

    message: str
    """what and which value, without the file's name and without the way on"""
    tag: str
    """the element's tag in the MJCF: ``joint``, ``geom``, ``connect``, ``option``, ``flag`` ..."""
    name: str
    """the element's name; ``#3`` for the fourth of its kind where it has none; empty where the tag says it all"""
    way: str
    """what would let the model run, as a clause"""
    kind: str
    """what refusals of one reason have in common; messages group by it"""
    ignore: str = ""
    """the entry of ``ignore`` that leaves it out of account; empty where there is none"""


def joined(file: str, refusals: Iterable[Refusal]) -> ModelError:
    """One error out of all refusals: of each kind the first, and how many more there are, by name.

    The records themselves are ``error.facts["refusals"]``.
    """
    found = tuple(refusals)
    kinds: dict[str, list[Refusal]] = {}
    for refusal in found:
        kinds.setdefault(refusal.kind, []).append(refusal)
    parts = []
    for group in kinds.values():
        first, more = group[0], [other.name for other in group[1:]]
        also = f" (and {len(more)} more: {_listed(more)})" if more else ""
        parts.append(f"{first.message}{also}; {first.way}")
    facts = {"file": file, "refusals": found}
    if found:
        facts |= {found[0].tag: found[0].name, "element": found[0].name}
    return ModelError(f"{file}: " + ". Also: ".join(parts), **facts)


def _listed(names: list[str], most: int = 4) -> str:
    shown = ", ".join(f'"{name}"' for name in names[:most])
    return shown + (" ..." if len(names) > most else "")
