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
from workbench.diagnosis.edits import STAGES, WHAT, Edit, edits_of
from workbench.diagnosis.examine import Examined
from workbench.diagnosis.noise import SAFETY
from workbench.diagnosis.parts import REST, Part, design, take_apart
from workbench.diagnosis.probes import Plan, ask
from workbench.diagnosis.result import Suggestion
from workbench.diagnosis.shares import reference_torques
from workbench.diagnosis.subject import AFFINE, Parameter, Subject
from workbench.diagnosis.trial import Exam, Paper, Score, Setup
from workbench.errors import WorkbenchError
from workbench.sweep.supervisor import Lost, Supervisor

POSES = 4
SHARE_POSES = 2
BEAM = 4
FULL = 60
"""Edits that are looked at again with all parameters varied, for each step."""

STEPS = 6
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

    @property
    def edit(self) -> Edit:
        """The last edit."""
        return self.chain[-1][0]

    @property
    def lines(self) -> set[int]:
        """Lines that were edited, from 0."""
        return {edit.place(on)[0] for edit, on in self.chain}


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
        search = _Search(supervisor, deadline, lines, groups, len(subject.joints), missing_in(seen))
        try:
            return search.run(text, str(source.file))
        except WorkbenchError as error:
            return [], (f"No edits are looked for: {error}.",)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Search:
    def __init__(
        self,
        supervisor: Supervisor,
        deadline: float,
        lines: set[int] | None,
        groups: dict[str, list[str]],
        joints: int,
        missing: frozenset[str],
    ) -> None:
        self._missing = missing
        self._supervisor, self._deadline = supervisor, deadline
        self._lines, self._groups, self._joints = lines, groups, joints
        self._moves: dict[tuple[int, int, int, str], np.ndarray] = {}
        self.tried = 0

    def run(self, text: str, path: str) -> tuple[list[Suggestion], tuple[str, ...]]:
        started = self._scores([text], None)[0]
        if started is None:
            return [], ("No edits are looked for: the file does not run in a worker.",)
        root = Node(text, started)
        best, waiting, others = root, [root], dict[str, list[Node]]()
        while waiting and not best.score.complete and time.monotonic() < self._deadline:
            # the best source first; one that led nowhere gives way to the next best
            node = waiting.pop(0)
            found = self._expand(node)
            others[node.text] = found
            if found and found[0].score.key > best.score.key:
                best = found[0]
            if len(node.chain) + 1 < STEPS:
                gain = [n for n in _distinct(found) if n.score.key > node.score.key][:BEAM]
                waiting = sorted([*waiting, *gain], key=lambda n: n.score.key, reverse=True)
        notes = [f"{self.tried} edits tried."]
        if time.monotonic() > self._deadline:
            notes.append("The time was up before all were; --time SECONDS gives more.")
        chain = _useful(root, best, others)
        if not chain:
            return [], (*notes, "None of them brings a part to round-off.")
        if not chain[-1].score.complete:
            notes.append("These mend a part of it; what is left is not among the edits that were tried.")
        return list(_suggestions(root, chain, others, path)), tuple(notes)

    def _expand(self, node: Node) -> list[Node]:
        """Score all edits of a source, and the promising ones thoroughly; best first."""
        made: dict[str, Edit] = {}
        wrong = ~node.score.base
        for edit in edits_of(node.text, self._lines, self._groups, self._joints, self._missing):
            place = edit.place(node.text)
            moves = self._moves.get(place)
            # a mend moves nothing that is right; what an edit moves was seen when it was tried first
            if node.chain and moves is not None and place[0] not in node.lines and (moves & ~wrong).any():
                continue
            made.setdefault(edit.apply(node.text), edit)
        found: list[Node] = []
        for stage in STAGES:
            texts = [text for text, edit in made.items() if edit.kind in stage]
            found += self._stage(node, texts, made)
            if any(n.score.complete for n in found):
                break
        found.sort(key=lambda n: (n.score.complete, n.score.key, -n.edit.kind), reverse=True)
        return found

    def _stage(self, node: Node, texts: list[str], made: dict[str, Edit]) -> list[Node]:
        cheap = self._scores(texts, 1)
        ranked = []
        for text, score in zip(texts, cheap, strict=True):
            if score is not None:
                ranked.append((score.base.sum(), score.total, -made[text].kind, text))
                if not node.chain:
                    self._moves[made[text].place(node.text)] = score.moved
        ranked.sort(reverse=True)
        whole = [item[3] for item in ranked if item[0] == node.score.base.size]
        kept, full = whole, self._scores(whole, None)
        if not any(score is not None and score.complete for score in full):
            others = [item[3] for item in ranked if item[0] != node.score.base.size][:FULL]
            kept, full = whole + others, full + self._scores(others, None)
        return [
            Node(text, score, (*node.chain, (made[text], node.text)))
            for text, score in zip(kept, full, strict=True)
            if score is not None
        ]

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


def _useful(root: Node, best: Node, others: dict[str, list[Node]]) -> list[Node]:
    """The way to the best source, as far as each of its steps ends with more entries right and none broken."""
    chain, before = [], root
    for edit, on in best.chain:
        text = edit.apply(on)
        node = next(n for n in others[on] if n.text == text)
        chain.append(node)
        before = node
    while chain and not chain[-1].score.complete:
        earlier = chain[-2] if len(chain) > 1 else root
        now, then = chain[-1].score, earlier.score
        if now.right > then.right and not (then.mask & ~now.mask).any():
            break
        chain.pop()
    return chain if before is not root else []


def _suggestions(root: Node, chain: list[Node], others: dict[str, list[Node]], path: str) -> Iterator[Suggestion]:
    """The way to the best source, and at each step the edits that do the same."""
    before = root.score
    for step, mine in enumerate(chain, start=1):
        siblings = others[mine.chain[-1][1]]
        alike = [mine, *(n for n in siblings if n.text != mine.text and n.score.like(mine.score))]
        alike = [n for n in alike if n.score.complete == mine.score.complete]
        alike.sort(key=lambda node: _rank(node.edit))
        if step < len(chain):  # the way goes on from this one
            alike.sort(key=lambda node: node.text != mine.text)
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
    start, _ = ask(plan, lambda q, qd, qdd, force: subject.formula(q, qd, qdd, force, {}))
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
        _parts(splitting, start), len(seen.entries) // len(subject.joints), SAFETY * seen.noise,
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


def missing_in(seen: Examined) -> frozenset[str]:
    """Parameters that are missing from a part somewhere: a term with them may have been left out."""
    shares = [share for share in seen.shares if any(entry.ratio == 0 for entry in share.wrong)]
    return frozenset(share.parameter.name for share in shares)


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
