"""A pick-and-place cycle planned in task coordinates, with analytic derivatives; rotations run with the traverse.

The cycle is a sum of straight moves, each a displacement times a rest-to-rest time law. Moves may overlap in time,
which rounds the corners of the path; sums of polynomials stay polynomials, so the derivatives stay exact.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray
from workbench.errors import MotionError, did_you_mean
from workbench.motion.base import POSITION, PlatformMotion, as_coordinates, as_times, time_grid, unit_of
from workbench.motion.checks import as_number, as_vector

LAWS = {"quintic": 2, "septic": 3}
"""Time laws by name: how many derivatives vanish at both ends (velocity and acceleration; and jerk)."""


def time_law(name: str, s: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Evaluate a rest-to-rest law, which rises from 0 at s = 0 to 1 at s = 1 and rests outside.

    With k = `LAWS[name]` vanishing derivatives it is the polynomial of degree 2k + 1 whose derivative is
    proportional to s^k (1 - s)^k: quintic 10 s^3 - 15 s^4 + 6 s^5, septic 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7.

    Parameters
    ----------
    name
        A key of `LAWS`.
    s
        Time divided by the move's duration, any shape.

    Returns
    -------
    tuple
        Value, first and second derivative with respect to s, each of the shape of *s*.

    Raises
    ------
    MotionError
        Unknown law.
    """
    if name not in LAWS:
        raise MotionError(f'unknown time law "{name}"{did_you_mean(str(name), LAWS)}', value=name)
    k = LAWS[name]
    s = np.clip(np.asarray(s, dtype=np.float64), 0.0, 1.0)
    rest = 1.0 - s
    # the regularised incomplete beta function of (k + 1, k + 1), as a sum without cancellation
    value = s ** (k + 1) * sum(math.comb(k + j, j) * rest**j for j in range(k + 1))
    scale = math.factorial(2 * k + 1) / math.factorial(k) ** 2
    first = scale * (s * rest) ** k
    second = scale * k * (s * rest) ** (k - 1) * (rest - s)
    return np.asarray(value), np.asarray(first), np.asarray(second)


@dataclass(frozen=True)
class Move:
    """One straight part of a cycle: a displacement, and when it happens."""

    name: str
    """``lift``, ``traverse`` or ``lower``; on the way back ``lift back`` and so on"""
    start: float
    """s from the start of the cycle"""
    duration: float
    """s"""
    displacement: tuple[float, ...]
    """m and rad, in task coordinates"""

    @property
    def stop(self) -> float:
        """End of the move, s from the start of the cycle."""
        return self.start + self.duration


@dataclass(frozen=True)
class PickAndPlace:
    """Lift from the pick pose, traverse, lower onto the place pose, dwell; then, if asked for, the same way back.

    Parameters
    ----------
    pick, place
        Platform poses in task coordinates, m and rad, in the paper's frame. At different heights the traverse is
        inclined; rotations run with the traverse, by the same law.
    lift
        Height in metres along *up*, > 0; or the lift itself as a vector in task coordinates, without *up*. The vector
        is what the attribute holds afterwards, and *up* is None.
    up
        Direction away from the ground, any length: (0, 0, -1) where x3 points down, (0, 1, 0) where y points up. One
        number for each position among the task coordinates; zeros for the rotations may follow in their places.
    lift_time, traverse_time, lower_time
        Durations in seconds, > 0; *lower_time* None is *lift_time*.
    dwell
        Seconds of rest at the place pose and, with *back*, again at the pick pose.
    overlap
        Fraction in [0, 1) of the lift, and of the lower, that runs together with the traverse: 0 stops at both
        corners, more rounds them. The full height is reached in every case, so the traverse must last at least
        ``overlap * (lift_time + lower_time)``.
    back
        True: return to the pick pose, so that cycles can be joined.
    law
        Time law of each move, a key of `LAWS`.
    coordinates
        Names of the task coordinates, of `workbench.motion.base.COORDINATES`; ``x y z`` where not said.

    Raises
    ------
    MotionError
        A number that is not finite or out of its range; the message names it.
    """

    pick: Sequence[float]
    place: Sequence[float]
    lift: float | Sequence[float]
    lift_time: float
    traverse_time: float
    lower_time: float | None = None
    up: Sequence[float] | None = None
    dwell: float = 0.0
    overlap: float = 0.0
    back: bool = False
    law: str = "quintic"
    coordinates: Sequence[str] = POSITION

    def __post_init__(self) -> None:
        """Check every number, and resolve *lift* with *up* and *lower_time* to what they stand for."""
        names = as_coordinates(self.coordinates)
        _set(self, "coordinates", names)
        for name in ("pick", "place"):
            _set(self, name, tuple(_in_coordinates(name, getattr(self, name), names)))
        _set(self, "lift", _lift_vector(self.lift, self.up, names))
        _set(self, "up", None)
        if self.lower_time is None:
            _set(self, "lower_time", self.lift_time)
        for name in ("lift_time", "traverse_time", "lower_time"):
            value = as_number(f"pick and place: {name}", getattr(self, name), "s", 0.0, minimum_allowed=False)
            _set(self, name, value)
        _set(self, "dwell", as_number("pick and place: dwell", self.dwell, "s", 0.0))
        overlap = as_number("pick and place: overlap", self.overlap, "")
        if not 0.0 <= overlap < 1.0:
            raise MotionError(f"pick and place: overlap = {overlap:g}; allowed: >= 0 and < 1", value=overlap)
        _set(self, "overlap", overlap)
        needed = overlap * sum(self._vertical_times())
        # compared with a little room, so that a traverse of exactly the needed length is not refused by round-off
        if self.traverse_time < needed * (1.0 - 1e-12):
            raise MotionError(
                f"pick and place: traverse_time = {self.traverse_time:g} s with overlap = {overlap:g}; "
                f"allowed: >= {needed:g} s, or the lower begins before the lift has ended",
                value=self.traverse_time,
                limit=needed,
            )
        time_law(self.law, 0.0)

    @property
    def moves(self) -> tuple[Move, ...]:
        """The moves in order of their start."""
        lift, lower = (np.array(self.lift, dtype=np.float64) * sign for sign in (1.0, -1.0))
        across = np.subtract(self.place, self.pick)
        lift_time, lower_time = self._vertical_times()
        moves: list[Move] = []
        clock = 0.0
        for suffix, way in [("", across), (" back", -across)][: 2 if self.back else 1]:
            traverse = clock + (1.0 - self.overlap) * lift_time
            lowering = traverse + self.traverse_time - self.overlap * lower_time
            moves += [
                Move(f"lift{suffix}", clock, lift_time, _plain(lift)),
                Move(f"traverse{suffix}", traverse, self.traverse_time, _plain(way)),
                Move(f"lower{suffix}", lowering, lower_time, _plain(lower)),
            ]
            clock = lowering + lower_time + self.dwell
        return tuple(moves)

    @property
    def duration(self) -> float:
        """Length of the whole cycle in seconds, dwells included."""
        return self.moves[-1].stop + self.dwell

    def sample(self, t: ArrayLike) -> PlatformMotion:
        """Evaluate the cycle at times *t* ``(n,)`` in seconds from its start; before and after it the platform rests.

        Raises
        ------
        MotionError
            *t* is not a strictly increasing sequence of finite times.
        """
        times = as_times(t)
        x = np.tile(np.array(self.pick, dtype=np.float64), (len(times), 1))
        xd, xdd = np.zeros_like(x), np.zeros_like(x)
        # overflow (a duration of 1e-200 s) is reported by PlatformMotion, with time and axis
        with np.errstate(over="ignore", invalid="ignore"):
            for move in self.moves:
                value, first, second = time_law(self.law, (times - move.start) / move.duration)
                displacement = np.array(move.displacement)
                x += value[:, None] * displacement
                xd += first[:, None] * (displacement / move.duration)
                xdd += second[:, None] * (displacement / move.duration / move.duration)
        return PlatformMotion(times, x, xd, xdd, tuple(self.coordinates))

    def _vertical_times(self) -> tuple[float, float]:
        lower_time = self.lift_time if self.lower_time is None else self.lower_time
        return self.lift_time, lower_time


def pick_and_place(
    pick: Sequence[float],
    place: Sequence[float],
    *,
    samples: int | None = None,
    rate: float | None = None,
    **cycle: Any,
) -> PlatformMotion:
    """Sample one `PickAndPlace` cycle from its start to its end.

    Parameters
    ----------
    pick, place
        Platform poses in task coordinates, m and rad, in the paper's frame.
    samples, rate
        As in `time_grid`; exactly one of them.
    **cycle
        The other parameters of `PickAndPlace`: *lift*, *lift_time* and *traverse_time* at least.

    Raises
    ------
    MotionError
        As `PickAndPlace` and `time_grid`.
    """
    plan = PickAndPlace(pick, place, **cycle)
    return plan.sample(time_grid(0.0, plan.duration, samples=samples, rate=rate))


def _set(plan: PickAndPlace, name: str, value: object) -> None:
    object.__setattr__(plan, name, value)


def _plain(vector: FloatArray) -> tuple[float, ...]:
    return tuple(float(entry) for entry in vector)


def _in_coordinates(what: str, value: Any, names: tuple[str, ...]) -> list[float]:
    """A pose or displacement, with as many numbers as there are task coordinates."""
    vector = as_vector(f"pick and place: {what}", value, "")
    if len(vector) != len(names):
        raise MotionError(
            f"pick and place: {what} has {len(vector)} entries; allowed: {len(names)}, the task coordinates"
            f" {', '.join(names)}",
            value=len(vector),
        )
    return vector


def _lift_vector(lift: Any, up: Any, names: tuple[str, ...]) -> tuple[float, ...]:
    if isinstance(lift, Sequence | np.ndarray) and not isinstance(lift, str):
        vector = np.array(_in_coordinates("lift", lift, names))
        if up is not None:
            raise MotionError("pick and place: lift is a vector and up is given too; allowed: a height with up")
        if not vector.any():
            raise MotionError("pick and place: lift is all zeros; allowed: a vector that is not zero")
        return _plain(vector)
    height = as_number("pick and place: lift", lift, "m", 0.0, minimum_allowed=False)
    if up is None:
        raise MotionError(f"pick and place: lift = {height:g} m without up; allowed: a height with up, or a vector")
    direction = _direction(up, names)
    length = math.hypot(*direction)
    if length == 0.0:
        raise MotionError("pick and place: up is all zeros; allowed: a direction, of any length but zero")
    return _plain(height * (direction / length))


def _direction(up: Any, names: tuple[str, ...]) -> FloatArray:
    """*up* in task coordinates: a height is one of positions."""
    given = as_vector("pick and place: up", up, "")
    places = [k for k, name in enumerate(names) if unit_of(name) == "m"]
    direction = np.zeros(len(names))
    if not places:
        raise MotionError(
            f"pick and place: the task coordinates {', '.join(names)} hold no position to lift along; give lift as a"
            " vector"
        )
    if len(given) == len(names):
        direction[:] = given
    elif len(given) == len(places):
        direction[places] = given
    else:
        wanted = f"{len(places)}, the positions {', '.join(names[k] for k in places)}"
        raise MotionError(f"pick and place: up has {len(given)} entries; allowed: {wanted}", value=len(given))
    turned = [name for k, name in enumerate(names) if k not in places and direction[k] != 0.0]
    if turned:
        raise MotionError(f"pick and place: up turns {turned[0]}; allowed: a direction of positions, 0 for rotations")
    return direction
