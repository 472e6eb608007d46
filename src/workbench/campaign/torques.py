"""The candidates' torques of one case. A user's formula that fails costs its own rows, not the case."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.cases import Case
from workbench.campaign.user_candidates import SLOW_S, UserCandidate
from workbench.errors import ArrayError, CandidateError
from workbench.reference import ReferenceResult


@dataclass(frozen=True)
class Fault:
    """What a user's candidate did wrong; not the error itself, whose traceback would keep the whole case in memory."""

    message: str
    not_finite: bool
    """it returned NaN or infinity, of the right shape"""


@dataclass(frozen=True)
class Computed:
    """Torques ``(n, na)`` by candidate, NaN where one failed, and what there is to say about it."""

    torques: dict[str, FloatArray] = field(default_factory=dict)
    faults: dict[str, Fault] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    def judged(self, name: str) -> FloatArray:
        """Torques as they are judged: a candidate that failed is infinitely far off, on all joints."""
        return np.full_like(self.torques[name], np.inf) if name in self.faults else self.torques[name]

    def noted(self, facts: dict[str, Any]) -> dict[str, Any]:
        """Return a case's facts with the faults and warnings in them; a fault fails the case."""
        if not self.faults and not self.warnings:
            return facts
        noted = {
            **facts,
            "warnings": [*facts["warnings"], *(fault.message for fault in self.faults.values()), *self.warnings],
        }
        if self.faults:
            messages = [
                *([facts["message"]] if facts["message"] else []),
                *(fault.message for fault in self.faults.values()),
            ]
            noted |= {"status": "failed", "message": "; ".join(messages)}
        return noted


def torques_of(case: Case, names: Iterable[str], result: ReferenceResult, *, timed: bool = True) -> Computed:
    """Compute the torques of the named candidates; *result* is the reference's, for the platform's motion.

    A slow candidate is warned of if *timed*: a sweep counts warnings, and what it stores must not depend on the clock.

    Raises
    ------
    MotionError
        A built-in closed form cannot follow the motion.
    ArrayError
        A built-in candidate returns the wrong shape.
    """
    computed, motion, robot = Computed(), case.motion, case.robot
    known = vars(result) | {"t": motion.t}
    for name in names:
        function = robot.candidates[name].function
        try:
            told = {"known": known} if isinstance(function, UserCandidate) else {}
            tau = function(robot, motion.q, motion.qd, motion.qdd, case.force, **told)
        except CandidateError as error:
            computed.faults[name] = Fault(str(error), "sample" in error.facts)
            tau = np.full_like(motion.q, np.nan)
        if tau.shape != motion.q.shape:
            raise ArrayError(f'candidate "{name}": expected tau of shape {motion.q.shape}, got {tau.shape}')
        if timed and isinstance(function, UserCandidate) and function.seconds_per_sample > SLOW_S:
            computed.warnings.append(
                f'candidate "{name}" ({function.where}) is slow: {1e3 * function.seconds_per_sample:.3g} ms a sample'
            )
        computed.torques[name] = tau
    return computed
