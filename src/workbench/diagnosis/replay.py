"""Running edited formulas quickly: of a formula that ran once, only what an edit reaches is run again.

A formula is run once statement by statement, and what each wrote is kept. An edited statement is then run on what was
there before it, and of those behind it the ones that read what has changed. What comes out only ranks edits: whatever
is suggested has been run as the file that it is.
"""

from __future__ import annotations

import ast
import copy
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import CodeType
from typing import Any

import numpy as np

from workbench.diagnosis.edits import Edit
from workbench.diagnosis.steps import RETURNED, Function, Program, Step, compiled_statement, functions_of

MOST_TRACES = 24
HEAVY_S = 1e-4
"""A call that took longer is not made again with the same arguments."""

MISSING = object()


class OutsideError(Exception):
    """An edit stands where nothing was recorded."""


Space = dict[str, Any]


@dataclass
class Trace:
    """One call of a function, statement by statement."""

    arguments: tuple[Any, ...]
    before: list[Space] = field(default_factory=list)
    """names before each statement, and at the end"""
    result: Any = None
    seconds: float = 0.0


class Tape:
    """A formula's run on one robot's states, to be gone through again with edits."""

    def __init__(self, text: str, path: str, module: Mapping[str, Any], function: Callable[..., Any]) -> None:
        self._data, self._path = text.encode(), path
        self._globals: Space = module  # type: ignore[assignment]
        self._functions = functions_of(text, path)
        self._traces: dict[str, list[Trace]] = {}
        self._main = next((name for name in self._functions if module.get(name) is function), None)

    def record(self, *arguments: Any) -> Any:
        """Run the formula and remember how.

        Raises
        ------
        OutsideError
            The formula is no function at the top of its file.
        Exception
            Whatever the formula raises.
        """
        if self._main is None:
            raise OutsideError
        self._patched(self._recorder)
        try:
            return self._globals[self._main](*arguments)
        finally:
            self._restore()

    def replay(self, edit: Edit, *arguments: Any) -> Any:
        """Run the formula with an edit.

        Raises
        ------
        OutsideError
            The edit stands outside of all functions.
        Exception
            Whatever the edited formula raises.
        """
        home = next((f for f in self._functions.values() if f.start <= edit.start and edit.end <= f.end), None)
        if home is None or self._main is None:
            raise OutsideError
        changed = _Changed(self, home, edit)
        self._patched(changed.wrapper)
        try:
            return self._globals[self._main](*arguments)
        finally:
            self._restore()

    def _patched(self, wrapper: Callable[[Function, Callable[..., Any]], Callable[..., Any]]) -> None:
        self._plain = {name: self._globals[name] for name in self._functions if callable(self._globals.get(name))}
        for name, plain in self._plain.items():
            self._globals[name] = wrapper(self._functions[name], plain)

    def _restore(self) -> None:
        self._globals.update(self._plain)

    def _recorder(self, function: Function, plain: Callable[..., Any]) -> Callable[..., Any]:
        program = function.program
        if program is None:
            return plain
        traces = self._traces.setdefault(function.name, [])

        def recorded(*arguments: Any, **named: Any) -> Any:
            if named or len(traces) >= MOST_TRACES or len(arguments) != len(program.parameters):
                return plain(*arguments, **named)
            trace = Trace(arguments)
            begun = time.perf_counter()
            local = dict(zip(program.parameters, arguments, strict=True))
            space = {**self._globals, **local}
            for step in program.steps:
                trace.before.append(dict(local))
                run(step, step.code, space)
                for name in step.writes:
                    if name in space:
                        local[name] = space[name]
            trace.before.append(local)
            trace.result, trace.seconds = local[RETURNED], time.perf_counter() - begun
            traces.append(trace)
            return trace.result

        return recorded


def run(step: Step, code: CodeType, space: Space) -> None:
    """Run a statement; what it may change in place is copied first."""
    for name in step.mutates:
        if isinstance(space.get(name), np.ndarray | list | dict):
            space[name] = copy.copy(space[name])
    exec(code, space)  # the user named this file on the command line


class _Changed:
    """One edit, and how calls of the module's functions go with it."""

    def __init__(self, tape: Tape, home: Function, edit: Edit) -> None:
        self._tape, self._home, self._edit = tape, home, edit
        every = tape._functions
        self._dirty = {home.name} | {name for name, function in every.items() if home.name in function.uses}
        self._start, self._code, self._whole = self._edited()

    def _edited(self) -> tuple[int, CodeType | None, Callable[..., Any] | None]:
        """The statement that the edit stands in, and its code; or the whole function where it cannot be told."""
        edit, program, data = self._edit, self._home.program, self._tape._data
        if program is not None and self._tape._traces.get(self._home.name):
            for number, step in enumerate(program.steps):
                if step.start <= edit.start and edit.end <= step.end:
                    lines = data[step.start : edit.start] + edit.new.encode() + data[edit.end : step.end]
                    return number, compiled_statement(lines, self._tape._path), None
        return 0, None, self._function()

    def _function(self) -> Callable[..., Any]:
        """The whole function, edited."""
        home, edit, data = self._home, self._edit, self._tape._data
        text = data[home.start : edit.start] + edit.new.encode() + data[edit.end : home.end]
        made: Space = {}
        exec(compile(ast.parse(text), self._tape._path, "exec"), self._tape._globals, made)
        found: Callable[..., Any] = made[home.name]
        return found

    def wrapper(self, function: Function, plain: Callable[..., Any]) -> Callable[..., Any]:
        name, program = function.name, function.program
        traces = self._tape._traces.get(name, [])
        mine, dirty = name == self._home.name, name in self._dirty
        if mine and self._whole is not None:
            return self._whole
        if program is None or not traces:
            return plain
        if not dirty and not any(trace.seconds > HEAVY_S for trace in traces):
            return plain

        def called(*arguments: Any, **named: Any) -> Any:
            trace = None if named else next((t for t in traces if _same_all(t.arguments, arguments)), None)
            if trace is not None:
                return self._replayed(program, trace, mine) if dirty else trace.result
            if mine:
                return self._compiled_whole()(*arguments, **named)
            return plain(*arguments, **named)

        return called

    def _compiled_whole(self) -> Callable[..., Any]:
        if self._whole is None:
            self._whole = self._function()
        return self._whole

    def _replayed(self, program: Program, trace: Trace, mine: bool) -> Any:
        start = self._start if mine else 0
        stale: set[str] = set()
        space = {**self._tape._globals, **trace.before[start]}
        for number in range(start, len(program.steps)):
            step, after = program.steps[number], trace.before[number + 1]
            edited = mine and number == start
            if not (edited or step.reads & stale or step.reads & self._dirty):
                for name in step.writes:
                    if name in after:
                        space[name] = after[name]
                stale -= step.writes
                continue
            code = self._code if edited and self._code is not None else step.code
            run(step, code, space)
            for name in step.writes:
                if same(space.get(name, MISSING), after.get(name, MISSING)):
                    space[name] = after.get(name)
                    stale.discard(name)
                else:
                    stale.add(name)
            if edited and not stale:
                return trace.result
        return space[RETURNED]


def same(one: Any, other: Any) -> bool:
    """Whether two values are the same, to the last bit."""
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return one.shape == other.shape and one.dtype == other.dtype and bool(np.array_equal(one, other))
    if isinstance(one, float | int | str | np.generic):
        return bool(one == other)
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same, one, other))
    return False


def _same_all(one: tuple[Any, ...], other: tuple[Any, ...]) -> bool:
    return len(one) == len(other) and all(map(same, one, other))
