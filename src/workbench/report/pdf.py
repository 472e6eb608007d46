"""The report as one PDF, and each figure as one: set by Typst from the same sections, tables and drawings as the page.

The text travels as JSON and the drawings as SVG files beside it, so nothing that a campaign names is read as markup.
"""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import matplotlib as mpl
import typst
from PIL import Image

from workbench.campaign.changed import ANOTHER, NOT_JUDGED
from workbench.errors import OutputError
from workbench.records import reason
from workbench.report.case_section import CaseView
from workbench.report.control.film import Shot
from workbench.report.control.load import StudyRun
from workbench.report.cost import cost_table
from workbench.report.load import Run
from workbench.report.pictures import MOST_PIXELS
from workbench.report.plot import Plot
from workbench.report.section import Section
from workbench.report.style import PAPERS
from workbench.report.svg import standalone
from workbench.report.sweep.load import SweepRun
from workbench.report.tables import Cell, Status, Table
from workbench.report.verdict_section import changes, circumstances

FULL_WIDTH_FROM = 7.0
"""inches: figures designed wider than this take the whole width of the page"""
COLUMN, TEXT = 229.0, 344.0
"""TeX points: a column of a two-column article, and the text of a one-column article."""
POINTS = 72.27
"""TeX's points in an inch."""
LEAST_HEIGHT = 0.8
"""Of the height on a page: panels above each other need their room."""
LONG = 36
"""Letters from which on a column of a table breaks its lines."""
FONTS = {"page": "DejaVu Sans", "paper": "DejaVu Serif"}
"""Letters of drawings, by style: those that matplotlib brings and has measured them with."""
FIGURE = """#set document(date: none)
#set page(width: auto, height: auto, margin: 0pt)
#image("figure.svg")
"""

Block = dict[str, Any]


def report_pdf(
    run: Run | SweepRun | StudyRun, sections: Sequence[Section], style: str = "page", paper: str = "a4"
) -> bytes:
    """Return the whole report as PDF, on *paper* (a key of `PAPERS`); the same results give the same bytes."""
    manifest = run.manifest
    parts: dict[str, str] = {}
    costs = cost_table(manifest)
    document = {
        "title": manifest.title or manifest.campaign,
        "campaign": manifest.campaign,
        "description": manifest.description,
        "run": " ".join(circumstances(manifest)),
        "changed": f"{ANOTHER}. {NOT_JUDGED}",
        "changes": list(changes(manifest)),
        "paper": PAPERS[paper],
        "costs": _table(costs) if costs else None,
        "sections": [
            {"title": section.title, "key": section.key, "blocks": list(_blocks(section, style, parts))}
            for section in sections
        ],
    }
    template = files("workbench.report").joinpath("templates", "report.typ").read_text("utf-8")
    return _compiled(template, parts | {"report.json": json.dumps(document, allow_nan=False)})


def figure_pdf(plot: Plot, style: str = "page") -> bytes:
    """Return one figure as a PDF of its own size; in the style ``paper`` of the size that it has in an article."""
    drawing = _drawing(plot, style) if style != "paper" else _lettered(plot, plot.drawn(article_size(plot)), style)
    return _compiled(FIGURE, {"figure.svg": drawing})


def article_size(plot: Plot) -> tuple[float, float]:
    """Width and height in inches on which a figure needs no scaling: of a column, or of the text where it is wide."""
    width, height = plot.size
    if width > FULL_WIDTH_FROM:  # panels beside each other, which become narrow enough
        return TEXT / POINTS, height
    room = COLUMN / POINTS
    return room, height * max(room / width, LEAST_HEIGHT)


def all_tables(sections: Sequence[Section]) -> list[Table]:
    """Return every table of the report, those of the cases included."""
    tables = [table for section in sections for table in section.context.get("tables", ())]
    views = [view for section in sections for view in section.context.get("views", ()) if isinstance(view, CaseView)]
    return tables + [table for view in views for table in view.tables]


def _compiled(main: str, parts: Mapping[str, str]) -> bytes:
    # a mapping is a folder in memory; the library's stub has forgotten it
    sources: Any = {name: text.encode() for name, text in {"main.typ": main, **parts}.items()}
    return typst.compile(sources, font_paths=_fonts(), ignore_system_fonts=True, format="pdf")


@cache
def _fonts() -> typst.Fonts:
    folder = Path(mpl.get_data_path()) / "fonts" / "ttf"
    return typst.Fonts(include_system_fonts=False, font_paths=[str(folder)])


def _drawing(plot: Plot, style: str) -> str:
    return _lettered(plot, plot.svg, style)


def _lettered(plot: Plot, svg: str, style: str) -> str:
    return standalone(svg, plot.alt).replace("font-family: sans-serif", f"font-family: {FONTS[style]}")


def _picture(content: bytes, file: str) -> str:
    """A picture of pixels as SVG: Typst takes sources in memory as text alone."""
    buffer = io.BytesIO()
    try:
        with Image.open(io.BytesIO(content), formats=["WEBP"]) as image:
            width, height = image.size
            if max(width, height) > MOST_PIXELS:
                raise OutputError(f"{file}: {width} x {height} pixels; allowed: {MOST_PIXELS} along each edge")
            image.convert("RGB").save(buffer, format="png")
    except (OSError, ValueError, SyntaxError) as error:
        raise OutputError(f"{file}: no WebP picture that can be read ({reason(error)})") from error
    data = base64.b64encode(buffer.getvalue()).decode("ascii")
    size = f'width="{width}" height="{height}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size}><image {size} href="data:image/png;base64,{data}"/></svg>'


def _blocks(section: Section, style: str, parts: dict[str, str]) -> Iterator[Block]:
    """The blocks of a section, in order; drawings and pictures go to *parts*."""
    context = section.context
    if "sentence" in context:
        yield {"kind": "verdict", **_badge(context["status"]), "sentence": context["sentence"]}
    if context.get("compared"):
        yield from _opening(context, style, parts)
    elif context.get("about"):
        yield _text(context["about"])
    if context.get("attention"):
        yield _text("Needs attention (no failure of a formula; the verdict stands):")
        yield {"kind": "points", "points": list(context["attention"])}
    for name, found in context.get("diagnosis", {}).items():
        told = f"What is wrong with {name}, held against MuJoCo's {found.reference} model part by part:"
        yield _text(told)
        yield {"kind": "points", "points": list(found.findings)}
        yield _text("More, and what would mend it:")
        yield {"kind": "code", "text": found.command}
    for text in context.get("paragraphs", ()):
        yield _text(text)
    yield from _stills(context.get("shots", ()), parts)
    if context.get("command"):
        yield {"kind": "code", "text": context["command"]}
    if context.get("note"):
        yield _text(context["note"])
    views = context.get("views", ())
    cases = [view for view in views if isinstance(view, CaseView)]
    if not cases and not context.get("compared"):
        yield from _figures(section, views, style, parts)
    yield from map(_table, context.get("tables", ()))
    if context.get("points"):
        yield {"kind": "points", "points": list(context["points"])}
    for view in cases:
        yield from _case(view, style, parts)


def _stills(shots: Sequence[Shot], parts: dict[str, str]) -> Iterator[Block]:
    """The pictures of a study's film, two in a row."""
    shown = []
    for number, shot in enumerate(shots):
        name = f"tracking-{number}.svg"
        parts[name] = _picture(shot.still, shot.still_file)
        shown.append(_figure(name, f"{shot.name}: {shot.caption}", shot.alt))
    for first in range(0, len(shown), 2):
        yield {"kind": "plots", "plots": shown[first : first + 2], "wide": False}


def _opening(context: Mapping[str, Any], style: str, parts: dict[str, str]) -> Iterator[Block]:
    """What stands on the first page, before the contents: what was compared, what to look at, the robot, all cases."""
    still, sketch, picture = context["still"], context["sketch"], None
    if still is not None:
        picture = _figure(
            "still.svg", f"The robot, rendered by MuJoCo at the first moment of case {still.case}", still.alt
        )
        parts["still.svg"] = _picture(still.still, still.still_file)
    elif sketch is not None:
        picture = _figure(f"{sketch.key}.svg", sketch.caption, sketch.alt)
        parts[f"{sketch.key}.svg"] = _drawing(sketch, style)
    found = [point.text for point in context["findings"]]
    calm = "" if found or context.get("attention") else "Nothing needs attention."
    texts = [text for text in (context["compared"], context["about"], calm) if text]
    yield {"kind": "opening", "texts": texts, "points": found, "picture": picture, "head": True}
    if context["glance"] is not None:
        for block in _plots((context["glance"],), style, parts, {}):
            yield block | {"head": True}


def _figures(section: Section, views: Iterable[Any], style: str, parts: dict[str, str]) -> Iterator[Block]:
    """Figures of a section of its own: those of the campaign have titles and sources, or a reason why they are not."""
    titles = {}
    for view in views:
        record = view.record
        source = f"{record.source}." if record.source else ""
        other = f"Not for the robot of the source: {record.not_about}." if record.not_about else ""
        told = " ".join(text for text in (record.title, source, other) if text)
        if view.plot is None:
            yield _text(f"{told} {view.missing}")
        else:
            names = ", ".join(name for name, _ in view.cases)
            titles[view.plot.key] = f"{told} {'Case' if len(view.cases) == 1 else 'Cases'} {names}."
    yield from _plots(section.plots, style, parts, titles)


def _case(view: CaseView, style: str, parts: dict[str, str]) -> Iterator[Block]:
    yield {"kind": "case", "title": view.heading, "name": view.name, "key": view.anchor, **_badge(view.status)}
    if view.record.description:
        yield _text(view.record.description)
    if view.record.message:
        yield {"kind": "notice", "text": view.record.message}
    for warning in view.record.warnings:
        yield {"kind": "notice", "text": f"Warning: {warning}"}
    yield {"kind": "facts", "facts": [list(fact) for fact in view.facts]}
    yield from _plots(view.plots, style, parts, {})
    if view.film is not None and view.film.note:
        yield _text(f"No rendered picture: {view.film.note}.")
    yield from map(_table, view.tables)


def _plots(plots: Sequence[Plot], style: str, parts: dict[str, str], titles: Mapping[str, str]) -> Iterator[Block]:
    """Figures two in a row, wide ones alone, each above its caption."""
    row: list[Block] = []
    for plot in plots:
        name = f"{plot.key}.svg"
        parts[name] = _drawing(plot, style)
        shown = _figure(name, titles.get(plot.key, plot.caption), plot.alt)
        wide = plot.size[0] > FULL_WIDTH_FROM
        if row and (wide or len(row) == 2):
            yield {"kind": "plots", "plots": row, "wide": False}
            row = []
        if wide:
            yield {"kind": "plots", "plots": [shown], "wide": True}
        else:
            row.append(shown)
    if row:
        yield {"kind": "plots", "plots": row, "wide": False}


def _figure(file: str, caption: str, alt: str) -> Block:
    return {"file": file, "caption": caption, "alt": alt}


def _text(text: str) -> Block:
    return {"kind": "text", "text": text}


def _badge(status: Status) -> Block:
    return {"status": status.key, "badge": f"{status.symbol} {status.text}".strip()}


def _table(table: Table) -> Block:
    longest = [max((len(_shown(row[number])) for row in table.rows), default=0) for number in range(len(table.columns))]
    return {
        "kind": "table",
        "shows": table.shows,
        "columns": [
            {"title": column.title, "numeric": column.numeric, "long": length > LONG}
            for column, length in zip(table.columns, longest, strict=True)
        ],
        "rows": [
            [
                {
                    "text": _shown(cell),
                    "strong": cell.emphasis,
                    "link": cell.link or "",
                    "status": cell.status.key if cell.status else "",
                }
                for cell in row
            ]
            for row in table.rows
        ],
        "reading": table.reading,
    }


def _shown(cell: Cell) -> str:
    return _badge(cell.status)["badge"] if cell.status else cell.text
