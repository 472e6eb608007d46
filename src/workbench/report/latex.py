"""Tables as LaTeX, for a paper: booktabs, numbers right-aligned, every name and sign escaped."""

from __future__ import annotations

import re

from workbench.report.tables import Cell, Table

_SPECIAL = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "$": r"\$", "&": r"\&", "#": r"\#", "%": r"\%", "_": r"\_",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
    "|": r"\textbar{}", '"': r"\textquotedbl{}", "–": "--", "“": "``", "”": "''", "·": r"$\cdot$", "²": r"$^2$",
    "µ": r"$\mu$", "±": r"$\pm$", "−": r"$-$", "Δ": r"$\Delta$", "τ": r"$\tau$", "q̇": r"$\dot q$", "ẋ": r"$\dot x$",
    "✓": "", "✗": "", "⚠": "", "≠": r"$\neq$", "→": r"$\rightarrow$",
}  # fmt: skip
_SIGN = re.compile("|".join(sorted(map(re.escape, _SPECIAL), key=len, reverse=True)))
_POWER = re.compile(r"(?<![\w.])(-?\d(?:\.\d+)?)e([+-]\d{2,3})(?!\w)")

LONG = 36
"""Letters from which on a column breaks its lines."""
LONG_COLUMN = r"p{0.24\linewidth}"
HEAD = "% Needs \\usepackage{booktabs}, and an engine that reads UTF-8. Made by the workbench; will be overwritten."


def latex_text(text: str) -> str:
    """Return *text* so that LaTeX prints it: one line, no commands of its own, powers of ten as such."""
    plain = " ".join(text.split())
    pieces, start = [], 0
    for match in _POWER.finditer(plain):
        pieces += [_escape(plain[start : match.start()]), f"${match[1]}\\times10^{{{int(match[2])}}}$"]
        start = match.end()
    written = "".join([*pieces, _escape(plain[start:])])
    return f"{{}}{written}" if written[:1] in ("[", "*") else written  # after a line break they would be an option


def latex_table(table: Table) -> str:
    """Return a table environment: the sentence above as its caption, the sentence below in small print."""
    alignment = "".join(
        "r" if column.numeric else LONG_COLUMN if any(len(row[number].text) > LONG for row in table.rows) else "l"
        for number, column in enumerate(table.columns)
    )
    head = " & ".join(latex_text(column.title) for column in table.columns)
    rows = "\n".join(f"{' & '.join(map(_cell, row))} \\\\" for row in table.rows)
    return (
        f"{HEAD}\n\\begin{{table}}\n\\caption{{{latex_text(table.shows)}}}\n"
        f"\\label{{tab:{table.key}}}\n\\footnotesize\n"
        f"\\begin{{tabular}}{{{alignment}}}\n\\toprule\n{head} \\\\\n\\midrule\n{rows}\n\\bottomrule\n"
        f"\\end{{tabular}}\n\n\\smallskip\n{latex_text(table.reading)}\n\\end{{table}}\n"
    )


def _escape(text: str) -> str:
    return _SIGN.sub(lambda match: _SPECIAL[match[0]], text)


def _cell(cell: Cell) -> str:
    text = latex_text(cell.status.text if cell.status else cell.text)
    return f"\\textbf{{{text}}}" if cell.emphasis and text else text
