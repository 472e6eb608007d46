"""How figures look: one colour-blind-safe palette, one style for the page and one for print in a paper."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl

PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
"""Okabe and Ito's colours in an order that keeps neighbours apart."""
INK = "#222222"
GRID = "#dddddd"
ALARM = "#b3261e"
BACKGROUND = "#ffffff"

THEME = {
    **{colour: f"var(--series-{index})" for index, colour in enumerate(PALETTE)},
    INK: "var(--plot-ink)",
    GRID: "var(--plot-grid)",
    ALARM: "var(--plot-alarm)",
    BACKGROUND: "var(--plot-background)",
}
"""Each drawn colour and the CSS variable that stands for it inside the page, so that figures follow dark and light."""

STYLE: Any = {
    "svg.fonttype": "none",  # text stays text: small, searchable, the same bytes on every machine
    "svg.hashsalt": "workbench",
    "path.simplify": True,
    "path.simplify_threshold": 0.4,
    "font.family": "sans-serif",
    "font.size": 8.5,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.facecolor": BACKGROUND,
    "figure.facecolor": BACKGROUND,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.use_mathtext": False,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "text.color": INK,
    "text.parse_math": False,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.minor.visible": False,
    "ytick.minor.visible": False,
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "legend.handlelength": 2.6,
    "legend.columnspacing": 1.2,
}

PAPER: Any = STYLE | {
    "font.family": ["serif", "sans-serif"],  # the second has the ticks and crosses
    "axes.grid": False,
    "axes.spines.top": True,
    "axes.spines.right": True,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "lines.linewidth": 1.0,
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 7.0,
    "legend.handlelength": 1.7,
    "legend.columnspacing": 0.8,
}
"""For a column of a paper: serif letters of 8 pt as in tables of a 10 pt article, a closed frame, no grid."""

STYLES = {"page": STYLE, "paper": PAPER}

PAPERS = {"a4": "a4", "letter": "us-letter"}
"""Sizes of a PDF's pages, and what Typst calls them."""


@contextmanager
def figure_style(name: str = "page") -> Iterator[None]:
    """Give the figures drawn inside one of `STYLES`, whatever the user's matplotlibrc says."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(STYLES[name])
        yield
