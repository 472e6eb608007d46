"""Tables as LaTeX, for a paper: booktabs, numbers right-aligned, fitted to one-column and two-column articles.

A table that fits a column of a two-column article is a ``table``; a wider one a ``table*``, which takes the whole width
there and is an ordinary table in one column. What is wider still is cut into parts with the same columns in front.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from workbench.report.latex_layout import GAP, LETTERS, LINE, Content, Part, chunks, heights, lay_out
from workbench.report.latex_text import latex_text
from workbench.report.tables import Cell, Table

HEAD = (
    "% Needs \\usepackage{booktabs,array}, and an engine that reads UTF-8; \\cite takes references.bib from beside it."
    " Made by the workbench; will be overwritten."
)
KEYS = frozenset({"Case", "Candidate", "Reference", "Joint", "Actuator", "Figure", "Formula", "Item"})
"""Headings of columns that say what a row is about: they stand in front of every part of a wide table."""
MOST_KEYS = 3


def latex_table(table: Table, cited: Collection[str] = ()) -> str:
    """Return a table as LaTeX: the sentence above as its caption, the sentence below in small print.

    Parameters
    ----------
    table
        What is shown.
    cited
        Keys that the bibliography beside it knows.
    """
    contents = [
        Content(
            column.title,
            tuple(_plain(row[number]) for row in table.rows),
            column.numeric,
            tuple(row[number].emphasis for row in table.rows),
        )
        for number, column in enumerate(table.columns)
    ]
    keys = 0
    while keys < min(MOST_KEYS, len(contents) - 1) and table.columns[keys].title in KEYS:
        keys += 1
    parts, wide = lay_out(contents, max(keys, 1))
    sizes = [sum(row) for row in zip(*(heights(contents, part, len(table.rows)) for part in parts), strict=True)]
    stretches = chunks(sizes)
    environment = "table*" if wide else "table"
    floats = [
        _float(table, contents, parts, stretch, number, len(stretches), environment, cited)
        for number, stretch in enumerate(stretches)
    ]
    return f"{HEAD}\n" + "\n".join(floats)


def _plain(cell: Cell) -> str:
    return cell.status.text if cell.status else cell.text


def _float(
    table: Table,
    contents: Sequence[Content],
    parts: Sequence[Part],
    rows: range,
    number: int,
    count: int,
    environment: str,
    cited: Collection[str],
) -> str:
    caption = latex_text(table.shows, cited, breaks=True) + (f" (part {number + 1} of {count})" if count > 1 else "")
    label = table.key if number == 0 else f"{table.key}-{number + 1}"
    tabulars = "\n\n\\smallskip\n".join(_tabular(table, contents, part, rows, cited) for part in parts)
    reading = ""
    if number == count - 1:
        reading = f"\n\n\\smallskip\n{{\\raggedright {latex_text(table.reading, cited, breaks=True)}\\par}}"
    return (
        f"\\begin{{{environment}}}\n\\centering\\sloppy\n\\caption{{{caption}}}\n\\label{{tab:{label}}}\n"
        f"\\fontsize{{{LETTERS:g}}}{{{LINE:g}}}\\selectfont\n\\setlength{{\\tabcolsep}}{{{GAP / 2:g}pt}}\n"
        f"{tabulars}{reading}\n\\end{{{environment}}}\n"
    )


def _tabular(table: Table, contents: Sequence[Content], part: Part, rows: range, cited: Collection[str]) -> str:
    alignment = "".join(
        _column(contents[number].numeric, width) for number, width in zip(part.columns, part.widths, strict=True)
    )
    head = " & ".join(
        latex_text(contents[number].head, breaks=width is not None)
        for number, width in zip(part.columns, part.widths, strict=True)
    )
    body = "\n".join(
        " & ".join(
            _cell(table.rows[row][number], cited, width is not None)
            for number, width in zip(part.columns, part.widths, strict=True)
        )
        + r" \\"
        for row in rows
    )
    return (
        f"\\begin{{tabular}}{{@{{}}{alignment}@{{}}}}\n\\toprule\n{head} \\\\\n\\midrule\n{body}\n\\bottomrule\n"
        f"\\end{{tabular}}"
    )


def _column(numeric: bool, width: float | None) -> str:
    if width is None:
        return "r" if numeric else "l"
    side = "raggedleft" if numeric else "raggedright"
    return f">{{\\{side}\\arraybackslash}}p{{{width:.1f}pt}}"


def _cell(cell: Cell, cited: Collection[str], breaks: bool) -> str:
    text = latex_text(_plain(cell), cited, breaks)
    return f"\\textbf{{{text}}}" if cell.emphasis and text else text
