"""What a controller sees and when: rates, delays, encoders, noise, the motion that is asked for at each tick."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from workbench.arrays import FloatArray

Course = Callable[[FloatArray], tuple[FloatArray, FloatArray, FloatArray]]
"""Times ``(n,)`` in s -> q, qd, qdd, each ``(n, na)``."""

TICK = 1e-9
"""Of a control period: a time nearer than this to a tick is one."""


@dataclass(frozen=True)
class Sampling:
    """How a loop is sampled; arrays are ``(na,)``."""

    rate: float
    """Hz"""
    delay: float
    """s, from measuring to the torque that follows from it"""
    resolution: FloatArray
    """m or rad of an encoder's count; zero is none"""
    noise: FloatArray
    """standard deviation of what is measured, m or rad"""
    ideal_rate: bool
    """whether rates are known, or differences of what is measured"""
    limit: FloatArray
    """largest torque, N or N m; infinite where there is none"""
    seed: int = 0

    @property
    def period(self) -> float:
        """S between ticks."""
        return 1.0 / self.rate


@dataclass(frozen=True)
class Desired:
    """The motion at the ticks."""

    t: FloatArray
    """``(n,)`` s"""
    q: FloatArray = field(repr=False)
    """``(n, na)``"""
    qd: FloatArray = field(repr=False)
    qdd: FloatArray = field(repr=False)
    differences: FloatArray | None = field(default=None, repr=False)
    """``(n, na)`` rates as an encoder would give them, where it gives no others"""

    @property
    def rates(self) -> FloatArray:
        """``(n, na)`` what measured rates are held against."""
        return self.qd if self.differences is None else self.differences

    @property
    def stroke(self) -> FloatArray:
        """``(na,)`` how far each joint goes."""
        found: FloatArray = np.ptp(self.q, axis=0)
        return found


def as_measured(desired: Desired, sampling: Sampling) -> Desired:
    """The motion with rates as the encoder would give them: differences are held against differences.

    A difference is half a period late; against the rate of this moment it would count that as an error.
    """
    if sampling.ideal_rate:
        return desired
    rates = np.diff(desired.q, axis=0) / np.diff(desired.t)[:, None]
    return replace(desired, differences=np.concatenate([desired.qd[:1], rates]))


def desired_at_ticks(course: Course, start: float, stop: float, rate: float) -> Desired:
    """The motion at start, start + 1/rate and so on, up to stop."""
    count = int(np.floor((stop - start) * rate * (1.0 + 1e-12) + TICK)) + 1
    t = np.minimum(start + np.arange(count) / rate, stop)
    return Desired(t, *(np.ascontiguousarray(values) for values in course(t)))


class Encoder:
    """Measures coordinates and rates, tick after tick."""

    def __init__(self, sampling: Sampling, first_rate: FloatArray) -> None:
        self._sampling = sampling
        self._random = np.random.default_rng(sampling.seed)
        self._before: FloatArray | None = None
        self._first_rate = first_rate.copy()
        self._counts = sampling.resolution > 0.0
        self._all, self._some = bool(self._counts.all()), bool(self._counts.any())
        self._noisy = bool(sampling.noise.any())

    def measure(self, q: FloatArray, qd: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What is measured at a tick; the first difference is the motion's own rate."""
        sampling = self._sampling
        seen = q.copy()
        if self._noisy:
            seen += sampling.noise * self._random.standard_normal(len(q))
        if self._all:
            seen = np.rint(seen / sampling.resolution) * sampling.resolution
        elif self._some:
            counts = self._counts
            seen[counts] = np.rint(seen[counts] / sampling.resolution[counts]) * sampling.resolution[counts]
        if sampling.ideal_rate:
            return seen, qd.copy()
        rate = self._first_rate if self._before is None else (seen - self._before) * sampling.rate
        self._before = seen
        return seen, rate
