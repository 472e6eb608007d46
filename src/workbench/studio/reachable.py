"""How far a parameter may be moved before the case's motion leaves the robot's reach."""

from __future__ import annotations

from collections.abc import Callable

from workbench.capabilities.nearest import last_reached

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
    def at(share: float) -> float:
        return end if share == 1.0 else value + share * (end - value)

    return end if value == end else at(last_reached(lambda share: feasible(at(share)), STEPS, HALVINGS, stopped))
