"""Calls of the command line that are watched: what came back, in how much time, with how much memory.

A server imports everything and loads the compiled kernels once; each call is a fork of it. So a call costs no start of
an interpreter, yet what it does to its process (memory, limits, threads, modules) ends with it, and time and memory
are its own: the system's figures of the fork and of every process that it waited for.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import pickle
import pkgutil
import re
import resource
import select
import signal
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

LONGEST_S = 60.0
"""of computing: seconds of a clock would be the machine's load"""
HANGS_S = 400.0
"""by the clock, on a machine that others use as well"""
LARGEST_MB = 2000.0
PROGRESS = re.compile(r"\[\d+/\d+\] |workbench: compiling ")

Content = str | bytes | Callable[[Path], object]


@dataclass(frozen=True, eq=False)
class Bad:
    """A bad input: files (or what makes them) by name, arguments, and what the line must say."""

    name: str
    arguments: tuple[str, ...]
    files: Mapping[str, Content] = field(default_factory=dict)
    says: str = ""
    codes: tuple[int, ...] = (2,)


@dataclass(frozen=True)
class Answer:
    """What the command line did."""

    code: int
    out: str
    err: str
    seconds: float
    """of computing"""
    megabytes: float

    @property
    def lines(self) -> list[str]:
        return [line for line in self.err.splitlines() if line.strip() and not PROGRESS.match(line)]

    def fault(self, bad: Bad) -> str:
        """What is wrong with the answer; empty where nothing is."""
        if self.code < 0:
            return f"ended by {signal.Signals(-self.code).name}: {self.err[-600:]}"
        if self.code not in bad.codes:
            return f"exit code {self.code}: {(self.err or self.out)[-600:]}"
        if self.code == 2:
            if len(self.lines) != 1 or not self.lines[0].startswith("workbench: "):
                return f"no one line: {self.err[-600:]}"
            if bad.says.lower() not in self.lines[0].lower():
                return f'does not say "{bad.says}": {self.lines[0][:600]}'
            if len(self.lines[0]) > 1500:
                return f"a line of {len(self.lines[0])} characters: {self.lines[0][:200]}"
            if "out of memory" in self.lines[0]:
                return f"takes too much memory: {self.lines[0]}"
        if self.code == 1 and bad.says.lower() not in (self.out + self.err).lower():
            return f'does not say "{bad.says}": {self.out[-600:]}'
        if "Traceback" in self.err + self.out or "internal error" in self.err:
            return f"traceback: {self.err[-600:]}"
        if self.megabytes > LARGEST_MB:
            return f"takes {self.megabytes:.0f} MB"
        if self.seconds > LONGEST_S:
            return f"takes {self.seconds:.0f} s"
        return ""


def lay(place: Path, files: Mapping[str, Content]) -> None:
    for name, content in files.items():
        path = place / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if callable(content):
            content(path)
        elif isinstance(content, bytes):
            path.write_bytes(content)
        else:
            path.write_text(content, encoding="utf-8")


def prepare(repository: Path) -> Callable[[tuple[str, tuple[str, ...]]], Answer]:
    """Begin a server: what the calls need is imported, the kernels of the robot they use are loaded."""
    import numpy as np

    import workbench as wb

    for module in pkgutil.walk_packages(wb.__path__, "workbench."):
        if not module.name.endswith(("__main__", "worker", "served", "viewer", "cluster", "pinocchio_reference")):
            importlib.import_module(module.name)
    model = repository / "models" / "asym_2rss_ppap.xml"
    mechanism, reference = wb.load_mechanism(model), wb.MujocoReference(model)
    q, still = mechanism.inverse_kinematics(np.tile((0.0, 0.0, 0.4), (30, 1))), np.zeros((30, 3))
    mechanism.platform_motion(q, still, still)
    mechanism.inverse_dynamics(q, still, still)
    reference.inverse_dynamics(q, still, still)
    return call


def call(task: tuple[str, tuple[str, ...]]) -> Answer:
    """Call the command line in a directory, in a fork of this process."""
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # threads of libraries that hold no lock of ours
        number = os.fork()
    if not number:
        os.close(reading)
        _obey(task, writing)
    os.close(writing)
    data, ended = _read(reading, time.monotonic() + HANGS_S)
    os.close(reading)
    if not ended:
        os.killpg(number, signal.SIGKILL)
    _, status, usage = os.wait4(number, 0)
    seconds, megabytes = usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3
    if not ended:
        return Answer(-signal.SIGKILL, "", f"hangs: no answer within {HANGS_S:g} s", seconds, megabytes)
    if not data:
        return Answer(os.waitstatus_to_exitcode(status) or -signal.SIGKILL, "", "no answer", seconds, megabytes)
    code, out, err = pickle.loads(data)
    return Answer(code, out, err, seconds, megabytes)


def _read(descriptor: int, deadline: float) -> tuple[bytes, bool]:
    """Everything that comes out of a pipe, and whether its end was reached in time."""
    found = []
    while True:
        ready, _, _ = select.select([descriptor], [], [], max(deadline - time.monotonic(), 0.0))
        if not ready:
            return b"".join(found), False
        piece = os.read(descriptor, 1 << 20)
        if not piece:
            return b"".join(found), True
        found.append(piece)


def _obey(task: tuple[str, tuple[str, ...]], writing: int) -> None:
    """Be the command line, then end without a word to what the server has open."""
    place, arguments = task
    out, err = io.StringIO(), io.StringIO()
    code = 1
    try:
        from workbench.cli import _run

        os.setpgid(0, 0)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        os.chdir(place)
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                code = _run(list(arguments))
            except SystemExit as stop:
                code = stop.code if isinstance(stop.code, int) else 1
    except BaseException as error:
        err.write(f"Traceback: {type(error).__name__}: {str(error)[:500]}")
    finally:
        with contextlib.suppress(BaseException), os.fdopen(writing, "wb") as stream:
            stream.write(pickle.dumps((code, out.getvalue(), err.getvalue())))
        os._exit(0)
