"""The motions that a campaign may ask for, one table each, told apart by their ``kind``."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.schema import Finite, Strict, Vector

MAX_SAMPLES = 100_000
"""Samples of one case: the reference holds some 20 kB of matrices for each while it computes."""

Samples = Annotated[int, Field(le=MAX_SAMPLES)]
Term = Annotated[list[Finite], Field(min_length=2, max_length=3)]
Terms = list[Annotated[list[Term], Field(max_length=1000)]]
Moment = Annotated[Finite, Field(ge=-1e6, le=1e6)]
"""Seconds; beyond some weeks the phase of a sinusoid is no longer known to all digits."""
Task = Annotated[list[Finite], Field(min_length=1, max_length=6)]
"""One number for each task coordinate of the robot; how many those are is known where the robot is."""


class Window(Strict):
    """When a motion is sampled: seconds, and either a number of samples or a rate in hertz."""

    start: Moment = 0.0
    stop: Moment
    samples: Samples | None = None
    rate: Finite | None = None

    @model_validator(mode="after")
    def _one_of(self) -> Window:
        if (self.samples is None) == (self.rate is None):
            raise ValueError("give exactly one of samples and rate")
        if self.rate is not None and (self.stop - self.start) * self.rate >= MAX_SAMPLES:
            raise ValueError(f"rate = {self.rate:g} Hz makes more samples than allowed: {MAX_SAMPLES}")
        return self


class SineMotion(Window):
    """One sinusoid per joint."""

    kind: Literal["sine"]
    offset: Vector
    amplitude: Vector
    frequency: Vector
    phase: Vector | None = None


class MultiSineMotion(Window):
    """Any number of sinusoids per joint, each ``[amplitude, frequency, phase]``."""

    kind: Literal["multi_sine"]
    offset: Vector
    terms: Terms


class CycleMotion(Strict):
    """A pick-and-place cycle planned in task coordinates."""

    kind: Literal["pick_and_place"]
    pick: Task
    place: Task
    lift: Finite | Task
    up: Task | None = None
    lift_time: Finite
    traverse_time: Finite
    lower_time: Finite | None = None
    dwell: Finite = 0.0
    overlap: Finite = 0.0
    back: bool = False
    law: str = "quintic"
    samples: Samples | None = None
    rate: Finite | None = None


class PlatformSineMotion(Window):
    """One sinusoid per task coordinate."""

    kind: Literal["platform_sine"]
    offset: Task
    amplitude: Task
    frequency: Task
    phase: Task | None = None


class PlatformMultiSineMotion(Window):
    """Any number of sinusoids per task coordinate, each ``[amplitude, frequency, phase]``."""

    kind: Literal["platform_multi_sine"]
    offset: Task
    terms: Terms


class TableMotion(Strict):
    """A motion from a file beside the campaign."""

    file: str


class CsvMotion(TableMotion):
    """Columns are the joints: ``t``, their names or ``q1 q2 ...`` and, if given, derivatives."""

    kind: Literal["csv"]


class PlatformCsvMotion(TableMotion):
    """Columns are the task coordinates: ``t x y z`` and, if given, derivatives."""

    kind: Literal["platform_csv"]


class ColumnSpec(Strict):
    """A column of a table, by its header, and the unit where the header does not say it."""

    name: str = ""
    unit: str = ""


Columns = dict[str, str | ColumnSpec]
"""``t``, a joint or ``q1``, ``tau_JOINT`` or ``tau1`` -> header, or header and unit"""


class RecordedMotion(TableMotion):
    """Coordinates from a table, differentiated as their noise and digits allow; what that leaves open is stated."""

    kind: Literal["recorded"]
    columns: Columns = Field(default_factory=dict)


MOTIONS: dict[str, type[Strict]] = {
    "sine": SineMotion, "multi_sine": MultiSineMotion, "pick_and_place": CycleMotion, "csv": CsvMotion,
    "platform_sine": PlatformSineMotion, "platform_multi_sine": PlatformMultiSineMotion,
    "platform_csv": PlatformCsvMotion, "recorded": RecordedMotion,
}  # fmt: skip
"""By their ``kind``."""

PlannedMotion = (
    SineMotion
    | MultiSineMotion
    | CycleMotion
    | CsvMotion
    | PlatformSineMotion
    | PlatformMultiSineMotion
    | PlatformCsvMotion
)
"""What is known to all digits, or taken to be."""

Motion = Annotated[PlannedMotion | RecordedMotion, Field(discriminator="kind")]
