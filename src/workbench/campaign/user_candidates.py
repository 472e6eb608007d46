"""Candidates from a user's Python file or an installed package: loaded when the command line names them, and only then.

A user's function may do anything wrong: raise, return the wrong shape or NaN, write into its arguments, never end.
Whatever it does becomes one line with the user's own file and line, and the campaign goes on.
"""

from __future__ import annotations

import inspect
import re
import statistics
import time
import traceback
from collections.abc import Callable, Iterable, Mapping
from contextlib import nullcontext
from dataclasses import fields, is_dataclass
from functools import partial
from pathlib import Path
from types import CodeType
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.bounded_call import TooSlow, UnrulyError, bounded, said
from workbench.campaign.candidate_spec import LARGEST_BOUND, CandidateSpec
from workbench.campaign.formula_files import Siblings, files_of, load_module
from workbench.campaign.formula_signature import wants_of
from workbench.campaign.spec import Campaign
from workbench.capabilities.robot import Robot
from workbench.errors import CandidateError, SpecError, did_you_mean
from workbench.robots.closed_form import Candidate
from workbench.robots.registered import refuse_lost
from workbench.robots.registration import FORWARD, MARK, TORQUE, Registration
from workbench.schema import NAME, NAME_RULE

LONGEST_ABOUT = 10_000
"""Characters of what a formula says about itself."""

LIMIT_S = 60.0
"""Longest time that one call may take before it is stopped, where the system can (not in threads, not on Windows)."""

LOADING_LIMIT_S = 60.0
"""Longest time that a file may take to run, likewise."""

SLOW_S = 1e-3
"""Seconds per sample from which a candidate is called slow: the papers' slowest formula takes 7e-4 s."""


class UserCandidate:
    """A user's function, called with arrays that it cannot write to and judged on what it returns."""

    def __init__(self, function: Any, registration: Registration, module: str, siblings: Siblings | None) -> None:
        self.registration = registration
        self.name = registration.name
        self._function = function
        self._siblings = siblings
        code = _code_of(function, module)
        self.file, self.line = Path(code.co_filename), code.co_firstlineno
        self._wants = wants_of(function, registration.kind, self.where)
        self._taken: list[float] = []

    @property
    def files(self) -> tuple[Path, ...]:
        """The file and those beside it that it has imported."""
        return files_of(self.file, self._siblings)

    @property
    def where(self) -> str:
        """``my_model.py:12``, the line where the function, with its decorators, begins."""
        return f"{self.file.name}:{self.line}" if self.line else self.file.name

    @property
    def takes_force(self) -> bool:
        """Whether the function is told the external force."""
        return self._wants.force

    @property
    def needs_time(self) -> bool:
        """Whether the function asks for the time, so that only samples of a motion can be handed to it."""
        return "t" in self._wants.motion

    @property
    def kind(self) -> str:
        """``torque``, or which kinematics it is."""
        return self.registration.kind

    @property
    def seconds_per_sample(self) -> float:
        """Median over the calls so far; NaN before the first."""
        return statistics.median(self._taken) if self._taken else float("nan")

    @property
    def function(self) -> Any:
        """What the user has written."""
        return self._function

    def as_candidate(self) -> Candidate:
        """The same as a candidate of a robot."""
        about = self.registration
        return Candidate(self.name, about.reference, self, about.description, about.source or self.where)

    def __call__(
        self,
        robot: Robot,
        q: FloatArray,
        qd: FloatArray,
        qdd: FloatArray,
        force: FloatArray,
        known: Mapping[str, FloatArray] | None = None,
    ) -> FloatArray:
        """Call the function; *known* is the time and the platform's motion at the samples, where they are a motion.

        Raises
        ------
        CandidateError
            It raised, took too long, or returned something that is no finite array ``(n, na)``; with file and line.
        """
        given = (q, qd, qdd, force) if self._wants.force else (q, qd, qdd)
        return self._called(robot, given, self._motion(robot, q, qd, qdd, known), q.shape, robot.joints)

    def kinematics(self, robot: Robot, given: FloatArray, expected: FloatArray) -> FloatArray:
        """Call a kinematics function with q or x; the result has the shape of *expected*.

        Raises
        ------
        CandidateError
            As of a torque.
        """
        columns = robot.joints if self.kind != FORWARD else robot.coordinates
        return self._called(robot, (given,), {}, expected.shape, columns)

    def _motion(
        self, robot: Robot, q: FloatArray, qd: FloatArray, qdd: FloatArray, known: Mapping[str, FloatArray] | None
    ) -> dict[str, FloatArray]:
        """What the function asks for by argument name; the platform's motion from the reference."""
        wanted = self._wants.motion
        if wanted and known is None:
            if self.needs_time:
                raise self._fault("asks for the time t, and these samples are no motion")
            known = vars(robot.reference.inverse_dynamics(q, qd, qdd))
        return {name: known[name] for name in wanted} if known else {}

    def _called(
        self,
        robot: Robot,
        arrays: tuple[FloatArray, ...],
        named: Mapping[str, FloatArray],
        shape: tuple[int, ...],
        columns: tuple[str, ...],
    ) -> FloatArray:
        given = [_sealed(array) for array in arrays]
        asked = {name: _sealed(array) for name, array in named.items()}
        count = shape[0]
        begun = time.perf_counter()
        try:
            found = bounded(lambda: self._call(robot.parameters, given, asked, shape), LIMIT_S)
        except UnrulyError as trouble:
            what = f"{trouble} for {count} samples" if isinstance(trouble.error, TooSlow) else str(trouble)
            raise self._fault(what + _valid_names(trouble.error, robot.parameters), trouble.error) from trouble.error
        self._taken.append((time.perf_counter() - begun) / max(count, 1))
        return self._checked(found, shape, columns)

    def _call(
        self, parameters: Any, given: list[FloatArray], asked: dict[str, FloatArray], shape: tuple[int, ...]
    ) -> Any:
        """Call the function and turn what it returns into an array, which may run code of the user's as well."""
        with self._siblings.visible() if self._siblings else nullcontext():
            found = self._function(parameters, *given, **asked)
            if isinstance(found, np.ma.MaskedArray) and np.any(np.ma.getmaskarray(found)):
                raise TypeError(
                    f"returns {np.count_nonzero(np.ma.getmaskarray(found))} masked entries; expected a number in each"
                )
            if isinstance(found, np.ndarray):
                return found.view(np.ndarray) if type(found) is np.ndarray else np.asarray(found)
            if type(found) in (list, tuple):
                if len(found) != shape[0]:
                    raise TypeError(f"returns {len(found)} rows; expected {shape[0]}, one for each sample")
                return np.asarray(found)
            if hasattr(found, "__array__"):
                return np.asarray(found)
        return found

    def _checked(self, found: Any, shape: tuple[int, ...], columns: tuple[str, ...]) -> FloatArray:
        if not isinstance(found, np.ndarray) or found.dtype.kind not in "fiuc":
            kind = f"an array of {found.dtype}" if isinstance(found, np.ndarray) else said(type(found).__name__)
            raise self._fault(f"returns {kind}; expected numbers of shape {shape}")
        if found.dtype.kind == "c":
            raise self._fault("returns complex numbers; expected real ones")
        if found.shape != shape:
            raise self._fault(
                f"returns an array of shape {found.shape}; expected {shape}: samples, then {_and(columns)}"
            )
        with np.errstate(over="ignore"):  # of longer numbers: infinite ones are refused below
            tau = np.array(found, dtype=np.float64)
        if not np.isfinite(tau).all():
            sample, *rest = (int(index) for index in np.argwhere(~np.isfinite(tau))[0])
            what = "joint" if self.kind == TORQUE else "column"
            raise self._fault(
                f"returns {tau[(sample, *rest)]} for sample {sample}, {what} {columns[rest[-1]]}"
                f" ({np.count_nonzero(~np.isfinite(tau))} of {tau.size} entries are not finite)",
                sample=sample,
            )
        return tau

    def _fault(self, what: str, error: BaseException | None = None, **facts: Any) -> CandidateError:
        line = self.where
        for frame in traceback.extract_tb(error.__traceback__) if error else ():
            if Path(frame.filename) == self.file:
                line = f"{self.file.name}:{frame.lineno}"
        return CandidateError(f'candidate "{self.name}" ({line}) {what}', candidate=self.name, line=line, **facts)


def _valid_names(error: BaseException, parameters: Any) -> str:
    """Return the names that the parameters have, where a formula has asked for another one."""
    if not isinstance(error, AttributeError) or error.obj is not parameters or not is_dataclass(parameters):
        return ""
    if "did you mean" in said(error) or "valid:" in said(error):
        return ""  # they have said it themselves
    names = {part for one in fields(parameters) for part in (one.name, re.sub("_(left|right)$", "", one.name))}
    return did_you_mean(error.name or "", names)


def _sealed(array: FloatArray) -> FloatArray:
    copy = np.array(array, dtype=np.float64)
    copy.flags.writeable = False
    return copy


def _and(names: tuple[str, ...]) -> str:
    return " ".join(names)


def _code_of(function: Any, module: str) -> CodeType:
    """Return the code of a plain function, or of the one that a decorator has wrapped."""
    try:
        code = getattr(inspect.unwrap(function), "__code__", None)
    except Exception:
        code = None
    if not isinstance(code, CodeType) or isinstance(function, type | partial):
        raise SpecError(
            f"{module}: a candidate is a function that is defined with def, got {said(type(function).__name__)};"
            " write one that calls it"
        )
    return code


Formula = str | Path | Callable[..., Any]


def load_candidates(names: Iterable[Formula]) -> tuple[UserCandidate, ...]:
    """Load the candidates of Python files and of installed entry points, or take functions as they are.

    Parameters
    ----------
    names
        Paths of files, ``.py`` or in another language (docs/languages.md), names of entry points of the group `GROUP`,
        or functions, registered or not.

    Raises
    ------
    SpecError
        No such file or entry point; the file does not run (with its own line); nothing is registered in it; a name
        that stands twice.
    """
    from workbench.campaign.foreign_candidates import is_foreign, load_foreign

    found: list[UserCandidate] = []
    for name in names:
        if not isinstance(name, str | Path):
            found.append(UserCandidate(name, _mark(name) or _unregistered(name), said(name), None))
            continue
        if is_foreign(Path(name)):
            found.append(load_foreign(Path(name)))
            continue
        module, siblings = load_module(str(name), LOADING_LIMIT_S)
        refuse_lost(module, "candidate", str(name))
        registered = [
            UserCandidate(value, mark, str(name), siblings)
            for value, mark in ((value, _mark(value)) for value in list(vars(module).values()))
            if mark is not None
        ]
        if not registered:
            raise SpecError(
                f"{name}: no candidate is registered in it; mark a function with @workbench.candidate",
                file=str(name),
            )
        found += {id(one.function): one for one in registered}.values()
    for one in found:
        _check_registration(one)
        if sum((one.name, one.kind) == (other.name, other.kind) for other in found) > 1:
            raise SpecError(f'{one.where}: candidate "{one.name}" is registered twice', candidate=one.name)
    return tuple(found)


def _mark(value: Any) -> Registration | None:
    try:
        mark = getattr(value, MARK, None) if callable(value) else None
    except Exception:  # an object whose attributes raise is no candidate
        return None
    return mark if isinstance(mark, Registration) else None


def _unregistered(function: Callable[..., Any]) -> Registration:
    """How a plain function is held: a measured modelling error under its own name."""
    name = said(getattr(function, "__name__", type(function).__name__))
    return Registration(name, description=said(getattr(function, "__doc__", None) or "").strip().partition("\n")[0])


def _check_registration(one: UserCandidate) -> None:
    about = one.registration
    # exactly str and numbers: what merely inherits from them may answer as it likes
    if type(about.name) is not str or not re.match(NAME, about.name):
        raise SpecError(f'{one.where}: candidate name "{said(about.name)}"; {NAME_RULE}')
    for what in ("reference", "description", "source"):
        value = getattr(about, what)
        if type(value) is not str:
            raise SpecError(
                f'{one.where}: candidate "{one.name}": {what} is {said(type(value).__name__)}; allowed: a text'
            )
        if len(value) > LONGEST_ABOUT:
            raise SpecError(
                f'{one.where}: candidate "{one.name}": {what} has {len(value)} characters; allowed: {LONGEST_ABOUT}'
            )
    bound = about.bound
    if bound is not None and (not _is_plain_number(bound) or not 0 < bound <= LARGEST_BOUND):
        raise SpecError(
            f"{one.where}: bound = {said(bound)}; allowed: a number > 0, at most {LARGEST_BOUND:g}", candidate=one.name
        )


def _is_plain_number(value: object) -> bool:
    return type(value) in (int, float) or (isinstance(value, np.number) and type(value).__module__ == "numpy")


def full_names(names: Iterable[Formula]) -> tuple[str, ...]:
    """Names that mean the same in another process: whole paths of files, entry points as they are.

    Raises
    ------
    SpecError
        A function, which another process cannot have.
    """
    files: list[str | Path] = []
    for name in names:
        if not isinstance(name, str | Path):
            raise SpecError(f"{said(name)}: a sweep computes in other processes; give the file that the function is in")
        files.append(name)
    return tuple(str(Path(name).resolve()) if Path(name).is_file() else str(name) for name in files)


def offer(robot: Robot, users: Iterable[UserCandidate]) -> None:
    """Add a user's candidates to those of one robot.

    Raises
    ------
    SpecError
        The robot has a candidate of that name already.
    """
    extra = {}
    for user in users:
        if user.kind != TORQUE:
            continue
        if user.name in robot.candidates:
            raise SpecError(f'{user.where}: {robot.name} already has a candidate "{user.name}"; choose another name')
        extra[user.name] = user.as_candidate()
    if extra:
        robot.offer(extra)
    robot.offer_kinematics(tuple(user for user in users if user.kind != TORQUE))


def with_rows(campaign: Campaign, users: Iterable[UserCandidate]) -> Campaign:
    """Return the campaign with a row for each of the user's candidates that it does not name itself."""
    named = {candidate.name for candidate in campaign.candidate}
    rows = []
    for user in users:
        if user.name in named or user.kind != TORQUE:
            continue
        about = user.registration
        rows.append(CandidateSpec(name=user.name, reference=about.reference, bound=about.bound))
    return campaign.model_copy(update={"candidate": [*campaign.candidate, *rows]}) if rows else campaign
