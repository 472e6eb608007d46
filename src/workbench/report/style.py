"""How figures look: one colour-blind-safe palette, one matplotlib style, and SVG made small, stable and theme-able."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

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
    "path.simplify_threshold": 0.25,
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
}

_DECLARATIONS = re.compile(
    r"^.*?(?=<svg)|<metadata>.*?</metadata>\s*|<defs>\s*<style.*?</style>\s*</defs>\s*", re.DOTALL
)
_GEOMETRY = re.compile(r'(?<= )(?:d|x|y|transform)="[^"<>]*"')
_LONG_NUMBER = re.compile(r"-?\d+\.\d{3,}")
_FONT = re.compile(r"font-family: [^;\"]*")
_IDENTIFIER = re.compile(r'(?<=<)(\w+)([^<>]*?) id="([^"<>]*)"')
_REFERENCE = re.compile(r'(url\(#|href="#)([^")]+)')
_SVG_TAG = re.compile(r"<svg[^>]*>")
_VIEW_BOX = re.compile(r'viewBox="([^"]*)"')


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure, inches, that draws to SVG without a display or pyplot's global state."""
    figure = Figure(figsize=(width, height))
    FigureCanvasSVG(figure)
    return figure


@contextmanager
def report_style() -> Iterator[None]:
    """Give the figures drawn inside the report's style, whatever the user's matplotlibrc says."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(STYLE)
        yield


def svg_of(figure: Figure, key: str) -> str:
    """Draw *figure* as the body of an SVG document: no dates, two decimals, identifiers that start with *key*."""
    buffer = io.StringIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a name in another script: the reader's font has it
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return compact(buffer.getvalue(), key)


def compact(svg: str, key: str) -> str:
    """Strip what matplotlib adds around the drawing, round coordinates and make identifiers unique to *key*."""
    svg = _DECLARATIONS.sub("", svg)
    svg = _GEOMETRY.sub(
        lambda match: _LONG_NUMBER.sub(lambda number: f"{float(number[0]):.2f}", match[0].replace("\n", "")), svg
    )
    svg = _FONT.sub("font-family: sans-serif", svg)
    used = {match[2] for match in _REFERENCE.finditer(svg)}

    def identifier(match: re.Match[str]) -> str:
        kept = f' id="{key}-{match[3]}"' if match[3] in used else ""
        return f"{match[1]}{match[2]}{kept}"

    svg = _IDENTIFIER.sub(identifier, svg)
    svg = _REFERENCE.sub(lambda match: f"{match[1]}{key}-{match[2]}", svg)
    return re.sub(r"\n\s*", "\n", svg)


def standalone(svg: str, alt: str) -> str:
    """Return a complete SVG file with a white background and *alt* as its title."""
    return '<?xml version="1.0" encoding="utf-8"?>\n' + _open(svg, alt, stand_alone=True)


def inline(svg: str, alt: str) -> str:
    """Return the SVG for use inside an HTML page: colours are CSS variables, the size follows the page."""
    for colour, variable in THEME.items():
        svg = svg.replace(f": {colour}", f": {variable}")
    return _open(svg, alt, stand_alone=False)


def _open(svg: str, alt: str, stand_alone: bool) -> str:
    found = _VIEW_BOX.search(svg)
    box = found[1] if found else "0 0 1 1"
    text = escape_xml(alt)
    if stand_alone:
        width, height = box.split()[2:]
        names = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
        tag = f'<svg {names} width="{width}pt" height="{height}pt" viewBox="{box}" role="img"><title>{text}</title>'
    else:
        tag = f'<svg viewBox="{box}" role="img" aria-label="{text}">'
    return _SVG_TAG.sub(lambda _: tag, svg, count=1)


def escape_xml(text: str) -> str:
    """Escape *text* for an XML attribute or element, and drop characters that XML does not know."""
    kept = "".join(c for c in text if c in "\t\n" or c >= " ")
    return kept.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace('"', "&quot;")
