"""The same drawing in fewer bytes: one path for all lines of a grid and all ticks of an axis, shapes shared by a page.

None of this moves anything that is seen by more than a twentieth of a point.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache

from workbench.report.style import GRID

_LONG_NUMBER = re.compile(r"-?\d+\.\d{3,}")
_GROUP = re.compile(r"(</?g(?: [^<>]*)?>\n?)")
_GRID_LINE = re.compile(rf'<path d="([^"]*)"((?: clip-path="[^"]*")?) (style="[^"]*stroke: {GRID}[^"]*")/>\n?')
_TICK = re.compile(r'<defs>\s*<path id="([^"]*)" d="M0 0l(-?[\d.]+ ?-?[\d.]+)" style="[^"]*"/>\s*</defs>\n?')
_USE = re.compile(r'<use (?:xlink:)?href="#([^"]*)" x="([^"]*)" y="([^"]*)" (style="[^"]*")/>\n?')
_SHAPE = re.compile(
    r'<defs>\s*(?:<path id="([^"]*)" ([^<>]*)/>|<clipPath id="([^"]*)">\s*(<rect [^<>]*/>)\s*</clipPath>)\s*</defs>\n?'
)
LONGEST_SHAPE = 800
"""Letters of a shape that drawings share."""


def relative_path(path: str) -> str:
    """Write a path in tenths of a point, with lines as steps from point to point: half of the bytes.

    The curve that matplotlib draws may leave the data by `path.simplify_threshold`, four of these tenths; steps lead
    from rounded place to rounded place, so that they do not add up to an error.
    """
    closed = path.rstrip().endswith("z")
    words = path.rstrip().removesuffix("z").split()
    if len(words) % 3 or not set(words[::3]) <= {"M", "L"}:  # curves, of markers: short anyway
        return _LONG_NUMBER.sub(lambda number: f"{float(number[0]):.2f}", path.replace("\n", ""))
    pieces: list[str] = []
    x = y = 0
    before = ""
    for kind, first, second in zip(words[::3], words[1::3], words[2::3], strict=True):
        to_x, to_y = round(10 * float(first)), round(10 * float(second))
        if kind == "M":
            pieces.append("M" + _pair(to_x, to_y))
            before = "M"
        elif (to_x, to_y) != (x, y):
            step = _pair(to_x - x, to_y - y)
            pieces.append(step if before == "l" and step[0] == "-" else f" {step}" if before == "l" else f"l{step}")
            before = "l"
        x, y = to_x, to_y
    return "".join(pieces) + ("z" if closed else "")


def _pair(x: int, y: int) -> str:
    first, second = tenths(x), tenths(y)
    return first + second if second[0] == "-" else f"{first} {second}"


@lru_cache(10_000)
def tenths(value: int) -> str:
    """Write a number of tenths without what is not needed: ``-.4``."""
    whole, tenth = divmod(abs(value), 10)
    sign = "-" if value < 0 else ""
    return f"{sign}{whole or ''}.{tenth}" if tenth else f"{sign}{whole}"


def merge_lines(svg: str) -> str:
    """Make one path of the grid's lines, and one of the ticks, of each axis."""
    ticks = {match[1]: match[2] for match in _TICK.finditer(svg)}  # panels share them
    svg = "".join(part if part.startswith(("<g", "</g")) else _merged(part, ticks) for part in _GROUP.split(svg))
    return _TICK.sub(lambda match: match[0] if f'href="#{match[1]}"' in svg else "", svg)


def _merged(part: str, ticks: Mapping[str, str]) -> str:
    if "<path" not in part and "<use" not in part:
        return part
    for clip, style in dict.fromkeys((match[2], match[3]) for match in _GRID_LINE.finditer(part)):
        lines = [match for match in _GRID_LINE.finditer(part) if (match[2], match[3]) == (clip, style)]
        whole = f'<path d="{"".join(match[1] for match in lines)}"{clip} {style}/>\n'
        for match in lines[1:]:
            part = part.replace(match[0], "", 1)
        part = part.replace(lines[0][0], whole, 1)
    for found in dict.fromkeys((match[1], match[4]) for match in _USE.finditer(part) if match[1] in ticks):
        uses = [match for match in _USE.finditer(part) if (match[1], match[4]) == found]
        drawn = "".join(
            f"M{_pair(round(10 * float(at[2])), round(10 * float(at[3])))}l{ticks[found[0]]}" for at in uses
        )
        for match in uses[1:]:
            part = part.replace(match[0], "", 1)
        part = part.replace(uses[0][0], f'<path d="{drawn}" {found[1]}/>\n', 1)
    return part


class Shapes:
    """Gathers markers and clipping frames of all drawings of a page, so that each is written once."""

    def __init__(self) -> None:
        self._names: dict[str, str] = {}

    def share(self, svg: str) -> str:
        """Take the shapes out of a drawing, and let it refer to the page's."""
        renamed: dict[str, str] = {}

        def taken(match: re.Match[str]) -> str:
            if len(match[0]) > LONGEST_SHAPE:
                return match[0]  # an area: no other drawing has the same
            kind, body = ("path", match[2]) if match[1] else ("clipPath", match[4])
            renamed[match[1] or match[3]] = self._names.setdefault(f"{kind} {body}", f"m{len(self._names)}")
            return ""

        svg = _SHAPE.sub(taken, svg)
        for old, new in renamed.items():
            for before, after in (("url(#", ")"), ('href="#', '"')):
                svg = svg.replace(f"{before}{old}{after}", f"{before}{new}{after}")
        return svg

    @property
    def drawn(self) -> str:
        """The shapes as a drawing that shows nothing itself; empty without any."""
        if not self._names:
            return ""
        shapes = []
        for told, name in self._names.items():
            kind, _, body = told.partition(" ")
            shapes.append(
                f'<path id="{name}" {body}/>' if kind == "path" else f'<clipPath id="{name}">{body}</clipPath>'
            )
        return (
            '<svg class="shapes" width="0" height="0" aria-hidden="true"><defs>' + "\n".join(shapes) + "</defs></svg>"
        )
