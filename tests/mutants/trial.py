"""One trial: some tests run over the copy of the package, in a fork of a process that holds the libraries already.

The parent never imports the package itself, so a child's import sees the planted fault. Kernels are compiled anew only
where a file that they are made of has changed; the machine code of a mutant goes to a cache of its own.
"""

from __future__ import annotations

import ast
import hashlib
import importlib
import json
import math
import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mutants.tree import COPY

LIBRARIES = (
    "numpy", "scipy.linalg", "scipy.spatial", "scipy.interpolate", "scipy.optimize", "pandas", "pyarrow.parquet",
    "matplotlib.pyplot", "mujoco", "mujoco.batch", "numba", "pinocchio", "pydantic", "typer.testing", "rich.progress",
    "jinja2", "yaml", "portalocker", "hypothesis", "hypothesis.strategies", "pytest", "coverage",
)  # fmt: skip

DECORATORS = ("compiled", "borrowing", "inlined", "merged")
"""of `workbench.compiled`: what makes machine code of a function"""

KILLED, SURVIVED, TIMED_OUT, BROKEN = "killed", "survived", "timed out", "broken"


@dataclass(frozen=True)
class Outcome:
    """What became of one trial."""

    status: str
    by: str
    """test that noticed"""
    seconds: float
    """of the processor"""


def warm() -> None:
    """Import what does not change, once for all trials."""
    os.environ.setdefault("MPLBACKEND", "Agg")
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ[name] = "1"
    for name in LIBRARIES:
        try:
            importlib.import_module(name)
        except ImportError:
            continue


def trial(
    tests: Iterable[str],
    cache: Path,
    limit: int,
    plugins: tuple[Any, ...] = (),
    stop: bool = True,
    interpreted: bool = False,
) -> Outcome:
    """Run tests in a fork until the first fails; *limit* in seconds of the processor.

    *interpreted*: the reference's kernels stay Python, which is slow, and still faster than compiling them.
    """
    log = COPY.parent / "last.json"
    log.unlink(missing_ok=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    child = os.fork()
    if child == 0:
        _run(list(tests), cache, limit, plugins, stop, log, interpreted)
    status = _wait(child, 10 * limit)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    said = json.loads(log.read_text()) if log.exists() else {}
    if os.WIFSIGNALED(status):
        ended = os.WTERMSIG(status)
        late = ended in (signal.SIGXCPU, signal.SIGKILL)
        return Outcome(TIMED_OUT if late else KILLED, signal.Signals(ended).name, spent)
    code = os.WEXITSTATUS(status)
    if code == 0:
        return Outcome(SURVIVED, "", spent)
    # pytest calls it a wrong usage (4) where a file that holds a test by name cannot be imported
    noticed = code in (1, 2) or (code == 4 and "failed" in said)
    return Outcome(KILLED if noticed else BROKEN, said.get("failed", f"exit code {code}"), spent)


def _wait(child: int, limit: float) -> int:
    """The wait status of a child; one that sleeps for ever is killed."""
    end = time.monotonic() + limit
    while True:
        found, status = os.waitpid(child, os.WNOHANG)
        if found:
            return status
        if time.monotonic() > end:
            os.killpg(child, signal.SIGKILL)
            return os.waitpid(child, 0)[1]
        time.sleep(0.02)


class _FirstFailure:
    """Writes down which test failed."""

    def __init__(self, log: Path) -> None:
        self.log = log

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed and not self.log.exists():
            self.log.write_text(json.dumps({"failed": report.nodeid}))

    def pytest_collectreport(self, report: Any) -> None:
        if report.failed and not self.log.exists():
            self.log.write_text(json.dumps({"failed": f"{report.nodeid} (import)"}))


def _run(
    tests: list[str], cache: Path, limit: int, plugins: tuple[Any, ...], stop: bool, log: Path, interpreted: bool
) -> None:
    code = 3
    try:
        os.setpgid(0, 0)
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
        out = os.open(log.with_suffix(".log"), os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        os.dup2(out, 1)
        os.dup2(out, 2)
        os.chdir(COPY)
        source = str(COPY / "src")
        sys.path[:] = [source, *(place for place in sys.path if not place.endswith(("/tests", "/src")))]
        if "workbench" in sys.modules:
            raise RuntimeError("the package was imported before its copy could be")
        os.environ |= {"PYTHONPATH": source, "NUMBA_CACHE_DIR": str(cache), "PYTHONDONTWRITEBYTECODE": ""}
        sys.dont_write_bytecode = False  # what is not changed need not be compiled again; see `tree.planted`
        import numba
        import pytest

        numba.config.CACHE_DIR = str(cache)
        stamp_by_parts(COPY / "src" / "workbench")
        if interpreted:
            interpret()
        options = ["-q", "-n", "0", "-p", "no:cacheprovider", "-W", "ignore::pytest.PytestAssertRewriteWarning"]
        code = int(pytest.main([*tests, *options, *(["-x"] if stop else [])], plugins=[_FirstFailure(log), *plugins]))
        if not str(sys.modules["workbench"].__file__).startswith(source):
            raise RuntimeError(f"another copy was tested: {sys.modules['workbench'].__file__}")
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def interpret() -> None:
    """Leave the reference's kernels uncompiled from here on, with their arithmetic: a division by zero is infinite.

    Numbers of Python raise there; those of NumPy do not, and all that `math` returns is one of those from here on.
    """
    from types import SimpleNamespace

    import numpy as np
    from numba.experimental import structref

    from workbench import compiled

    np.seterr(all="ignore")
    ieee = SimpleNamespace(**{name: getattr(math, name) for name in dir(math)})
    for name, function in {"sqrt": np.sqrt, "sin": np.sin, "cos": np.cos, "atan2": np.arctan2, "log2": np.log2}.items():
        setattr(ieee, name, function)

    def plain_or(by: Any) -> Any:
        def decorated(function: Any) -> Any:
            if not function.__module__.startswith("workbench.reference."):
                return by(function)
            function.py_func = function  # as a compiled kernel gives its Python
            if function.__globals__.get("math") is math:
                function.__globals__["math"] = ieee
            return function

        return decorated

    for name in DECORATORS:
        setattr(compiled, name, plain_or(getattr(compiled, name)))

    class Plain:
        """Arrays held together for machine code, as Python holds them."""

        fields: tuple[str, ...] = ()

        def __init__(self, *values: Any) -> None:
            for field, value in zip(self.fields, values, strict=True):
                setattr(self, field, value)

    structref.StructRefProxy = Plain
    structref.register = lambda kind: kind
    structref.define_proxy = lambda proxy, kind, fields: setattr(proxy, "fields", tuple(fields))


def stamp_by_parts(package: Path) -> None:
    """Bind a kernel's machine code to the files that it can call, not to all files with kernels.

    A user's installation is safe with the coarser rule; here it would compile everything for every mutant.
    """
    from workbench import compiled

    known: dict[str, str] = {}

    def fingerprint(module: str) -> str:
        if module not in known:
            names = sorted(kernel_files(package, module.removeprefix("workbench.").replace(".", "/") + ".py"))
            content = b"".join((package / name).read_bytes() for name in ("compiled.py", *names))
            known[module] = hashlib.sha256(content).hexdigest()
        return known[module]

    coarse = compiled._cached

    def cached(function: Any, more: dict[str, Any]) -> Any:
        compiled._known[:] = [fingerprint(function.__module__)]
        return coarse(function, more)

    compiled._cached = cached


def kernel_files(package: Path, module: str) -> set[str]:
    """A file with kernels and all such files that it imports."""
    from workbench.compiled import KERNEL_FILES

    found, open_ = set(), [module]
    while open_:
        name = open_.pop()
        if name in found:
            continue
        found.add(name)
        for node in ast.walk(ast.parse((package / name).read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("workbench."):
                inner = (node.module or "").removeprefix("workbench.").replace(".", "/")
                open_ += [
                    f for f in (f"{inner}.py", *(f"{inner}/{a.name}.py" for a in node.names)) if f in KERNEL_FILES
                ]
    return found
