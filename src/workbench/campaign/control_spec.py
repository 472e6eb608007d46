"""The ``[control]`` table of a campaign file: what tracks the motions of its cases; every key is in docs/control.md."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from workbench.schema import Finite, Name, Strict

Positive = Annotated[Finite, Field(gt=0)]
PRINTED_COST = "printed cost"
NO_MODEL = "none"
PD = "pd"
BUILT_IN = (PD, "pd + weight", "feed-forward + pd", "computed torque")

MOST_RUNS = 100_000
FASTEST_RATE = 1e6

Rate = Annotated[Finite, Field(gt=0, le=FASTEST_RATE)] | Literal["printed cost"]


class DelaySpec(Strict):
    """From measuring to the torque that follows: samples, microseconds, or what the formula's authors printed."""

    samples: Annotated[Finite, Field(ge=0, le=100)] | None = None
    """control periods"""
    us: Annotated[Finite, Field(ge=0)] | None = None
    """microseconds"""
    printed_cost: bool = False
    """true: what the formula's authors printed of its cost"""

    @model_validator(mode="after")
    def _one_of(self) -> DelaySpec:
        if (self.samples is not None) + (self.us is not None) + self.printed_cost != 1:
            raise ValueError("give exactly one of samples, us, printed_cost = true")
        return self

    def seconds(self, rate: float, printed_us: float | None) -> float:
        """The delay at a control rate."""
        if self.samples is not None:
            return self.samples / rate
        if self.us is not None:
            return self.us * 1e-6
        return (printed_us or 0.0) * 1e-6


class ControlClaim(Strict):
    """A sentence about models in control, and what decides it: the tracking errors of this campaign."""

    id: Name
    """unique"""
    text: str
    """the claim in words"""
    source: str = ""
    """where it is printed"""
    kind: Literal["enough", "faster", "grows", "enough-but-fast"]
    """what decides it"""
    model: str
    """the model that it is about"""
    against: str
    """the model that *model* is held against"""
    controller: str
    """with which it is decided"""
    cases: list[str] = Field(default_factory=list)
    """empty is all"""
    speeds: list[Positive] = Field(default_factory=list)
    """empty is all; for ``enough-but-fast`` those that count as fast"""
    parameters: dict[str, float] = Field(default_factory=dict)
    """numbers of a case that the sentence is about, too: a load that a robot carries makes it no other robot"""
    note: str = ""
    """remark in the report"""


class ControlSpec(Strict):
    """Controllers, models, rates, speeds and gains; every combination is one run of each case."""

    controllers: Annotated[list[str], Field(min_length=1)]
    """of `BUILT_IN`, or names of a user's own"""
    models: Annotated[list[str], Field(min_length=1)]
    """names of formulas, ``none`` for controllers without"""
    rates: Annotated[list[Rate], Field(min_length=1)]
    """Hz"""
    highest_rate: Positive | None = None
    """Hz: a printed cost allows more; more is not asked for"""
    bandwidths: Annotated[list[Positive], Field(min_length=1)]
    """Hz"""
    damping: Positive = 1.0
    """ratio"""
    speeds: Annotated[list[Positive], Field(min_length=1)] = Field(default_factory=lambda: [1.0])
    """factors of the motions' own"""
    delay: DelaySpec = Field(default_factory=lambda: DelaySpec(samples=0.0))
    """from measuring to the torque that follows"""
    resolution: dict[str, Positive] = Field(default_factory=dict)
    """by joint: m or rad"""
    noise: dict[str, Positive] = Field(default_factory=dict)
    """by joint: standard deviation of what is measured, m or rad"""
    rate_from: Literal["ideal", "differences"] = "ideal"
    """where velocities come from: known, or differences of measured positions"""
    seed: Annotated[int, Field(ge=0)] = 0
    """of the noise; the same seed gives the same numbers"""
    limits: bool = False
    """whether torques end at what the robot's file or the campaign says that the actuators give"""
    plant: dict[str, Finite] = Field(default_factory=dict)
    """parameters of the robot that is moved, where the models do not know them"""
    force_known: bool = True
    """whether the models know the external force"""
    printed_cost: dict[str, Positive] = Field(default_factory=dict)
    """by model: microseconds a sample"""
    step: Positive | None = None
    """s: longest step of the plant; none is the control period or 1 ms"""
    second_route: Literal["all", "none"] = "all"
    """which runs are computed by another route too"""
    duration: Positive | None = None
    """s: longest stretch of a motion that is tracked"""
    wanted: Positive = 1e-4
    """m: an error of the platform that does not matter"""
    enough: Positive = 0.1
    """a model is enough where its error is larger than the other's by at most this part"""
    time_limit: Positive = 300.0
    """seconds that one run may take"""
    memory_limit: Annotated[Finite, Field(ge=512, le=1e9)] = 2048.0
    """megabytes of address space that a worker may take beyond its first"""
    retries: Annotated[int, Field(ge=0, le=100)] = 2
    """how often a run is tried again after its worker was killed or it ran out of time"""
    claim: list[ControlClaim] = Field(default_factory=list)
    """sentences about models in control"""

    @model_validator(mode="after")
    def _consistent(self) -> ControlSpec:
        for what in ("controllers", "models", "rates", "bandwidths", "speeds"):
            values = getattr(self, what)
            for value in values:
                if values.count(value) > 1:
                    raise ValueError(f"{what}: {value} stands twice")
        if self.step is not None:
            for rate in self.rates:
                if isinstance(rate, float) and rate * self.step > 1.0 + 1e-9:
                    raise ValueError(
                        f"rate {rate:g} Hz is above the plant's step of {self.step:g} s; allowed: step <="
                        f" {1.0 / rate:.6g}, or leave it out"
                    )
        if PRINTED_COST in self.rates or self.delay.printed_cost:
            for model in self.models:
                if model != NO_MODEL and model not in self.printed_cost:
                    raise ValueError(f'printed_cost: none for model "{model}"; rates or delay ask for it')
        for model in self.printed_cost:
            if model not in self.models:
                raise ValueError(f'printed_cost: no model "{model}" in models')
        for one in self.claim:
            for name, known in (
                (one.model, self.models),
                (one.against, self.models),
                (one.controller, self.controllers),
            ):
                if name not in known:
                    raise ValueError(f'claim "{one.id}": no "{name}"; valid: {", ".join(known)}')
            for speed in one.speeds:
                if not any(math.isclose(speed, known) for known in self.speeds):
                    raise ValueError(f'claim "{one.id}": no speed {speed:g}')
        return self
