"""The search for a mend: small edits of the formula's source, tried one by one, the best taken further.

A beam of a few sources, since a mistake in kinematics spoils everything and the first mend is then not yet a success.
Edits run in supervised workers, as sweeps do, each with a time limit; whatever they break, they break alone.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from types import FrameType
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.diagnosis.edits import WHAT, Edit, edits_of
from workbench.diagnosis.examine import Examined
from workbench.diagnosis.noise import SAFETY
from workbench.diagnosis.parts import REST, Part, design, take_apart
from workbench.diagnosis.probes import Plan
from workbench.diagnosis.result import Suggestion
from workbench.diagnosis.shares import reference_torques
from workbench.diagnosis.subject import AFFINE, Parameter, Subject
from workbench.diagnosis.trial import Exam, Paper, Score, Setup
from workbench.errors import WorkbenchError
from workbench.sweep.supervisor import Lost, Supervisor

POSES = 4
SHARE_POSES = 2
BEAM = 5
FULL = 120
"""Edits that are looked at again with all parameters varied, for each step."""

STEPS = 4
BATCH = 12
MEMORY_MB = 2000.0
MOST_MENDS = 12


@dataclass(frozen=True)
class Node:
    """An edited source and the way to it."""

    text: str
    score: Score
    chain: tuple[tuple[Edit, str], ...] = ()
    """edits so far, each with the text that it was made on"""


def search_mends(
    subject: Subject, seen: Examined, time_limit: float, jobs: int | None = None
) -> tuple[list[Suggestion], tuple[str, ...]]:
    """Look for edits that bring parts to round-off.

    Returns
    -------
    suggestions, notes
        Edits step by step, those with the same effect side by side; and what there is to say about the search.
    """
    source = subject.source
    if source is None:
        return [], ("No edits are looked for: the formula's source is not at hand.",)
    try:
        text = source.file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        return [], (f"No edits are looked for: {source.file}: {error}.",)
    deadline = time.monotonic() + time_limit
    paper = make_paper(subject, seen)
    lines = lines_run(subject, seen.plan)
    groups = groups_of(subject.parameters)
    supervisor = Supervisor(jobs or _cores(), Setup(paper), 60.0, MEMORY_MB, 0)
    with closing(supervisor):
        search = _Search(supervisor, deadline, lines, groups, len(subject.joints))
        try:
            return search.run(text, str(source.file))
        except WorkbenchError as error:
            return [], (f"No edits are looked for: {error}.",)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Search:
    def __init__(
        self, supervisor: Supervisor, deadline: float, lines: set[int] | None, groups: dict[str, list[str]], joints: int
    ) -> None:
        self._supervisor, self._deadline = supervisor, deadline
        self._lines, self._groups, self._joints = lines, groups, joints
        self.tried = 0

    def run(self, text: str, path: str) -> tuple[list[Suggestion], tuple[str, ...]]:
        started = self._scores([text], None)[0]
        if started is None:
            return [], ("No edits are looked for: the file does not run in a worker.",)
        root = Node(text, started)
        frontier, best = [root], root
        others: dict[str, list[Node]] = {}
        for _ in range(STEPS):
            found = self._step(frontier)
            if not found:
                break
            complete = [node for node in found if node.score.complete]
            for node in found:
                others.setdefault(node.chain[-1][1], []).append(node)
            if complete:
                best = complete[0]
                break
            frontier = _distinct(found)[:BEAM]
            if frontier[0].score.right > best.score.right:
                best = frontier[0]
            if time.monotonic() > self._deadline:
                break
        notes = [f"{self.tried} edits tried."]
        if time.monotonic() > self._deadline:
            notes.append("The time was up before all were; --time SECONDS gives more.")
        if best is root or best.score.right <= root.score.right:
            return [], (*notes, "None of them brings a part to round-off.")
        if not best.score.complete:
            notes.append("These mend a part of it; what is left is not among the edits that are tried.")
        return list(_suggestions(root, best, others, path)), tuple(notes)

    def _step(self, frontier: Sequence[Node]) -> list[Node]:
        """Score all edits of the frontier's sources, and the promising ones thoroughly; best first."""
        made: dict[str, tuple[Node, Edit]] = {}
        for node in frontier:
            for edit in edits_of(node.text, self._lines, self._groups, self._joints):
                made.setdefault(edit.apply(node.text), (node, edit))
        texts = list(made)
        cheap = self._scores(texts, 1)
        ranked = [
            (score, -made[text][1].kind, text) for text, score in zip(texts, cheap, strict=True) if score is not None
        ]
        ranked.sort(key=lambda item: (item[0].complete, item[0].key, item[1]), reverse=True)
        kept = [text for score, _, text in ranked if score.complete]
        kept += [text for score, _, text in ranked if not score.complete][:FULL]
        full = self._scores(kept, None)
        nodes = []
        for text, score in zip(kept, full, strict=True):
            if score is None:
                continue
            parent, edit = made[text]
            nodes.append(Node(text, score, (*parent.chain, (edit, parent.text))))
        nodes.sort(key=lambda node: (node.score.complete, node.score.key, -node.chain[-1][0].kind), reverse=True)
        return nodes

    def _scores(self, texts: Sequence[str], exams: int | None) -> list[Score | None]:
        """Score texts in the workers, until the time is up; None for those that fail or are not reached."""
        found: list[Score | None] = [None] * len(texts)

        def tasks() -> Iterator[tuple[int, Any]]:
            for first in range(0, len(texts), BATCH):
                if time.monotonic() > self._deadline:
                    return
                yield first, (texts[first : first + BATCH], exams)

        for first, answer in self._supervisor.run(tasks()):
            if not isinstance(answer, Lost):
                found[first : first + len(answer)] = answer
                self.tried += len(answer)
        return found


def _distinct(nodes: Iterable[Node]) -> list[Node]:
    """One node of each effect."""
    kept: list[Node] = []
    for node in nodes:
        if not any(node.score.like(other.score) for other in kept):
            kept.append(node)
    return kept


def _suggestions(root: Node, best: Node, others: dict[str, list[Node]], path: str) -> Iterator[Suggestion]:
    """The way to the best source, and at each step the edits that do the same."""
    before = root.score
    for step, (edit, on) in enumerate(best.chain, start=1):
        after_text = edit.apply(on)
        siblings = others.get(on, [])
        mine = next((node for node in siblings if node.text == after_text), best)
        alike = [mine, *(n for n in siblings if n.text != after_text and n.score.like(mine.score))]
        alike = [n for n in alike if not mine.score.complete or n.score.complete]
        alike.sort(key=lambda node: _rank(node.chain[-1][0]))
        for node in alike[:MOST_MENDS]:
            yield _suggestion(node, before, step, path)
        before = mine.score


def _rank(edit: Edit) -> tuple[int, int]:
    return edit.kind, len(edit.new)


def _suggestion(node: Node, before: Score, step: int, path: str) -> Suggestion:
    edit, on = node.chain[-1]
    line = on.encode()[: edit.start].count(b"\n") + 1
    old, new = on.splitlines(), node.text.splitlines()
    shown = [i for i in range(min(len(old), len(new))) if old[i] != new[i]]
    first = shown[0] if shown else line - 1
    return Suggestion(
        file=os.path.basename(path),
        line=first + 1,
        before=old[first],
        after=new[first],
        what=WHAT[edit.kind],
        mends=int((node.score.base & ~before.base).sum()),
        left=int((~node.score.base).sum()),
        step=step,
        path=path,
        text=node.text,
    )


def make_paper(subject: Subject, seen: Examined) -> Paper:
    """Write down what an edited formula is asked: parts at a few poses, and each parameter's share at fewer."""
    source = subject.source
    assert source is not None
    plan = seen.plan.at(POSES)
    splitting = splitting_of(plan, subject.takes_force)
    exams = [Exam(subject.values({}), plan.flat(), _parts(splitting, reference_torques(subject, plan, {})))]
    few = seen.plan.at(SHARE_POSES)
    changes = [{p.name: p.varied} for p in subject.parameters if p.read and p.kind in AFFINE]
    lengths = [{p.name: p.varied} for p in subject.parameters if p.read and p.kind not in AFFINE]
    for change in [*changes, *lengths]:
        try:
            tau = reference_torques(subject, few, change)
            exams.append(Exam(subject.values(change), few.flat(), _parts(splitting, tau)))
        except WorkbenchError:
            continue
    return Paper(
        str(source.file), source.candidate, subject.takes_force, splitting, seen.floors, tuple(exams),
        SAFETY * seen.noise,
    )  # fmt: skip


def _parts(splitting: FloatArray, tau: FloatArray) -> FloatArray:
    found: FloatArray = np.einsum("pk,ksn->psn", splitting, tau)
    return found


def splitting_of(plan: Plan, with_force: bool) -> FloatArray:
    """The matrix ``(parts, probes)`` that `take_apart` is, and a row for each state with everything at once."""
    probes = len(plan.labels)
    one = plan.at(1)
    columns = []
    for probe in range(probes):
        tau = np.zeros((probes, 1, len(plan.rates)))
        tau[probe] = 1.0
        parts = {part: values for part, values in _linear(one, tau, with_force).items() if part.kind != REST}
        columns.append([float(values[0, 0]) for values in parts.values()])
    matrix = np.array(columns).T
    known = [part for part in parts if part.kind != "odd"]
    rows = [i for i, part in enumerate(parts) if part.kind != "odd"]
    mixed = []
    for index, label in enumerate(plan.labels):
        if label[0] == "mixed":
            row = -design(one, known, index) @ matrix[rows]
            row[index] += 1.0
            mixed.append(row)
    return np.vstack([matrix, *mixed])


def _linear(plan: Plan, tau: FloatArray, with_force: bool) -> dict[Part, FloatArray]:
    """`take_apart` of unit answers; its choice of the larger of two odd parts is taken back to their sum."""
    return take_apart(plan, tau, with_force)


def groups_of(parameters: Sequence[Parameter]) -> dict[str, list[str]]:
    """Parameter -> those of the same unit: any of them might have been meant."""
    return {p.name: [o.name for o in parameters if o.unit == p.unit and o.name != p.name] for p in parameters}


def lines_run(subject: Subject, plan: Plan) -> set[int] | None:
    """Lines of the formula's file that it runs through; None where that cannot be seen."""
    source = subject.source
    if source is None:
        return None
    file, lines = str(source.file), set()
    q, qd, qdd, force = (array[:, 0] for array in (plan.q, plan.qd, plan.qdd, plan.force))

    def trace(frame: FrameType, event: str, argument: object) -> Any:
        if frame.f_code.co_filename != file:
            return None
        if event == "line":
            lines.add(frame.f_lineno)
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        subject.formula(q, qd, qdd, force, {})
    except WorkbenchError:
        pass
    finally:
        sys.settrace(before)
    return lines or None
