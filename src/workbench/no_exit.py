"""A user's code cannot end the process: an exit code of its own would be taken for the verdict.

While such code runs, what ends a Python process (``os._exit``, ``os.abort``, ``os.exec...``, a signal to itself) raises
in place of ending it; in a process that is a command of the workbench also afterwards, in threads that the code leaves
behind and in what it registers for the end. A library in machine code that calls C's ``exit`` (a Fortran ``STOP``)
during a call is met on its way out. One that ends the process past all that (``_exit`` in machine code) is not met.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

BAD_INPUT = 2
OWN = str(Path(__file__).parent) + os.sep
ALWAYS = ("_exit", "abort", "execv", "execve")
SIGNALS = ("kill", "killpg")
LINE = b"workbench: a formula's library ended the process by exit(); it has to return\n"


class EndsProcess(BaseException):
    """Raised where a user's code would have ended the process; no ``except Exception`` of theirs holds it up."""


_real: dict[str, Callable[..., Any]] = {}
_process = [0]
_inside = [0]
"""calls of a user's code that are under way"""
_for_good = [False]
_kept: list[Any] = []
"""callbacks that machine code holds"""


@contextmanager
def no_exit() -> Iterator[None]:
    """Run a user's code: what would end the process raises `EndsProcess` in it, now and later."""
    if _process[0] != os.getpid():
        _install()
    _inside[0] += 1
    try:
        yield
    finally:
        _inside[0] -= 1


def for_good() -> None:
    """Say that this process is a command of the workbench: what a user's code leaves behind cannot end it either."""
    _for_good[0] = True


def _install() -> None:
    known = bool(_process[0])
    _process[0] = os.getpid()  # a forked process that runs such code has its own verdict
    if known:
        return
    modules = [os, *(sys.modules[name] for name in ("posix", "nt") if name in sys.modules)]
    for name in (*ALWAYS, *SIGNALS):
        if hasattr(os, name):
            _replace(modules, name, _guard if name in ALWAYS else _signal_guard)
    if hasattr(signal, "raise_signal"):
        _replace([signal, sys.modules["_signal"]], "raise_signal", _guard)
    with contextlib.suppress(AttributeError, OSError, TypeError):
        _meet_exit()


def _replace(modules: list[ModuleType], name: str, guard: Callable[[str], Callable[..., Any]]) -> None:
    _real[name] = getattr(modules[0], name)
    for module in modules:
        if hasattr(module, name):
            setattr(module, name, guard(name))


def _guard(name: str) -> Callable[..., Any]:
    def guarded(*arguments: Any) -> Any:
        if _let_through():
            return _real[name](*arguments)
        raise EndsProcess(f"ends the process by {name}({', '.join(map(repr, arguments[:1]))}); it has to return")

    return guarded


def _signal_guard(name: str) -> Callable[..., Any]:
    def guarded(target: int, number: int) -> Any:
        own = (os.getpid(), 0, -1, -os.getpgrp()) if name == "kill" else (os.getpgrp(), 0)
        if number == 0 or target not in own or _let_through():
            return _real[name](target, number)
        raise EndsProcess(f"sends signal {int(number)} to the process that runs it; it has to return")

    return guarded


def _let_through() -> bool:
    """Whether the call is none of the user's: of the package, of a process forked off, or of whoever called it."""
    if os.getpid() != _process[0] or not (_inside[0] or _for_good[0]):
        return True
    try:
        return sys._getframe(2).f_code.co_filename.startswith(OWN)
    except ValueError:  # called by the interpreter itself, at its end
        return False


def _meet_exit() -> None:
    """Be called by C's ``exit`` while the interpreter still runs, and turn it into a bad input."""
    import ctypes

    library = ctypes.CDLL(None)
    handler_type = ctypes.CFUNCTYPE(None, ctypes.c_void_p)

    def met(_: object) -> None:
        if _inside[0] and os.getpid() == _process[0]:
            with contextlib.suppress(OSError):
                os.write(2, LINE)
            _real["_exit"](BAD_INPUT)

    handler, owner = handler_type(met), ctypes.create_string_buffer(1)
    _kept.extend([handler, owner, library])
    library.__cxa_atexit(handler, None, owner)
    # before the interpreter goes, after which nothing of Python may be called
    atexit.register(library.__cxa_finalize, owner)
