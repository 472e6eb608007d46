"""Trying edited sources, in a worker of its own: run the text, ask the formula, count the entries that are right."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.bounded_call import UnrulyError, bounded
from workbench.campaign.formula_files import Siblings
from workbench.robots.registration import MARK

ONE_EDIT_S = 2.0
"""Longest time for one edited formula on one robot."""

RIGHT = 1e-7
NOTHING = 1e-9

MODULE = "workbench_mended_candidate"


@dataclass(frozen=True)
class Exam:
    """A robot, states, and the parts of the torque that are right there."""

    values: Any
    """the parameters: an object, or the fields of one"""
    states: tuple[FloatArray, FloatArray, FloatArray, FloatArray]
    """q, qd, qdd ``(n, na)`` and force ``(n, 3)``, n = probes times poses"""
    parts: FloatArray
    """``(parts, poses, na)`` by the reference"""


@dataclass(frozen=True)
class Paper:
    """All that an edited formula is asked."""

    path: str
    candidate: str
    with_force: bool
    splitting: FloatArray
    """``(parts, probes)``: parts from the torques of the probes"""
    floors: FloatArray
    """``(na,)`` the joints' largest parts"""
    exams: tuple[Exam, ...]
    """the robot as it is first, then with parameters changed one by one"""
    start: FloatArray
    """``(parts, poses, na)`` of the first exam by the formula as it is"""
    named: int
    """how many of the parts are parts; the others are states with everything at once"""
    noise: float
    """fraction of the floors that is noise of the formula's own"""


@dataclass(frozen=True)
class Score:
    """How right an edited formula is; the larger, the better."""

    right: int
    """entries that are right, of all exams"""
    total: float
    """minus the sum of the logarithms of the entries' errors"""
    base: np.ndarray
    """``(parts, na)`` which entries are right for the robot as it is"""
    mask: np.ndarray
    """the same for all exams in a row"""
    moved: np.ndarray
    """``(parts, na)`` which are other than the unedited formula's"""
    complete: bool
    """all of them, in all exams"""

    @property
    def key(self) -> tuple[int, float]:
        """For sorting."""
        return self.right, self.total

    def like(self, other: Score) -> bool:
        """Whether two edits have the same effect."""
        return self.right == other.right and abs(self.total - other.total) < 1e-3 * max(1.0, abs(self.total))


def _named_values(values: Any) -> Any:
    if not isinstance(values, dict):
        return values
    return dataclasses.make_dataclass("Parameters", [(name, float) for name in values], frozen=True)(**values)


@cache
def siblings_of(path: str) -> Siblings:
    """Modules beside a file, which an edited copy of it imports as well; they stay as they were first read."""
    return Siblings(Path(path).parent)


def code_of(text: str, path: str) -> list[CodeType]:
    """Compile a source text statement by statement: of an edited text all but one have been compiled before.

    Raises
    ------
    SyntaxError
        The text is no Python.
    """
    if "__future__" in text:
        return [compile(text, path, "exec")]
    chunks: list[tuple[int, str]] = []
    joined = False
    for number, line in enumerate(text.splitlines(keepends=True)):
        begins = line[0] not in " \t\n\r\f#)]}"
        if chunks and (joined or not begins):
            chunks[-1] = chunks[-1][0], chunks[-1][1] + line
        else:
            chunks.append((number, line))
        joined = line.startswith("@") if begins else joined
    try:
        return [_compiled(number, chunk, path) for number, chunk in chunks]
    except SyntaxError:  # a statement that goes on at the margin: an else, a text over several lines
        return [compile(text, path, "exec")]


@lru_cache(maxsize=256)
def _compiled(number: int, chunk: str, path: str) -> CodeType:
    return compile("\n" * number + chunk, path, "exec")


def load_text(text: str, path: str, candidate: str) -> Callable[..., Any]:
    """Run a source text and return the function that it registers under a name.

    Raises
    ------
    Exception
        Whatever the text raises; KeyError where it registers no such name.
    """
    module = ModuleType(MODULE)
    module.__file__ = path
    sys.modules[MODULE] = module
    with siblings_of(path).visible():
        for code in code_of(text, path):
            exec(code, module.__dict__)  # the user named this file on the command line
    for value in vars(module).values():
        if callable(value) and getattr(getattr(value, MARK, None), "name", None) == candidate:
            function: Callable[..., Any] = value
            return function
    raise KeyError(candidate)


def torques_of(paper: Paper, function: Callable[..., Any], exam: Exam) -> FloatArray:
    """Parts ``(parts, poses, na)`` of an edited formula in one exam; NaN where it fails."""
    q, qd, qdd, force = (array.copy() for array in exam.states)
    given = (q, qd, qdd, force) if paper.with_force else (q, qd, qdd)

    def call() -> FloatArray:
        with np.errstate(all="ignore"), siblings_of(paper.path).visible():
            return np.asarray(function(exam.values, *given), dtype=np.float64)

    try:
        tau = bounded(call, ONE_EDIT_S)
    except UnrulyError:
        return np.full_like(exam.parts, np.nan)
    if tau.shape != q.shape:
        return np.full_like(exam.parts, np.nan)
    found: FloatArray = np.einsum("pk,ksn->psn", paper.splitting, tau.reshape(paper.splitting.shape[1], -1, q.shape[1]))
    return found


def score(paper: Paper, text: str, exams: int | None = None) -> Score | None:
    """Score a source text on the first few exams, None for all; None where it does not run."""
    try:
        function = bounded(lambda: load_text(text, paper.path, paper.candidate), ONE_EDIT_S)
    except UnrulyError:
        return None
    right, total, complete = 0, 0.0, True
    base = moved = np.zeros(0, dtype=np.bool_)
    masks = []
    first: FloatArray | None = None
    for number, exam in enumerate(paper.exams[:exams]):
        found = torques_of(paper, function, exam)
        if number == 0 and not np.isfinite(found).any():
            return None
        wanted = exam.parts
        if number == 0:
            first = found
        else:
            assert first is not None
            poses = found.shape[1]
            found, wanted = found - first[:, :poses], wanted - paper.exams[0].parts[:, :poses]
        good, logs = _entries(paper, found, wanted, number > 0)
        masks.append(good.ravel())
        right += int(good.sum())
        total -= float(logs.sum())
        complete = complete and bool(good.all())
        if number == 0:
            base = good
            moved = ~(np.abs(found - paper.start).max(axis=1) <= NOTHING * paper.floors)
    return Score(right, total, base, np.concatenate(masks), moved, complete)


def _entries(paper: Paper, found: FloatArray, wanted: FloatArray, share: bool) -> tuple[np.ndarray, FloatArray]:
    gap = np.abs(found - wanted).max(axis=1)
    size = np.maximum(np.abs(found).max(axis=1), np.abs(wanted).max(axis=1))
    small = (NOTHING * (10.0 if share else 1.0) + paper.noise) * paper.floors
    good = (gap <= RIGHT * size) | (gap <= small)
    error = np.where(np.isfinite(gap), gap / np.maximum(size, 1e-9 * paper.floors), 1e3)
    logs: FloatArray = np.log10(np.clip(np.where(good, 1e-8, error), 1e-8, 1e3))
    return good, logs


Task = tuple[Sequence[str], int | None]


class Setup:
    """Makes the function that a worker calls with texts; travels there by pickle."""

    def __init__(self, paper: Paper) -> None:
        self.paper = paper

    def __call__(self) -> Callable[[Task], list[Score | None]]:
        """Prepare the parameters and return the function."""
        exams = tuple(dataclasses.replace(exam, values=_named_values(exam.values)) for exam in self.paper.exams)
        paper = dataclasses.replace(self.paper, exams=exams)

        def work(task: Task) -> list[Score | None]:
            texts, count = task
            return [score(paper, text, count) for text in texts]

        return work
