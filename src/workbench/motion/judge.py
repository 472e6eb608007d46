"""What the numbers of a tabulated motion are worth: both sides of a comparison share them, so agreement says nothing.

Positions alone: velocities and accelerations from all samples are held against those from every second one, which tells
rounding (it grows as the step shrinks) from a grid that is too coarse. Given derivatives: velocity against position and
acceleration against velocity, less what their digits and the step explain; an error that shrinks with the step belongs
to the grid and not to the numbers. Familiar factors (degrees, millimetres, milliseconds, a sign) are named.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import MotionError
from workbench.motion.base import JointMotion, PlatformMotion
from workbench.motion.digits import FULL, rounding_of
from workbench.motion.spline import interpolating_spline
from workbench.motion.table import SPLINE_DEGREE, Tabulated

WORTH_SAYING = 1e-3
"""Of a coordinate's peak rate: a larger doubt is a warning. Torques follow accelerations, and what is claimed of closed
forms is mostly 0.1 % and more."""

TOO_FAR = 0.1
"""Of the peak rate: a larger doubt is refused. Nothing that a comparison shows would be about the motion meant."""

FEWEST = 2 * (SPLINE_DEGREE + 1)
"""Samples; of fewer every second one makes no spline, and the motion is not judged, which is said."""

QUIET = 1e-6
"""Of the fastest coordinate of the same unit: slower ones rest, up to the rounding of whoever computed them."""

ROUNDING = 4.0 * float(np.finfo(np.float64).eps)
"""Relative: what the arithmetic that made a table leaves in its last digits."""

FACTORS = {
    "deg": (180.0 / np.pi, "degrees in place of radians"),
    "rad": (np.pi / 180.0, "radians where the others are in degrees"),
    "-": (-1.0, "the wrong sign"),
    "mm": (1e3, "millimetres in place of metres, or times in milliseconds"),
    "m": (1e-3, "metres where the others are in millimetres, or times in milliseconds"),
}
"""Given rate over that of the positions: what it looks like."""

ALIKE = 0.02
"""Relative: how near a factor has to be to a familiar one."""

FULL_TURNS = 4.0 * np.pi
"""rad: a hinge that never passes zero and goes beyond two turns was most likely given in degrees."""

FAR = 20.0
"""m: no parallel robot reaches so far; the number is most likely in millimetres."""

SLOW_STEP = 0.5
"""s: whole numbers of seconds apart are most likely milliseconds."""


@dataclass(frozen=True)
class _Doubt:
    """The largest doubt about one kind of rate."""

    what: str
    coordinate: int
    share: float
    """of the peak"""
    size: float
    """in the rate's unit"""
    sample: int
    why: str


def judged(table: Tabulated) -> JointMotion | PlatformMotion:
    """Return a table's motion with what there is to say about its numbers among its ``warnings``.

    Raises
    ------
    MotionError
        Derivatives that belong to another motion, or positions too coarse to be differentiated twice: a doubt of more
        than `TOO_FAR` of a coordinate's peak rate. The message names file, coordinate, time, figure and the way on.
    """
    motion = table.motion
    t, values = motion.t, _arrays(motion)
    said = _unlikely(table, t, values[0])
    if len(t) < FEWEST:
        said.append(f"{table.file}: {len(t)} samples are too few to judge the motion (from {FEWEST} on)")
        return replace(motion, warnings=(*motion.warnings, *said))
    try:
        doubts = _of_given(table, t, values) if table.derivatives_given else _of_positions(table, t, values)
    except MotionError:  # steps that every second sample makes too uneven for a spline
        said.append(f"{table.file}: time steps are too uneven to judge the motion")
        doubts = []
    for doubt in doubts:
        if doubt.share > TOO_FAR:
            raise MotionError(
                f"{_sentence(table, doubt, t)}; allowed: {100 * TOO_FAR:g} %; {_way_on(table, doubt)}",
                file=table.file,
                joint=table.names[doubt.coordinate],
                time=float(t[doubt.sample]),
                value=doubt.share,
                limit=TOO_FAR,
            )
        if doubt.share > WORTH_SAYING:
            said.append(_sentence(table, doubt, t))
    return replace(motion, warnings=(*motion.warnings, *said))


def _arrays(motion: JointMotion | PlatformMotion) -> tuple[FloatArray, FloatArray, FloatArray]:
    if isinstance(motion, JointMotion):
        return motion.q, motion.qd, motion.qdd
    return motion.x, motion.xd, motion.xdd


def _sentence(table: Tabulated, doubt: _Doubt, t: FloatArray) -> str:
    unit = table.units[doubt.coordinate] or "SI units"
    per = {"velocity": "/s", "acceleration": "/s^2"}[doubt.what] if unit != "SI units" else ""
    percent = 100 * doubt.share
    shown = f"{percent:.2g} %" if percent < 10 else f"{percent:.0f} %" if percent < 1000 else f"{doubt.share:.2g} times"
    verb = "does not fit" if table.derivatives_given else "is uncertain"
    return (
        f"{table.file}: {doubt.what} of {table.names[doubt.coordinate]} {verb}{_against(table, doubt)} by"
        f" {doubt.size:.2g} {unit}{per}, {shown} of its peak, at t = {t[doubt.sample]:.6g} s{doubt.why}"
    )


def _against(table: Tabulated, doubt: _Doubt) -> str:
    if not table.derivatives_given:
        return ""
    return " position" if doubt.what == "velocity" else " velocity"


def _way_on(table: Tabulated, doubt: _Doubt) -> str:
    if table.derivatives_given:
        return "correct the columns, or leave all derivatives out so that they follow from the positions"
    # a campaign's other kind of table estimates derivatives from noisy joint positions and says what that leaves open
    smoothed = ', or kind = "recorded", which smooths them' if isinstance(table.motion, JointMotion) else ""
    if "samples" in doubt.why:
        return f"give more samples, or velocities and accelerations{smoothed}"
    return f"give velocities and accelerations, or positions and times with all their digits{smoothed}"


# --- positions alone --------------------------------------------------------------------------------------------------


def _of_positions(table: Tabulated, t: FloatArray, values: tuple[FloatArray, ...]) -> list[_Doubt]:
    """Doubts of rates from a spline: full against half; whether it is rounding or the grid, quarter against half."""
    elapsed, position = t - t[0], values[0]
    coarse = [step for step in (2, 4) if len(t[::step]) > SPLINE_DEGREE]
    rates = [values[1:], *(_rates(elapsed[::step], position[::step]) for step in coarse)]
    doubts = []
    for order, what in enumerate(("velocity", "acceleration")):
        gap = np.abs(rates[0][order][::2] - rates[1][order])
        size = gap.max(axis=0)
        if len(rates) > 2:
            coarser = np.abs(rates[1][order][::2] - rates[2][order]).max(axis=0)
            # an error that falls with each halving of the step leaves a part of the gap: a smooth motion's falls by
            # 16 and leaves a fifteenth, that of a corner by 2 and leaves all; rounding grows, and the gap is its size
            falls = np.divide(size, coarser, out=np.ones_like(size), where=coarser > 0.0)
            falls = np.clip(falls, 1.0 / 16.0, 0.5)
            size = size * falls / (1.0 - falls)
        share = size / _normaliser(rates[0][order], table.units)
        worst = int(np.argmax(share))
        sample = 2 * int(np.argmax(gap[:, worst]))
        doubts.append(
            _Doubt(what, worst, float(share[worst]), float(size[worst]), sample, _reason(t, values, worst, order))
        )
    # the acceleration's doubt is the larger one and says it all, unless it is small
    return sorted(doubts, key=lambda doubt: -doubt.share)[:1]


def _rates(t: FloatArray, position: FloatArray) -> tuple[FloatArray, FloatArray]:
    curve = interpolating_spline(t, position, SPLINE_DEGREE)
    return np.asarray(curve(t, nu=1)), np.asarray(curve(t, nu=2))


def _reason(t: FloatArray, values: tuple[FloatArray, ...], coordinate: int, order: int) -> str:
    """What the positions' and the times' digits leave in a rate, in words."""
    step = float(np.median(np.diff(t)))
    amplified = {0: 2.0 / step, 1: 8.0 / step**2}[order]
    position, digits = rounding_of(values[0][:, coordinate])
    times, places = _rounding_of_times(t)
    speed = float(np.median(np.abs(values[1][:, coordinate])))
    worth = {"positions": position * amplified, "times": times * speed * amplified}
    worst = max(worth, key=lambda name: worth[name])
    if digits >= FULL and places >= FULL:
        return f": {len(t)} samples are too few for it, or the positions carry noise"
    count = digits if worst == "positions" else places
    return f": {worst} of {count} digits every {1e3 * step:.3g} ms leave up to {worth[worst]:.2g} in it"


def _normaliser(rate: FloatArray, units: tuple[str, ...]) -> FloatArray:
    """Peak of each coordinate; of one that rests beside others of its unit, a small part of theirs."""
    peak = np.abs(rate).max(axis=0)
    floor = np.array([max(p for p, u in zip(peak, units, strict=True) if u == unit) for unit in units])
    floored: FloatArray = np.maximum(np.maximum(peak, QUIET * floor), np.finfo(np.float64).tiny)
    return floored


# --- derivatives given ------------------------------------------------------------------------------------------------


def _of_given(table: Tabulated, t: FloatArray, values: tuple[FloatArray, ...]) -> list[_Doubt]:
    doubts = []
    for order, what in enumerate(("velocity", "acceleration")):
        value, rate = values[order], values[order + 1]
        fine, slope = _mismatch(t, value, rate)
        coarse, _ = _mismatch(t[::2], value[::2], rate[::2])
        size = fine.max(axis=0)
        # what falls with the step belongs to the grid, at a corner of an acceleration too (by 2); what stays, to the
        # numbers: the power keeps the one and drops the other
        falls = np.divide(size, coarse.max(axis=0), out=np.ones_like(size), where=coarse.max(axis=0) > 0.0)
        size = size * np.clip(falls, 0.0, 1.0) ** 4
        both = np.maximum(np.abs(rate), np.abs(np.vstack([slope, slope[-1:]])))
        share = size / _normaliser(both, table.units)
        why = [""] * len(share)
        for coordinate in range(len(share)):
            factor = _familiar(slope[:, coordinate], 0.5 * (rate[1:, coordinate] + rate[:-1, coordinate]))
            if factor is not None:
                # rounding of the positions may excuse a mismatch, but not one that is a factor
                share[coordinate] = max(share[coordinate], abs(1.0 - factor[0]) / max(1.0, abs(factor[0])))
                why[coordinate] = f"; it looks like {factor[1]} (factor {factor[0]:.4g})"
        worst = int(np.argmax(share))
        doubts.append(
            _Doubt(what, worst, float(share[worst]), float(size[worst]), int(np.argmax(fine[:, worst])), why[worst])
        )
    return doubts


def _mismatch(t: FloatArray, value: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean rate of each step ``(n - 1, m)`` against the mean of a spline through the given rates, and that mean itself.

    Less what rounding of positions, rates and times explains.
    """
    elapsed, steps = t - t[0], np.diff(t)[:, None]
    integral = interpolating_spline(elapsed, rate, 3).antiderivative()
    slope = np.diff(value, axis=0) / steps
    gap = np.abs(slope - np.diff(integral(elapsed), axis=0) / steps)
    rounding = np.array([rounding_of(column)[0] for column in value.T]) + ROUNDING * np.abs(value).max(axis=0)
    of_rate = np.array([rounding_of(column)[0] for column in rate.T]) + ROUNDING * np.abs(rate).max(axis=0)
    of_time = _rounding_of_times(t)[0] + ROUNDING * max(abs(float(t[0])), abs(float(t[-1])))
    allowed = 2.0 * rounding / steps + 2.0 * of_rate + 2.0 * of_time / steps * np.abs(slope)
    return np.maximum(gap - allowed, 0.0), slope


def _rounding_of_times(t: FloatArray) -> tuple[float, int]:
    """As `rounding_of`; steps that are all alike were not rounded, however short they are."""
    error, digits = rounding_of(t - t[0])
    steps = np.diff(t)
    unlike = float(steps.max() - steps.min())
    return (error, digits) if unlike > 1e-6 * float(steps.max()) else (0.0, FULL)


def _familiar(slope: FloatArray, rate: FloatArray) -> tuple[float, str] | None:
    """The factor between given rates and the positions', where it is a familiar one and nothing else is wrong."""
    worth = float(slope @ slope)
    if worth == 0.0 or not rate.any():
        return None
    factor = float(slope @ rate) / worth
    left = float(np.linalg.norm(rate - factor * slope))
    if left > 0.05 * float(np.linalg.norm(rate)):
        return None
    for known, words in FACTORS.values():
        if abs(factor / known - 1.0) < ALIKE:
            return factor, words
    return None


# --- numbers that look like another unit ------------------------------------------------------------------------------


def _unlikely(table: Tabulated, t: FloatArray, position: FloatArray) -> list[str]:
    """Sentences about times in milliseconds, angles in degrees, lengths in millimetres."""
    facts: list[tuple[bool, str]] = []
    steps = np.diff(t)
    whole = len(t) >= FEWEST and bool((t == np.round(t)).all()) and float(np.median(steps)) >= SLOW_STEP
    facts.append((whole, f"times are whole numbers up to {t[-1]:g}; they are in seconds, and look like milliseconds"))
    for name, unit, column in zip(table.names, table.units, position.T, strict=True):
        far = float(np.abs(column).max())
        turns = unit == "rad" and far > FULL_TURNS and float(np.ptp(column)) < far
        facts.append((turns, f"{name} reaches {far:g} rad, {far / (2 * np.pi):.3g} turns; it looks like degrees"))
        facts.append((unit == "m" and far > FAR, f"{name} reaches {far:g} m; it looks like millimetres"))
    return [f"{table.file}: {words}" for holds, words in facts if holds]
