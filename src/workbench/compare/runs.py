"""Compare two run directories: inputs, outcomes and errors."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.campaign.changed import few, not_shared
from workbench.campaign.good import Answer, answers
from workbench.campaign.margins import Margin
from workbench.compare.asked import Asked, demands, margins_of_both, reactions, shared_cases
from workbench.compare.errors import ErrorChange, match_errors
from workbench.compare.parameters import parameter_changes
from workbench.report.concluded import conclusion_of
from workbench.report.load import Run, load_run
from workbench.report.manifest import ClaimRecord, Manifest
from workbench.report.tables import NOT_COMPUTED

MISSING = None
"""Stands for what a run does not have, as in JSON."""

LABELS = ("name", "id")
"""Keys by which entries of a list are told apart, so that an entry put in between does not shift all others."""

CASE = re.compile(r'case ("[^"]*") (.+)')
"""What says something of one case."""

PARAMETERS = re.compile(r'(case "[^"]*" )?parameters( |$)|(actuators|good)( |$)')
"""What a campaign says of parameters, limits and accuracy: what holds in the run is compared instead."""

PROSE = frozenset({"title", "description", "text", "note", "source"})
"""Keys of a campaign that say something and change nothing."""


@dataclass(frozen=True)
class Difference:
    """Something that two runs do not share."""

    group: str
    """``model``, ``parameter``, ``version``, ``machine``, ``campaign``, ``run`` or ``outcome``"""
    what: str
    before: Any
    after: Any


@dataclass(frozen=True)
class RunComparison:
    """Two runs side by side."""

    inputs: tuple[Difference, ...]
    outcomes: tuple[Difference, ...]
    """verdict, status of cases, mobility, claims"""
    errors: tuple[ErrorChange, ...]
    joints: tuple[str, ...]
    demands: tuple[Asked, ...] = ()
    """what actuators have to give, by case, actuator and figure"""
    reactions: tuple[Asked, ...] = ()
    margins: tuple[tuple[Margin, ...], tuple[Margin, ...]] = ((), ())
    """of both runs, against the same limits"""
    answers: tuple[tuple[Answer, ...], tuple[Answer, ...]] = ((), ())
    """of both runs, whether formulas without a bound keep the same wanted accuracy"""
    apart: tuple[str, ...] = ()
    """cases that not both runs have computed; only the others are compared"""

    @property
    def shared(self) -> int:
        """Errors that both runs have: without any there is nothing to compare."""
        return sum(change.before is not None and change.after is not None for change in self.errors)


def compare_runs(before: Path, after: Path, good: float | None = None) -> RunComparison:
    """Compare two run directories.

    Parameters
    ----------
    before, after
        Directories that ``workbench run`` wrote.
    good
        As `compare_loaded`.

    Raises
    ------
    OutputError
        One of them cannot be read; the message names file and key.
    """
    return compare_loaded(load_run(before), load_run(after), good)


def compare_loaded(old: Run, new: Run, good: float | None = None) -> RunComparison:
    """Compare two runs that are read.

    Both are held against the same limits of actuators and the same wanted accuracy *good*: the second run's, or where
    that has none, the first's.
    """
    shared = set(shared_cases(old.manifest, new.manifest))
    apart = [name for name in dict.fromkeys([*old.manifest.cases, *new.manifest.cases]) if name not in shared]
    wanted = good or new.manifest.good or old.manifest.good
    both = [
        tuple(answers([row for row in run.rows if row.case in shared], wanted, not_shared(apart))) for run in (old, new)
    ]
    limits = margins_of_both(old.manifest, new.manifest)
    return RunComparison(
        inputs=tuple(_inputs(old.manifest, new.manifest)),
        outcomes=(*_verdicts(old, new), *_once(_outcomes(old.manifest, new.manifest))),
        errors=tuple(match_errors(old.rows, new.rows)),
        joints=new.manifest.joints,
        demands=tuple(demands(old.manifest, new.manifest)),
        reactions=tuple(reactions(old.manifest, new.manifest)),
        margins=(tuple(limits[0]), tuple(limits[1])),
        answers=(both[0], both[1]),
        apart=tuple(apart),
    )


def _inputs(old: Manifest, new: Manifest) -> Iterator[Difference]:
    for key in ("mechanism", "file", "sha256"):
        yield from differences("model", key, getattr(old.model, key), getattr(new.model, key))
    for change in parameter_changes(old, new):
        yield Difference("parameter", change.what, change.before, change.after)
    yield from differences("actuator", "", _limits(old), _limits(new))
    for group, field in (("version", "versions"), ("machine", "machine"), ("campaign", "spec")):
        found = differences(group, "", getattr(old, field), getattr(new, field))
        yield from _once(one for one in found if not PARAMETERS.search(one.what))
    for field in ("campaign", "engines", "budget", "good", "git_commit"):
        yield from differences("run", field.replace("_", " "), getattr(old, field), getattr(new, field))


def _once(found: Iterable[Difference]) -> Iterator[Difference]:
    """Yield what changed alike in several cases once, with the cases' names."""
    groups: dict[tuple[str, str, str, str], list[tuple[str, Difference]]] = {}
    for one in found:
        match = CASE.match(one.what)
        case, rest = (match[1], match[2]) if match else ("", one.what)
        groups.setdefault((one.group, rest if match else f"\n{rest}", repr(one.before), repr(one.after)), []).append(
            (case, one)
        )
    for members in groups.values():
        first = members[0][1]
        if len(members) == 1:
            yield first
        else:
            rest = CASE.sub(r"\2", first.what)
            yield Difference(
                first.group, f"case {few([case for case, _ in members])} {rest}", first.before, first.after
            )


def _limits(manifest: Manifest) -> dict[str, Any]:
    return {joint: limits.model_dump() for joint, limits in manifest.actuators.items()}


def _verdicts(old: Run, new: Run) -> Iterator[Difference]:
    yield from differences("outcome", "verdict", *(conclusion_of(run).word for run in (old, new)))


def _outcomes(old: Manifest, new: Manifest) -> Iterator[Difference]:
    for name in dict.fromkeys([*old.cases, *new.cases]):
        one, two = old.cases.get(name), new.cases.get(name)
        if one is None or two is None:
            yield Difference("outcome", f'case "{name}"', one and one.status, two and two.status)
            continue
        computed = not {one.status, two.status} & NOT_COMPUTED
        for field in ("status", *(("mobility", "rank", "redundant_rows", "idle_freedoms") if computed else ())):
            yield from differences("outcome", f'case "{name}" {field}', getattr(one, field), getattr(two, field))
    claims = [{claim.id: _word(claim) for claim in manifest.claims} for manifest in (old, new)]
    yield from differences("outcome", "claim", *claims)


def _word(claim: ClaimRecord) -> str:
    if claim.not_about:
        return "not about this robot"
    holds = claim.holds
    return "undecided" if holds is None else "holds" if holds else "does not hold"


def differences(group: str, what: str, before: Any, after: Any) -> Iterator[Difference]:
    """Walk through two nested values; yield the places where they differ."""
    one, two = _labelled(before), _labelled(after)
    if isinstance(one, Mapping) and isinstance(two, Mapping):
        for key in dict.fromkeys([*one, *two]):
            if key not in PROSE:
                yield from differences(group, f"{what} {key}".strip(), one.get(key, MISSING), two.get(key, MISSING))
    elif not _same(before, after):
        yield Difference(group, what, before, after)


def _labelled(value: Any) -> Any:
    """Turn a list of named entries into a mapping by name; candidates may share a name and differ by reference."""
    if isinstance(value, Sequence) and not isinstance(value, str) and value:
        for label in LABELS:
            if all(isinstance(entry, Mapping) and label in entry for entry in value):
                keys = [f'"{entry[label]}"' for entry in value]
                if len(set(keys)) < len(keys):
                    keys = [
                        f"{key} against {entry.get('reference', '')}" for key, entry in zip(keys, value, strict=True)
                    ]
                if len(set(keys)) == len(keys):
                    return dict(zip(keys, value, strict=True))
    return value


def _same(one: Any, two: Any) -> bool:
    if isinstance(one, float) and isinstance(two, float) and math.isnan(one) and math.isnan(two):
        return True
    if isinstance(one, list | tuple) and isinstance(two, list | tuple):
        return len(one) == len(two) and all(map(_same, one, two))
    return bool(one == two)
