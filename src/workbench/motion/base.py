"""What a prescribed motion is: time, position, velocity and acceleration, in joint or in platform space."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray
from workbench.errors import MotionError, did_you_mean
from workbench.motion.checks import as_number
from workbench.motion.spline import interpolating_spline

MAX_SAMPLES = 10_000_000
"""A grid or file with more samples is taken for a slip (a rate in the wrong unit) and refused while memory lasts."""

COORDINATES = {"x": "m", "y": "m", "z": "m", "rx": "rad", "ry": "rad", "rz": "rad"}
"""Task coordinates of a platform and their units: positions of its site, and rotations, in the base body's frame."""

POSITION = ("x", "y", "z")
"""Task coordinates where a robot does not say its own."""

_WHOLE_STEPS = 1e-6
"""Fraction of a step by which a duration may miss a whole number of steps and still end on its last sample."""

_CHECK_DEGREE = 3
"""Degree of the spline that `consistency` integrates."""


@dataclass(frozen=True)
class Consistency:
    """How well velocity and acceleration fit the samples they come with; see `JointMotion.consistency`.

    Each is one figure per coordinate, a fraction: near 0 they agree, near 1 or above they do not belong together.
    """

    velocity: FloatArray
    """velocity against position, ``(m,)``"""
    acceleration: FloatArray
    """acceleration against velocity, ``(m,)``"""


@dataclass(frozen=True, eq=False)
class JointMotion:
    """A motion in actuated coordinates.

    Parameters
    ----------
    t
        Time in seconds, ``(n,)``, strictly increasing.
    q, qd, qdd
        Position, velocity and acceleration, each ``(n, m)`` with one column per joint in actuator order (m = 3 for the
        robots here); m, rad and their time derivatives.

    Raises
    ------
    MotionError
        Wrong shapes, an entry that is not finite (the message names time and joint), or time that does not increase.
    """

    t: FloatArray
    q: FloatArray
    qd: FloatArray
    qdd: FloatArray
    warnings: tuple[str, ...] = ()
    """what there is to say about the numbers it came from, `workbench.motion.judge`"""

    def __post_init__(self) -> None:
        """Check the arrays and keep copies of them."""
        t, arrays = _checked(self.t, {"q": self.q, "qd": self.qd, "qdd": self.qdd}, None)
        for name, array in {"t": t, **arrays}.items():
            object.__setattr__(self, name, array)

    def consistency(self) -> Consistency:
        """Compare the derivatives with the samples they come with.

        Between neighbouring samples the mean velocity is the difference of position over the difference of time; it is
        compared with the mean of a cubic spline through the velocity samples, and likewise acceleration with velocity.
        The largest gap, divided by the largest rate of that coordinate, is the figure. Exact derivatives of a smooth
        motion leave O(h^4) for sample spacing h, O(h^2) where its jerk jumps (the corners of a quintic cycle), so the
        figure also says whether the grid resolves the motion.

        Raises
        ------
        MotionError
            Time steps too uneven for the spline.
        """
        return _consistency(self.t, self.q, self.qd, self.qdd)


@dataclass(frozen=True, eq=False)
class PlatformMotion:
    """A motion of the platform in task coordinates, to be turned into joint space by a mechanism.

    Parameters
    ----------
    t
        Time in seconds, ``(n,)``, strictly increasing.
    x, xd, xdd
        Task coordinates, their velocities and accelerations, each ``(n, m)``; m, rad, s, in the paper's frame.
    coordinates
        Their names, of `COORDINATES`; ``x y z`` where not said.

    Raises
    ------
    MotionError
        Wrong shapes, an entry that is not finite (the message names time and axis), time that does not increase, or
        names that are no task coordinates.
    """

    t: FloatArray
    x: FloatArray
    xd: FloatArray
    xdd: FloatArray
    coordinates: tuple[str, ...] = POSITION
    warnings: tuple[str, ...] = ()
    """as of a `JointMotion`"""

    def __post_init__(self) -> None:
        """Check the arrays and keep copies of them."""
        object.__setattr__(self, "coordinates", as_coordinates(self.coordinates))
        t, arrays = _checked(self.t, {"x": self.x, "xd": self.xd, "xdd": self.xdd}, len(self.coordinates))
        for name, array in {"t": t, **arrays}.items():
            object.__setattr__(self, name, array)

    @property
    def units(self) -> tuple[str, ...]:
        """``m`` or ``rad`` for each coordinate."""
        return tuple(unit_of(name) for name in self.coordinates)

    def consistency(self) -> Consistency:
        """Compare the derivatives with the samples they come with, as `JointMotion.consistency`."""
        return _consistency(self.t, self.x, self.xd, self.xdd)


def time_grid(start: float, stop: float, *, samples: int | None = None, rate: float | None = None) -> FloatArray:
    """Return evenly spaced times in seconds, from *start* to *stop*.

    Parameters
    ----------
    start, stop
        First and last time, s.
    samples
        Number of times, both ends included; at least 2.
    rate
        Or: times per second, Hz. The grid starts at *start*; it ends at *stop* where that is a whole number of steps
        away, else at the last step before it.

    Returns
    -------
    numpy.ndarray
        ``(n,)``, strictly increasing, never past *stop*.

    Raises
    ------
    MotionError
        Not exactly one of *samples* and *rate*; an empty interval; fewer than 2 or more than `MAX_SAMPLES` times; or
        steps too small for floating point.
    """
    start = as_number("time grid: start", start, "s")
    stop = as_number("time grid: stop", stop, "s")
    if stop <= start:
        raise MotionError(f"time grid: stop = {stop:g} s; allowed: > start = {start:g} s", value=stop, limit=start)
    if (samples is None) == (rate is None):
        given = "neither" if samples is None else "both"
        raise MotionError(f"time grid: {given} of samples and rate given; allowed: exactly one of them")
    if rate is not None:
        rate = as_number("time grid: rate", rate, "Hz", 0.0, minimum_allowed=False)
        steps = (stop - start) * rate
        _check_count("time grid: rate", rate, "Hz", steps + 1.0)
        count = math.floor(steps + _WHOLE_STEPS) + 1
        grid = np.minimum(start + np.arange(count) / rate, stop)
        if abs(count - 1 - steps) <= _WHOLE_STEPS:
            grid[-1] = stop
    else:
        number = as_number("time grid: samples", samples, "")
        if number != math.floor(number):
            raise MotionError(f"time grid: samples = {number:g}; allowed: a whole number", value=number)
        _check_count("time grid: samples", number, "", number)
        with np.errstate(over="ignore", invalid="ignore"):
            grid = np.linspace(start, stop, int(number))
    with np.errstate(invalid="ignore"):
        resolved = bool((np.diff(grid) > 0.0).all())
    if not resolved:
        raise MotionError(
            f"time grid: {len(grid)} samples from {start:g} s to {stop:g} s; allowed: steps that a float resolves",
            value=len(grid),
        )
    return grid


def unit_of(coordinate: str) -> str:
    """``m`` or ``rad``: the unit of a task coordinate of `COORDINATES`."""
    return COORDINATES[as_coordinates([coordinate])[0]]


def as_coordinates(names: Sequence[str]) -> tuple[str, ...]:
    """Return names of task coordinates as a tuple: one to six different ones of `COORDINATES`.

    Raises
    ------
    MotionError
        Anything else.
    """
    for name in names:
        if name not in COORDINATES:
            raise MotionError(f'task coordinate "{name}"{did_you_mean(str(name), COORDINATES)}', value=name)
    if not names or len(set(names)) < len(names):
        raise MotionError(f"task coordinates {', '.join(names) or 'none'}; allowed: one or more, each once")
    return tuple(names)


def as_times(t: ArrayLike) -> FloatArray:
    """Return a copy of *t* as finite, strictly increasing float64 times ``(n,)`` with n >= 1.

    Raises
    ------
    MotionError
        Anything else; the message names the first bad sample.
    """
    times = _as_floats("t", t)
    if times.ndim != 1 or not len(times):
        raise MotionError(f"t: expected shape (n,) with n >= 1, got {times.shape}", shape=times.shape)
    if not np.isfinite(times).all():
        sample = int(np.argmin(np.isfinite(times)))
        raise MotionError(f"t: sample {sample} is {times[sample]}; allowed: a finite number", sample=sample)
    falls = np.diff(times) <= 0.0
    if falls.any():
        sample = int(np.argmax(falls)) + 1
        raise MotionError(
            f"t: sample {sample} is {times[sample]:g} s after {times[sample - 1]:g} s; allowed: strictly increasing",
            sample=sample,
            time=float(times[sample]),
        )
    return times


def _check_count(what: str, value: float, unit: str, count: float) -> None:
    if not 2 <= count + _WHOLE_STEPS < MAX_SAMPLES + 1:
        shown = f"{value:g} {unit}".rstrip()
        raise MotionError(f"{what} = {shown} makes {count:.7g} samples; allowed: 2 to {MAX_SAMPLES}", value=value)


def _as_floats(name: str, value: ArrayLike) -> FloatArray:
    try:
        # a copy: the caller's array may change afterwards, a motion may not
        return np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise MotionError(f"{name}: expected an array of numbers, got {type(value).__name__}") from error


def _checked(
    t: ArrayLike, columns: dict[str, FloatArray], width: int | None
) -> tuple[FloatArray, dict[str, FloatArray]]:
    times = as_times(t)
    arrays: dict[str, FloatArray] = {}
    for name, value in columns.items():
        array = _as_floats(name, value)
        if width is None and array.ndim == 2 and array.shape[1]:
            width = array.shape[1]
        expected = (len(times), width)
        if array.shape != expected:
            shown = f"({expected[0]}, {'m' if width is None else width})"
            raise MotionError(f"{name}: expected shape {shown}, got {array.shape}", argument=name, shape=array.shape)
        finite = np.isfinite(array)
        if not finite.all():
            sample, column = (int(index) for index in np.argwhere(~finite)[0])
            raise MotionError(
                f"{name}{column + 1} at t = {times[sample]:g} s is {array[sample, column]}; allowed: a finite number",
                time=float(times[sample]),
                joint=column,
                sample=sample,
            )
        arrays[name] = array
    return times, arrays


def _consistency(t: FloatArray, position: FloatArray, velocity: FloatArray, acceleration: FloatArray) -> Consistency:
    return Consistency(_rate_mismatch(t, position, velocity), _rate_mismatch(t, velocity, acceleration))


def _rate_mismatch(t: FloatArray, value: FloatArray, rate: FloatArray) -> FloatArray:
    if len(t) == 1:
        return np.zeros(value.shape[1])
    elapsed = t - t[0]
    integral = interpolating_spline(elapsed, rate, min(_CHECK_DEGREE, len(t) - 1)).antiderivative()
    steps = np.diff(t)[:, None]
    slope = np.diff(value, axis=0) / steps
    gap = np.abs(slope - np.diff(integral(elapsed), axis=0) / steps).max(axis=0)
    peak = np.maximum(np.abs(rate).max(axis=0), np.abs(slope).max(axis=0))
    return np.asarray(np.divide(gap, peak, out=np.zeros_like(gap), where=peak > 0.0))
