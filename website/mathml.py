"""Equations as MathML, which browsers draw themselves: no script, nothing to fetch. docutils translates the TeX."""

from __future__ import annotations

import re

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.math import get_node_equation_number
from sphinx.writers.html5 import HTML5Translator

ACCENTED = re.compile(r"(\\(?:dot|ddot|bar|hat|tilde|vec) ?(?:\{[^{}]*\}|[A-Za-z]))(?=_)")
"""docutils takes what has an accent for what has limits and would set an index below it; a larger group is none."""


def _mathml(node: nodes.Element, block: bool) -> str:
    text = node.astext()
    try:
        # docutils' entities are HTML's
        return str(tex2mathml(ACCENTED.sub(r"{\1{}}", text.strip()), as_block=block))
    except MathError as error:
        raise ExtensionError(f"{node.source or ''}:{node.line or ''}: no MathML for {text!r}: {error}") from error


def _inline(self: HTML5Translator, node: nodes.math) -> None:
    self.body.append(_mathml(node, block=False))
    raise nodes.SkipNode


def _display(self: HTML5Translator, node: nodes.math_block) -> None:
    self.body.append(self.starttag(node, "div", CLASS="equation", tabindex="0"))
    if node["number"]:
        self.body.append(f'<span class="eqno">({get_node_equation_number(self, node)})</span>')
    self.body.append(_mathml(node, block=True))
    self.body.append("</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Offer the renderer to Sphinx, which takes it for there is no other."""
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
