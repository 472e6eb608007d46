"""Equations in plain text become the same equations in TeX; what could be read in two ways stays text."""

from __future__ import annotations

from pathlib import Path

import pytest
from markdown_it import MarkdownIt

from website.equations import UnreadableError, equations

READ = {
    "x1 = q1": "x_{1} = q_{1}",
    "qd2 = xd": r"\dot{q}_{2} = \dot{x}",
    "omega = Cdd": r"\omega = \ddot{C}",
    "md = 2": "m_{d} = 2",
    "a1_left = L": r"a_{1,\mathrm{left}} = L",
    "J_x^-1 J_q = J^T": r"{J_{x}}^{-1} J_{q} = {J}^{\top}",
    "u.w = 0.": r"u \cdot w = 0 .",
    "r x dr = 0": r"r \times \mathrm{d}r = 0",
    "J x = 1": "J x = 1",
    "a b / c = a b/c": r"\frac{a b}{c} = a \frac{b}{c}",
    "h' = -x2/h": r"h' = - \frac{x_{2}}{h}",
    "(a + b)/(2 c) = 1": r"\frac{a + b}{2 c} = 1",
    "(a) (b) / c = 1": r"\frac{( a ) ( b )}{c} = 1",
    "S = sum 1 / p_i^2": r"S = \sum \, \frac{1}{{p_{i}}^{2}}",
    "b = a / cos b": r"b = \frac{a}{\cos b}",
    "y = +-sqrt(q1^2 - z^2)": r"y = \pm \sqrt{{q_{1}}^{2} - {z}^{2}}",
    "|rd_i|^2 = e^(iu)": r"{\lvert \dot{r}_{i} \rvert}^{2} = {e}^{i u}",
    "M = [[a, b (1-k)], [c, d]]": r"M = \begin{bmatrix} a & b ( 1 - k ) \\ c & d \end{bmatrix}",
    "f = m payload": r"f = m \; \text{payload}",
    "n''_across = 0": r"n_{\mathrm{across}}'' = 0",
    "(a/b + c)^2 = det J": r"{\left( \frac{a}{b} + c \right)}^{2} = \det \, J",
    "a = cos b (c + external_force)": r"a = \cos \, b \, ( c + \text{external_force} )",
    "a = 1,    b = 2": r"a = 1 , \qquad b = 2",
    "a = (1,\n     b)": r"a = ( 1 , b )",
}
KEPT = [
    "a = b / c d",
    "a = 1/d.d",
    "a = (b",
    "a = b)",
    "x = 5 %",
    "no relation at all",
    "a = b ^",
    "a = / b",
    "a = [[1, 2], 3]",
]


@pytest.mark.parametrize("text", READ)
def test_an_equation_is_read(text: str) -> None:
    assert equations(text) == READ[text]


@pytest.mark.parametrize("text", KEPT)
def test_what_could_be_read_in_two_ways_is_kept_as_it_is(text: str) -> None:
    with pytest.raises(UnreadableError):
        equations(text)


def test_rows_meet_at_their_relation() -> None:
    assert equations("a = b\nc = d + e\n    + f") == (
        "\\begin{aligned}\na &= b \\\\\nc &= d + e \\\\\n&\\quad + f\n\\end{aligned}"
    )


def test_the_derivations_are_set(repository: Path) -> None:
    """All of them, but for commands; a new one that cannot be read is to be written so that it can."""
    kept = []
    for page in sorted((repository / "docs" / "derivations").glob("*.md")):
        for token in MarkdownIt("commonmark").parse(page.read_text(encoding="utf-8")):
            if token.type == "code_block":
                try:
                    equations(token.content)
                except UnreadableError as error:
                    kept.append(f"{page.name}: {token.content.strip()[:60]}: {error}")
    assert kept == []
