"""The search for a mend: small edits of the formula's source, tried one by one, the best taken further.

Each edit is looked at on the robot as it is, by running what it reaches again; those that get better are run as a file
on all robots. Several sources are taken further, since a mistake in kinematics spoils everything and the first mend is
then not yet a success; where none gets better, the least wrong are. Effects that add up are found without a run.
Edits run in supervised workers, as sweeps do, each with a time limit; whatever they break, they break alone.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing

import numpy as np

from workbench.diagnosis.combine import groups_alike, masks, sums
from workbench.diagnosis.edits import LIKELY, STAGES, Edit, edits_of
from workbench.diagnosis.examine import Examined
from workbench.diagnosis.inserts import inserts_of
from workbench.diagnosis.nodes import Node, distinct, moved
from workbench.diagnosis.paper import groups_of, lines_run, make_paper, missing_in
from workbench.diagnosis.result import Suggestion
from workbench.diagnosis.subject import Subject
from workbench.diagnosis.suggestions import suggested
from workbench.diagnosis.trial import FIRST, NOTHING, Paper, Score, Setup, Task, nothing_right
from workbench.errors import WorkbenchError
from workbench.processes import cores
from workbench.sweep.supervisor import Lost, Supervisor

BEAM = 4
FULL = 40
"""Edits that are looked at again with all parameters varied, for each step."""

WHOLE = 400
"""The same, of edits after which the robot as it is is right."""

BROKEN = 10
"""What an entry that was right and is no longer counts against those that became right."""

MOST_ACCIDENTS = 6
"""Sums that are right for this robot's numbers and no others, after which no more are looked at thoroughly."""

NEAREST, OTHERS = slice(4), slice(4, None)
"""Lines that terms are put into first, those that move least beyond what is wrong; and all others."""

WORSE_FIRST = 8
"""Sources that got no better that are taken further before terms are put in, where most is wrong."""

MOST_INSERTS = 6000

STEPS = 6
BATCH = 24
MEMORY_MB = 2000.0


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
    lines, groups, missing = lines_run(subject, seen.plan), groups_of(subject.parameters), missing_in(seen)
    supervisor = Supervisor(jobs or cores(), Setup(paper), 60.0, MEMORY_MB, 0)
    with closing(supervisor):
        joints = len(subject.joints)
        search = _Search(supervisor, paper, deadline, lambda text: edits_of(text, lines, groups, joints, missing))
        try:
            return search.run(text, str(source.file))
        except WorkbenchError as error:
            return [], (f"No edits are looked for: {error}.",)


Place = tuple[int, int, int, str]
"""Of an edit, whatever other lines look like."""


class _Search:
    def __init__(
        self, supervisor: Supervisor, paper: Paper, deadline: float, edits: Callable[[str], list[Edit]]
    ) -> None:
        self._supervisor, self._paper, self._deadline, self._edits = supervisor, paper, deadline, edits
        self._breaks: dict[str, dict[Place, np.ndarray]] = {}
        self._looked: dict[str, list[Node]] = {}
        self._right: np.ndarray | None = None
        self.tried = 0

    def run(self, text: str, path: str) -> tuple[list[Suggestion], tuple[str, ...]]:
        started, whole = self.scores([text], FIRST)[0], self.scores([text], None)[0]
        if started is None or whole is None:  # it fails at all of these states; an edit may mend that
            started, whole = (nothing_right(self._paper, count) for count in (1, len(self._paper.exams)))
        root, self._right = Node(text, started, whole=whole), whole.mask
        best = self._followed(root)
        notes = [f"{self.tried} edits tried."]
        if time.monotonic() > self._deadline:
            notes.append("The time was up before all were; --time SECONDS gives more.")
        self._deadline = float("inf")  # what is shown is looked at thoroughly
        found = suggested(root, best, self._looked, self._fill, path)
        if not found:
            return [], (*notes, "None of them brings a part to round-off.")
        if found[-1].left or not best.complete:
            notes.append("These mend a part of it; what is left is not among the edits that were tried.")
        return found, tuple(notes)

    def _followed(self, root: Node) -> Node:
        """The best source that is found in time."""
        best, better, worse, near, far = root, [root], list[Node](), list[Node](), list[Node]()
        seen, left = {root.text}, 0
        while (better or worse) and not best.complete and time.monotonic() < self._deadline:
            # the best source first; one that led nowhere gives way to the next best, at last to the least wrong
            climbing = bool(better)
            # where most is wrong two mistakes in kinematics hide each other; where little is, a term may be missing
            hidden = 2 * best.look.base.sum() < best.look.base.size and len(worse) > max(0, left - WORSE_FIRST)
            if not climbing and (near or (far and not hidden)):
                node, climbing, lines = (near.pop(), True, NEAREST) if near else (far.pop(0), True, OTHERS)
                far += [node] if lines == NEAREST else []
                found = [n for n in self._inserted(node, lines) if _key(n) > _key(best)]
            else:
                node = better.pop(0) if climbing else worse.pop(0)
                if node.whole is None:
                    self._fill([node])
                found = self._expand(node, climbing)
                if not found:  # tens of thousands of sources that led nowhere are not kept
                    self._looked[node.text], self._breaks[node.text] = [], {}
                if node is root or (climbing and node is best):
                    near.append(node)
            if found and _rank(found[0]) > _rank(best):
                best = found[0]
            if len(node.chain) + 1 >= STEPS:
                continue
            before = _key(node if climbing else root)[0]
            gain = [n for n in distinct(found) if n.text not in seen and _key(n)[0] > before][:BEAM]
            seen |= {n.text for n in gain}
            better = sorted([*better, *gain], key=_rank, reverse=True)
            if node is root:
                kept = [n for n in self._looked[node.text] if n.text not in seen and n.edit.kind in LIKELY]
                worse = distinct_looks(sorted(kept, key=lambda n: n.look.key, reverse=True))
                left = len(worse)
        return best

    def _expand(self, node: Node, thorough: bool) -> list[Node]:
        """Look at all edits of a source, and at the promising ones on all exams; best first."""
        made: dict[str, Edit] = {}
        before = [self._breaks.get(text, {}) for _, text in node.chain]
        for edit in self._edits(node.text):
            place = edit.place(node.text)
            # what was right, was broken by the edit when it was tried there, and is right still, would be broken again
            seen = (breaks[place] for breaks in before if place in breaks) if place[0] not in node.lines else ()
            if not any((broken & node.look.base).any() for broken in seen):
                made.setdefault(edit.apply(node.text), edit)
        looked = self._looked[node.text] = []
        for kinds in STAGES if thorough else (LIKELY,):
            stage = self._look(node, [edit for edit in made.values() if edit.kind in kinds])
            looked += stage
            right = [n for n in stage if n.look.base.all()]
            self._fill(self._telling(node, right)[:WHOLE])
            if any(n.complete for n in right):
                break
        else:
            looked = [*looked, *self._combined(node, looked)]
        looked = sorted(looked, key=lambda n: n.look.key, reverse=True)
        self._fill([n for n in looked if thorough or n.look.key[0] > node.look.key[0]][:FULL])
        return sorted((n for n in looked if n.whole is not None), key=_rank, reverse=True)

    def _inserted(self, node: Node, lines: slice) -> list[Node]:
        """The same of terms and factors put into the statements whose edits move what is wrong."""
        looked: list[Node] = []
        for line in self._suspects(node)[lines]:
            stage = self._look(node, inserts_of(node.text, line))
            looked += stage
            right = [n for n in stage if n.look.base.all()]
            self._fill(right[:FULL])
            if any(n.complete for n in right) or len(looked) > MOST_INSERTS:
                break
        self._looked[node.text] += looked
        if not any(n.complete for n in looked):
            looked += self._combined(node, looked)
        self._fill(sorted((n for n in looked if n.look.key > node.look.key), key=_rank, reverse=True)[:FULL])
        return sorted((n for n in looked if n.whole is not None), key=_rank, reverse=True)

    def _suspects(self, node: Node) -> list[int]:
        """Lines whose edits together move all that is wrong, those first of which one moves just that."""
        wrong, moves, nearest = ~node.look.base, dict[int, np.ndarray](), dict[int, int]()
        for looked in self._looked[node.text]:
            moved = ~(np.abs(looked.look.found - node.look.found).max(axis=1) <= NOTHING * self._paper.floors)
            line = looked.edit.line
            moves[line] = moves.get(line, False) | moved
            nearest[line] = min(nearest.get(line, moved.size), int((moved != wrong).sum()))
        lines = [line for line, moved in moves.items() if not (wrong & ~moved).any()]
        return sorted(lines, key=lambda line: (nearest[line], line))

    def _telling(self, node: Node, nodes: list[Node]) -> list[Node]:
        """Those that are right in the exam, too, that the source before is most wrong in."""
        if node.whole is None or len(nodes) <= FULL:
            return nodes
        counts = (~node.whole.mask).reshape(node.whole.exams, -1).sum(axis=1)
        exam = int(counts[1:].argmax()) + 1 if len(counts) > 1 else 0
        scores = self.scores([n.text for n in nodes], (0, exam) if exam else FIRST)
        return [n for n, score in zip(nodes, scores, strict=True) if score is not None and score.complete]

    def _combined(self, node: Node, looked: list[Node]) -> list[Node]:
        """Sources with two or three edits at once whose effects add up to what is wrong, of all joints or of one."""
        floors = self._paper.floors
        nodes = [n for n in looked if np.isfinite(n.look.found).all()]
        start = node.look.found
        if len(nodes) < 2 or not np.isfinite(start).all():
            return []
        effects = np.array([((n.look.found - start) / floors).ravel() for n in nodes])
        wanted = ((self._paper.exams[0].parts - start) / floors).ravel()
        groups = groups_alike(effects)
        first = np.array([min(group, key=lambda i: (nodes[i].edit.kind, len(nodes[i].edit.new))) for group in groups])
        alike = {id(nodes[i]): [nodes[j] for j in group] for group in groups for i in group}
        made, accidents = dict[str, Node](), 0
        for mask, triples in masks(start.shape):
            small = effects[first][:, mask] if len(first) else np.zeros((0, 0))
            moving = np.flatnonzero(np.abs(small).max(axis=1, initial=0.0) > 0.0)
            for chosen in sums(small[moving], wanted[mask], triples):
                parts = [nodes[int(first[moving[i]])] for i in chosen]
                joined = self._joined(node, parts, alike)
                if joined is not None and joined.text not in made:
                    self._scored([joined])
                    made[joined.text] = joined
                    if joined.look.base.all() and accidents < MOST_ACCIDENTS:
                        others = [joined, *self._same_sums(node, joined, parts, alike)]
                        made.update({n.text: n for n in others})
                        if any(n.complete for n in others):
                            return list(made.values())
                        accidents += 1
        return list(made.values())

    def _same_sums(self, node: Node, joined: Node, parts: list[Node], alike: dict[int, list[Node]]) -> list[Node]:
        """The same with edits that do the same on the robot as it is, where other robots tell them apart."""
        found, best, chosen = list[Node](), joined, list(parts)
        self._fill([best])
        for place in range(len(parts)):
            if best.complete:
                break
            tries = [[*chosen[:place], other, *chosen[place + 1 :]] for other in alike[id(parts[place])][:FULL]]
            made = [(one, self._joined(node, one, alike)) for one in tries]
            others = [(one, n) for one, n in made if n is not None and n.text != best.text]
            self._scored([n for _, n in others])
            self._fill([n for _, n in others])
            found += [n for _, n in others if n.whole is not None]
            for one, n in others:
                if n.whole is not None and _rank(n) > _rank(best):
                    best, chosen = n, one
        return found

    def _scored(self, nodes: list[Node]) -> None:
        """Run sources with several edits on the robot as it is; what does not run has nothing right."""
        for n, score in zip(nodes, self.scores([n.text for n in nodes], FIRST), strict=True):
            n.look = score or nothing_right(self._paper, 1)

    def _joined(self, node: Node, parts: list[Node], alike: dict[int, list[Node]]) -> Node | None:
        """One source with several edits, the one first that mends most alone."""
        current, done = node, list[Edit]()
        for part in sorted(parts, key=lambda n: n.look.key, reverse=True):
            edit = moved(part.edit, done)
            if edit is None:
                return None
            after = current.after(edit, part.look)
            if current is not node:
                others = [moved(n.edit, done) for n in alike[id(part)]]
                known = self._looked.setdefault(current.text, [])
                known += [after, *(current.after(e, part.look) for e in others if e is not None and e != edit)]
            current = after
            done.append(edit)
        return current

    def _look(self, node: Node, edits: list[Edit]) -> list[Node]:
        found, broken = [], self._breaks.setdefault(node.text, {})
        batches = [tuple(edits[first : first + BATCH]) for first in range(0, len(edits), BATCH)]
        answers = self._asked([Task((node.text,), FIRST, batch) for batch in batches])
        for batch, answer in zip(batches, answers, strict=True):
            for edit, score in zip(batch, answer or [None] * len(batch), strict=True):
                if score is not None:
                    found.append(node.after(edit, score))
                    broken[edit.place(node.text)] = node.look.base & ~score.base
        return found

    def _fill(self, nodes: Sequence[Node]) -> None:
        """Run sources on all exams that have not been yet."""
        waiting = [node for node in nodes if node.whole is None]
        for node, score in zip(waiting, self.scores([n.text for n in waiting], None), strict=True):
            node.whole = score
            if score is not None and self._right is not None:
                node.broken = int((self._right & ~score.mask).sum())

    def scores(self, texts: Sequence[str], exams: tuple[int, ...] | None) -> list[Score | None]:
        """Score texts in the workers, until the time is up; None for those that fail or are not reached."""
        size = max(1, min(BATCH // 2, len(texts) // 4))
        batches = [tuple(texts[first : first + size]) for first in range(0, len(texts), size)]
        answers = self._asked([Task(batch, exams) for batch in batches])
        return [
            score for batch, answer in zip(batches, answers, strict=True) for score in (answer or [None] * len(batch))
        ]

    def _asked(self, tasks: list[Task]) -> list[list[Score | None] | None]:
        found: list[list[Score | None] | None] = [None] * len(tasks)

        def timely() -> Iterator[tuple[int, Task]]:
            for number, task in enumerate(tasks):
                if time.monotonic() > self._deadline:
                    return
                yield number, task

        for number, answer in self._supervisor.run(timely()):
            if not isinstance(answer, Lost):
                found[number] = answer
                self.tried += len(answer)
        return found


def _key(node: Node) -> tuple[int, float]:
    right, total = (node.whole or node.look).key
    return right - BROKEN * node.broken, total


def _rank(node: Node) -> tuple[bool, int, float, int, int]:
    """For sorting: how right, and of what is as right the most usual and shortest edit."""
    right, total = _key(node)
    edit = (-node.edit.kind, -len(node.edit.new)) if node.chain else (0, 0)
    return node.complete, right, round(total, 2), *edit


def distinct_looks(nodes: list[Node]) -> list[Node]:
    """One node of each effect, of nodes that are sorted by it."""
    return [n for i, n in enumerate(nodes) if i == 0 or not n.look.like(nodes[i - 1].look)]
