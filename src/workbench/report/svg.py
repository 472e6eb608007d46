"""Figures as SVG: small, the same bytes everywhere, in the page's colours, and legible for the page's script.

The script reads the panels' scales from the attribute ``data-panels`` and finds curves by their class, so that a
marker, a zoom and the values under the pointer need no second copy of the numbers.
"""

from __future__ import annotations

import io
import json
import re
import warnings
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG, RendererSVG
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, fontManager, get_font
from matplotlib.lines import Line2D
from matplotlib.textpath import text_to_path

from workbench.report.light_axis import lighten
from workbench.report.light_legend import measure_once
from workbench.report.shrink import Shapes, merge_lines, relative_path
from workbench.report.style import THEME

POINTS_PER_INCH = 72.0
Heights = tuple[float, float, float] | tuple[None, None, None]
OWN = "wb-"
"""Identifiers that begin so become classes, for the script to find."""
OVER_TIME = f"{OWN}over-time"
"""Mark of panels whose abscissa is time; `layout.stack` sets it."""

_DECLARATIONS = re.compile(
    r"^.*?(?=<svg)|<metadata>.*?</metadata>\s*|<defs>\s*<style.*?</style>\s*</defs>\s*", re.DOTALL
)
_PATH = re.compile(r' d="([^"]*)"')
_STYLE = re.compile(r' style="([^"]*)"')
_PLACE = re.compile(r'(?<= )(?:x|y|transform)="[^"<>]*"')
_NUMBER = re.compile(r"-?\d+\.\d+")
_UPRIGHT = re.compile(r' transform="rotate\(-?0 [^"]*"')
_FONT = re.compile(r"font-family: [^;\"]*")
_IDENTIFIER = re.compile(r'(?<=<)(\w+)((?: (?!id=)[^<>="]*="[^"<>]*")*) id="([^"<>]*)"')
_REFERENCE = re.compile(r'(url\(#|href="#)([^")]+)')
_GROUP = re.compile(r"<g(?: [^>]*[^>/])?>\n?|</g>\n?")
_SVG_TAG = re.compile(r"<svg[^>]*>")
_PANELS = re.compile(r"data-panels='[^']*'")
_MARKERS = re.compile(
    r'<g( clip-path="[^"]*")?>\n((?:<use [^<>]* class="(p\d+)"/>\n)(?:<use [^<>]* class="\3"/>\n)*)</g>'
)
_BETWEEN = re.compile(r">\n<(?!/?t)")
"""Line ends between elements, except about text."""
_VIEW_BOX = re.compile(r'viewBox="([^"]*)"')


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure, inches, that draws to SVG without a display or pyplot's global state."""
    figure = Figure(figsize=(width, height))
    FigureCanvasSVG(figure)
    return figure


def svg_of(figure: Figure, key: str) -> str:
    """Draw *figure* as the body of an SVG document: no dates, two decimals, identifiers that start with *key*."""
    panels = _tag(figure)
    lighten(figure)
    measure_once(figure)
    buffer = io.StringIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a name in another script: the reader's font has it
        _write(figure, buffer)
    svg = compact(buffer.getvalue(), key)
    if panels:
        told = escape_xml(json.dumps(panels, ensure_ascii=False, separators=(",", ":")))
        told = told.replace("&quot;", '"').replace("'", "&#39;")  # in single quotes: many fewer bytes
        svg = svg.replace("<svg ", f"<svg data-panels='{told}' ", 1)
    return svg


def _write(figure: Figure, buffer: io.StringIO) -> None:
    """As ``savefig`` does, with a renderer that remembers how long words are."""
    dpi, (width, height) = figure.dpi, POINTS_PER_INCH * figure.get_size_inches()
    figure.dpi = POINTS_PER_INCH
    renderer: Any = _renderer(width, height, buffer, image_dpi=dpi, metadata={"Date": None, "Creator": None})
    figure.draw(renderer)
    renderer.finalize()


class _Renderer(RendererSVG):
    """Measures each word once for all figures: matplotlib does for each figure anew."""

    def get_text_width_height_descent(self, s: str, prop: FontProperties, ismath: Any) -> tuple[float, float, float]:
        return _measured(s, prop.copy(), ismath)  # a copy: it can be changed, and is a key

    def _get_font_height_metrics(self, prop: FontProperties) -> Heights:
        return _heights(prop.copy())


_renderer: Any = _Renderer
"""matplotlib says no types of it"""


@lru_cache(10_000)
def _measured(text: str, letters: FontProperties, is_math: Any) -> tuple[float, float, float]:
    found: tuple[float, float, float] = text_to_path.get_text_width_height_descent(text, letters, is_math)
    return found


@lru_cache(100)
def _heights(letters: FontProperties) -> Heights:
    """Ascent, descent and gap between lines, points: what `Text` takes from the font's tables, each time anew.

    Of a font without such a table None, three times: then `Text` looks for itself.
    """
    font: Any = get_font(fontManager._find_fonts_by_props(letters))
    table, points = font.get_sfnt_table("OS/2"), letters.get_size_in_points()
    if table is None:
        return None, None, None
    unit = 1 / font.get_sfnt_table("head")["unitsPerEm"] * points
    return table["sTypoAscender"] * unit, -table["sTypoDescender"] * unit, table["sTypoLineGap"] * unit


def _tag(figure: Figure) -> list[dict[str, Any]]:
    """Name the panels over time and their curves, and return where they stand and what their axes measure."""
    width, height = (POINTS_PER_INCH * side for side in figure.get_size_inches())
    panels: list[dict[str, Any]] = []
    for axes in figure.axes:
        if axes.get_gid() != OVER_TIME:
            continue
        number = len(panels)
        axes.set_gid(f"{OWN}panel-{number}")
        axes.xaxis.set_gid(f"{OWN}times-{number}")
        box = axes.get_position()
        panels.append(
            {
                "box": [round(v, 2) for v in _corners(box.x0, box.y0, box.x1, box.y1, width, height)],
                "x": [float(f"{v:.8g}") for v in axes.get_xlim()],
                "y": [float(f"{v:.8g}") for v in axes.get_ylim()],
                "log": axes.get_yscale() == "log",
                "name": axes.get_ylabel(),
                "curves": _tag_curves(axes, number),
            }
        )
    return panels


def _corners(x0: float, y0: float, x1: float, y1: float, width: float, height: float) -> tuple[float, ...]:
    return x0 * width, (1 - y1) * height, x1 * width, (1 - y0) * height


def _tag_curves(axes: Axes, number: int) -> list[str]:
    names: list[str] = []
    for line in axes.lines:
        if _is_curve(line):
            line.set_gid(f"{OWN}curve-{number}-{len(names)}")
            names.append(str(line.get_label()))
    return names


def _is_curve(line: Line2D) -> bool:
    drawn = line.get_linestyle() not in ("None", "none", "", " ")
    return drawn and not str(line.get_label()).startswith("_") and np.size(line.get_xdata()) > 2


def compact(svg: str, key: str) -> str:
    """Strip what matplotlib adds around the drawing, shorten coordinates and make identifiers unique to *key*."""
    svg = _DECLARATIONS.sub("", svg, count=3)
    svg = _PATH.sub(lambda match: f' d="{relative_path(match[1])}"', svg)
    svg = _PLACE.sub(
        lambda match: _NUMBER.sub(lambda number: f"{float(number[0]):.1f}".removesuffix(".0"), match[0]), svg
    )
    svg = _FONT.sub("font-family: sans-serif", svg)
    svg = _UPRIGHT.sub("", svg)
    short: dict[str, str] = {}
    for match in _REFERENCE.finditer(svg):
        short.setdefault(match[2], f"{key}-{len(short)}")

    def identifier(match: re.Match[str]) -> str:
        if match[3].startswith(OWN):
            return f'{match[1]}{match[2]} class="{match[3]}"'
        kept = f' id="{short[match[3]]}"' if match[3] in short else ""
        return f"{match[1]}{match[2]}{kept}"

    svg = _IDENTIFIER.sub(identifier, svg)
    svg = _REFERENCE.sub(lambda match: f"{match[1]}{short[match[2]]}", svg)
    return merge_lines(_without_bare_groups(re.sub(r"\n\s*", "\n", svg)))


def _without_bare_groups(svg: str) -> str:
    """Take away groups that say nothing."""
    kept: list[bool] = []

    def group(match: re.Match[str]) -> str:
        if match[0].startswith("</"):
            return match[0] if kept.pop() else ""
        kept.append(match[0].strip() != "<g>")
        return match[0] if kept[-1] else ""

    return _GROUP.sub(group, svg)


def _styled_once(match: re.Match[str]) -> str:
    """Markers of one curve look alike: their group says how."""
    uses = match[2].replace(f' class="{match[3]}"', "")
    return f'<g{match[1] or ""} class="{match[3]}">\n{uses}</g>'


class StyleSheet:
    """Gathers the styles of all drawings of a page, so that each is written once; gives identifiers short names."""

    def __init__(self) -> None:
        self._names: dict[str, str] = {}
        self._identifiers = 0
        self._shapes = Shapes()

    def shorten(self, svg: str) -> str:
        """Replace every ``style`` attribute by a class, and identifiers by numbers that no other drawing has."""
        svg = svg.replace("xlink:href", "href")
        for name in dict.fromkeys(match[2] for match in _REFERENCE.finditer(svg)):
            self._identifiers += 1
            for before, after in (('id="', '"'), ("url(#", ")"), ('href="#', '"')):
                svg = svg.replace(f"{before}{name}{after}", f"{before}s{self._identifiers}{after}")
        svg = _STYLE.sub(lambda match: f' class="{self._name(match[1])}"', svg)
        return self._shapes.share(_BETWEEN.sub("><", _MARKERS.sub(_styled_once, svg)))

    def _name(self, style: str) -> str:
        return self._names.setdefault(style, f"p{len(self._names)}")

    @property
    def shapes(self) -> str:
        """What several drawings refer to, as a drawing of its own."""
        return self._shapes.drawn

    @property
    def rules(self) -> str:
        """The classes as CSS."""
        return "".join(f".drawing .{name}{{{style}}}\n" for style, name in self._names.items())


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
        panels = _PANELS.search(svg)
        told = f" {panels[0]}" if panels else ""
        tag = f'<svg viewBox="{box}" role="img" aria-label="{text}"{told}>'
    return _SVG_TAG.sub(lambda _: tag, svg, count=1)


def escape_xml(text: str) -> str:
    """Escape *text* for an XML attribute or element, and drop characters that XML does not know."""
    kept = "".join(c for c in text if c in "\t\n" or c >= " ")
    return kept.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace('"', "&quot;")
