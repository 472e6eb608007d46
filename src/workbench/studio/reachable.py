"""How far a parameter may be moved before the case's motion leaves the robot's reach."""

from __future__ import annotations

from collections.abc import Callable

HALVINGS = 5
"""Of the way between the last value in reach and the first out of it: a thirtieth of a step is left open."""

STEPS = 4
"""Values that are tried on the way outwards, so that a gap in the reach that is as wide as a step is seen."""


def reach_of(
    value: float,
    low: float,
    high: float,
    feasible: Callable[[float], bool],
    stopped: Callable[[], bool] = lambda: False,
) -> tuple[float, float]:
    """Return the part of ``low`` to ``high`` around *value* in which a motion can be followed.

    Parameters
    ----------
    value
        Where the parameter stands; taken to be in reach.
    low, high
        Ends of the slider.
    feasible
        Whether the motion can be followed with a value.
    stopped
        Asked between two tries; true ends the search with what is known to be in reach.
    """
    return (
        _outwards(value, low, feasible, stopped),
        _outwards(value, high, feasible, stopped),
    )


def _outwards(value: float, end: float, feasible: Callable[[float], bool], stopped: Callable[[], bool]) -> float:
    inside, outside = value, None
    for step in range(1, STEPS + 1):
        tried = end if step == STEPS else value + (end - value) * step / STEPS
        if stopped():
            return inside
        if tried == inside:
            continue
        if not feasible(tried):
            outside = tried
            break
        inside = tried
    if outside is None:
        return end
    for _ in range(HALVINGS):
        if stopped():
            return inside
        middle = 0.5 * (inside + outside)
        if feasible(middle):
            inside = middle
        else:
            outside = middle
    return inside
