"""Which runs a study is made of: every combination of case, controller, model, speed, rate and bandwidth, in order."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.campaign.cases import base_robot, resolve_case
from workbench.campaign.control_spec import BUILT_IN, MOST_RUNS, NO_MODEL, PD, PRINTED_COST, ControlSpec
from workbench.campaign.spec import Campaign, CaseSpec
from workbench.campaign.user_candidates import UserCandidate
from workbench.capabilities.robot import Robot
from workbench.control.user_controller import UserController
from workbench.errors import MotionError, SpecError, WorkbenchError, did_you_mean
from workbench.sweep.vary import FASTER

LONGEST_RUN = 100_000
"""Ticks of one run."""


@dataclass(frozen=True)
class Loop:
    """One run: what is tracked, by what."""

    case: str
    controller: str
    model: str
    speed: float
    rate: float
    """Hz, a printed cost resolved"""
    rate_asked: str
    """as the campaign has it"""
    bandwidth: float


@dataclass(frozen=True)
class StudyPlan:
    """All runs of a campaign with ``[control]``."""

    campaign: Campaign
    file: Path
    model: Path
    robot: Robot
    loops: tuple[Loop, ...]

    @property
    def spec(self) -> ControlSpec:
        """The campaign's ``[control]``."""
        assert self.campaign.control is not None
        return self.campaign.control

    def robots(self, settings: Mapping[str, float]) -> dict[str, Robot]:
        """The robot of each case, as its models believe it."""
        return {
            case.name: self.robot.with_parameters(**overrides_of(self.campaign, self.robot, case, settings))
            for case in self.campaign.case
        }


def plan_study(
    campaign: Campaign,
    file: Path,
    model: Path | None = None,
    settings: Mapping[str, float] | None = None,
    users: Sequence[UserCandidate] = (),
    controllers: Sequence[UserController] = (),
) -> StudyPlan:
    """Resolve every name and number of a study; nothing is tracked yet.

    Raises
    ------
    SpecError, ModelError, ParameterError, MotionError
        One line that names the file, the key, the value and what is allowed.
    """
    spec = campaign.control
    assert spec is not None
    robot, path = base_robot(campaign, file, model, users)
    own = [one.name for one in controllers]
    where = f"{file}: control"
    for name in spec.controllers:
        if name not in (*BUILT_IN, *own):
            raise SpecError(
                f'{where}: no controller "{name}"{did_you_mean(name, [*BUILT_IN, *own])}; controllers of your own come'
                " from a Python file: --controllers FILE",
                file=str(file),
                key="controllers",
            )
    for name in spec.models:
        if name != NO_MODEL and name not in robot.candidates:
            raise SpecError(
                f'{where}: {robot.name} has no candidate "{name}"{did_you_mean(name, [*robot.candidates, NO_MODEL])}',
                file=str(file),
                key="models",
            )
    for what in ("resolution", "noise"):
        for joint in getattr(spec, what):
            if joint not in robot.joints:
                raise SpecError(f'{where}.{what}: no actuated joint "{joint}"{did_you_mean(joint, robot.joints)}')
    for one in spec.claim:
        for case in one.cases:
            if case not in [c.name for c in campaign.case]:
                raise SpecError(f'{where}: claim "{one.id}": no case "{case}"')
    for key, numbers in (("plant", spec.plant), *((f'claim "{one.id}"', one.parameters) for one in spec.claim)):
        try:
            robot.description.table.changed(robot.values, numbers)
        except WorkbenchError as error:
            raise SpecError(f"{where}.{key}: {error}", file=str(file), key=key) from error
    if spec.limits and not torque_limits(campaign, robot):
        raise SpecError(
            f"{where}: limits = true, and neither robot file nor campaign says what an actuator gives; add"
            " [actuators.JOINT] with peak, or leave limits out",
            file=str(file),
            key="limits",
        )
    loops = []
    for one_case in campaign.case:
        for speed in spec.speeds:
            if not math.isclose(speed, 1.0) and one_case.motion.kind not in FASTER:
                raise SpecError(
                    f'{where}: case "{one_case.name}": no formula makes a motion of kind {one_case.motion.kind} faster;'
                    " allowed: speeds = [1.0]",
                    file=str(file),
                    case=one_case.name,
                )
            length = _duration(campaign, file, path, robot, case_at(one_case, speed), settings or {}, spec)
            for controller, one_model in pairs_of(spec):
                for asked in spec.rates:
                    found = rate_of(spec, asked, one_model)
                    if found is None:
                        continue
                    _check_times(spec, asked, found, one_model, length, f'{where}: case "{one_case.name}"')
                    loops += [
                        Loop(one_case.name, controller, one_model, speed, found, _shown(asked), bandwidth)
                        for bandwidth in spec.bandwidths
                    ]
    if not loops:
        raise SpecError(f"{where}: no controller goes with any of the models; pd goes with model none", file=str(file))
    if len(loops) > MOST_RUNS:
        raise SpecError(f"{where}: {len(loops)} runs; allowed: at most {MOST_RUNS}", file=str(file))
    return StudyPlan(campaign, file, path, robot, tuple(loops))


def pairs_of(spec: ControlSpec) -> list[tuple[str, str]]:
    """Controllers with the models that go with them."""
    return [(c, model) for c in spec.controllers for model in spec.models if _goes_with(c, model)]


def _goes_with(controller: str, model: str) -> bool:
    if controller == PD:
        return model == NO_MODEL
    return model != NO_MODEL if controller in BUILT_IN else True


def _shown(asked: float | str) -> str:
    return asked if isinstance(asked, str) else f"{asked:g}"


def rate_of(spec: ControlSpec, asked: float | str, model: str) -> float | None:
    """Hz; None where a printed cost is asked of no model. The cost of a sample ends the rate, as does the highest."""
    if asked != PRINTED_COST:
        return float(asked)
    if model == NO_MODEL:
        return None
    return min(1e6 / spec.printed_cost[model], spec.highest_rate or math.inf)


def delay_of(spec: ControlSpec, rate: float, asked: str, model: str) -> float:
    """From measuring to torque, s; at the rate that a printed cost sets, the cost itself."""
    cost = spec.printed_cost.get(model)
    return (cost or 0.0) * 1e-6 if asked == PRINTED_COST else spec.delay.seconds(rate, cost)


def case_at(case: CaseSpec, speed: float) -> CaseSpec:
    """The case with its motion made faster by a factor."""
    if math.isclose(speed, 1.0):
        return case
    content = copy.deepcopy(case.model_dump())
    FASTER[content["motion"]["kind"]](content["motion"], speed)
    return CaseSpec.model_validate(content)


def torque_limits(campaign: Campaign, robot: Robot) -> dict[str, float]:
    """The largest torque of each joint that has one, N or N m: the robot file's, and over it the campaign's."""
    found = {**robot.description.robot.spec.actuators, **(campaign.actuators or {})}
    return {joint: limits.peak for joint, limits in found.items() if limits.peak is not None}


def overrides_of(campaign: Campaign, robot: Robot, case: CaseSpec, settings: Mapping[str, float]) -> dict[str, Any]:
    """Parameters that the models believe: the campaign's, over them the case's and the command line's."""
    return robot.description.table.layered(campaign.parameters, case.parameters, settings)


def _duration(
    campaign: Campaign,
    file: Path,
    model: Path,
    robot: Robot,
    case: CaseSpec,
    settings: Mapping[str, float],
    spec: ControlSpec,
) -> float:
    """Seconds that are tracked."""
    try:
        found = resolve_case(case, file, robot, model, overrides_of(campaign, robot, case, settings))
    except MotionError as error:
        raise MotionError(f'{file}: case "{case.name}": {error}', **{**error.facts, "case": case.name}) from error
    length = float(found.motion.t[-1] - found.motion.t[0])
    return min(length, spec.duration or math.inf)


def _check_times(spec: ControlSpec, asked: float | str, rate: float, model: str, length: float, where: str) -> None:
    ticks = length * rate
    if ticks < 2.0:
        raise SpecError(f"{where}: rate {rate:g} Hz gives {ticks:.3g} ticks in {length:.4g} s; allowed: 2 or more")
    if ticks > LONGEST_RUN:
        raise SpecError(
            f"{where}: rate {rate:g} Hz gives {ticks:.0f} ticks in {length:.4g} s; allowed: at most {LONGEST_RUN};"
            " highest_rate or duration set less"
        )
    if spec.step is not None and rate * spec.step > 1.0 + 1e-9:
        raise SpecError(
            f"{where}: rate {rate:g} Hz is above the plant's step of {spec.step:g} s; allowed: step <= {1 / rate:.6g}"
        )
    delay = delay_of(spec, rate, _shown(asked), model)
    if delay >= length:
        raise SpecError(f"{where}: a delay of {delay:.4g} s is longer than the motion of {length:.4g} s", key="delay")
