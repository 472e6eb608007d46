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
    """first time, s"""
    stop: Moment
    """last time, s"""
    samples: Samples | None = None
    """number of samples, both ends included"""
    rate: Finite | None = None
    """or samples per second"""

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
    """q = offset + amplitude sin(frequency t + phase), joint by joint"""
    offset: Vector
    """one per joint, m or rad"""
    amplitude: Vector
    """one per joint, m or rad"""
    frequency: Vector
    """one per joint, rad/s"""
    phase: Vector | None = None
    """one per joint, rad; zeros where not said"""


class MultiSineMotion(Window):
    """Any number of sinusoids per joint, each ``[amplitude, frequency, phase]``."""

    kind: Literal["multi_sine"]
    """an offset and any number of sinusoids, joint by joint"""
    offset: Vector
    """one per joint, m or rad"""
    terms: Terms
    """for each joint a list of ``[amplitude, frequency, phase]``; the phase may be left out"""


class CycleMotion(Strict):
    """A pick-and-place cycle planned in task coordinates."""

    kind: Literal["pick_and_place"]
    """lift, traverse, lower"""
    pick: Task
    """pose, one number per task coordinate, m and rad"""
    place: Task
    """pose, one number per task coordinate, m and rad"""
    lift: Finite | Task
    """height along *up*, m; or the lift as a vector, without *up*"""
    up: Task | None = None
    """direction away from the ground, one number per position"""
    lift_time: Finite
    """s"""
    traverse_time: Finite
    """s"""
    lower_time: Finite | None = None
    """s; *lift_time* where not said"""
    dwell: Finite = 0.0
    """rest at the place pose and, with *back*, again at the pick pose, s"""
    overlap: Finite = 0.0
    """part of lift and lower that runs together with the traverse, from 0 to below 1"""
    back: bool = False
    """return to the pick pose"""
    law: str = "quintic"
    """``quintic``: velocity and acceleration vanish at the ends of a move; ``septic``: jerk too"""
    samples: Samples | None = None
    """number of samples, both ends included"""
    rate: Finite | None = None
    """or samples per second"""


class PlatformSineMotion(Window):
    """One sinusoid per task coordinate."""

    kind: Literal["platform_sine"]
    """as ``sine``, in the task coordinates"""
    offset: Task
    """one per task coordinate, m or rad"""
    amplitude: Task
    """one per task coordinate, m or rad"""
    frequency: Task
    """one per task coordinate, rad/s"""
    phase: Task | None = None
    """one per task coordinate, rad; zeros where not said"""


class PlatformMultiSineMotion(Window):
    """Any number of sinusoids per task coordinate, each ``[amplitude, frequency, phase]``."""

    kind: Literal["platform_multi_sine"]
    """as ``multi_sine``, in the task coordinates"""
    offset: Task
    """one per task coordinate, m or rad"""
    terms: Terms
    """for each task coordinate a list of ``[amplitude, frequency, phase]``"""


class TableMotion(Strict):
    """A motion from a file beside the campaign."""

    file: str
    """beside the campaign file or in the directory above it"""


class CsvMotion(TableMotion):
    """Columns are the joints: ``t``, their names or ``q1 q2 ...`` and, if given, derivatives."""

    kind: Literal["csv"]
    """a table of joint motions"""


class PlatformCsvMotion(TableMotion):
    """Columns are the task coordinates: ``t x y z`` and, if given, derivatives."""

    kind: Literal["platform_csv"]
    """a table of the platform's motion"""


class ColumnSpec(Strict):
    """A column of a table, by its header, and the unit where the header does not say it."""

    name: str = ""
    """header of the column"""
    unit: str = ""
    """where the header does not say it"""


Columns = dict[str, str | ColumnSpec]
"""``t``, a joint or ``q1``, ``tau_JOINT`` or ``tau1`` -> header, or header and unit"""


class RecordedMotion(TableMotion):
    """Coordinates from a table, differentiated as their noise and digits allow; what that leaves open is stated."""

    kind: Literal["recorded"]
    """a table that was measured, or written with few digits"""
    columns: Columns = Field(default_factory=dict)
    """where quantities stand, by ``t`` and joint; by their own names where not said"""


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
