"""What a search shows: the way to the best source, step by step, and at each step the edits that do the same."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence

from workbench.diagnosis.edits import WHAT, Edit
from workbench.diagnosis.nodes import Node
from workbench.diagnosis.result import Suggestion
from workbench.diagnosis.trial import Score

MOST_MENDS = 12


def suggested(
    root: Node, best: Node, looked: dict[str, list[Node]], fill: Callable[[Sequence[Node]], None], path: str
) -> list[Suggestion]:
    """Put the way from *root* to *best* into words; *fill* runs nodes on all exams, *looked* are those of each text."""
    chain = _useful(root, best, looked, fill)
    return list(_suggestions(root, chain, looked, fill, path))


def _useful(
    root: Node, best: Node, looked: dict[str, list[Node]], fill: Callable[[Sequence[Node]], None]
) -> list[Node]:
    """The way to the best source, as far as each of its steps ends with more entries right and none broken."""
    chain: list[Node] = []
    for edit, on in best.chain:
        text = edit.apply(on)
        chain.append(best if text == best.text else next(n for n in looked[on] if n.text == text))
    fill([root, *chain])
    while chain and not chain[-1].complete:
        now, then = chain[-1].whole, (chain[-2] if len(chain) > 1 else root).whole
        if now and then and now.right > then.right and not (then.mask & ~now.mask).any():
            break
        chain.pop()
    return chain


def _suggestions(
    root: Node, chain: list[Node], looked: dict[str, list[Node]], fill: Callable[[Sequence[Node]], None], path: str
) -> Iterator[Suggestion]:
    before = root.look
    for step, mine in enumerate(chain, start=1):
        siblings = [n for n in looked[mine.parent] if n.text != mine.text and n.look.like(mine.look)]
        siblings = sorted(siblings, key=lambda node: _rank(node.edit))[: 2 * MOST_MENDS]
        fill([mine, *siblings])
        alike = [mine, *(n for n in siblings if n.whole and mine.whole and n.whole.like(mine.whole))]
        alike = [n for n in alike if n.complete == mine.complete]
        alike.sort(key=lambda node: _rank(node.edit))
        if step < len(chain):  # the way goes on from this one
            alike.sort(key=lambda node: node.text != mine.text)
        for node in alike[:MOST_MENDS]:
            yield _suggestion(node, before, step, path)
        before = mine.whole or mine.look


def _rank(edit: Edit) -> tuple[int, int]:
    return edit.kind, len(edit.new)


def _suggestion(node: Node, before: Score, step: int, path: str) -> Suggestion:
    edit, on = node.chain[-1]
    score = node.whole or node.look
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
        mends=int((score.base & ~before.base).sum()),
        left=int((~score.base).sum()),
        step=step,
        path=path,
        text=node.text,
    )
