"""One sample where a batch is meant: methods take ``(k,)`` as well as ``(n, k)``, and answer in kind."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

Method = TypeVar("Method", bound=Callable[..., Any])


def one_or_many(arrays: int) -> Callable[[Method], Method]:
    """Let the first *arrays* arguments of a method be single samples; the answer loses its first axis then."""

    def decorate(method: Method) -> Method:
        @functools.wraps(method)
        def either(self: Any, *given: Any, **named: Any) -> Any:
            if not given or (given[0].ndim if type(given[0]) is np.ndarray else np.ndim(given[0])) != 1:
                return method(self, *given, **named)
            batch = [np.asarray(value)[None] for value in given[:arrays]]
            return _first(method(self, *batch, *given[arrays:], **named))

        return either  # type: ignore[return-value]

    return decorate


def _first(found: Any) -> Any:
    if isinstance(found, tuple):
        return tuple(_first(value) for value in found)
    if isinstance(found, dict):
        return {name: _first(value) for name, value in found.items()}
    return found[0]
