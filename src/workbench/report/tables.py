"""Tables of a report: cells, columns, a sentence above and one below; the templates turn them into HTML or Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from urllib.parse import quote


@dataclass(frozen=True)
class Status:
    """An outcome that reads the same without colour: a symbol and words, and a key for the style sheet."""

    key: str
    symbol: str
    text: str
    loud: bool = False


PASSED = Status("passed", "✓", "passed")
FAILED = Status("failed", "✗", "FAILED", loud=True)
ERROR = Status("error", "⚠", "ERROR, not computed", loud=True)
MEASURED = Status("measured", "", "measured")
HOLDS = Status("passed", "✓", "holds")
REFUTED = Status("refuted", "✗", "does not hold")
NOT_ABOUT = Status("unjudged", "–", "not about this robot")
UNDECIDED = Status("undecided", "?", "cannot be decided")

EXPECTED_FAIL = Status("expected", "≠", "declared failure, seen")
UNEXPECTED_PASS = Status("failed", "✗", "DECLARED FAILURE, NOT SEEN", loud=True)
UNDECIDED_VERDICT = Status("undecided", "?", "UNDECIDED", loud=True)

CASE_STATUS = {
    "passed": PASSED,
    "failed": FAILED,
    "error": ERROR,
    "undecided": UNDECIDED_VERDICT,
    "nothing-judged": Status("unjudged", "–", "nothing judged"),
    "not-driven": Status("error", "⚠", "CANNOT BE DRIVEN", loud=True),
    "invalid": Status("invalid", "⊘", "invalid, not computed"),
    "timeout": Status("timeout", "◷", "TIMED OUT", loud=True),
    "killed": Status("killed", "☠", "KILLED", loud=True),
    "filtered": Status("filtered", "", "filtered out"),
}
NOT_COMPUTED = frozenset({"error", "not-driven", "invalid", "timeout", "killed", "filtered"})
"""Statuses of cases that have no series."""
VERDICT_STATUS = {
    "pass": PASSED,
    "fail": FAILED,
    "measured": MEASURED,
    "expected-fail": EXPECTED_FAIL,
    "unexpected-pass": UNEXPECTED_PASS,
    "undecided": UNDECIDED_VERDICT,
    "agrees": Status("passed", "≈", "agrees within its uncertainty"),
    "differs": Status("measured", "≠", "differs"),
}
FAILURES = frozenset({"fail", "unexpected-pass", "undecided"})
"""Verdicts that fail a campaign."""
CHECKED = frozenset({"pass", "fail", "undecided"})
"""Verdicts of rows that have a bound to keep."""
KINDS = ("verification", "expected-failure", "modelling", "unbounded", "recorded", "contrast")
"""Families of rows, which a table never mixes."""

CLAIM_STATUS = {True: HOLDS, False: REFUTED, None: UNDECIDED}


def verdict_status(verdict: str) -> Status:
    """Return the status of a verdict of summary.csv; one that this version does not know is shown as it stands."""
    return VERDICT_STATUS.get(verdict, Status("undecided", "?", verdict))


@dataclass(frozen=True)
class Column:
    """A column's heading; numbers are right-aligned."""

    title: str
    numeric: bool = False


@dataclass(frozen=True)
class Cell:
    """What a cell shows; ``value`` is the number behind it at full precision, ``link`` an anchor in the report."""

    text: str = ""
    value: float | None = None
    status: Status | None = None
    link: str | None = None
    emphasis: bool = False
    file: str = ""
    """path of a file of the run directory, relative to it, that the text leads to"""

    @property
    def href(self) -> str:
        """Where the text leads to, as a relative address; empty where it leads nowhere."""
        return quote(self.file) if self.file else f"#{self.link}" if self.link else ""


@dataclass(frozen=True)
class Table:
    """A table with the sentence that says what it shows and the sentence that says how to read it."""

    key: str
    shows: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    reading: str

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"table {self.key}: {len(row)} cells in a row of {len(self.columns)} columns")


def columns(names: Sequence[str], numeric: Sequence[str] = ()) -> tuple[Column, ...]:
    """Make columns from their titles; those in *numeric* are right-aligned."""
    return tuple(Column(name, name in numeric) for name in names)
