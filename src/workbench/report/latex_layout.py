"""How wide the columns of a LaTeX table are, and into how many parts it is cut, so that it fits the page it goes on.

Widths are measured with the letters that LaTeX prints, Computer Modern, of which matplotlib brings a copy.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import matplotlib as mpl
from PIL import ImageFont

from workbench.report.latex_text import POWER, parts_of

NARROW = 226.0
"""pt: a column of a two-column article (229.5), with some air."""
WIDE = 341.0
"""pt: the text of a one-column article (345), with some air."""
LETTERS = 8.0
"""pt: size of a table's letters, `footnotesize` of a document in 10 pt."""
GAP = 6.0
"""pt between columns."""
LINE = 9.5
TALLEST = 400.0
"""pt: rows of one part; with caption and reading it fits a page."""
FINE = 100.0
"""Letters are measured at this size and scaled."""
SLACK, AIR = 1.03, 1.0
"""What kerning and accents may add to the plain letters: a factor, and pt."""
BOLD = 1.18
"""Bold letters over others."""
SIGNS = frozenset("→×±≠≈≤≥−·✓✗Δτ≡°πωφα")
SIGN = 10.5
"""pt: the widest of them with the air of an operator."""
POWER_SIGN = 14.5
"""pt: the sign of a power of ten and the minus in its exponent."""


@cache
def _font() -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(str(Path(mpl.get_data_path()) / "fonts" / "ttf" / "cmr10.ttf"), FINE)


@cache
def width_of(text: str, bold: bool = False) -> float:
    """Width of a piece of text on one line, pt; signs and powers of ten as mathematics."""
    # a power's exponent is small, and around its sign stands some air: 1.2e-13 is as wide as 1.2 10 9 and a sign
    plain, powers = POWER.subn(lambda match: f"{match[1]}1099", text)
    signs = sum(plain.count(sign) for sign in SIGNS)
    measured = "".join(c for c in plain if c not in SIGNS).replace("_", "m")  # this copy has no underscore
    letters = _font().getlength(measured) * LETTERS / FINE
    return SLACK * (letters * (BOLD if bold else 1.0) + SIGN * signs + POWER_SIGN * powers) + AIR


def word_width(text: str, bold: bool = False) -> float:
    """Width of the longest piece that cannot be broken, pt."""
    pieces = [piece for word in text.split() for part in parts_of(word) for piece in _hyphens(part)]
    return max((width_of(piece, bold) for piece in pieces), default=0.0)


def _hyphens(part: str) -> list[str]:
    pieces = part.split("-")
    return [*(f"{piece}-" for piece in pieces[:-1]), pieces[-1]]


@dataclass(frozen=True)
class Content:
    """What one column holds, as plain text."""

    head: str
    cells: tuple[str, ...]
    numeric: bool
    bold: tuple[bool, ...]

    @property
    def natural(self) -> float:
        """Width on which nothing is broken."""
        cells = (width_of(cell, bold) for cell, bold in zip(self.cells, self.bold, strict=True))
        return max([width_of(self.head), *cells])

    @property
    def least(self) -> float:
        """Width on which everything that can be broken is; numbers stay whole."""
        cells = (
            width_of(cell, bold) if self.numeric and len(cell) <= WHOLE_NUMBER else word_width(cell, bold)
            for cell, bold in zip(self.cells, self.bold, strict=True)
        )
        return max([word_width(self.head), *cells])


WHOLE_NUMBER = 14
"""Letters up to which a number with its unit is not broken."""


@dataclass(frozen=True)
class Part:
    """Columns that stand beside each other: their numbers, and widths in pt; None where nothing is broken."""

    columns: tuple[int, ...]
    widths: tuple[float | None, ...]


def lay_out(contents: Sequence[Content], keys: int) -> tuple[list[Part], bool]:
    """Cut a table into parts that fit, each with its first *keys* columns in front.

    Returns
    -------
    parts, wide
        *wide* tells whether they need the width of a one-column article's text, or of both columns.
    """
    numbers = tuple(range(len(contents)))
    for room, wide in ((NARROW, False), (WIDE, True)):
        found = _fit([contents[i] for i in numbers], room)
        if found is not None:
            return [Part(numbers, found)], wide
    parts, front = [], numbers[:keys]
    rest = list(numbers[keys:])
    while rest:
        taken = 1
        while taken < len(rest) and _fit([contents[i] for i in (*front, *rest[: taken + 1])], WIDE) is not None:
            taken += 1
        columns = (*front, *rest[:taken])
        found = _fit([contents[i] for i in columns], WIDE)
        if found is None:  # one column is too wide: all of them are broken as they can be
            room = WIDE - GAP * (len(columns) - 1)
            least = [contents[i].least for i in columns]
            found = tuple(one * room / sum(least) for one in least)
        parts.append(Part(columns, found))
        rest = rest[taken:]
    return parts, True


def _fit(contents: Sequence[Content], room: float) -> tuple[float | None, ...] | None:
    """Widths of columns that fit into *room*, None for such as need no break; None where nothing fits."""
    room -= GAP * (len(contents) - 1)
    natural, least = [one.natural for one in contents], [one.least for one in contents]
    if sum(natural) <= room:
        return (None,) * len(contents)
    if sum(least) > room:
        return None
    # texts share what is left beyond their longest words; more for longer ones, but not all to the longest
    wish = [math.sqrt(max(n - m, 0.0) * max(n, 1.0)) for n, m in zip(natural, least, strict=True)]
    widths = list(least)
    left = room - sum(least)
    open_ = [i for i in range(len(contents)) if natural[i] > least[i]]
    while left > 1e-6 and open_:
        share = left / sum(wish[i] for i in open_)
        full = [i for i in open_ if widths[i] + share * wish[i] >= natural[i]]
        if not full:
            for i in open_:
                widths[i] += share * wish[i]
            break
        for i in full:
            left -= natural[i] - widths[i]
            widths[i] = natural[i]
        open_ = [i for i in open_ if i not in full]
    return tuple(None if width >= whole else width for width, whole in zip(widths, natural, strict=True))


def heights(contents: Sequence[Content], part: Part, rows: int) -> list[float]:
    """Estimate how tall each row of a part is, pt."""
    found = []
    for row in range(rows):
        lines = 1
        for number, width in zip(part.columns, part.widths, strict=True):
            if width is not None:
                one = contents[number]
                lines = max(lines, math.ceil(1.15 * width_of(one.cells[row], one.bold[row]) / width))
        found.append(LINE * lines)
    return found


def chunks(sizes: Sequence[float]) -> list[range]:
    """Cut rows into stretches that fit a page."""
    found, start, height = [], 0, 0.0
    for row, size in enumerate(sizes):
        if height + size > TALLEST and row > start:
            found.append(range(start, row))
            start, height = row, 0.0
        height += size
    return [*found, range(start, len(sizes))]
