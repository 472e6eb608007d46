"""Whether a formula is good enough: errors without a bound held against the accuracy that a campaign wants.

``good = 0.02`` asks for a modelling error of at most 2 % of the peak on every joint. The answer is yes or no and judges
nothing: no verdict and no exit code depend on it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

from workbench.campaign.changed import few
from workbench.campaign.verdict import SHARE, WITHOUT_BOUND

YES, NO, UNDECIDED = "yes", "no", "undecided"
WORDS = {YES: "good enough", NO: "NOT good enough", UNDECIDED: "good enough? undecided"}


class Measured(Protocol):
    """A row of errors, computed just now or read from ``summary.csv``."""

    @property
    def case(self) -> str: ...  # noqa: D102
    @property
    def candidate(self) -> str: ...  # noqa: D102
    @property
    def reference(self) -> str: ...  # noqa: D102
    @property
    def joint(self) -> str: ...  # noqa: D102
    @property
    def kind(self) -> str: ...  # noqa: D102
    @property
    def peak_error(self) -> float: ...  # noqa: D102
    @property
    def worst_time_s(self) -> float: ...  # noqa: D102
    @property
    def uncertainty(self) -> float: ...  # noqa: D102


def good_enough(row: Measured, good: float | None) -> str:
    """``yes``, ``no`` or ``undecided``; empty where nobody asked, or where the row has a bound to keep.

    As for bounds, an answer counts where the reference's own uncertainty is below a tenth of what it is held against.
    An error that is no number is not good enough.
    """
    if good is None or row.kind not in WITHOUT_BOUND:
        return ""
    within = row.peak_error <= good
    if row.uncertainty >= SHARE * (good if within else row.peak_error):
        return UNDECIDED
    return YES if within else NO


@dataclass(frozen=True)
class Answer:
    """Whether one formula is good enough against one reference, over all cases and joints."""

    candidate: str
    reference: str
    good: float
    rows: tuple[Measured, ...]
    besides: str = ""
    """what it does not cover, a sentence with a blank in front; empty where that is nothing"""

    def _with(self, answer: str) -> list[Measured]:
        return [row for row in self.rows if good_enough(row, self.good) == answer]

    @property
    def answer(self) -> str:
        """``no`` where one case and joint exceeds it; ``yes`` where all keep it."""
        return NO if self._with(NO) else UNDECIDED if self._with(UNDECIDED) else YES

    @property
    def sentence(self) -> str:
        """The answer in words, with what decides it: the worst joint and case, and what it does not cover."""
        return self._told + self.besides

    @property
    def _told(self) -> str:
        rows = self.rows
        worst = max(rows, key=lambda row: math.inf if math.isnan(row.peak_error) else row.peak_error)
        at = f"{100 * worst.peak_error:.3g} % on {worst.joint} in case {worst.case} at {worst.worst_time_s:.4g} s"
        asked = f"Is {self.candidate} good enough, within {100 * self.good:.3g} % of {self.reference} on every joint?"
        if self.answer == YES:
            count = len({row.case for row in rows})
            of = f" in {count} case{'s' if count > 1 else ''}" if self.besides else ""
            return f"{asked} Yes{of}: the largest error is {at}."
        if self.answer == UNDECIDED:
            names = few(list(dict.fromkeys(row.case for row in self._with(UNDECIDED))))
            return f"{asked} Undecided: the reference's own uncertainty is too large in {names}."
        bad: dict[str, list[str]] = {}
        for row in self._with(NO):
            bad.setdefault(row.case, []).append(row.joint)
        cases = list(dict.fromkeys(row.case for row in rows))
        kept = [case for case in cases if case not in bad and case not in {r.case for r in self._with(UNDECIDED)}]
        where = few([f"{case} ({', '.join(joints)})" for case, joints in bad.items()])
        rest = f"; yes in {few(kept)}" if kept else ""
        return f"{asked} No: {at}; no in {where}{rest}."


def answers(rows: Iterable[Measured], good: float | None, besides: str = "") -> list[Answer]:
    """Answer for each formula without a bound, in the order of the rows; nothing where nobody asked.

    *besides* says of which cases nothing is said.
    """
    if good is None:
        return []
    groups: dict[tuple[str, str], list[Measured]] = {}
    for row in rows:
        if good_enough(row, good):
            groups.setdefault((row.candidate, row.reference), []).append(row)
    return [Answer(*names, good, tuple(found), besides) for names, found in groups.items()]
