"""What can be moved on the page, as one value; and the way back through such values."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from workbench.errors import ParameterError

FACTORS = (0.05, 20.0)
"""Smallest and largest factor on a motion's amplitude and speed."""


@dataclass(frozen=True)
class State:
    """A robot's changed parameters, a case, and what is done to its motion."""

    case: str
    changes: Mapping[str, float] = field(default_factory=dict)
    """parameter -> value, SI, over what campaign and case say; members of groups by their own names"""
    amplitude: float = 1.0
    speed: float = 1.0
    rows: tuple[int, ...] = ()
    """which of the campaign's candidates are held against MuJoCo, by their place in it"""

    def __post_init__(self) -> None:
        """Check the factors.

        Raises
        ------
        ParameterError
            A factor out of range.
        """
        for name in ("amplitude", "speed"):
            value = getattr(self, name)
            if not FACTORS[0] <= value <= FACTORS[1]:
                raise ParameterError(
                    f"{name} {value:g} times the case's own; allowed: {FACTORS[0]:g} to {FACTORS[1]:g}", value=value
                )

    @property
    def moved(self) -> bool:
        """Whether the motion is not the case's own."""
        return (self.amplitude, self.speed) != (1.0, 1.0)

    @property
    def changed(self) -> bool:
        """Whether robot or motion are not those of the files."""
        return bool(self.changes) or self.moved


class History:
    """States one after the other. A gesture, one drag of a slider, is one step back."""

    def __init__(self, first: State) -> None:
        self._states = [first]
        self._place = 0
        self._gesture: Hashable = None

    @property
    def now(self) -> State:
        """The state that is wanted."""
        return self._states[self._place]

    @property
    def before(self) -> State | None:
        """The state one step back."""
        return self._states[self._place - 1] if self._place else None

    @property
    def after(self) -> State | None:
        """The state that was undone last."""
        return self._states[self._place + 1] if self._place + 1 < len(self._states) else None

    def change(self, gesture: Hashable = None, **fields: Any) -> State:
        """Go on to another state; changes of the same *gesture* replace each other until `settle`.

        Raises
        ------
        ParameterError
            A state that may not be.
        """
        made = replace(self.now, **fields)
        if made == self.now:
            return made
        again = gesture is not None and gesture == self._gesture and self._place > 0
        keep = self._place if again else self._place + 1
        self._states = [*self._states[:keep], made]
        self._place, self._gesture = keep, gesture
        return made

    def settle(self) -> None:
        """End a gesture: the next change is a step of its own."""
        self._gesture = None

    def undo(self) -> State:
        """Go one step back, where there is one."""
        self._place, self._gesture = max(self._place - 1, 0), None
        return self.now

    def redo(self) -> State:
        """Take the last `undo` back, where there is one."""
        self._place, self._gesture = min(self._place + 1, len(self._states) - 1), None
        return self.now
