"""What a closed form costs per sample, measured: the only figures of a run that differ from run to run."""

from __future__ import annotations

import statistics
import time

import numpy as np

from workbench.campaign.cases import Case
from workbench.campaign.user_candidates import UserCandidate

BATCH = 5000
REPEATS = 7
BUDGET_S = 0.2
"""Repeats stop when they have taken this long together."""


def cost_us(case: Case, candidate: str) -> float:
    """Median time of one call over its samples, in microseconds per sample.

    The samples are the case's own, repeated to a batch of `BATCH`; a first call, which may compile, is not counted.
    """
    robot, motion = case.robot, case.motion
    samples = np.resize(np.arange(len(motion.t)), BATCH)
    arguments = motion.q[samples], motion.qd[samples], motion.qdd[samples], case.force[samples]
    function = robot.candidates[candidate].function
    if isinstance(function, UserCandidate):  # measured while it ran: it may be slow, or fail
        return 1e6 * function.seconds_per_sample
    function(robot, *arguments)
    taken: list[float] = []
    while len(taken) < REPEATS and sum(taken) < BUDGET_S:
        begun = time.perf_counter()
        function(robot, *arguments)
        taken.append(time.perf_counter() - begun)
    return 1e6 * statistics.median(taken) / BATCH
