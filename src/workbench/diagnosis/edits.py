"""Small edits of a formula's Python source, the mistakes that people make turned round; formatting stays as it is.

Each edit replaces a few characters. Signs, factors, functions, indices and names are looked at where they stand in the
text, by the places that Python's own parser gives them.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from workbench.diagnosis.places import Places

SIGN, FACTOR, TRIG, INDEX, NAME, PARAMETER, EXPONENT, QUOTIENT, DROP = range(9)
NEGATE, SCALE, SWAP, SQUARE, RARE_SCALE, INSERT = range(9, 15)
WHAT = (
    "sign of a term", "a factor", "sine for cosine", "an index", "a name", "a parameter", "an exponent",
    "numerator for denominator", "a term or factor too many", "a minus sign", "a factor in front",
    "order of two arguments", "a missing square", "a factor in front",
    "a term too few",
)  # fmt: skip
"""Kinds of edits in words, most usual mistakes first: the order in which edits with the same effect are shown."""

STAGES = (
    frozenset({SIGN, FACTOR, TRIG, INDEX, NAME, PARAMETER, EXPONENT, QUOTIENT, DROP, SWAP}),
    frozenset({NEGATE, SCALE, INSERT}),
    frozenset({SQUARE, RARE_SCALE}),
)
"""Kinds in the order in which they are tried: the next only where those before mend nothing wholly."""

LIKELY = STAGES[0] | {NEGATE, SQUARE}
"""Kinds that are tried where one edit alone brings nothing."""

SHAPES = frozenset(
    {"zeros", "ones", "eye", "empty", "arange", "linspace", "reshape", "range", "len", "tile", "repeat", "swapaxes",
     "transpose", "expand_dims", "full", "roll", "broadcast_to", "candidate", "sum", "mean", "stack", "concatenate"}
)  # fmt: skip
"""Functions whose numbers are shapes, axes and counts, and no physics."""


@dataclass(frozen=True)
class Edit:
    """Replace ``text[start:end]`` (bytes of UTF-8) by *new*."""

    start: int
    end: int
    new: str
    kind: int
    line: int

    def place(self, text: str) -> tuple[int, int, int, str]:
        """Line and columns (bytes), which an edit of another line does not move, and what is put there."""
        data = text.encode()
        begin = data.rfind(b"\n", 0, self.start) + 1
        return data.count(b"\n", 0, self.start), self.start - begin, self.end - begin, self.new

    def apply(self, text: str) -> str:
        """Return the edited text."""
        data = text.encode()
        return (data[: self.start] + self.new.encode() + data[self.end :]).decode()


def edits_of(
    text: str,
    lines: Iterable[int] | None,
    groups: Mapping[str, Iterable[str]],
    joints: int = 3,
    missing: frozenset[str] = frozenset(),
) -> list[Edit]:
    """All small edits of a source text, most usual kinds first.

    Parameters
    ----------
    text
        Python source.
    lines
        Lines that the formula runs through; None is all.
    groups
        Parameter -> those of its kind, any of which might have been meant.
    joints
        Number of actuated joints; indices go up to it, and to three axes.
    missing
        Parameters that are missing somewhere: terms like those that there are, but with them, are put in.

    Raises
    ------
    SyntaxError
        The text is no Python.
    """
    tree = ast.parse(text)
    walker = _Walker(Places(text.encode()), set(lines) if lines is not None else None, groups, max(3, joints))
    walker.missing = missing
    walker.walk(tree)
    unique = {(e.start, e.end, e.new): e for e in sorted(walker.found, key=lambda e: -e.kind)}
    return sorted(unique.values(), key=lambda e: (e.kind, e.start, e.new))


class _Walker:
    def __init__(
        self, places: Places, lines: set[int] | None, groups: Mapping[str, Iterable[str]], indices: int
    ) -> None:
        self.places, self.lines, self.indices = places, lines, indices
        self.groups = {name: tuple(others) for name, others in groups.items()}
        self.found: list[Edit] = []
        self.missing: frozenset[str] = frozenset()
        self.names: list[dict[str, int]] = [{}]

    def walk(self, tree: ast.Module) -> None:
        for statement in tree.body:
            self._statement(statement, top=True)

    def _statement(self, node: ast.stmt, top: bool = False) -> None:
        if isinstance(node, ast.FunctionDef):
            self.names.append(_bound(node))
            for inner in node.body:
                self._statement(inner)
            self.names.pop()
            return
        if isinstance(node, ast.Import | ast.ImportFrom | ast.ClassDef | ast.Raise | ast.Assert):
            return
        if isinstance(node, ast.For | ast.While | ast.If | ast.With):
            for inner in [*node.body, *getattr(node, "orelse", [])]:
                self._statement(inner)
            if isinstance(node, ast.For) and self._ran(node.lineno, node.iter.end_lineno):
                self._expression(node.iter)
            return
        if top and not isinstance(node, ast.Assign):
            return
        if not top and not self._ran(node.lineno, node.end_lineno):
            return
        value = getattr(node, "value", None)
        if isinstance(value, ast.expr) and not (isinstance(value, ast.Constant) and isinstance(value.value, str)):
            self._term(value)
            self._expression(value)
        if isinstance(node, ast.AugAssign) and isinstance(node.op, ast.Add | ast.Sub):
            start = self.places.end(node.target)
            place = self.places.data.index(b"=", start) - 1
            sign = "-" if isinstance(node.op, ast.Add) else "+"
            self._add(place, place + 1, sign, SIGN, node.lineno)

    def _ran(self, first: int, last: int | None) -> bool:
        return self.lines is None or any(line in self.lines for line in range(first, (last or first) + 1))

    def _add(self, start: int, end: int, new: str, kind: int, line: int) -> None:
        self.found.append(Edit(start, end, new, kind, line))

    def _replace(self, node: ast.expr, new: str, kind: int) -> None:
        self._add(self.places.start(node), self.places.end(node), new, kind, node.lineno)

    def _expression(self, node: ast.expr, parent: ast.AST | None = None) -> None:
        """Edits of a node itself, then of what is in it."""
        if isinstance(node, ast.BinOp):
            self._binary(node)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            self._replace(node, self.places.text(self.places.start(node), self.places.end(node))[1:].lstrip(), SIGN)
            self._expression(node.operand, node)
        elif isinstance(node, ast.Constant):
            self._constant(node)
        elif isinstance(node, ast.Name):
            self._name(node)
        elif isinstance(node, ast.Attribute):
            self._attribute(node)
        elif isinstance(node, ast.Subscript):
            self._expression(node.value, node)
            self._subscript(node.slice)
        elif isinstance(node, ast.Call):
            self._call(node)
        elif isinstance(node, ast.Tuple | ast.List):
            for element in node.elts:
                self._term(element)
                self._expression(element, node)
        else:
            for child in ast.iter_child_nodes(node):
                if isinstance(child, ast.expr):
                    self._expression(child, node)
                elif isinstance(child, ast.comprehension):
                    self._expression(child.iter, child)

    def _binary(self, node: ast.BinOp) -> None:
        places, op = self.places, node.op
        start, end = places.start(node), places.end(node)
        at, after = places.operator(node)
        left, right = places.text(start, at).rstrip(), places.text(after, end).lstrip()
        if isinstance(op, ast.Add | ast.Sub):
            self._add(at, after, "-" if isinstance(op, ast.Add) else "+", SIGN, node.right.lineno)
            self._add(start, end, left, DROP, node.lineno)
            self._add(start, end, right if isinstance(op, ast.Add) else f"-{right}", DROP, node.lineno)
            self._squared(node.left)
            self._squared(node.right)
            for operand, sign in ((node.right, "+" if isinstance(op, ast.Add) else "-"), (node.left, "+")):
                self._inserted(operand, sign, end)
            self._term(node.right)
            if not (isinstance(node.left, ast.BinOp) and isinstance(node.left.op, ast.Add | ast.Sub)):
                self._term(node.left)
        elif isinstance(op, ast.Mult | ast.Div):
            self._add(at, after, "/" if isinstance(op, ast.Mult) else "*", QUOTIENT, node.lineno)
            self._add(start, end, left, DROP, node.lineno)
            if isinstance(op, ast.Mult):
                self._add(start, end, right, DROP, node.lineno)
            for operand in (node.left, node.right):
                self._squared(operand)
        elif isinstance(op, ast.Pow):
            self._power(node, left, right)
            self._expression(node.left, node)
            return
        elif isinstance(op, ast.MatMult):
            self._add(start, end, f"{right} @ {left}", SWAP, node.lineno)
        self._expression(node.left, node)
        self._expression(node.right, node)

    def _inserted(self, node: ast.expr, sign: str, end: int) -> None:
        """Put a copy of a term behind the sum, with a missing parameter in it, and with one name changed or none."""
        if not self.missing or (isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)):
            return
        start = self.places.start(node)
        text = self.places.text(start, self.places.end(node))
        inside = [n for n in ast.walk(node) if isinstance(n, ast.Attribute) and n.attr in self.groups]
        names = [n for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)]
        for wanted in self.missing:
            for attribute in inside:
                if wanted != attribute.attr and wanted not in self.groups[attribute.attr]:
                    continue
                place = self.places.end(attribute) - len(attribute.attr) - start
                changes: list[list[tuple[int, int, str]]] = [[(place, place + len(attribute.attr), wanted)]]
                for name in names:
                    at = self.places.start(name) - start
                    changes += [
                        [*changes[0], (at, at + len(name.id), other)]
                        for other, line in self.names[-1].items()
                        if other != name.id and line < node.lineno and alike(name.id, other)
                    ]
                for change in changes:
                    copied = text.encode()
                    for first, last, new in sorted(change, reverse=True):
                        copied = copied[:first] + new.encode() + copied[last:]
                    self._add(end, end, f" {sign} {copied.decode()}", INSERT, node.lineno)

    def _power(self, node: ast.BinOp, left: str, right: str) -> None:
        try:
            exponent = ast.literal_eval(node.right)
        except ValueError:
            return
        if not isinstance(exponent, int | float):
            return
        self._replace(node.right, f"{exponent + 1:g}", EXPONENT)
        if exponent - 1 == 1:
            self._replace(node, left, EXPONENT)
        else:
            self._replace(node.right, f"{exponent - 1:g}", EXPONENT)

    def _squared(self, node: ast.expr) -> None:
        end = self.places.end(node)
        if isinstance(node, ast.BinOp) and not isinstance(node.op, ast.Pow):
            if self.places.data[end : end + 1] != b")":
                return
            end += 1
        elif not isinstance(node, ast.Name | ast.Attribute | ast.Subscript | ast.Call):
            return
        self._add(end, end, "**2", SQUARE, node.lineno)

    def _term(self, node: ast.expr) -> None:
        """What may be forgotten in front of a whole term: a minus, a factor."""
        if isinstance(node, ast.Constant | ast.Tuple | ast.List | ast.Lambda | ast.Compare | ast.Starred | ast.Dict):
            return
        if isinstance(node, ast.GeneratorExp | ast.ListComp | ast.BoolOp):
            return
        text = self.places.text(self.places.start(node), self.places.end(node))
        whole = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)
        whole = whole or isinstance(node, ast.IfExp)
        inner = f"({text})" if whole else text
        if not isinstance(node, ast.UnaryOp):
            self._replace(node, f"-{inner}", NEGATE)
        for factor, kind in ((2, SCALE), (4, RARE_SCALE)):
            self._replace(node, f"{factor} * {inner}", kind)
            self._replace(node, f"{inner} / {factor}", kind)

    def _constant(self, node: ast.Constant) -> None:
        value = node.value
        if isinstance(value, bool) or not isinstance(value, int | float) or value == 0:
            return
        for other in (2 * value, value / 2, 4 * value, value / 4, 8 * value, value / 8):
            self._replace(node, f"{other:g}" if other != int(other) else f"{int(other)}", FACTOR)

    def _name(self, node: ast.Name) -> None:
        for other in _swapped(node.id):
            if other in self.names[-1] or other in ("sin", "cos"):
                self._replace(node, other, TRIG)
        for other, line in sorted(self.names[-1].items()):
            if other != node.id and line < node.lineno and alike(node.id, other):
                self._replace(node, other, NAME)

    def _attribute(self, node: ast.Attribute) -> None:
        place = self.places.end(node) - len(node.attr.encode())
        if node.attr in ("sin", "cos"):
            self._add(place, place + 3, "cos" if node.attr == "sin" else "sin", TRIG, node.lineno)
        for other in self.groups.get(node.attr, ()):
            if other != node.attr:
                self._add(place, self.places.end(node), other, PARAMETER, node.lineno)
        if not isinstance(node.value, ast.Name):
            self._expression(node.value, node)

    def _subscript(self, node: ast.expr) -> None:
        for part in node.elts if isinstance(node, ast.Tuple) else [node]:
            if isinstance(part, ast.Constant) and isinstance(part.value, int):
                for other in range(self.indices):
                    if other != part.value:
                        self._replace(part, str(other), INDEX)
            elif isinstance(part, ast.Name):
                self._name(part)

    def _call(self, node: ast.Call) -> None:
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if isinstance(node.func, ast.Attribute):
            if name in ("sin", "cos"):
                self._attribute(node.func)
            elif not isinstance(node.func.value, ast.Name):
                self._expression(node.func.value, node)
            if self.places.text(end := self.places.end(node.func.value), end + 1) == ")":
                self._squared(node.func.value)
        elif isinstance(node.func, ast.Name):
            self._name(node.func)
        arguments = node.args
        if len(arguments) == 2 and not node.keywords and name not in SHAPES and name != "solve":
            one, two = (self.places.text(self.places.start(a), self.places.end(a)) for a in arguments)
            first, last = self.places.start(arguments[0]), self.places.end(arguments[1])
            self._add(first, last, f"{two}, {one}", SWAP, node.lineno)
        for argument in arguments:
            if name in SHAPES:
                number = argument.operand if isinstance(argument, ast.UnaryOp) else argument
                if not isinstance(number, ast.Constant):
                    self._expression(argument, node)
                continue
            if name not in ("sin", "cos"):
                self._term(argument)
                if not isinstance(argument, ast.BinOp):
                    self._squared(argument)
            self._expression(argument, node)


def _bound(function: ast.FunctionDef) -> dict[str, int]:
    """Names that a function's own arguments and assignments bind, and the line where each is first."""
    names = {argument.arg: function.lineno for argument in [*function.args.posonlyargs, *function.args.args]}
    for node in ast.walk(function):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names[node.id] = min(names.get(node.id, node.lineno), node.lineno)
    names.pop("_", None)  # nobody means it
    return names


def _swapped(name: str) -> Iterator[str]:
    for one, other in (("sin", "cos"), ("cos", "sin")):
        if one in name:
            yield name.replace(one, other)
    short = {"s": "c", "c": "s"}
    if name[:1] in short and len(name) <= 2:
        yield short[name[0]] + name[1:]


PAIRS = (("left", "right"), ("sin", "cos"), ("one", "two"), ("up", "down"))


def alike(one: str, other: str) -> bool:
    """Whether a name may have been written for another: one character apart, or its sibling by a pair of words."""
    for a, b in PAIRS:
        if one.replace(a, b) == other or one.replace(b, a) == other:
            return one != other
    if len(one) == len(other):
        return sum(x != y for x, y in zip(one, other, strict=True)) == 1 and (len(one) > 1 or one.isalpha())
    longer, shorter = sorted((one, other), key=len, reverse=True)
    if len(longer) - len(shorter) == 1 and len(shorter) > 0:
        return any(longer[:i] + longer[i + 1 :] == shorter for i in range(len(longer)))
    return False
