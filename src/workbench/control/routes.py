"""One run by both routes: which step each takes, and what is made again to know how well its figures are known."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from workbench.arrays import FloatArray
from workbench.campaign.control_spec import PRINTED_COST
from workbench.control.figures import Error, extrapolated
from workbench.control.loop import TRACKED, Tracked
from workbench.control.names import NOT_RUN
from workbench.reference.forward import Plant
from workbench.reference.replay import quiet
from workbench.reference.stiff_plant import StiffPlant

LONGEST_STEP = 1e-3
"""s: the step of either route where the control period is longer."""

IMPLICIT_STEP = 2.5e-4
"""s: the second route's coarse step where no explicit method can move the robot, or the control period."""

HALVED_TO = 2000.0
"""Hz: up to this rate every run is made again at half the plant's step, as are those at the rate of a printed cost, by
which sentences are judged. Of the others the step is shorter than 0.5 ms, and MuJoCo's route alone vouches for them."""

AGREED = 0.01
"""Of the platform's error: where the routes differ by less, a tenth of what makes a figure undecided, the second is not
made again at half its step. Its own error cannot be larger, unless both err alike, by other methods in other
coordinates."""

Run = Callable[[Plant | StiffPlant, float, int], Tracked]
"""Plant, longest step in s, how many steps in place of each."""

ErrorOf = Callable[[FloatArray, FloatArray], Error]
"""Coordinates ``(n, na)`` and platform sites ``(n, 3)`` at the ticks."""


@dataclass(frozen=True)
class Outcome:
    """One run by all routes."""

    tracked: Tracked
    """the plant's own step"""
    error: Error | None
    """None where the run did not come to its end"""
    halved: Error | None
    """at half the step"""
    second: Error | None
    """by MuJoCo's route, at the finest step that was taken or, of first order, extrapolated to none"""
    second_status: str
    spread: float
    """m: what half the step changes in the platform's rms error by MuJoCo's route; NaN where it was not asked"""


def step_of(period: float, step: float | None) -> float:
    """S, the longest step of the package's route: as asked, or the period and at most `LONGEST_STEP`."""
    return step or min(period, LONGEST_STEP)


def is_halved(rate: float, rate_asked: str) -> bool:
    """Tell whether a run at a rate, Hz, is made again at half the plant's step."""
    return rate <= HALVED_TO * (1.0 + 1e-9) or rate_asked == PRINTED_COST


def by_routes(
    plant: Plant,
    stiff: StiffPlant | None,
    run: Run,
    error: ErrorOf,
    period: float,
    step: float | None,
    halve: bool = True,
) -> Outcome:
    """Run a loop by the package's route, at its step and at half of it, and by MuJoCo's where *stiff* is given.

    Parameters
    ----------
    plant, stiff
        The robot by either route.
    run, error
        One run, and what its states are worth.
    period
        s, of the control loop.
    step
        s, longest of the plant; None is the period, at most `LONGEST_STEP`.
    halve
        `is_halved`.
    """
    own_step = step_of(period, step)
    tracked = run(plant, own_step, 1)
    own = error(tracked.q, tracked.x) if tracked.status == TRACKED else None
    halved = None
    if own and halve:
        half = run(plant, 0.5 * own_step, 1)
        halved = error(half.q, half.x) if half.status == TRACKED else None
    if stiff is None:
        return Outcome(tracked, own, halved, None, NOT_RUN, math.nan)
    with quiet():
        second, status, spread = _second(stiff, run, error, own, period)
    return Outcome(tracked, own, halved, second, status, spread)


def _second(
    stiff: StiffPlant, run: Run, error: ErrorOf, own: Error | None, period: float
) -> tuple[Error | None, str, float]:
    """Errors by MuJoCo's route, how it ended, and what half its step changes."""
    step = min(period, LONGEST_STEP)
    explicit = stiff.takes(step)
    if not explicit:
        step = min(period, IMPLICIT_STEP)
    stiff.stiffen(step, explicit)
    coarse = run(stiff, step, 1)
    if explicit and own is None and coarse.status != TRACKED:
        return None, coarse.status, math.nan
    first = error(coarse.q, coarse.x) if coarse.status == TRACKED else None
    if explicit and own and first and abs(first.platform_rms - own.platform_rms) <= AGREED * own.platform_rms:
        return first, TRACKED, math.nan
    stiff.stiffen(0.5 * step, explicit)
    # extrapolation of a first order asks for exactly half of every step; of order four the longest ones alone count
    fine = run(stiff, 0.5 * step, 1) if explicit else run(stiff, step, 2)
    if own is None or fine.status != TRACKED or not (explicit or first):
        return None, fine.status if first or explicit else coarse.status, math.nan
    found = error(fine.q, fine.x)
    if explicit:
        return found, TRACKED, abs(found.platform_rms - first.platform_rms) if first else math.nan
    second = error(extrapolated(coarse.q, fine.q), extrapolated(coarse.x, fine.x))
    return second, TRACKED, abs(found.platform_rms - second.platform_rms)
