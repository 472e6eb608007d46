"""Errors of two runs side by side, and which of them got worse."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

from workbench.campaign.good import Measured
from workbench.campaign.verdict import FAILURES, MODELLING, UNBOUNDED, VERIFICATION
from workbench.errors import WorkbenchError

FLOOR = 1e-12
"""Errors below this are rounding: they differ between machines and versions by factors that say nothing."""

FACTOR = 10.0
"""An error that grew by more counts as worse, unless the user says otherwise."""

MEASURES = ("peak_error", "rms_error", "pointwise_error")

JUDGED = (VERIFICATION, MODELLING, UNBOUNDED)
"""Kinds of rows in which a larger error is worse; declared failures and contrasts are judged by their verdict alone."""


class Compared(Measured, Protocol):
    """A row of errors with its verdict."""

    @property
    def verdict(self) -> str: ...  # noqa: D102


@dataclass(frozen=True)
class ErrorChange:
    """One error before and after; None where a run does not have it."""

    case: str
    candidate: str
    reference: str
    joint: str
    kind: str
    before: Compared | None
    after: Compared | None

    @property
    def where(self) -> str:
        """Case, candidate, reference and joint in words."""
        return f"{self.case}: {self.candidate} against {self.reference}, {self.joint}"

    @property
    def same(self) -> bool:
        """Whether all measures and the verdict are the same, bit for bit."""
        if self.before is None or self.after is None:
            return False
        pairs = [(_value(self.before, m), _value(self.after, m)) for m in MEASURES]
        return self.before.verdict == self.after.verdict and all(a == b or (a != a and b != b) for a, b in pairs)

    def worse(self, factor: float = FACTOR, floor: float = FLOOR) -> list[str]:
        """Say what got worse by more than *factor*, one line each; errors below *floor* count as equal to it."""
        if self.before is None or self.after is None:
            return []
        lines = []
        for measure in MEASURES if self.kind in JUDGED else ():
            old, new = _value(self.before, measure), _value(self.after, measure)
            if growth(old, new, floor) > factor:
                lines.append(f"{self.where}: {measure} {old:.3g} -> {new:.3g} ({growth_text(growth(old, new, floor))})")
        if self.after.verdict in FAILURES and self.before.verdict not in FAILURES:
            lines.append(f"{self.where}: {self.before.verdict} -> {self.after.verdict}")
        return lines


def _value(row: Compared, measure: str) -> float:
    return float(getattr(row, measure))


def growth(before: float, after: float, floor: float = FLOOR) -> float:
    """Factor by which an error grew, both raised to *floor*; inf where it is no number any more."""
    if after != after:
        return 1.0 if before != before else math.inf
    if before != before:
        return 1.0
    old, new = max(before, floor), max(after, floor)
    return 1.0 if old == new else new / old


def growth_text(factor: float) -> str:
    """Write a factor in few characters: ``x1.24``, ``x3e+05``, ``/4.1``."""
    if not math.isfinite(factor) or factor == 0.0:
        return "lost" if factor else "gone"
    sign, size = ("x", factor) if factor >= 1 else ("/", 1 / factor)
    return f"{sign}{size:.0e}" if size >= 1000 else f"{sign}{size:.2f}" if size < 10 else f"{sign}{size:.0f}"


def match_errors(before: Iterable[Compared], after: Iterable[Compared]) -> list[ErrorChange]:
    """Pair the rows of two runs, in the order of the second; those that only the first has come last."""
    old, new = {_key(row): row for row in before}, {_key(row): row for row in after}
    # what kind a row is may be told otherwise by another version, or by a bound that came or went
    keys = [*new, *(key for key in old if key not in new)]
    return [ErrorChange(*key, (new.get(key) or old[key]).kind, old.get(key), new.get(key)) for key in keys]


def _key(row: Compared) -> tuple[str, str, str, str]:
    return row.case, row.candidate, row.reference, row.joint


def all_worse(changes: Sequence[ErrorChange], factor: float = FACTOR, floor: float = FLOOR) -> list[str]:
    """List everything that got worse, one line each.

    Raises
    ------
    WorkbenchError
        A factor below 1, or a floor that is not positive.
    """
    if not 1.0 <= factor < math.inf:
        raise WorkbenchError(f"--factor {factor:g}; allowed: a number of at least 1", value=factor, limit=1.0)
    if not 0.0 < floor < math.inf:
        raise WorkbenchError(f"--floor {floor:g}; allowed: a positive number", value=floor)
    return [line for change in changes for line in change.worse(factor, floor)]
