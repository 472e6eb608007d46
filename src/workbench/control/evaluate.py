"""One run of a study, computed in a worker: by both routes, at a step and at its half; errors come back as data."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.cases import Course, course_of, resolve_case
from workbench.campaign.control_spec import BUILT_IN, NO_MODEL
from workbench.campaign.evidence import Effort
from workbench.campaign.provenance import sha256
from workbench.campaign.spec import Campaign, CaseSpec
from workbench.campaign.user_candidates import load_candidates
from workbench.capabilities.robot import Robot
from workbench.control.controllers import Gains, Law, law_of
from workbench.control.figures import Error, error_of
from workbench.control.loop import TRACKED, Tracked, run_loop
from workbench.control.models import FormulaModel
from workbench.control.names import NOT_RUN
from workbench.control.plan import Loop, StudyPlan, case_at, delay_of, overrides_of, plan_study, torque_limits
from workbench.control.routes import Outcome, Run, by_routes, is_halved, step_of
from workbench.control.sampling import Desired, Sampling, as_measured, desired_at_ticks
from workbench.control.user_controller import UserController, load_controllers
from workbench.errors import WorkbenchError
from workbench.reference.forward import Plant
from workbench.reference.stiff_plant import StiffPlant
from workbench.sweep.evaluate import NO_MEMORY, Answer, Packed
from workbench.sweep.identity import case_key, common_key
from workbench.sweep.record import FAILED, INVALID, PASSED, Record, lost

LISTS = ("controllers", "models", "rates", "highest_rate", "bandwidths", "speeds")
"""What a study is a product of: a run knows its own, and a study that grows keeps what it has."""

JUDGING = ("claim", "wanted", "enough", "time_limit", "memory_limit", "retries")
"""What changes no number of a run."""


@dataclass(frozen=True)
class Bench:
    """All that runs of one case at one speed share."""

    case: CaseSpec
    course: Course
    start: float
    stop: float
    robot: Robot
    """as the models believe it"""
    plant: Plant
    stiff: StiffPlant
    mass: FloatArray
    """``(na,)`` diagonal of M at home, of the robot as the models believe it"""
    platforms: dict[float, tuple[Desired, FloatArray]] = field(default_factory=dict)
    """by rate: the motion at the ticks and the platform's site on it"""

    def desired(self, rate: float) -> tuple[Desired, FloatArray]:
        """The motion at the ticks of a rate, and the platform's site ``(n, 3)``."""
        if rate not in self.platforms:
            if len(self.platforms) > 4:
                self.platforms.clear()
            desired = desired_at_ticks(self.course, self.start, self.stop, rate)
            self.platforms[rate] = desired, self.site(desired.q)
        return self.platforms[rate]

    def site(self, q: FloatArray) -> FloatArray:
        """The platform's site ``(n, 3)`` over a course of coordinates, m, base frame."""
        still, reference = np.zeros_like(q), self.plant.reference
        return reference.inverse_dynamics(q, still, still, near=reference.closer.close_along(q).qpos).x


@dataclass(frozen=True)
class StudyContext:
    """What all runs of a study share; travels to every worker once."""

    campaign: Campaign
    file: Path
    model: Path
    settings: Mapping[str, float]
    common: str
    candidates: tuple[str, ...] = ()
    controllers: tuple[str, ...] = ()

    def setup(self) -> Callable[[tuple[int, Loop]], Packed]:
        """Check that this process gives the same numbers as the one that asks, and return what computes a run.

        Raises
        ------
        WorkbenchError
            The model or a version differs here.
        """
        users, own = load_candidates(self.candidates), load_controllers(self.controllers)
        plan = plan_study(self.campaign, self.file, self.model, self.settings, users, own)
        if study_key(plan, self.settings, users, own) != self.common:
            raise WorkbenchError("model, formulas, code or versions of this worker are not those of the run")
        study = Study(plan, self.settings, own)
        study.bench(plan.loops[0])  # kernels are compiled before a run's time is taken
        return partial(_packed, study, self.common)


class Study:
    """The runs of a plan, with benches that are kept while they are used."""

    def __init__(self, plan: StudyPlan, settings: Mapping[str, float], own: Sequence[UserController] = ()) -> None:
        self.plan, self._settings = plan, dict(settings)
        self._own = {one.name: one for one in own}
        self._kept: tuple[tuple[str, float], Bench] | None = None
        self._models: dict[tuple[str, float, str], FormulaModel] = {}

    def bench(self, loop: Loop) -> Bench:
        """The bench of a run's case at its speed; the last one is kept."""
        key = loop.case, loop.speed
        if self._kept is None or self._kept[0] != key:
            self._models.clear()
            self._kept = key, self._made(loop)
        return self._kept[1]

    def _made(self, loop: Loop) -> Bench:
        plan, spec = self.plan, self.plan.spec
        base = next(case for case in plan.campaign.case if case.name == loop.case)
        case = case_at(base, loop.speed)
        believed = overrides_of(plan.campaign, plan.robot, case, self._settings)
        found = resolve_case(case, plan.file, plan.robot, plan.model, believed)
        real = found.robot.with_parameters(**spec.plant) if spec.plant else found.robot
        force = np.array(case.external_force)
        plant = Plant(real.reference, force)
        home = Plant(found.robot.reference, force) if spec.plant else plant
        home.begin(found.robot.home, np.zeros(len(found.robot.joints)))
        start = float(found.motion.t[0])
        stop = min(float(found.motion.t[-1]), start + (spec.duration or math.inf))
        return Bench(
            case, course_of(found), start, stop, found.robot, plant, StiffPlant(real.reference, force),
            np.diag(home.mass).copy(),
        )  # fmt: skip

    def law(self, bench: Bench, loop: Loop, desired: Desired) -> Law:
        """The controller of a run, with nothing remembered."""
        spec = self.plan.spec
        gains = Gains(loop.bandwidth, spec.damping, bench.mass)
        model = None
        if loop.model != NO_MODEL:
            key = loop.case, loop.speed, loop.model
            if key not in self._models:
                known = np.array(bench.case.external_force) if spec.force_known else np.zeros(3)
                self._models[key] = FormulaModel(bench.robot, loop.model, known)
            model = self._models[key]
        if loop.controller in BUILT_IN:
            return law_of(loop.controller, model, gains, desired)
        own = self._own[loop.controller]
        return own.law(bench.robot.parameters, bench.robot.joints, model, gains, desired, loop.rate)

    def sampling(self, bench: Bench, loop: Loop) -> Sampling:
        """How a run's loop is sampled."""
        spec, joints = self.plan.spec, bench.robot.joints
        limits = torque_limits(self.plan.campaign, self.plan.robot) if spec.limits else {}
        return Sampling(
            rate=loop.rate,
            delay=delay_of(spec, loop.rate, loop.rate_asked, loop.model),
            resolution=np.array([spec.resolution.get(joint, 0.0) for joint in joints]),
            noise=np.array([spec.noise.get(joint, 0.0) for joint in joints]),
            ideal_rate=spec.rate_from == "ideal",
            limit=np.array([limits.get(joint, math.inf) for joint in joints]),
            seed=spec.seed,
        )


def compute(study: Study, loop: Loop) -> Outcome:
    """Run a loop by both routes.

    Raises
    ------
    WorkbenchError
        A controller of the user's own is at fault, or the robot is not covered.
    """
    spec, bench = study.plan.spec, study.bench(loop)
    desired, x_desired = bench.desired(loop.rate)
    run = _run_of(study, loop)

    def error(q: FloatArray, x: FloatArray) -> Error:
        return error_of(q, desired.q, x, x_desired)

    stiff = bench.stiff if spec.second_route == "all" else None
    halve = is_halved(loop.rate, loop.rate_asked)
    return by_routes(bench.plant, stiff, run, error, 1.0 / loop.rate, spec.step, halve)


def track(study: Study, loop: Loop) -> Tracked:
    """Run a loop by the package's route alone.

    Raises
    ------
    WorkbenchError
        As `compute`.
    """
    step = step_of(1.0 / loop.rate, study.plan.spec.step)
    return _run_of(study, loop)(study.bench(loop).plant, step, 1)


def _run_of(study: Study, loop: Loop) -> Run:
    """What runs a loop: with either plant, in steps of a length."""
    bench = study.bench(loop)
    desired, sampling = bench.desired(loop.rate)[0], study.sampling(bench, loop)
    seen = as_measured(desired, sampling)

    def run(plant: Plant | StiffPlant, step: float, times: int) -> Tracked:
        return run_loop(plant, study.law(bench, loop, seen), desired, sampling, step, times)

    return run


def _packed(study: Study, common: str, task: tuple[int, Loop]) -> Packed:
    return evaluate(study, common, task).packed()


def evaluate(study: Study, common: str, task: tuple[int, Loop]) -> Answer:
    """Compute one run; errors come back as data.

    Raises
    ------
    MemoryError
        For the worker to report.
    """
    index, loop = task
    key = case_key(common, vars(loop))
    try:
        outcome = compute(study, loop)
    except MemoryError:
        raise
    except Exception as error:
        if NO_MEMORY in str(error):
            raise MemoryError from error
        if isinstance(error, WorkbenchError):
            return Answer(lost(index, key, FAILED, str(error)))
        return Answer(lost(index, key, FAILED, f"{type(error).__name__}: {error}"))
    tracked, joints = outcome.tracked, study.plan.robot.joints
    facts = {"ended": tracked.time}
    if outcome.error is None:
        reason = f"{tracked.status} at t = {tracked.time:.6g} s: joint {joints[tracked.joint]} {tracked.why}"
        if outcome.second_status == TRACKED:
            reason += "; MuJoCo's route tracks"
        facts["agreed"] = float(outcome.second_status == tracked.status)
        return Answer(Record(index, key, PASSED, reason, [], facts))
    rows = _rows(outcome, joints)
    if not all(math.isfinite(value) for row in rows for value in (row["rms"], row["peak"])):
        return Answer(lost(index, key, INVALID, "an error is not a finite number"))
    reason = "" if outcome.second_status in (TRACKED, NOT_RUN) else f"the second route is {outcome.second_status}"
    facts |= {"work": tracked.work, "spread": outcome.spread}
    return Answer(Record(index, key, PASSED, reason, rows, facts))


def _rows(outcome: Outcome, joints: Sequence[str]) -> list[dict[str, Any]]:
    """A row for each joint and one for the platform: errors by each route, torques."""
    own, halved, second, tracked = outcome.error, outcome.halved, outcome.second, outcome.tracked
    assert own is not None
    rows: list[dict[str, Any]] = []
    for j, joint in enumerate(joints):
        rows.append(
            {
                "joint": joint,
                "rms": float(own.rms[j]),
                "peak": float(own.peak[j]),
                "rms_halved": float(halved.rms[j]) if halved else None,
                "rms_second": float(second.rms[j]) if second else None,
                "effort": float(np.sqrt(np.mean(tracked.tau[:, j] ** 2))),
                "largest": float(np.abs(tracked.tau[:, j]).max()),
                "saturated": float(tracked.saturated[j]),
            }
        )
    rows.append(
        {
            "joint": "platform",
            "rms": own.platform_rms,
            "peak": own.platform_peak,
            "rms_halved": halved.platform_rms if halved else None,
            "rms_second": second.platform_rms if second else None,
            "effort": None,
            "largest": None,
            "saturated": None,
        }
    )
    return rows


def study_key(
    plan: StudyPlan, settings: Mapping[str, float], users: Sequence[Any], own: Sequence[UserController]
) -> str:
    """Hash of everything that the runs of a study share."""
    keyed = common_key(
        plan.campaign, plan.file, plan.model, settings, Effort.of_many(("mujoco",), False), "none", users
    )
    content = {
        "control": plan.spec.model_dump(exclude=set(LISTS + JUDGING)),
        "actuators": torque_limits(plan.campaign, plan.robot),
        "cases": [case.model_dump(exclude={"title", "description"}) for case in plan.campaign.case],
        "controllers": {one.name: [sha256(path.read_bytes()) for path in one.files] for one in own},
    }
    return case_key(keyed, content)
