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
from workbench.diagnosis.edits import Edit
from workbench.diagnosis.replay import OutsideError, Tape
from workbench.robots.registration import MARK

ONE_EDIT_S = 2.0
"""Longest time for one edited formula on one robot."""

RIGHT = 1e-7
NOTHING = 1e-9

FIRST = (0,)

MOST_TAPES = 4
"""Texts whose runs a worker remembers."""

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
    pulled: FloatArray | None
    """``(poses, 3, na)`` torques to forces at the platform, the inverse of J^T, where it is regular: errors are looked
    at per direction, too"""
    forces: int | None
    """where among the parts the responses to the three components of the force begin"""
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
    complete: bool
    """all of them, in all exams"""
    behind: int
    """numbers behind the entries that are right: elements of the inverse Jacobian, each belonging to one limb, and
    errors per direction of the platform; a mend may bring these before any entry"""
    found: FloatArray
    """``(parts, poses, na)`` of the robot as it is"""
    exams: int = 1

    @property
    def key(self) -> tuple[int, float]:
        """For sorting: what is right of the robot as it is, and of the others; then how wrong the rest is."""
        return self.right + self.exams * self.behind, self.total

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
    return parts_of(paper, tau)


def parts_of(paper: Paper, tau: FloatArray) -> FloatArray:
    """Split torques ``(n, na)`` of all probes into parts ``(parts, poses, na)``."""
    rows = tau.reshape(paper.splitting.shape[1], -1, tau.shape[1])
    found: FloatArray = np.einsum("pk,ksn->psn", paper.splitting, rows)
    return found


def score(paper: Paper, text: str, exams: tuple[int, ...] | None = None) -> Score | None:
    """Score a source text on some exams, by number, 0 first, or on all; None where it does not run."""
    try:
        function = bounded(lambda: load_text(text, paper.path, paper.candidate), ONE_EDIT_S)
    except UnrulyError:
        return None
    answers = []
    chosen = paper.exams if exams is None else tuple(paper.exams[number] for number in exams)
    for exam in chosen:
        answers.append(torques_of(paper, function, exam))
        if len(answers) == 1 and not np.isfinite(answers[0]).any():
            return None
    return judged(paper, answers, chosen)


def judged(paper: Paper, answers: Sequence[FloatArray], exams: Sequence[Exam]) -> Score:
    """Hold parts against the reference's; in all exams but the first by what a changed parameter changes."""
    right, total, complete = 0, 0.0, True
    first, masks = answers[0], []
    for number, (found, exam) in enumerate(zip(answers, exams, strict=True)):
        wanted = exam.parts
        if number > 0:
            poses = found.shape[1]
            found, wanted = found - first[:, :poses], wanted - paper.exams[0].parts[:, :poses]
        good, logs = _entries(paper, found, wanted, number > 0)
        masks.append(good.ravel())
        right += int(good.sum())
        total -= float(logs.sum())
        complete = complete and bool(good.all())
    base = masks[0].reshape(first.shape[0], -1)
    mask = np.concatenate(masks)
    return Score(right, total, base, mask, complete, _behind(paper, first), first, len(answers))


def nothing_right(paper: Paper, exams: int) -> Score:
    """Score of a formula that does not answer."""
    nothing = [np.full_like(exam.parts, np.nan) for exam in paper.exams[:exams]]
    return judged(paper, nothing, paper.exams[:exams])


def _behind(paper: Paper, found: FloatArray) -> int:
    """Count the numbers behind the entries that are right."""
    if paper.pulled is None or not np.isfinite(found).all():
        return 0
    wanted = paper.exams[0].parts
    pushed = np.einsum("saj,qpsj->qpsa", paper.pulled, np.stack([found - wanted, wanted]))
    gap, size = np.abs(pushed).max(axis=2)
    right = int((gap <= RIGHT * np.maximum(size, 1e-3 * size.max())).sum())
    if paper.forces is None:
        return right
    rows = slice(paper.forces, paper.forces + 3)
    try:
        mine, theirs = (np.linalg.inv(parts[rows].swapaxes(0, 1)) for parts in (found, wanted))
    except np.linalg.LinAlgError:
        return right
    size = np.abs(theirs).max(axis=0)
    return right + int((np.abs(mine - theirs).max(axis=0) <= RIGHT * np.maximum(size, 1e-3 * size.max())).sum())


def _entries(paper: Paper, found: FloatArray, wanted: FloatArray, share: bool) -> tuple[np.ndarray, FloatArray]:
    gap = np.abs(found - wanted).max(axis=1)
    size = np.maximum(np.abs(found).max(axis=1), np.abs(wanted).max(axis=1))
    small = (NOTHING * (10.0 if share else 1.0) + paper.noise) * paper.floors
    good = (gap <= RIGHT * size) | (gap <= small)
    error = np.where(np.isfinite(gap), gap / np.maximum(size, 1e-9 * paper.floors), 1e3)
    logs: FloatArray = np.log10(np.clip(np.where(good, 1e-8, error), 1e-8, 1e3))
    return good, logs


@dataclass(frozen=True)
class Task:
    """What a worker is asked: texts on exams by number, or edits of one text on the first exam alone."""

    texts: tuple[str, ...]
    exams: tuple[int, ...] | None = None
    edits: tuple[Edit, ...] | None = None


class Setup:
    """Makes the function that a worker calls with tasks; travels there by pickle."""

    def __init__(self, paper: Paper) -> None:
        self.paper = paper

    def __call__(self) -> Callable[[Task], list[Score | None]]:
        """Prepare the parameters and return the function."""
        exams = tuple(dataclasses.replace(exam, values=_named_values(exam.values)) for exam in self.paper.exams)
        paper = dataclasses.replace(self.paper, exams=exams)
        looks = Looks(paper)

        def work(task: Task) -> list[Score | None]:
            if task.edits is not None:
                return [looks.score(task.texts[0], edit) for edit in task.edits]
            return [score(paper, text, task.exams) for text in task.texts]

        return work


class Looks:
    """Scores edits of a text on the first exam, by replaying what they reach."""

    def __init__(self, paper: Paper) -> None:
        self._paper = paper
        self._tapes: dict[str, Tape | None] = {}
        q, qd, qdd, force = paper.exams[0].states
        self._given = (q, qd, qdd, force) if paper.with_force else (q, qd, qdd)

    def score(self, text: str, edit: Edit) -> Score | None:
        """Score a text with one edit; None where it does not run."""
        if text not in self._tapes:
            if len(self._tapes) >= MOST_TAPES:
                self._tapes.pop(next(iter(self._tapes)))
            self._tapes[text] = self.recorded(text)
        tape = self._tapes[text]
        if tape is None:
            return score(self._paper, edit.apply(text), FIRST)
        try:
            tau = self._answer(lambda values, *given: tape.replay(edit, values, *given))
        except UnrulyError as error:
            return score(self._paper, edit.apply(text), FIRST) if isinstance(error.error, OutsideError) else None
        if tau.shape != self._given[0].shape or not np.isfinite(tau).any():
            return None
        return judged(self._paper, [parts_of(self._paper, tau)], self._paper.exams[:1])

    def _answer(self, function: Callable[..., Any]) -> FloatArray:
        values = self._paper.exams[0].values

        def call() -> FloatArray:
            with np.errstate(all="ignore"), siblings_of(self._paper.path).visible():
                return np.asarray(function(values, *self._given), dtype=np.float64)

        return bounded(call, ONE_EDIT_S)

    def recorded(self, text: str) -> Tape | None:
        """The text's run; None where going through it statement by statement does not give just what it gives."""
        paper = self._paper
        kept = [array.copy() for array in self._given]
        try:
            function = bounded(lambda: load_text(text, paper.path, paper.candidate), ONE_EDIT_S)
            tape = Tape(text, paper.path, vars(sys.modules[MODULE]), function)
            plain, taped = self._answer(function), self._answer(tape.record)
        except (UnrulyError, SyntaxError):
            return None
        untouched = all(np.array_equal(one, other) for one, other in zip(kept, self._given, strict=True))
        return tape if untouched and np.array_equal(plain, taped, equal_nan=True) else None
