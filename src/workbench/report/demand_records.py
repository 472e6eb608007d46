"""What manifest.json says of actuators: their limits, and what each case asks of them."""

from __future__ import annotations

from pydantic import Field

from workbench.records import Record


class ActuatorRecord(Record):
    """Limits of one actuator at its joint, SI; None where nobody said."""

    peak: float | None = Field(None, gt=0)
    rms: float | None = Field(None, gt=0)
    speed: float | None = Field(None, gt=0)
    power: float | None = Field(None, gt=0)
    source: str = ""


class DemandRecord(Record):
    """What a case asks of one actuator: see `workbench.demand.Demand`."""

    peak: float | None = None
    peak_at_s: float | None = None
    rms: float | None = None
    speed: float | None = None
    speed_at_s: float | None = None
    power: float | None = None
    power_at_s: float | None = None
    braking: float | None = None
    work: float | None = None
    returned: float | None = None


class CaseDemandRecord(Record):
    """What a case asks of its actuators, by joint; empty in runs of earlier versions."""

    mass_model: str = ""
    """of the reference whose torques these are"""
    joints: dict[str, DemandRecord] = Field(default_factory=dict)
