"""One run of a control loop: a plant, a law, a motion; torques are held between ticks and come late by the delay."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from workbench.arrays import FloatArray
from workbench.control.controllers import Law
from workbench.control.sampling import TICK, Desired, Encoder, Sampling
from workbench.errors import MotionError
from workbench.reference.forward_kernels import DONE, OPEN

TRACKED, UNSTABLE = "tracked", "unstable"

LOST = 1.0
"""Strokes of a joint: an error beyond is no tracking any more, and the loop is called unstable."""

SMALLEST_STROKE = 0.05
"""m or rad: a joint that holds (almost) still is measured against this."""


class Movable(Protocol):
    """A plant, by either route."""

    @property
    def q(self) -> FloatArray:
        """Coordinates ``(na,)``."""

    @property
    def qd(self) -> FloatArray:
        """Rates ``(na,)``."""

    @property
    def platform(self) -> FloatArray:
        """The platform's site ``(3,)``, m, base frame."""

    def begin(self, q: FloatArray, qd: FloatArray) -> None:
        """Stand at a state."""

    def move(self, tau: FloatArray, duration: float, steps: int) -> int:
        """Move on under constant torques."""


@dataclass(frozen=True)
class Tracked:
    """What a run left: states at the ticks, the torques that were asked for at them."""

    status: str
    """`TRACKED` or `UNSTABLE`"""
    time: float
    """s, when it ended"""
    joint: int
    """of a run that failed: the joint that is off most, in strokes"""
    q: FloatArray = field(repr=False)
    """``(k, na)``, k ticks were reached"""
    qd: FloatArray = field(repr=False)
    x: FloatArray = field(repr=False)
    """``(k, 3)`` the platform's site, m, base frame"""
    tau: FloatArray = field(repr=False)
    """``(k, na)`` asked for, limits kept"""
    saturated: FloatArray = field(repr=False)
    """``(na,)`` part of the ticks at which a limit was met"""
    why: str = ""
    """of a run that failed: what ended it"""
    work: float = 0.0
    """J, of the actuators; exact for torques that are held"""


def run_loop(plant: Movable, law: Law, desired: Desired, sampling: Sampling, step: float, times: int = 1) -> Tracked:
    """Track a motion, beginning on it; before the first torque arrives the actuators give the same one.

    Parameters
    ----------
    plant
        Either route.
    law
        From `workbench.control.controllers`.
    desired
        The motion at the ticks.
    sampling
        Delay, encoder, limits.
    step
        s, the longest step in time of the plant.
    times
        So many steps in place of each: 2 halves them all.
    """
    count, na = desired.q.shape
    period = sampling.period
    whole = math.floor(sampling.delay / period + TICK)
    rest = sampling.delay - whole * period
    rest = 0.0 if rest < TICK * period else rest
    pieces = [piece for piece in (rest, period - rest) if piece > 0.0]
    steps = [times * max(1, math.ceil(piece / step - TICK)) for piece in pieces]
    scale = LOST * np.maximum(desired.stroke, SMALLEST_STROKE)
    plant.begin(desired.q[0], desired.qd[0])
    encoder, furthest = Encoder(sampling, desired.qd[0]), scale.tolist()
    q, qd, tau = np.zeros((3, count, na))
    x = np.zeros((count, 3))

    def ended_at(status: str, k: int, reached: int, joint: int, why: str = "") -> Tracked:
        return Tracked(
            status, float(desired.t[k]), joint, q[:reached], qd[:reached], x[:reached], tau[:reached],
            hits / max(reached, 1), why, work,
        )  # fmt: skip

    def worst_of(now: FloatArray, k: int) -> int:
        off = np.abs(now - desired.q[k]) / scale
        return int(np.argmax(np.where(np.isfinite(off), off, np.inf)))

    hits = np.zeros(na)
    work, limited = 0.0, bool(np.isfinite(sampling.limit).any())
    for k in range(count):
        q[k], qd[k], x[k] = plant.q, plant.qd, plant.platform
        away = (q[k] - desired.q[k]).tolist()
        if not all(abs(off) <= most for off, most in zip(away, furthest, strict=True)):
            return ended_at(UNSTABLE, k, k, worst_of(q[k], k), "is off by more than its stroke")
        try:
            wanted = np.asarray(law(k, *encoder.measure(q[k], qd[k])), dtype=np.float64)
        except MotionError:  # the model cannot follow to where the robot has gone, or is thought to be
            return ended_at(UNSTABLE, k, k, worst_of(q[k], k), "is off most where the model has no torque to give")
        if limited:
            hits += np.abs(wanted) > sampling.limit
            wanted = np.clip(wanted, -sampling.limit, sampling.limit)
        tau[k] = wanted
        if k == count - 1:
            break
        before = q[k]
        for number, (piece, parts) in enumerate(zip(pieces, steps, strict=True)):
            late = whole + (1 if rest and number == 0 else 0)
            held = tau[max(k - late, 0)]
            ended = plant.move(held, piece, parts)
            work += float(held @ (plant.q - before))
            before = plant.q.copy()
            if ended != DONE:
                why = (
                    "is off most where the loops cannot be closed"
                    if ended == OPEN
                    else "is off most, and beyond numbers"
                )
                return ended_at(UNSTABLE, k, k + 1, worst_of(before, k), why)
    return ended_at(TRACKED, count - 1, count, -1)
