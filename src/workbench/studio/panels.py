"""The sliders of the page: a folder for each body, a slider and its number for each parameter."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from workbench.studio.hands import Hands
from workbench.studio.knobs import JOINTS, Knob
from workbench.studio.session import Session
from workbench.studio.words import number

UNITLESS = ("", "1")


def label_of(knob: Knob) -> str:
    """What stands before a slider."""
    return knob.name if knob.unit in UNITLESS else f"{knob.name} [{knob.unit}]"


def hint_of(knob: Knob, session: Session, reach: tuple[float, float] | None = None) -> str:
    """What is shown over a slider: meaning, whence the number is, and how far it reaches."""
    values, subject = session.values(), session.subject
    start = subject.base.description.table.changed(subject.base.values, subject.start(session.wanted.case))
    parts = [knob.meaning or knob.name]
    if knob.differs(values):
        parts.append("the sides differ: the mean is shown")
    if any(values[name] != start[name] for name in knob.members):
        by_hand = any(name in session.wanted.changes for name in knob.members)
        parts.append(
            f"{'set here' if by_hand else 'follows from what was set here'}; was {number(knob.value(start), 6)}"
        )
    elif any(start[name] != subject.base.values[name] for name in knob.members):
        parts.append("as the case, the campaign or the command line sets it")
    elif knob.source:
        parts.append(knob.source)
    if reach is not None:
        parts.append(f"this motion is in reach from {number(reach[0])} to {number(reach[1])}")
    return " · ".join(parts)


class Knobs:
    """Sliders in a viser panel."""

    def __init__(
        self, gui: Any, session: Session, hands: Hands,
        changed: Callable[[str, float], None], touched: Callable[[str], None],
    ) -> None:  # fmt: skip
        self._gui, self._session, self._hands = gui, session, hands
        self._changed, self._touched = changed, touched
        self._sliders: dict[str, Any] = {}
        self._reach: dict[str, tuple[float, float]] = {}
        self._folders: list[Any] = []
        self.build()

    def build(self) -> None:
        """Make all sliders anew, of a robot that was read again."""
        for folder in self._folders:
            folder.remove()
        self._sliders, self._reach, self._folders = {}, {}, []
        whole = [knob for knob in self._session.knobs if not knob.part]
        # what stands at joints comes last: it is mostly zero
        for body in sorted(dict.fromkeys(knob.body for knob in whole), key=lambda body: body == JOINTS):
            folder = self._gui.add_folder(body, expand_by_default=body != JOINTS)
            self._folders.append(folder)
            with folder:
                for knob in (knob for knob in whole if knob.body == body):
                    self._add(knob)
        parts = [knob for knob in self._session.knobs if knob.part]
        if parts:
            folder = self._gui.add_folder("left and right apart", expand_by_default=False)
            self._folders.append(folder)
            with folder:
                for knob in parts:
                    self._add(knob)

    def _add(self, knob: Knob) -> None:
        value = knob.value(self._session.values())
        slider = self._gui.add_slider(
            label_of(knob), min=min(knob.low, value), max=max(knob.high, value), step=knob.step, initial_value=value,
            disabled=not knob.settable, hint=hint_of(knob, self._session),
        )  # fmt: skip
        self._sliders[knob.name] = slider
        self._hands.listen(
            slider, lambda value: self._changed(knob.name, float(value)), partial(self._touched, knob.name)
        )

    def follow(self, values: Mapping[str, float], moved: str | None = None) -> None:
        """Put the sliders where the parameters are; *moved* is in a hand, and left alone."""
        places = []
        for knob in self._session.knobs:
            slider, value = self._sliders.get(knob.name), knob.value(values)
            if slider is None or knob.name == moved:
                continue
            if value < slider.min:
                slider.min = value
            if value > slider.max:
                slider.max = value
            places.append((slider, value))
            text = hint_of(knob, self._session, self._reach.get(knob.name))
            if slider.hint != text:
                slider.hint = text
        self._hands.put(places)

    def show_reach(self, name: str, reach: tuple[float, float]) -> None:
        """Let a slider end where the motion leaves the robot's reach."""
        slider, knob = self._sliders.get(name), self._session.knob(name)
        if slider is None:
            return
        self._reach[name] = reach
        low, high = min(reach[0], slider.value), max(reach[1], slider.value)
        if low < high and (slider.min, slider.max) != (low, high):
            slider.min, slider.max = low, high
        slider.hint = hint_of(knob, self._session, reach)

    def forget_reach(self, kept: str | None) -> None:
        """Give the sliders their whole range back, what is in reach has changed; but not the one in a hand.

        Its own reach does not depend on where it stands, and its ends may not move under the hand.
        """
        names = [name for name in self._reach if name != kept]
        for name in names:
            del self._reach[name]
            slider, knob = self._sliders.get(name), self._session.knob(name)
            if slider is not None:
                slider.min, slider.max = min(knob.low, slider.value), max(knob.high, slider.value)
                slider.hint = hint_of(knob, self._session)
