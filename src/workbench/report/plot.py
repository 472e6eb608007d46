"""A figure of a report: how to draw it, and the words that stand for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from matplotlib.figure import Figure, FigureBase

from workbench.report.svg import new_figure, svg_of


@dataclass(frozen=True)
class Plot:
    """A figure: the file-safe key, its size in inches, how to draw it, an alternative text and a caption."""

    key: str
    size: tuple[float, float]
    draw: Callable[[FigureBase], None] = field(repr=False)
    """draws into a whole figure or a part of a page"""
    alt: str
    caption: str
    case: str = ""
    """anchor of the case whose time slider moves a marker through it"""
    frames: str = ""
    """JSON of the positions that the page's script animates"""
    declared: str = ""
    """of a figure that the campaign asks for: its record, JSON"""

    @cached_property
    def svg(self) -> str:
        """The drawing, made when it is first asked for; inside the style that is set then."""
        return self.drawn(self.size)

    def drawn(self, size: tuple[float, float]) -> str:
        """The drawing at another size, inches; letters stay as large as the style has them."""
        figure = new_figure(*size)
        self.draw(figure)
        return svg_of(figure, self.key)


def figure_of(plots: Sequence[Plot]) -> Figure:
    """Draw some plots below each other into one figure, which a notebook shows and ``savefig`` writes."""
    figure = Figure(figsize=(max(plot.size[0] for plot in plots), sum(plot.size[1] for plot in plots)))
    parts = figure.subfigures(len(plots), 1, height_ratios=[plot.size[1] for plot in plots], squeeze=False)
    for plot, part in zip(plots, parts[:, 0], strict=True):
        plot.draw(part)
    return figure
