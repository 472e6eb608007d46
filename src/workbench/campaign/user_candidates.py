"""Candidates from a user's Python file or an installed package: loaded when the command line names them, and only then.

A user's function may do anything wrong: raise, return the wrong shape or NaN, write into its arguments, never end.
Whatever it does becomes one line with the user's own file and line, and the campaign goes on.
"""

from __future__ import annotations

import importlib.util
import inspect
import re
import signal
import statistics
import sys
import threading
import time
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.machinery import SourceFileLoader
from importlib.metadata import entry_points
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.candidate_spec import CandidateSpec
from workbench.campaign.spec import Campaign
from workbench.capabilities.robot import Robot
from workbench.errors import CandidateError, SpecError, did_you_mean
from workbench.robots.closed_form import Candidate
from workbench.robots.registration import MARK, Registration
from workbench.schema import NAME, NAME_RULE

LIMIT_S = 60.0
"""Longest time that one call may take before it is stopped, where the system can (not in threads, not on Windows)."""

SLOW_S = 1e-3
"""Seconds per sample from which a candidate is called slow: the papers' slowest formula takes 7e-4 s."""

GROUP = "workbench.candidates"
"""Entry points of installed packages: each names a module with registered functions."""

HERE = str(Path(__file__))


class UserCandidate:
    """A user's function, called with arrays that it cannot write to and judged on what it returns."""

    def __init__(self, function: Any, registration: Registration) -> None:
        self.registration = registration
        self.name = registration.name
        self._function = function
        code = inspect.unwrap(function).__code__
        self.file, self.line = Path(code.co_filename), code.co_firstlineno
        self._with_force = _takes_force(function, self.where)
        self._taken: list[float] = []

    @property
    def where(self) -> str:
        """``my_model.py:12``, the line where the function, with its decorators, begins."""
        return f"{self.file.name}:{self.line}"

    @property
    def seconds_per_sample(self) -> float:
        """Median over the calls so far; NaN before the first."""
        return statistics.median(self._taken) if self._taken else float("nan")

    def as_candidate(self) -> Candidate:
        """The same as a candidate of a robot."""
        about = self.registration
        return Candidate(self.name, about.reference, self, about.description, about.source or self.where)

    def __call__(self, robot: Robot, q: FloatArray, qd: FloatArray, qdd: FloatArray, force: FloatArray) -> FloatArray:
        """Call the function.

        Raises
        ------
        CandidateError
            It raised, took too long, or returned something that is no finite array ``(n, na)``; with file and line.
        """
        given = [_sealed(array) for array in ((q, qd, qdd, force) if self._with_force else (q, qd, qdd))]
        begun = time.perf_counter()
        try:
            with _limit(LIMIT_S):
                found = self._function(robot.parameters, *given)
        except _TooSlow as error:
            raise self._fault(f"takes more than {LIMIT_S:g} s for {len(q)} samples", error) from error
        except (Exception, SystemExit) as error:  # an exit code of theirs would be taken for the verdict
            raise self._fault(f"{type(error).__name__}: {error}", error) from error
        self._taken.append((time.perf_counter() - begun) / max(len(q), 1))
        return self._checked(found, q.shape, robot.joints)

    def _checked(self, found: Any, shape: tuple[int, ...], joints: tuple[str, ...]) -> FloatArray:
        if np.iscomplexobj(found):
            raise self._fault("returns complex numbers; expected real ones")
        try:
            tau = np.array(found, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise self._fault(f"returns {type(found).__name__}; expected numbers of shape {shape}") from error
        if tau.shape != shape:
            raise self._fault(f"returns an array of shape {tau.shape}; expected {shape}: samples, then {_and(joints)}")
        if not np.isfinite(tau).all():
            sample, joint = np.argwhere(~np.isfinite(tau))[0]
            raise self._fault(
                f"returns {tau[sample, joint]} for sample {sample}, joint {joints[joint]}"
                f" ({np.count_nonzero(~np.isfinite(tau))} of {tau.size} entries are not finite)",
                sample=int(sample),
            )
        return tau

    def _fault(self, what: str, error: BaseException | None = None, **facts: Any) -> CandidateError:
        line = self.where
        for frame in traceback.extract_tb(error.__traceback__) if error else ():
            if Path(frame.filename) == self.file:
                line = f"{self.file.name}:{frame.lineno}"
        return CandidateError(f'candidate "{self.name}" ({line}) {what}', candidate=self.name, line=line, **facts)


class _TooSlow(BaseException):
    """Stops a user's function; no ``except Exception`` of theirs holds it up."""


@contextmanager
def _limit(seconds: float) -> Iterator[None]:
    able = hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()
    if not able:
        yield
        return

    def stop(number: int, frame: object) -> None:
        raise _TooSlow

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _sealed(array: FloatArray) -> FloatArray:
    copy = np.array(array, dtype=np.float64)
    copy.flags.writeable = False
    return copy


def _and(names: tuple[str, ...]) -> str:
    return " ".join(names)


def _takes_force(function: Any, where: str) -> bool:
    """Whether a function takes the external force as its fifth argument."""
    parameters = list(inspect.signature(function).parameters.values())
    kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    needed = [p for p in parameters if p.kind in kinds and p.default is p.empty]
    taken = [p for p in parameters if p.kind in kinds]
    if len(needed) > 5 or len(taken) < 4 or any(p.kind is p.KEYWORD_ONLY and p.default is p.empty for p in parameters):
        raise SpecError(
            f"{where}: a candidate is called as f(parameters, q, qd, qdd) or f(parameters, q, qd, qdd, external_force),"
            f" got {getattr(function, '__name__', 'f')}{inspect.signature(function)}"
        )
    return len(taken) >= 5


def load_candidates(names: Iterable[str | Path]) -> tuple[UserCandidate, ...]:
    """Load the candidates of Python files and of installed entry points.

    Parameters
    ----------
    names
        Paths of files, ``.py`` or in another language (docs/languages.md), or names of entry points of the group
        `GROUP`.

    Raises
    ------
    SpecError
        No such file or entry point; the file does not run (with its own line); nothing is registered in it; a name
        that stands twice.
    """
    from workbench.campaign.foreign_candidates import is_foreign, load_foreign

    found: list[UserCandidate] = []
    for name in names:
        if is_foreign(Path(name)):
            found.append(load_foreign(Path(name)))
            continue
        module = _module(str(name))
        registered = [
            UserCandidate(value, getattr(value, MARK))
            for value in list(vars(module).values())
            if callable(value) and isinstance(getattr(value, MARK, None), Registration)
        ]
        if not registered:
            raise SpecError(
                f"{name}: no candidate is registered in it; mark a function with @workbench.candidate",
                file=str(name),
            )
        found += dict.fromkeys(registered)
    for one in found:
        if not re.match(NAME, one.name):
            raise SpecError(f'{one.where}: candidate name "{one.name}"; {NAME_RULE}', candidate=one.name)
        if sum(one.name == other.name for other in found) > 1:
            raise SpecError(f'{one.where}: candidate "{one.name}" is registered twice', candidate=one.name)
    return tuple(found)


def full_names(names: Iterable[str | Path]) -> tuple[str, ...]:
    """Names that mean the same in another process: whole paths of files, entry points as they are."""
    return tuple(str(Path(name).resolve()) if Path(name).is_file() else str(name) for name in names)


def _module(name: str) -> ModuleType:
    path = Path(name)
    installed = {entry.name: entry for entry in entry_points(group=GROUP)}
    if not path.is_file():
        if name in installed:
            return _run(name, installed[name].load)
        raise SpecError(
            f"{name}: no such Python file, nor an installed entry point of {GROUP}{did_you_mean(name, installed)}",
            file=name,
        )
    if path.suffix != ".py":
        raise SpecError(
            f"{name}: candidates stand in a file .py, .m, .c, .so, .jl, .R or in a program that can be run", file=name
        )
    loader = _Uncached(f"workbench_candidates_{path.stem}", str(path.resolve()))
    spec = importlib.util.spec_from_loader(loader.name, loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    # dataclasses and pickle look a function's module up by its name
    sys.modules[spec.name] = module

    def execute() -> ModuleType:
        loader.exec_module(module)
        return module

    return _run(name, execute)


class _Uncached(SourceFileLoader):
    """Reads the source every time: a sign mended within a second leaves a file's size and second of saving alone."""

    def get_code(self, fullname: str) -> CodeType:
        """Compile what the file holds now."""
        return self.source_to_code(self.get_data(self.path), self.path)


def _run(name: str, load: Any) -> ModuleType:
    try:
        module: ModuleType = load()
    except SyntaxError as error:
        raise SpecError(f"{name}:{error.lineno}: {error.msg}", file=name) from error
    except (Exception, SystemExit) as error:  # an exit code of theirs would be taken for the verdict
        own = [f for f in traceback.extract_tb(error.__traceback__) if Path(f.filename).name == Path(name).name]
        line = f":{own[-1].lineno}" if own else ""
        raise SpecError(f"{name}{line}: {type(error).__name__}: {error}", file=name) from error
    return module


def offer(robot: Robot, users: Iterable[UserCandidate]) -> None:
    """Add a user's candidates to those of one robot.

    Raises
    ------
    SpecError
        The robot has a candidate of that name already.
    """
    extra = {}
    for user in users:
        if user.name in robot.candidates:
            raise SpecError(f'{user.where}: {robot.name} already has a candidate "{user.name}"; choose another name')
        extra[user.name] = user.as_candidate()
    if extra:
        robot.offer(extra)


def with_rows(campaign: Campaign, users: Iterable[UserCandidate]) -> Campaign:
    """Return the campaign with a row for each of the user's candidates that it does not name itself.

    Raises
    ------
    SpecError
        A registered bound that is not a positive number.
    """
    named = {candidate.name for candidate in campaign.candidate}
    rows = []
    for user in users:
        if user.name in named:
            continue
        about = user.registration
        if about.bound is not None and not (isinstance(about.bound, int | float) and 0 < about.bound < float("inf")):
            raise SpecError(f"{user.where}: bound = {about.bound!r}; allowed: a number > 0")
        rows.append(CandidateSpec(name=user.name, reference=about.reference, bound=about.bound))
    return campaign.model_copy(update={"candidate": [*campaign.candidate, *rows]}) if rows else campaign
