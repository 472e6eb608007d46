"""What a comparison comes to, in words: the same sentences on terminal and page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from workbench.campaign.changed import few, not_shared
from workbench.campaign.good import YES
from workbench.campaign.margins import answer, shortfalls
from workbench.compare.errors import FACTOR, FLOOR, all_worse
from workbench.compare.runs import RunComparison

OK, WORSE, NOTHING = "ok", "worse", "nothing"
IN_PART = "OK IN PART"
"""Word where not all cases are in both runs."""


@dataclass(frozen=True)
class ComparisonOutcome:
    """What became of the errors, and what else needs attention in the second run."""

    key: str
    """``ok``, ``worse`` or ``nothing``"""
    word: str
    sentence: str
    worse: tuple[str, ...] = ()
    """everything that got worse, one line each"""
    attention: tuple[str, ...] = ()
    """of the second run: actuators too small, formulas not good enough; changes no outcome"""
    small: tuple[str, ...] = ()
    """of these, the actuators"""
    enough: str = ""
    """that its actuators are big enough, where they are"""
    alone: str = ""
    """what only one run has, and what is therefore not compared"""
    good: tuple[str, ...] = ()
    """whether formulas are good enough, in either run"""

    @property
    def exit_code(self) -> int:
        """Of the command: 4 where nothing could be compared."""
        return {OK: 0, WORSE: 1, NOTHING: 4}[self.key]

    @property
    def text(self) -> str:
        """Word and sentence, as on a terminal."""
        return f"{self.word}: {self.sentence}"


def outcome_of(found: RunComparison, factor: float = FACTOR, floor: float = FLOOR) -> ComparisonOutcome:
    """Judge a comparison.

    Raises
    ------
    WorkbenchError
        As `all_worse`.
    """
    worse = tuple(all_worse(found.errors, factor, floor))
    good = tuple(f"{name}: {one.sentence}" for name, said in zip("AB", found.answers, strict=True) for one in said)
    small = shortfalls(found.margins[1])
    held = found.margins[1]
    attention = (*small, *(one.sentence for one in found.answers[1] if one.answer != YES))
    enough = answer(held, not_shared(found.apart)) if held and not small else ""
    key, word, sentence = _judged(found, worse, factor)
    return ComparisonOutcome(key, word, sentence, worse, attention, tuple(small), enough, _alone(found), good)


def _judged(found: RunComparison, worse: Sequence[str], factor: float) -> tuple[str, str, str]:
    if worse:
        return WORSE, "WORSE", f"{len(worse)} by more than a factor of {factor:g}, or by verdict."
    if not found.shared:
        return NOTHING, "NOTHING COMPARED", "the runs have no error in common."
    word = IN_PART if found.apart else "OK"
    return OK, word, f"nothing got worse by more than a factor of {factor:g}."


def _alone(found: RunComparison) -> str:
    alone = sum(change.before is None or change.after is None for change in found.errors)
    said = [f"{alone} errors in one run only"] if alone else []
    said += [f"not computed in both: {few(list(found.apart))}"] if found.apart else []
    return f"Left out: {'; '.join(said)}." if said else ""
