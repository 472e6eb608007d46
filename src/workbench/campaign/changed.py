"""What was changed of a robot, from what to what, in words: one place for terminal, report, Markdown and PDF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

CASE = "case parameters"
"""By what the campaign itself changes single cases."""
ANOTHER = "Another robot than the one that the campaign is about"
NOT_JUDGED = "Claims about that one are not judged where this concerns them."
"""What stands over `sentences`."""
SHOWN = 8
"""Names that a sentence lists one by one."""


@dataclass(frozen=True)
class Change:
    """One parameter that is not what the robot's source says, SI."""

    name: str
    unit: str
    before: float
    after: float
    by: str
    cases: tuple[str, ...]


def sentences(model: str, parameters: Sequence[Any], every: Sequence[str]) -> list[str]:
    """What was changed, from what to what, for people: for terminal, report and PDF alike; empty where nothing was.

    Parameters
    ----------
    model, parameters
        As `Changes.facts`; items with the attributes of `Change`.
    every
        Names of all cases.
    """
    own = [one for one in parameters if one.by == CASE]
    parameters = [one for one in parameters if one.by != CASE]
    lines = [f"{model[:1].upper()}{model[1:]}."] if model else []
    groups: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for one in parameters:
        groups.setdefault((one.by, tuple(one.cases)), []).append(said_of(one, by=False))
    for (by, cases), said in groups.items():
        where = among(cases, every)
        lines.append(f"{by[:1].upper()}{by[1:]}{where}: {few(said)}.")
    if own and lines:  # alone they make no other robot: the campaign's own business, told with each case
        concerned = list(dict.fromkeys(case for one in own for case in one.cases))
        names = list(dict.fromkeys(one.name for one in own))
        lines.append(f"Parameters of their own in {few(concerned)}: {few(names)}.")
    return lines


def said_of(change: Any, by: bool = True) -> str:
    """One change: ``a2_left 0.2 -> 0.3 m (--set)``; *change* has the attributes of `Change`."""
    unit = f" {change.unit}" if change.unit not in ("", "1") else ""
    before, after = ("?" if value is None else f"{value:.6g}" for value in (change.before, change.after))
    return f"{change.name} {before} -> {after}{unit}{f' ({change.by})' if by else ''}"


def few(said: Sequence[str], most: int = SHOWN) -> str:
    """Join names, the first of them where they are many."""
    more = f" and {len(said) - most} more" if len(said) > most else ""
    return ", ".join(said[:most]) + more


def not_known(cases: Sequence[str]) -> str:
    """Say that nothing is known of *cases*, a sentence with a blank in front; empty where there are none."""
    return f" Nothing is known of {few(list(cases))}: not computed." if cases else ""


def not_shared(cases: Sequence[str]) -> str:
    """Say that *cases* are left out of a comparison, likewise."""
    return f" Left out, since not both runs have computed them: {few(list(cases))}." if cases else ""


def among(cases: Sequence[str], every: Sequence[str]) -> str:
    """Say which of *every* case something concerns, in as few names as it takes: `` in a``, `` in all cases but b``."""
    others = [case for case in every if case not in cases]
    if not others:
        return ""
    return f" in all cases but {few(others)}" if len(others) < len(cases) else f" in {few(list(cases))}"
