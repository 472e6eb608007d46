"""sweep.json as typed records, as far as a report reads it."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from workbench.records import Record

FORMAT_VERSION = 1
"""The version of sweep.json that this reader understands."""
ANY_JOINT = "any"
"""stands for the largest error over the joints"""


class KeyRecord(Record):
    """A number that varies."""

    key: str
    low: float
    high: float
    factor: bool = False
    unit: str = ""
    meaning: str = ""
    base: dict[str, float] = Field(default_factory=dict)
    """what a factor is a factor of"""

    @property
    def name(self) -> str:
        """The key without the part that all parameters share."""
        return self.key.removeprefix("parameters.")


class ReasonRecord(Record):
    """Why cases did not pass, or were left out."""

    status: str
    reason: str
    cases: int
    example: str = ""


class ErrorRecord(Record):
    """Errors of one candidate against one reference, on one joint or the largest over all (``any``)."""

    candidate: str
    reference: str
    kind: str
    joint: str
    cases: int
    mean: float | None = None
    max: float | None = None
    worst_case: str | None = None
    quantiles: dict[str, float] = Field(default_factory=dict)
    below: dict[str, float] = Field(default_factory=dict)


class DriverRecord(Record):
    """Rank correlation of the modelling error with a key."""

    candidate: str
    reference: str
    key: str
    rank_correlation: float
    p_value: float | None = None


class BinRecord(Record):
    """Modelling error over one range of one key."""

    candidate: str
    reference: str
    key: str
    low: float
    high: float
    cases: int
    median: float
    p95: float


class Summary(Record):
    """sweep.json."""

    format: Literal[1]
    campaign: str
    case: str
    method: str
    seed: int = 0
    cases: int
    counts: dict[str, int]
    keys: tuple[KeyRecord, ...]
    reasons: tuple[ReasonRecord, ...] = ()
    errors: tuple[ErrorRecord, ...] = ()
    drivers: tuple[DriverRecord, ...] = ()
    bins: tuple[BinRecord, ...] = ()

    @property
    def pairs(self) -> tuple[tuple[str, str, str], ...]:
        """Candidate, reference and kind of each comparison, in the campaign's order."""
        return tuple(dict.fromkeys((row.candidate, row.reference, row.kind) for row in self.errors))

    def row(self, candidate: str, reference: str, joint: str) -> ErrorRecord | None:
        """Errors of one comparison on one joint."""
        wanted = (candidate, reference, joint)
        return next((row for row in self.errors if (row.candidate, row.reference, row.joint) == wanted), None)

    def drivers_of(self, candidate: str, reference: str) -> tuple[DriverRecord, ...]:
        """Rank correlations of one comparison, strongest first."""
        return tuple(d for d in self.drivers if (d.candidate, d.reference) == (candidate, reference))
