"""Terms and factors that a statement may lack: what stands in it and near it, put in once more, alone or by twos."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from itertools import combinations_with_replacement

from workbench.diagnosis.edits import INSERT, SHAPES, Edit
from workbench.diagnosis.places import Places

NEAR = 2
"""Statements before and behind whose parts are made into new terms."""

MOST_ATOMS = 16
MOST_FACTORS = 40
LONGEST = 40
"""Characters of a part that is put in."""


def inserts_of(text: str, line: int) -> list[Edit]:
    """Edits that put a term or a factor into the statement that a line belongs to.

    Raises
    ------
    SyntaxError
        The text is no Python.
    """
    tree = ast.parse(text)
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    home = next((f for f in functions if f.lineno <= line <= (f.end_lineno or f.lineno)), None)
    if home is None:
        return []
    statements = [n for n in ast.walk(home) if isinstance(n, ast.Assign | ast.AugAssign | ast.Return) and n.value]
    statements.sort(key=lambda n: n.lineno)
    here = next((i for i, n in enumerate(statements) if n.lineno <= line <= (n.end_lineno or line)), None)
    if here is None:
        return []
    return list(dict.fromkeys(_Inserts(Places(text.encode()), statements, here).made()))


class _Inserts:
    def __init__(self, places: Places, statements: list[ast.Assign | ast.AugAssign | ast.Return], here: int) -> None:
        self._places, self._here = places, statements[here]
        order = sorted(range(len(statements)), key=lambda i: (abs(i - here), i))
        values = [(statements[i].value, abs(i - here) <= NEAR, i <= here) for i in order]
        before = [(value, near) for value, near, known in values if value is not None and (known or near)]
        self._near = self._texts((v for v, near in before if near), self._is_atom)[:MOST_ATOMS]
        self._factors = self._texts((v for v, _ in before), self._is_atom)[:MOST_FACTORS]
        self._terms = self._texts((v for v, _ in before), self._is_term)[:MOST_FACTORS]

    def made(self) -> Iterator[Edit]:
        value = self._here.value
        assert value is not None
        products = [f"{a} * {b}" for a, b in combinations_with_replacement(self._near, 2)]
        for node in self._sums(value):
            end, line = self._places.end(node), node.lineno
            for term in dict.fromkeys([*self._terms, *self._near, *products]):
                for sign in "+-":
                    yield Edit(end, end, f" {sign} {term}", INSERT, line)
        for node in self._operands(value):
            start, end, line = self._places.start(node), self._places.end(node), node.lineno
            for factor in self._factors:
                yield Edit(start, start, f"{factor} * ", INSERT, line)
                yield Edit(end, end, f" / {factor}", INSERT, line)

    def _texts(self, values: Iterator[ast.expr], wanted: Callable[[ast.expr], bool]) -> list[str]:
        found: dict[str, None] = {}
        for value in values:
            for node in ast.walk(value):
                if isinstance(node, ast.expr) and wanted(node):
                    text = self._places.text(self._places.start(node), self._places.end(node))
                    if len(text) <= LONGEST and "\n" not in text:
                        found.setdefault(text)
        return list(found)

    @staticmethod
    def _is_atom(node: ast.expr) -> bool:
        if isinstance(node, ast.BinOp):
            return isinstance(node.op, ast.Pow)
        if isinstance(node, ast.Name):
            return isinstance(node.ctx, ast.Load) and node.id not in ("np", "p")
        if isinstance(node, ast.Constant):
            return isinstance(node.value, complex)
        if isinstance(node, ast.Call):
            return _called(node) not in SHAPES
        return isinstance(node, ast.Subscript) or (isinstance(node, ast.Attribute) and _is_value(node))

    @staticmethod
    def _is_term(node: ast.expr) -> bool:
        return isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div)

    def _sums(self, node: ast.expr) -> Iterator[ast.expr]:
        """Whole values that a term may be added to: the statement's, sums in brackets, arguments."""
        yield node
        for inner in ast.walk(node):
            if isinstance(inner, ast.Call) and _called(inner) not in SHAPES:
                yield from (a for a in inner.args if not isinstance(a, ast.Constant | ast.Tuple | ast.List))
            elif isinstance(inner, ast.BinOp) and not isinstance(inner.op, ast.Add | ast.Sub):
                yield from (o for o in (inner.left, inner.right) if _is_sum(o))

    def _operands(self, node: ast.expr) -> Iterator[ast.expr]:
        """Parts that a factor may be put before or behind: operands of sums and products that are no sums."""
        yield from (n for n in [node] if self._is_atom(n) or self._is_term(n))
        for inner in ast.walk(node):
            if isinstance(inner, ast.BinOp) and isinstance(inner.op, ast.Add | ast.Sub | ast.Mult | ast.Div):
                yield from (o for o in (inner.left, inner.right) if self._is_atom(o))
            elif isinstance(inner, ast.Call) and _called(inner) not in SHAPES:
                yield from (a for a in inner.args if self._is_atom(a))


def _is_sum(node: ast.expr) -> bool:
    return isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)


def _is_value(node: ast.Attribute) -> bool:
    return isinstance(node.value, ast.Name) and node.value.id != "np"


def _called(node: ast.Call) -> str:
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
