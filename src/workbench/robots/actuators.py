"""What a robot's actuators can give: ``[actuators.JOINT]`` of a robot file or a campaign, with its source."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated

from pydantic import Field, model_validator

from workbench.errors import SpecError, did_you_mean
from workbench.schema import Finite, Strict

Positive = Annotated[Finite, Field(gt=0)]


class ActuatorSpec(Strict):
    """Limits of one actuator at its joint, behind the gear; SI, N or N m and m/s or rad/s as the joint is."""

    peak: Positive | None = None
    """largest force or torque, N or N m, for a moment"""
    rms: Positive | None = None
    """force or torque that it stands without end, N or N m: held against the root mean square over a case"""
    speed: Positive | None = None
    """m/s or rad/s"""
    power: Positive | None = None
    """largest mechanical power, W, driving or braking"""
    source: str = ""
    """where the numbers are from: a data sheet, a gear's ratio"""

    @model_validator(mode="after")
    def _some_limit(self) -> ActuatorSpec:
        if self.peak is None and self.rms is None and self.speed is None and self.power is None:
            raise ValueError("gives no limit; allowed: one or more of peak, rms, speed, power")
        return self

    @model_validator(mode="after")
    def _peak_above_rms(self) -> ActuatorSpec:
        if self.peak is not None and self.rms is not None and self.rms > self.peak:
            raise ValueError(f"rms = {self.rms:g} is above peak = {self.peak:g}; what lasts is at most the peak")
        return self


def check_joints(actuators: Mapping[str, ActuatorSpec], joints: Sequence[str], where: str) -> None:
    """Refuse limits of a joint that is not actuated.

    Raises
    ------
    SpecError
        One line with the nearest actuated joint.
    """
    for joint in actuators:
        if joint not in joints:
            raise SpecError(f'{where}: actuators: no actuated joint "{joint}"{did_you_mean(joint, joints)}', key=joint)
