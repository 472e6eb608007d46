"""Curves over time, one plot a joint: what MuJoCo says, what formulas say, and what it was before."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from html import escape
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.report.text import torque_name
from workbench.studio.outcome import Outcome

TORQUE, ERROR, POWER, COORDINATE = "torque", "formula less MuJoCo", "power", "coordinate"
QUANTITIES = (TORQUE, ERROR, POWER, COORDINATE)

REFERENCE_COLOURS = ("#1c7ed6", "#7048e8")
FORMULA_COLOURS = ("#e8590c", "#2b8a3e", "#c2255c", "#0b7285", "#a17f00")
BEFORE_COLOUR = "#868e96"
NOW_COLOUR = "#e03131"
HEIGHT = 190
BELOW: Mapping[str, Any] = {"label": "t [s]", "labelSize": 18, "labelFont": "12px sans-serif", "size": 34}
"""The axis of time."""


@dataclass(frozen=True)
class Curve:
    """One line of a plot."""

    label: str
    values: FloatArray = field(repr=False)
    """``(n,)``"""
    colour: str
    dash: tuple[int, ...] = ()
    width: float = 1.6


def curves_of(outcome: Outcome, other: Outcome | None, quantity: str, joint: int, before: str) -> list[Curve]:
    """The lines of one joint; *other* is dashed, at the times of *outcome*."""
    motion = outcome.case.motion
    if quantity == COORDINATE:
        found = [Curve("q", motion.q[:, joint], REFERENCE_COLOURS[0])]
        then = None if other is None else other.case.motion.q[:, joint]
    elif quantity == POWER:
        found = [Curve("power", outcome.power[:, joint], REFERENCE_COLOURS[0])]
        then = None if other is None else other.power[:, joint]
    elif quantity == ERROR:
        pairs = dict.fromkeys((row.candidate, row.reference) for row in outcome.rows)
        found = [
            Curve(f"{name} - {reference}", outcome.formulas[name][:, joint] - outcome.references[reference][:, joint],
                  FORMULA_COLOURS[i % len(FORMULA_COLOURS)])
            for i, (name, reference) in enumerate(pairs)
            if name in outcome.formulas
        ]  # fmt: skip
        then = None
    else:
        found = [
            Curve(f"MuJoCo {name}", tau[:, joint], REFERENCE_COLOURS[i % len(REFERENCE_COLOURS)], width=2.2)
            for i, (name, tau) in enumerate(outcome.references.items())
        ]
        found += [
            Curve(name, tau[:, joint], FORMULA_COLOURS[i % len(FORMULA_COLOURS)], (2, 4), 1.4)
            for i, (name, tau) in enumerate(outcome.formulas.items())
        ]
        then = None if other is None else other.tau[:, joint]
    if then is not None and other is not None:
        found.append(Curve(before, _at(outcome.t, other.t, then), BEFORE_COLOUR, (7, 5), 1.6))
    return found


def _at(t: FloatArray, times: FloatArray, values: FloatArray) -> FloatArray:
    """Values at other times; NaN where there are none."""
    if len(t) == len(times) and np.array_equal(t, times):
        return values
    return np.asarray(np.interp(t, times, values, left=np.nan, right=np.nan), dtype=np.float64)


def unit_of(outcome: Outcome, quantity: str, joint: int) -> str:
    """Unit of a plot's values."""
    robot = outcome.case.robot
    units = {COORDINATE: robot.coordinate_units[joint], POWER: "W"}
    return units.get(quantity, robot.force_units[joint])


def title_of(outcome: Outcome, quantity: str, joint: int) -> str:
    """What a plot shows, with its unit: a torque is named τ, a coordinate by its joint."""
    name = outcome.case.robot.joints[joint]
    shown = torque_name(name) if quantity in (TORQUE, ERROR) else name
    return f"{quantity} {shown} [{unit_of(outcome, quantity, joint)}]"


class Curves:
    """Plots in a viser panel, filled again and again."""

    def __init__(self, gui: Any) -> None:
        self._gui = gui
        self._plots: list[Any] = []
        self._shape: tuple[Any, ...] = ()
        self._lines: list[list[Curve]] = []
        self._outcome: Outcome | None = None
        self._dark = False

    def show(self, outcome: Outcome, other: Outcome | None, quantity: str, before: str, folder: Any) -> None:
        """Show another outcome; plots are made anew where other lines stand in them."""
        self._outcome = outcome
        joints = outcome.case.robot.joints
        self._lines = [curves_of(outcome, other, quantity, i, before) for i in range(len(joints))]
        shape = (quantity, self._dark, *(tuple(line.label for line in lines) for lines in self._lines))
        data = [self._data(lines, 0) for lines in self._lines]
        if shape == self._shape:
            for plot, columns in zip(self._plots, data, strict=True):
                plot.data = columns
            return
        for plot in self._plots:
            plot.remove()
        with folder:
            self._plots = [
                self._plot(title_of(outcome, quantity, i), self._lines[i], data[i]) for i in range(len(joints))
            ]
        self._shape = shape

    def key(self) -> str:
        """What the lines mean, as HTML: once for all plots."""
        lines = self._lines[0] if self._lines else []
        if not lines:
            return '<p style="font-size:0.8rem;margin:0.3em 0.7em">No formula is held against MuJoCo.</p>'
        parts = [
            f'<span style="white-space:nowrap;margin-right:0.9em"><svg width="22" height="8" aria-hidden="true"><line'
            f' x1="0" x2="22" y1="4" y2="4" stroke="{line.colour}" stroke-width="{max(line.width, 2)}"'
            f' stroke-dasharray="{" ".join(str(part) for part in line.dash)}"/></svg> {escape(line.label)}</span>'
            for line in lines
        ]
        return f'<p style="font-size:0.78rem;line-height:1.6;margin:0.2em 0.7em">{" ".join(parts)}</p>'

    def mark(self, sample: int) -> None:
        """Mark the moment that is drawn."""
        if self._outcome is None:
            return
        for plot, lines in zip(self._plots, self._lines, strict=True):
            plot.data = self._data(lines, sample)

    def in_the(self, dark: bool) -> None:
        """Take the colours of axes and text that are seen on light, or on dark; plots follow at the next `show`."""
        self._dark = dark

    def _data(self, lines: list[Curve], sample: int) -> tuple[FloatArray, ...]:
        assert self._outcome is not None
        t = self._outcome.t
        sample = min(sample, len(t) - 1)
        now = np.full(len(t), np.nan)
        if lines:
            now[sample] = lines[0].values[sample]
        return (t, *(line.values for line in lines), now)

    def _plot(self, title: str, lines: list[Curve], data: tuple[FloatArray, ...]) -> Any:
        ink = "#c1c2c5" if self._dark else "#343a40"
        rule = "#373a40" if self._dark else "#e9ecef"
        axis: Mapping[str, Any] = {"stroke": ink, "grid": {"stroke": rule, "width": 1}, "ticks": {"stroke": rule}}
        series = [
            {"label": "t [s]"},
            *(
                {"label": line.label, "stroke": line.colour, "width": line.width, "points": {"show": False},
                 "auto": bool(np.isfinite(line.values).all())}
                | ({"dash": line.dash} if line.dash else {})
                for line in lines
            ),
            # a plot's range is not found where the first number is none
            {"label": "now", "stroke": NOW_COLOUR, "width": 0, "auto": False,
             "points": {"show": True, "size": 8, "fill": NOW_COLOUR, "stroke": NOW_COLOUR}},
        ]  # fmt: skip
        return self._gui.add_uplot(
            data, tuple(series), title=title, height=HEIGHT, axes=({**axis, **BELOW}, {**axis, "size": 62}),
            scales={"x": {"time": False}}, cursor={"sync": {"key": "workbench"}, "drag": {"x": True, "y": False}},
            legend={"show": False}, padding=(4, 12, 0, 0),
        )  # fmt: skip
