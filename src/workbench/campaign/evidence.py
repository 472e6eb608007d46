"""The error budget of a case: what the reference itself is worth, so that a verdict can be believed.

Power balance and a second engine bound the reference's own error; the forward replay judges each candidate's torques
with dynamics that share nothing with the projection. What each figure means is explained in docs/evidence.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.cases import Case, course_of
from workbench.campaign.unloaded import joint_error, largest_reaction
from workbench.campaign.user_candidates import UserCandidate
from workbench.errors import CandidateError, MotionError, SpecError, did_you_mean
from workbench.reference import MujocoReference, ReferenceResult
from workbench.reference.left_open import left_open
from workbench.reference.power import PowerBalance, displaced_samples, power_balance
from workbench.reference.replay import Replay, ReplaySet, replay

MUJOCO = "mujoco"
PINOCCHIO = "pinocchio"
ENGINES = (MUJOCO, PINOCCHIO)


@dataclass(frozen=True)
class Effort:
    """How much evidence a run gathers beside the errors."""

    engines: tuple[str, ...] = (MUJOCO,)
    budget: bool = True
    """power balance, forward replay and the row of raw `mj_inverse`"""
    drawing: bool = True
    """the robot's points over time, for drawings of it"""
    timed: bool = True
    """a slow formula is warned of; not where warnings are stored as numbers, which must not depend on the clock"""
    threads: int = 1
    """that the reference's samples are evaluated over; more than one where no other case is computed meanwhile"""
    described: bool = True
    """all that a manifest says of a case; without it, what is judged and the figures that a sweep stores"""

    @classmethod
    def of_many(cls, engines: tuple[str, ...] = (MUJOCO,), budget: bool = False) -> Effort:
        """What is gathered where cases come by the thousand, or many times a second: no more than is looked at."""
        return cls(engines, budget=budget, drawing=False, timed=False, described=False)


FULL = Effort()
"""All evidence that MuJoCo alone can give."""


@dataclass(frozen=True)
class Evidence:
    """The error budget of one case."""

    power: dict[str, PowerBalance] = field(default_factory=dict)
    """by reference mass model"""
    spread: dict[str, dict[str, float]] = field(default_factory=dict)
    """second engine against MuJoCo: mass model -> joint -> peak error"""
    replays: ReplaySet | None = None
    undetermined: dict[str, dict[str, float]] = field(default_factory=dict)
    """what the model leaves open, of each peak torque: loops that agree only to some digits, rods that are not round;
    mass model -> joint; empty where nothing is open"""
    times: FloatArray = field(default_factory=lambda: np.zeros(0))

    def power_residual(self, mass_model: str) -> float:
        """Power balance of a reference, relative to peak power; NaN where it was not looked at."""
        return self.power[mass_model].uncertainty if mass_model in self.power else math.nan

    def engine_spread(self, mass_model: str, joint: str) -> float:
        """Peak error of the second engine against MuJoCo; NaN where there was none."""
        return self.spread.get(mass_model, {}).get(joint, math.nan)

    def uncertainty(self, mass_model: str, joint: str) -> float:
        """The reference's own relative uncertainty on a joint: the largest known; NaN where nothing was looked at."""
        left_open = self.undetermined.get(mass_model, {}).get(joint, math.nan)
        found = (self.power_residual(mass_model), self.engine_spread(mass_model, joint), left_open)
        return max((value for value in found if not math.isnan(value)), default=math.nan)

    def facts(self) -> dict[str, Any]:
        """What the manifest holds of it; keys documented in docs/run-directory.md."""
        return {
            "power_balance": {
                name: {
                    "relative": balance.relative,
                    "peak_power_w": balance.peak_power,
                    "worst_time_s": float(self.times[balance.worst_sample]),
                    "differentiation": balance.differentiation,
                    "rounding": balance.rounding,
                    "samples": len(balance.samples),
                }
                for name, balance in self.power.items()
            },
            "undetermined": self.undetermined,
            "second_engine": {"engine": PINOCCHIO, "spread": self.spread} if self.spread else None,
            "replay": _replay_facts(self.replays) if self.replays else None,
        }


def check_engines(engines: tuple[str, ...]) -> None:
    """Refuse engines that do not exist, before anything is computed; a missing extra is named by the engine itself.

    Raises
    ------
    SpecError
        Unknown engine, or no MuJoCo among them.
    MissingExtraError
        The second engine is not installed; the message holds the command that installs it.
    """
    for engine in engines:
        if engine not in ENGINES:
            raise SpecError(f'unknown engine "{engine}"{did_you_mean(engine, ENGINES)}')
    if MUJOCO not in engines:
        raise SpecError(f"engines {', '.join(engines)}: {MUJOCO} is the reference and cannot be left out")
    if PINOCCHIO in engines:
        from workbench.reference.pinocchio_reader import import_pinocchio

        import_pinocchio()


def gather_evidence(
    case: Case,
    reference: MujocoReference,
    results: Mapping[str, ReferenceResult],
    candidates: list[str],
    effort: Effort,
) -> Evidence:
    """Gather what *effort* asks for.

    Parameters
    ----------
    case
        The case.
    reference
        Its reference.
    results
        What the reference gave, by mass model.
    candidates
        Names of the candidates whose torques are replayed.
    effort
        How much is looked at.

    Raises
    ------
    MotionError
        The second engine cannot follow the motion.
    """
    motion, force = case.motion, case.force
    # of excess actuators the second engine solves for one set of torques among many, not for that of least norm
    second = PINOCCHIO in effort.engines and not reference.excess_actuators
    spread = _spread(case, results) if second else {}
    left_open = {name: _left_open(case, reference, name, result) for name, result in results.items()}
    left_open = {name: found for name, found in left_open.items() if found}
    if not effort.budget:
        return Evidence(spread=spread, undetermined=left_open, times=motion.t)
    first = next(iter(results.values()))
    displaced = displaced_samples(reference, first.qpos, motion.q, motion.qd, motion.qdd)
    power = {
        name: power_balance(
            reference, motion.q, motion.qd, motion.qdd, name, force, along=motion.t, known=result, displaced=displaced
        )
        for name, result in results.items()
    }
    return Evidence(power, spread, _replays(case, reference, candidates), left_open, motion.t)


def _left_open(case: Case, reference: MujocoReference, mass_model: str, result: ReferenceResult) -> dict[str, float]:
    """Of each joint's peak torque: what the model leaves open; empty where nothing is."""
    motion = case.motion
    worth = left_open(reference, result, motion.q, motion.qd, motion.qdd, mass_model, case.force)
    if not worth.any():
        return {}
    peak = np.abs(result.tau).max(axis=0)
    shares = np.divide(worth, peak, out=np.full_like(peak, np.inf), where=peak > 0.0)
    return dict(zip(reference.joint_names, shares.tolist(), strict=True))


def _spread(case: Case, results: Mapping[str, ReferenceResult]) -> dict[str, dict[str, float]]:
    from workbench.reference.pinocchio_reference import PinocchioReference

    motion = case.motion
    engine = PinocchioReference(case.model, loaded=case.robot.loaded)
    spread: dict[str, dict[str, float]] = {}
    for name, result in results.items():
        tau = engine.inverse_dynamics(motion.q, motion.qd, motion.qdd, name, case.force, ordered=True).tau
        reaction = largest_reaction(result.reactions.values())
        spread[name] = {
            joint: joint_error(tau[:, i], result.tau[:, i], reaction).peak_error
            for i, joint in enumerate(case.robot.joints)
        }
    return spread


def _replays(case: Case, reference: MujocoReference, candidates: list[str]) -> ReplaySet | None:
    motion, robot, force = case.motion, case.robot, case.force[0]

    def torque_of(name: str) -> Any:
        function = robot.candidates[name].function

        def torque(q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
            try:
                return function(robot, q, qd, qdd, np.tile(force, (len(q), 1)))
            except CandidateError:  # a user's formula may hold at the samples and fail between them
                return np.full_like(q, np.nan)

        return torque

    if len(motion.t) < 2:
        return None
    window = case.spec.replay
    start, stop = (window.start, window.stop) if window else (float(motion.t[0]), float(motion.t[-1]))
    torques = {name: torque_of(name) for name in candidates if not needs_time(robot.candidates[name].function)}
    try:
        return replay(reference, course_of(case), torques, start, stop, force)
    except MotionError:
        # between the samples the motion may leave the workspace; then there is nothing to drive
        return None


def needs_time(function: Any) -> bool:
    """Whether a formula asks for the time, which the simulation's own states do not have."""
    return isinstance(function, UserCandidate) and function.needs_time


def _replay_facts(found: ReplaySet) -> dict[str, Any]:
    def one(entry: Replay) -> dict[str, Any]:
        return {
            "steps_s": entry.steps.tolist(),
            "peak_error": entry.peak_error.tolist(),
            "final_error": entry.final_error.tolist(),
            "order": entry.order,
            "worst_joint": entry.worst_joint,
            "limit": entry.limit,
            "verdict": entry.verdict,
            "text": entry.text,
            "same_as": entry.same_as,
        }

    return {
        "start_s": found.start,
        "stop_s": found.stop,
        "note": found.note,
        "candidates": {name: one(entry) for name, entry in found.replays.items()},
    }
