"""MuJoCo's warnings, heard by who computes: its handler and Python's filters are one for all threads of a process.

A thread that put either back as it found it would take it from another that computes at the same time, as the studio
does beside a run. So neither is ever put back to what one thread saw: the handler goes when nobody listens any more,
the filter stays.
"""

from __future__ import annotations

import contextlib
import re
import threading
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import mujoco

COMPILED_BY = re.compile(r"workbench\.(mjcf|reference)\.")
"""Modules that compile specifications, which warn in Python's way."""

_changing = threading.Lock()
_listening: list[tuple[int, list[str]]] = []
"""thread and what it has heard, the innermost last"""
_before: list[Callable[[str], Any] | None] = []
"""the handler that was there before anybody listened"""


class EvaluationWarnings:
    """Collects MuJoCo's warnings while models are evaluated; left alone it prints them and writes a log file.

    Each thread hears its own; those of MuJoCo's own threads are heard by all. A class, since it is entered for every
    block of samples, and a generator's costs as much as a short block does.
    """

    def __enter__(self) -> list[str]:
        """From now on warnings go into the list that is returned."""
        heard: list[str] = []
        self._mine = threading.get_ident(), heard
        with _changing:
            if not _listening:
                _before.append(mujoco.get_mju_user_warning())
                mujoco.set_mju_user_warning(_heard)
            _listening.append(self._mine)
        return heard

    def __exit__(self, *_: object) -> None:
        """Whoever heard them before hears them again."""
        with _changing:
            if _listening[-1] is self._mine:
                _listening.pop()
            else:  # by identity: two that have heard the same are equal
                _listening[:] = [one for one in _listening if one is not self._mine]
            if not _listening:
                mujoco.set_mju_user_warning(_before.pop())


@contextlib.contextmanager
def engine_warnings() -> Iterator[list[str]]:
    """As `EvaluationWarnings`, where models are compiled, too.

    What a specification's own ``compile`` says comes as Python's UserWarning, and is dropped.
    """
    _drop_what_compile_says()
    with EvaluationWarnings() as heard:
        yield heard


def _heard(warning: str) -> None:
    thread, listening = threading.get_ident(), list(_listening)
    own = [heard for listener, heard in listening if listener == thread]
    for heard in own[-1:] or [heard for _, heard in listening]:
        heard.append(warning)


def _drop_what_compile_says() -> None:
    dropped = ("ignore", None, UserWarning, COMPILED_BY, 0)
    if warnings.filters[:1] != [dropped]:
        warnings.filterwarnings("ignore", category=UserWarning, module=COMPILED_BY.pattern)
