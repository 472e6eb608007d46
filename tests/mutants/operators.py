"""The faults that are planted: each an edit of a few characters of one source file, found in its syntax tree.

Texts of messages, docstrings, annotations and decorators are left alone: what they say is not what is computed.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass

COMPARISONS = {
    ast.Lt: ">=",
    ast.GtE: "<",
    ast.Gt: "<=",
    ast.LtE: ">",
    ast.Eq: "!=",
    ast.NotEq: "==",
    ast.In: "not in",
    ast.NotIn: "in",
    ast.Is: "is not",
    ast.IsNot: "is",
}
ARITHMETIC = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.Pow: "*", ast.BitAnd: "|", ast.BitOr: "&"}
SWAPPED = {
    one: other
    for pair in (
        ("min", "max"),
        ("minimum", "maximum"),
        ("fmin", "fmax"),
        ("argmin", "argmax"),
        ("any", "all"),
        ("sin", "cos"),
        ("floor", "ceil"),
        ("zeros", "ones"),
    )
    for one, other in (pair, pair[::-1])
}

OPERATORS = {
    "comparison": "a comparison says the opposite (`<` is `>=`)",
    "arithmetic": "`+` and `-`, `*` and `/` swapped; a power becomes a product",
    "logic": "`and` and `or` swapped",
    "condition": "the condition of an `if`, of a filter or of a choice is negated",
    "constant": "a number a hundred times as large; 0 is 1, True is False",
    "index": "an index or a bound of a slice is one more",
    "sign": "a minus sign is left out",
    "swapped": "`min` and `max`, `any` and `all`, `sin` and `cos`, `argmin` and `argmax` ... swapped",
    "arguments": "the first two arguments of a call change places",
    "statement": "a call, an update, an assignment into an array or an attribute, or a `raise` is left out",
    "return": "a function returns nothing",
}
"""Names and meanings of all operators."""


@dataclass(frozen=True)
class Mutant:
    """One fault: characters *start* to *stop* of a file's text become *after*."""

    operator: str
    line: int
    start: int
    stop: int
    before: str
    after: str

    def planted(self, text: str) -> str:
        """The text of the file with the fault in it."""
        return text[: self.start] + self.after + text[self.stop :]

    def said(self) -> str:
        """The fault in one line."""
        one, other = (" ".join(part.split()) for part in (self.before, self.after))
        return f"{self.operator}: {one[:80]} -> {other[:80] or 'nothing'}"


def mutants_of(text: str) -> list[Mutant]:
    """All faults that the operators find in a file, in the order of its lines; a few of them do not compile."""
    finder = _Finder(text)
    finder.visit(ast.parse(text))
    return sorted(set(finder.found), key=lambda one: (one.start, one.stop, one.operator, one.after))


def compiles(text: str) -> bool:
    """Whether a text is Python: what does not even compile tests nothing."""
    try:
        compile(text, "mutant", "exec", dont_inherit=True)
    except SyntaxError:
        return False
    return True


class _Finder(ast.NodeVisitor):
    def __init__(self, text: str) -> None:
        self.text = text
        self.found: list[Mutant] = []
        self._lines = [0]
        for line in text.splitlines(keepends=True):
            self._lines.append(self._lines[-1] + len(line))
        self._bytes = [line.encode() for line in text.splitlines(keepends=True)]

    def _offset(self, line: int, column: int) -> int:
        """Place in the text; columns of the syntax tree count bytes."""
        return self._lines[line - 1] + len(self._bytes[line - 1][:column].decode())

    def _span(self, node: ast.AST) -> tuple[int, int]:
        return (
            self._offset(node.lineno, node.col_offset),  # type: ignore[attr-defined]
            self._offset(node.end_lineno, node.end_col_offset),  # type: ignore[attr-defined]
        )

    def _plant(self, operator: str, node: ast.AST, after: str) -> None:
        start, stop = self._span(node)
        line = node.lineno  # type: ignore[attr-defined]
        self.found.append(Mutant(operator, line, start, stop, self.text[start:stop], after))

    def _source(self, node: ast.AST) -> str:
        start, stop = self._span(node)
        return self.text[start:stop]

    def _between(self, operator: str, left: ast.AST, right: ast.AST, after: str) -> None:
        """Replace the sign between two operands; brackets stay where they are."""
        start, stop = self._span(left)[1], self._span(right)[0]
        gap = self.text[start:stop]
        sign = gap.strip("() \n\\\t")
        if not sign or "#" in sign or "(" in sign or ")" in sign:
            return
        at = start + gap.index(sign)
        self.found.append(Mutant(operator, left.end_lineno, at, at + len(sign), sign, after))  # type: ignore[attr-defined]

    def _negated(self, condition: ast.expr) -> None:
        self._plant("condition", condition, f"(not ({self._source(condition)}))")

    # what is not entered: texts, types, decorators

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Texts say, they do not compute."""

    def visit_Raise(self, node: ast.Raise) -> None:
        self._plant("statement", node, "pass")

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        for default in (*node.args.defaults, *node.args.kw_defaults):
            if default is not None:
                self.visit(default)
        for statement in node.body:
            self.visit(statement)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        for statement in node.body:
            self.visit(statement)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    # statements

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Constant):
            return
        if isinstance(node.value, ast.Call):
            self._plant("statement", node, "pass")
        self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> None:
        if any(isinstance(target, ast.Name) and target.id == "__all__" for target in node.targets):
            return
        if all(isinstance(target, ast.Subscript | ast.Attribute) for target in node.targets):
            self._plant("statement", node, "pass")
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self._plant("statement", node, "pass")
        if type(node.op) in ARITHMETIC:
            self._between("arithmetic", node.target, node.value, ARITHMETIC[type(node.op)] + "=")
        self.generic_visit(node)

    def visit_Continue(self, node: ast.Continue) -> None:
        self._plant("statement", node, "pass")

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is not None and not (isinstance(node.value, ast.Constant) and node.value.value is None):
            self._plant("return", node, "return None")
        self.generic_visit(node)

    def visit_If(self, node: ast.If) -> None:
        if isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            return
        self._negated(node.test)
        self.generic_visit(node)

    # expressions

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self._negated(node.test)
        self.generic_visit(node)

    def visit_comprehension(self, node: ast.comprehension) -> None:
        for condition in node.ifs:
            self._negated(condition)
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        left: ast.expr = node.left
        for sign, right in zip(node.ops, node.comparators, strict=True):
            self._between("comparison", left, right, COMPARISONS[type(sign)])
            left = right
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        after = "or" if isinstance(node.op, ast.And) else "and"
        for left, right in zip(node.values, node.values[1:], strict=False):
            self._between("logic", left, right, after)
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        text = isinstance(node.left, ast.Constant | ast.JoinedStr) and not isinstance(
            getattr(node.left, "value", None), int | float
        )
        if type(node.op) in ARITHMETIC and not text:
            self._between("arithmetic", node.left, node.right, ARITHMETIC[type(node.op)])
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.USub):
            self._plant("sign", node, f"({self._source(node.operand)})")
        elif isinstance(node.op, ast.Not):
            self._plant("condition", node, f"bool({self._source(node.operand)})")
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        value = node.value
        if isinstance(value, bool):
            self._plant("constant", node, str(not value))
        elif isinstance(value, int | float):
            self._plant("constant", node, f"100 * {self._source(node)}" if value else "1")

    def visit_Subscript(self, node: ast.Subscript) -> None:
        self.visit(node.value)
        parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        for part in parts:
            for bound in (part.lower, part.upper) if isinstance(part, ast.Slice) else (part,):
                if isinstance(bound, ast.Constant) and isinstance(bound.value, int):
                    self._plant("index", bound, str(bound.value + 1))
                elif isinstance(bound, ast.UnaryOp) and isinstance(bound.operand, ast.Constant):
                    self._plant("index", bound, f"({self._source(bound)} + 1)")
                elif bound is not None and not isinstance(bound, ast.Constant):
                    self.visit(bound)

    def visit_Call(self, node: ast.Call) -> None:
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if name in SWAPPED:
            start, stop = self._span(node.func)
            self.found.append(Mutant("swapped", node.func.end_lineno or 0, stop - len(name), stop, name, SWAPPED[name]))
        first, second = (*node.args[:2], None, None)[:2]
        if first is not None and second is not None and name not in {"isinstance", "getattr", "max", "min", "zip"}:
            one, other = self._source(first), self._source(second)
            if one != other and not isinstance(first, ast.Starred) and not isinstance(second, ast.Starred):
                start, middle, after = self._span(first)[0], self._span(first)[1], self._span(second)
                swapped = other + self.text[middle : after[0]] + one
                before = self.text[start : after[1]]
                self.found.append(Mutant("arguments", first.lineno, start, after[1], before, swapped))
        self.generic_visit(node)
