"""Axes that make one tick where matplotlib makes dozens, and draw all ticks with it: the same drawing.

matplotlib makes three lines and two texts for every tick and copies their looks; that took half of the time of a
report's figures. Here grid and ticks of an axis are one line each, with gaps, and one text moves from label to label.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis, Tick, XAxis, YAxis
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

ROUNDING = 1e-10
"""Of an axis: a tick so little beyond its end is drawn, as by matplotlib."""


class _Light(Axis):
    """An axis that keeps what its ticks should look like, and makes none before somebody asks for one."""

    light = False
    """whether it draws itself lightly, what `lighten` asks for; else as any axis"""

    @contextmanager
    def _no_tick_made(self) -> Iterator[None]:
        """What goes through the lists of ticks finds none, and does not make any for that."""
        absent = [name for name in ("majorTicks", "minorTicks") if name not in vars(self)]
        for name in absent:
            setattr(self, name, [])
        try:
            yield
        finally:
            for name in absent:
                delattr(self, name)

    def set_tick_params(self, which: Any = "major", reset: bool = False, **kwargs: Any) -> None:
        """As of any axis; ticks that are made later look so."""
        if reset:
            super().set_tick_params(which, reset, **kwargs)
            return
        with self._no_tick_made():
            super().set_tick_params(which, reset, **kwargs)

    def set_clip_path(self, path: Any, transform: Any = None) -> None:
        """As of any axis; ticks that are made later are cut so."""
        with self._no_tick_made():
            super().set_clip_path(path, transform)
        self._clipped = path, transform

    def _get_tick(self, major: bool) -> Tick:
        tick: Tick = super()._get_tick(major)  # type: ignore[misc]
        tick.set_clip_path(*self._clipped)
        return tick

    def draw(self, renderer: Any) -> None:
        """Draw; lightly where that was asked for and nothing but the axis' own ticks has to be known."""
        placed = not getattr(self, "_autolabelpos", True) or not self.label.get_text()
        simple = self.light and placed and isinstance(self.get_minor_locator(), NullLocator)
        bare = not simple or isinstance(self.get_major_locator(), NullLocator)
        places: Any = [] if bare else self.get_majorticklocs()
        labels = self.get_major_formatter().format_ticks(places) if simple else []
        if not simple or self.get_major_formatter().get_offset():
            super().draw(renderer)
            return
        if not self.get_visible():
            return
        renderer.open_group("matplotlib.axis", gid=self.get_gid())
        transform = self.get_transform()
        low, high = sorted(transform.transform(sorted(self.get_view_interval())))
        beyond = ROUNDING * (high - low)
        at = np.asarray(places, dtype=np.float64)
        seen = transform.transform(at)
        seen = (seen >= low - beyond) & (seen <= high + beyond)
        if seen.any():
            kept = [label for label, is_seen in zip(labels, seen, strict=True) if is_seen]
            self._draw_ticks(renderer, self.get_major_ticks(1)[0], at[seen], kept)
        self.label.draw(renderer)
        renderer.close_group("matplotlib.axis")
        self.stale = False

    def _draw_ticks(self, renderer: Any, tick: Tick, places: np.ndarray, labels: list[str]) -> None:
        across = isinstance(self, XAxis)
        if tick.gridline.get_visible():
            along, between = np.repeat(places, 3), np.tile([0.0, 1.0, np.nan], len(places))
            tick.gridline.set_data(*((along, between) if across else (between, along)))
            tick.gridline.draw(renderer)
        for line, side in ((tick.tick1line, 0.0), (tick.tick2line, 1.0)):
            if line.get_visible() and line.get_markersize():
                edge = np.full(len(places), side)
                line.set_data(*((places, edge) if across else (edge, places)))
                line.draw(renderer)
        for text in (tick.label1, tick.label2):
            if text.get_visible():
                for place, label in zip(places, labels, strict=True):
                    (text.set_x if across else text.set_y)(place)
                    text.set_text(label)
                    text.draw(renderer)


class _LightX(_Light, XAxis):
    pass


class _LightY(_Light, YAxis):
    pass


class LightAxes(Axes):
    """Axes with light axes: what `Figure.add_axes` takes as ``axes_class``."""

    def _init_axis(self) -> None:
        self.xaxis, self.yaxis = _LightX(self, clear=False), _LightY(self, clear=False)
        for names, axis in ((("bottom", "top"), self.xaxis), (("left", "right"), self.yaxis)):
            for name in names:
                self.spines[name].register_axis(axis)


def lighten(figure: Figure) -> None:
    """Let the light axes of a finished figure draw themselves so; without this they draw as any others do."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if isinstance(axis, _Light):
                axis.light = True
