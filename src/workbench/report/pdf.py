"""The report as one PDF, set by matplotlib: text and tables, then each case's figures as vector graphics."""

from __future__ import annotations

import io
import textwrap
import warnings
from collections.abc import Sequence

import numpy as np
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure, FigureBase
from matplotlib.lines import Line2D
from PIL import Image

from workbench.report.case_section import CaseView
from workbench.report.cost import cost_table
from workbench.report.load import Run
from workbench.report.plot import Plot
from workbench.report.section import Section
from workbench.report.style import GRID, INK
from workbench.report.svg import new_figure
from workbench.report.sweep.load import SweepRun
from workbench.report.tables import Cell, Table
from workbench.report.verdict_section import changes, circumstances

A4 = (8.27, 11.69)
MARGIN = 0.55
POINTS_PER_INCH = 72.0
LINE = 1.3
"""Distance of lines, in letter heights."""
LETTER = 0.56
"""Mean width of a letter, in letter heights."""
BODY, SMALL_PRINT, TABLE_PRINT = 9.0, 7.5, 6.4
NARROWEST = 6
"""Letters that a column keeps when a table is too wide for the page."""
CHANGED = (
    "Another robot than the one that the campaign is about. Claims about that one are not judged where this concerns"
    " them."
)
FULL_WIDTH_FROM = 7.0
"""inches: figures designed wider than this take the whole width of the page"""


class Pages:
    """A4 pages that fill from the top."""

    def __init__(self, sink: PdfPages) -> None:
        self._sink = sink
        self._page: Figure | None = None
        self._y = 0.0

    @property
    def width(self) -> float:
        """Inches between the margins."""
        return A4[0] - 2 * MARGIN

    def finish(self) -> None:
        """Write the page that is being filled."""
        if self._page is not None:
            self._sink.savefig(self._page)  # type: ignore[no-untyped-call]
            self._page = None

    def room(self, height: float) -> Figure:
        """Return a page with *height* inches left."""
        if self._page is None or self._y + height > A4[1] - MARGIN:
            self.finish()
            self._page, self._y = new_figure(*A4), MARGIN
        return self._page

    def lines(self, text: str, size: float, indent: float = 0.0, bold: bool = False, after: float = 0.08) -> None:
        """Set a paragraph."""
        letters = int((self.width - indent) * POINTS_PER_INCH / (LETTER * size))
        for line in textwrap.wrap(text, letters) or [""]:
            step = size * LINE / POINTS_PER_INCH
            self._put(self.room(step), MARGIN + indent, line, size, bold)
            self._y += step
        self._y += after

    def table(self, table: Table) -> None:
        """Set a table between its two sentences; its head stands on every page that it reaches."""
        self.room(1.2)
        self.lines(table.shows, BODY, bold=True)
        widths = _column_widths(table, int(self.width * POINTS_PER_INCH / (LETTER * TABLE_PRINT)))
        head = [column.title for column in table.columns]
        self._row(head, widths, table, bold=True)
        for row in table.rows:
            texts = [_shown(cell) for cell in row]
            before = self._page
            self.room(self._height(texts, widths))
            if self._page is not before:
                self._row(head, widths, table, bold=True)
            self._row(texts, widths, table)
        self._y += 0.05
        self.lines(f"How to read it: {table.reading}", SMALL_PRINT, after=0.2)

    def plots(self, plots: Sequence[Plot]) -> None:
        """Set figures, two in a row, wide ones alone, each above its caption."""
        rows: list[list[Plot]] = []
        for plot in plots:
            alone = plot.size[0] > FULL_WIDTH_FROM
            if alone or not rows or len(rows[-1]) == 2 or rows[-1][0].size[0] > FULL_WIDTH_FROM:
                rows.append([plot])
            else:
                rows[-1].append(plot)
        for row in rows:
            self._plot_row(row)

    def picture(self, content: bytes, caption: str) -> None:
        """Set a picture of pixels, half as wide as the page."""
        with Image.open(io.BytesIO(content)) as image:
            pixels = np.asarray(image.convert("RGB"))
        width = self.width / 2
        height = width * pixels.shape[0] / pixels.shape[1]
        page = self.room(height + 0.3)
        axes = page.add_axes((MARGIN / A4[0], 1 - (self._y + height) / A4[1], width / A4[0], height / A4[1]))
        axes.imshow(pixels, aspect="auto")
        axes.set_axis_off()
        self._put(page, MARGIN, caption, SMALL_PRINT, below=height + 0.05)
        self._y += height + 0.35

    def _plot_row(self, row: list[Plot]) -> None:
        alone = row[0].size[0] > FULL_WIDTH_FROM
        width = self.width if alone else self.width / 2
        height = max(width * plot.size[1] / plot.size[0] for plot in row)
        letters = int((width - 0.15) * POINTS_PER_INCH / (LETTER * SMALL_PRINT))
        captions = [textwrap.wrap(plot.caption, letters) for plot in row]
        step = SMALL_PRINT * LINE / POINTS_PER_INCH
        page = self.room(height + max(map(len, captions)) * step + 0.15)
        for number, (plot, caption) in enumerate(zip(row, captions, strict=True)):
            left = MARGIN + number * width
            plot.draw(_part(page, left, self._y, width - (0.0 if alone else 0.1), height))
            for line, text in enumerate(caption):
                self._put(page, left, text, SMALL_PRINT, below=height + line * step)
        self._y += height + max(map(len, captions)) * step + 0.15

    def _row(self, texts: Sequence[str], widths: Sequence[int], table: Table, bold: bool = False) -> None:
        height = self._height(texts, widths)
        page = self.room(height)
        left = MARGIN
        letter = LETTER * TABLE_PRINT / POINTS_PER_INCH
        for text, letters, column in zip(texts, widths, table.columns, strict=True):
            for number, line in enumerate(_wrapped(text, letters)):
                at = left + (letters - 2) * letter if column.numeric else left
                below = 0.045 + number * TABLE_PRINT * LINE / POINTS_PER_INCH
                self._put(page, at, line, TABLE_PRINT, bold, below, right=column.numeric)
            left += letters * letter
        self._y += height
        self._rule(page, INK if bold else GRID)

    def _rule(self, page: Figure, color: str) -> None:
        y = 1 - self._y / A4[1]
        right = (A4[0] - MARGIN) / A4[0]
        page.add_artist(Line2D([MARGIN / A4[0], right], [y, y], color=color, linewidth=0.4))

    def _height(self, texts: Sequence[str], widths: Sequence[int]) -> float:
        lines = max(len(_wrapped(text, letters)) for text, letters in zip(texts, widths, strict=True))
        return lines * TABLE_PRINT * LINE / POINTS_PER_INCH + 0.07

    def _put(
        self,
        page: Figure,
        x: float,
        text: str,
        size: float,
        bold: bool = False,
        below: float = 0.0,
        right: bool = False,
    ) -> None:
        page.text(
            x / A4[0],
            1 - (self._y + below) / A4[1],
            text,
            fontsize=size,
            fontweight="bold" if bold else "normal",
            ha="right" if right else "left",
            va="top",
        )


def report_pdf(run: Run | SweepRun, sections: Sequence[Section]) -> bytes:
    """Return the whole report as PDF; the same results give the same bytes."""
    manifest = run.manifest
    title = manifest.title or manifest.campaign
    buffer = io.BytesIO()
    told = {"Title": f"{title}: error report", "Creator": "workbench", "Producer": None, "CreationDate": None}
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a name in another script: this font has it not
        with PdfPages(buffer, metadata=told) as sink:
            pages = Pages(sink)
            pages.lines(f"Error report of the campaign {manifest.campaign}", SMALL_PRINT, after=0.02)
            pages.lines(title, 15.0, bold=True)
            pages.lines(manifest.description, BODY, after=0.1)
            pages.lines(" ".join(circumstances(manifest)), SMALL_PRINT, after=0.2)
            if said := changes(manifest):
                pages.lines(CHANGED, BODY, bold=True)
                for line in said:
                    pages.lines(f"• {line}", BODY)
            if costs := cost_table(manifest):
                pages.table(costs)
            for section in sections:
                _set_section(pages, section)
            pages.finish()
    return buffer.getvalue()


def figure_pdf(plot: Plot) -> bytes:
    """Return one figure as a PDF of its own size, for a paper."""
    figure = new_figure(*plot.size)
    plot.draw(figure)
    buffer = io.BytesIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")
        figure.savefig(buffer, format="pdf", metadata={"Title": plot.caption, "Producer": None, "CreationDate": None})
    return buffer.getvalue()


def all_tables(sections: Sequence[Section]) -> list[Table]:
    """Return every table of the report, those of the cases included."""
    tables = [table for section in sections for table in section.context.get("tables", ())]
    views = [view for section in sections for view in section.context.get("views", ()) if isinstance(view, CaseView)]
    return tables + [table for view in views for table in view.tables]


def _set_section(pages: Pages, section: Section) -> None:
    context = section.context
    pages.room(1.5)
    pages.lines(section.title, 12.5, bold=True, after=0.12)
    if "sentence" in context:
        status = context["status"]
        pages.lines(f"{status.symbol} {status.text}: {context['sentence']}", BODY + 1, bold=True, after=0.2)
    for text in context.get("paragraphs", ()):
        pages.lines(text, BODY, after=0.15)
    if context.get("command"):
        pages.lines(context["command"], BODY, after=0.15)
    for table in context.get("tables", ()):
        pages.table(table)
    for point in context.get("points", ()):
        pages.lines(f"• {point}", BODY)
    views = context.get("views", ())
    for view in views:
        if isinstance(view, CaseView):
            _set_case(pages, view)
    if not any(isinstance(view, CaseView) for view in views):
        pages.plots(section.plots)


def _set_case(pages: Pages, view: CaseView) -> None:
    pages.room(2.5)
    pages.lines(f"{view.heading} ({view.name}): {view.status.symbol} {view.status.text}", 11.0, bold=True)
    for text in (view.record.description, view.record.message, *view.record.warnings):
        if text:
            pages.lines(text, BODY)
    pages.lines("; ".join(f"{what.lower()} {value}" for what, value in view.facts), BODY, after=0.15)
    pages.plots(view.plots)
    if view.film is not None and view.film.still:
        pages.picture(view.film.still, "The robot's model as MuJoCo renders it, at the first moment of this case")
    for table in view.tables:
        pages.table(table)


def _part(page: Figure, left: float, top: float, width: float, height: float) -> FigureBase:
    """Return a part of the page, inches from its upper left corner, to draw a whole figure into."""
    below = A4[1] - top - height
    grid = page.add_gridspec(
        3, 3, width_ratios=[left, width, A4[0] - left - width], height_ratios=[top, height, below], wspace=0, hspace=0
    )
    part = page.add_subfigure(grid[1, 1])
    part.set_facecolor("none")
    return part


def _shown(cell: Cell) -> str:
    return f"{cell.status.symbol} {cell.status.text}".strip() if cell.status else cell.text


def _wrapped(text: str, letters: int) -> list[str]:
    return textwrap.wrap(text, max(letters - 2, 1)) or [""]


def _column_widths(table: Table, letters: int) -> list[int]:
    """Share a line's letters among the columns: what they need, or as much of it as there is."""
    needs = []
    for number, column in enumerate(table.columns):
        texts = [column.title if len(table.rows) < 1 else "", *(_shown(row[number]) for row in table.rows)]
        longest = max(map(len, texts))
        needs.append(max(longest, max(map(len, column.title.split()), default=0)) + 3)
    while sum(needs) > letters:
        widest = max(range(len(needs)), key=needs.__getitem__)
        if needs[widest] <= NARROWEST:
            break
        needs[widest] -= 1
    return needs
