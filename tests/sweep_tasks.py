"""Tasks that do what should never happen, without the workbench: for tests of the workers alone. They start fast."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from typing import Any

HOG_MB = 50


def _hog() -> None:
    held = []
    while True:
        held.append(b"x" * (HOG_MB * 1_000_000))


def suffer(fault: str) -> None:
    """Do what a fault's name says; nothing for other names."""
    if fault == "raise":
        raise ValueError("planted")
    if fault == "exit":
        raise SystemExit(7)
    if fault == "hang":
        time.sleep(3600)
    if fault == "os._exit":
        os._exit(3)
    if fault == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    if fault == "segfault":
        os.kill(os.getpid(), signal.SIGSEGV)
    if fault == "memory":
        _hog()
    if fault == "print":
        os.write(1, b"\x00" * 100)
        print("noise on standard output", flush=True)


def broken_setup() -> Callable[[Any], Any]:
    raise RuntimeError("nothing here")


def echo_setup() -> Callable[[Any], Any]:
    """Set up a worker that needs nothing: for tests of the supervisor alone."""
    return echo


def echo(task: tuple[str, float]) -> Any:
    kind, number = task
    suffer(kind)
    if kind == "large":
        return b"x" * int(number)
    if kind == "wait":
        time.sleep(number)
    return number
