"""Legends whose boxes are measured once in a drawing: the same drawing.

A legend is boxes in boxes, five deep. matplotlib has each box measure all that it holds, for itself and for each box
around it, which took a tenth of the time of a report's figures.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.offsetbox import PackerBase


def measure_once(figure: Figure) -> None:
    """Let the legends of a finished figure remember the sizes of their boxes, for the renderer that asks."""
    for holder in (figure, *figure.axes):
        for legend in holder.get_children():
            if isinstance(legend, Legend):
                for part in legend.get_children():
                    _remember(part)


def _remember(box: Any) -> None:
    if isinstance(box, PackerBase):
        vars(box)["_get_bbox_and_child_offsets"] = lru_cache(1)(box._get_bbox_and_child_offsets)  # type: ignore[attr-defined]
        for part in box.get_children():
            _remember(part)
