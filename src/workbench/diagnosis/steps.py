"""A formula's functions as lists of statements that can be run one by one, and what each of them reads and writes."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from dataclasses import dataclass
from types import CodeType

RETURNED = "__returned__"

FEWEST = 3
"""Statements of a function that is worth taking apart."""


@dataclass(frozen=True)
class Step:
    """One statement at the top of a function's body."""

    code: CodeType
    reads: frozenset[str]
    writes: frozenset[str]
    mutates: frozenset[str]
    """names whose objects the statement may change in place"""
    start: int
    end: int
    """its whole lines in the text, bytes; equal where it shares a line with another"""
    line: int


@dataclass(frozen=True)
class Program:
    """A function that can be run statement by statement."""

    name: str
    parameters: tuple[str, ...]
    steps: tuple[Step, ...]


@dataclass(frozen=True)
class Function:
    """A function at the top of a module."""

    name: str
    start: int
    end: int
    """whole lines of its ``def``, without decorators, bytes"""
    line: int
    uses: frozenset[str]
    """other functions of the module that it names, and those that they name"""
    program: Program | None
    """None where it cannot be taken apart: it is then run as a whole"""


def functions_of(text: str, path: str) -> dict[str, Function]:
    """Functions at the top of a source text.

    Raises
    ------
    SyntaxError
        The text is no Python.
    """
    tree, starts = ast.parse(text), _line_starts(text.encode())
    nodes = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    named = {name: _names(node) & nodes.keys() - {name} for name, node in nodes.items()}
    return {
        name: Function(
            name,
            starts[node.lineno - 1],
            starts[node.end_lineno or node.lineno],
            node.lineno,
            _closure(name, named),
            _program(node, starts, path),
        )
        for name, node in nodes.items()
    }


def compiled_statement(lines: bytes, path: str) -> CodeType:
    """Compile the whole lines of an indented statement that ran before; what it returns is kept under `RETURNED`.

    Raises
    ------
    SyntaxError
        The text is no Python.
    """
    bare = lines.lstrip()
    if bare.startswith(b"return"):
        lines = lines.replace(b"return", f"{RETURNED} =".encode(), 1)
    return compile(b"if 1:\n" + lines, path, "exec")


def _line_starts(data: bytes) -> list[int]:
    starts = [0]
    for line in data.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    return starts


def _names(node: ast.AST) -> set[str]:
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}


def _closure(name: str, named: Mapping[str, set[str]]) -> frozenset[str]:
    found: set[str] = set()
    waiting = [name]
    while waiting:
        for other in named[waiting.pop()] - found:
            found.add(other)
            waiting.append(other)
    return frozenset(found)


def _program(node: ast.FunctionDef, starts: list[int], path: str) -> Program | None:
    arguments = node.args
    plain = [argument.arg for argument in [*arguments.posonlyargs, *arguments.args]]
    if arguments.vararg or arguments.kwarg or arguments.kwonlyargs or arguments.defaults:
        return None
    body = [s for s in node.body if not (isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant))]
    if len(body) < FEWEST or not isinstance(body[-1], ast.Return) or any(_entangled(s) for s in body):
        return None
    steps = []
    for number, statement in enumerate(body):
        last = statement.end_lineno or statement.lineno
        others = [body[i] for i in (number - 1, number + 1) if 0 <= i < len(body)]
        shared = any(o.lineno <= last and (o.end_lineno or o.lineno) >= statement.lineno for o in others)
        start, end = starts[statement.lineno - 1], starts[last]
        writes, mutates = _written(statement), _mutated(statement)
        reads = frozenset(n.id for n in ast.walk(statement) if isinstance(n, ast.Name)) - (
            writes if isinstance(statement, ast.Assign) and not _loads(statement.value) & writes else frozenset()
        )
        steps.append(
            Step(
                _compiled(statement, path),
                reads | mutates,
                writes | mutates,
                mutates,
                start,
                start if shared else end,
                statement.lineno,
            )
        )
    return Program(node.name, tuple(plain), tuple(steps))


def _loads(node: ast.AST) -> set[str]:
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}


def _entangled(statement: ast.stmt) -> bool:
    """Whether a statement does what only a function can: it returns from inside, yields, reaches for outer names."""
    outer = isinstance(statement, ast.Return)
    kinds = (ast.Yield, ast.YieldFrom, ast.Await, ast.Global, ast.Nonlocal, ast.Import, ast.ImportFrom, ast.Delete)
    return any(
        isinstance(node, kinds) or (isinstance(node, ast.Return) and not (outer and node is statement))
        for node in ast.walk(statement)
    )


def _written(statement: ast.stmt) -> frozenset[str]:
    if isinstance(statement, ast.Return):
        return frozenset({RETURNED})
    names = {n.id for n in ast.walk(statement) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    names |= {n.name for n in ast.walk(statement) if isinstance(n, ast.FunctionDef)}
    return frozenset(names)


def _mutated(statement: ast.stmt) -> frozenset[str]:
    found: set[str] = set()
    for node in ast.walk(statement):
        match node:
            case ast.AugAssign(target=ast.Name(id=name)):
                found.add(name)
            case (
                ast.Subscript(value=value, ctx=ast.Store())
                | ast.Attribute(value=value, ctx=ast.Store())
                | ast.Expr(value=ast.Call() as value)
                | ast.keyword(arg="out", value=value)
            ):
                found |= _loads(value)
    return frozenset(found)


def _compiled(statement: ast.stmt, path: str) -> CodeType:
    if isinstance(statement, ast.Return):
        value = statement.value or ast.Constant(None)
        kept = ast.Assign([ast.Name(RETURNED, ast.Store())], value)
        statement = ast.copy_location(kept, statement)
    return compile(ast.fix_missing_locations(ast.Module([statement], [])), path, "exec")
