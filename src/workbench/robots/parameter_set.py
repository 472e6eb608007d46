"""The values of a robot's parameters: a frozen dataclass made for its names, so that formulas read ``p.m2``."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from workbench.errors import ParameterError, did_you_mean

Groups = tuple[tuple[str, tuple[str, ...]], ...]


class ParameterSet:
    """Base of every such dataclass; values are SI.

    The name of a group (``parameters.a2`` for ``a2_left`` and ``a2_right``) reads the common value of its members.
    """

    _groups: Mapping[str, tuple[str, ...]] = {}

    def __getattr__(self, name: str) -> Any:
        """Common value of a group.

        Raises
        ------
        ParameterError
            The members differ, so the group has no single value.
        AttributeError
            There is no such parameter; the nearest one is named.
        """
        if name.startswith("__"):
            raise AttributeError(name)
        members = type(self)._groups.get(name)
        if members is None:
            known = [field.name for field in dataclasses.fields(self)]  # type: ignore[arg-type]
            raise AttributeError(f'no parameter "{name}"{did_you_mean(name, [*known, *type(self)._groups])}')
        found = [getattr(self, member) for member in members]
        if any(value != found[0] for value in found):
            listed = ", ".join(f"{member} = {value:g}" for member, value in zip(members, found, strict=True))
            raise ParameterError(f"parameter {name}: its members differ, {listed}; name one of them")
        return found[0]

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Made anew in another process, where the class does not exist yet."""
        return _again, (tuple(vars(self).items()), tuple(type(self)._groups.items()))


def _again(values: tuple[tuple[str, float], ...], groups: Groups) -> Any:
    return parameter_type(tuple(name for name, _ in values), groups)(**dict(values))


@lru_cache(maxsize=64)
def parameter_type(names: tuple[str, ...], groups: Groups = ()) -> type:
    """Return the frozen dataclass with these fields; the same one for the same names."""
    fields = [(name, float) for name in names]
    made = dataclasses.make_dataclass("Parameters", fields, bases=(ParameterSet,), frozen=True)
    made._groups = dict(groups)  # type: ignore[attr-defined]
    return made
