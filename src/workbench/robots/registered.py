"""What a user's file registers while it runs, so that a function that its names have lost is missed.

Two functions of one name are one in Python: the second takes the place of the first, whatever they were registered as.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

from workbench.errors import SpecError

NOTED = "__workbench_registered__"
"""of a module: the functions that were registered in it, with what they were registered as"""
DEEPEST = 100
"""decorators around a function that are looked through"""


def note(function: Callable[..., Any], name: object) -> None:
    """Remember in the function's own module that it was registered under a name; what has no module is let be."""
    names = getattr(function, "__globals__", None)
    if isinstance(names, dict):
        names.setdefault(NOTED, []).append((function, name))


def refuse_lost(module: ModuleType, what: str, file: str) -> None:
    """Refuse a file that has registered a function which none of its names means any more.

    Raises
    ------
    SpecError
        With the function's line.
    """
    reached = {id(one) for value in list(vars(module).values()) for one in _layers(value)}
    for function, name in vars(module).get(NOTED, ()):
        if id(function) not in reached:
            raise SpecError(
                f'{file}:{function.__code__.co_firstlineno}: {what} "{name}" is registered and lost: its function'
                f" {function.__name__} is defined again, deleted, wrapped without functools.wraps, or inside another"
                " function; give each a name of its own",
                file=file,
            )


def _layers(value: Any) -> Iterator[Any]:
    """Yield what a name means, and what decorators have wrapped in it."""
    for _ in range(DEEPEST):
        yield value
        try:
            value = getattr(value, "__wrapped__", None) if callable(value) else None
        except Exception:  # an object whose attributes raise wraps nothing
            value = None
        if value is None:
            return
