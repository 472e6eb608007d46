"""Edited sources on the way to a mend: the edits so far, and how right they are."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property

from workbench.diagnosis.edits import Edit
from workbench.diagnosis.trial import Score


@dataclass(eq=False)
class Node:
    """An edited source and the way to it."""

    origin: str
    """the text before all edits"""
    look: Score
    """on the robot as it is"""
    chain: tuple[tuple[Edit, str], ...] = ()
    """edits so far, each with the text that it was made on"""
    whole: Score | None = field(default=None)
    """on all exams, where it was looked at"""
    broken: int = 0
    """numbers of those that were right at the start and are no longer"""

    @cached_property
    def text(self) -> str:
        """The source; made when it is asked for, since most nodes are looked at once and never again."""
        return self.edit.apply(self.parent) if self.chain else self.origin

    @property
    def edit(self) -> Edit:
        """The last edit."""
        return self.chain[-1][0]

    @property
    def parent(self) -> str:
        """The text that the last edit was made on."""
        return self.chain[-1][1]

    @property
    def lines(self) -> set[int]:
        """Lines that were edited, from 0."""
        return {edit.place(on)[0] for edit, on in self.chain}

    @property
    def complete(self) -> bool:
        """Whether all is right in all exams."""
        return self.whole is not None and self.whole.complete

    def after(self, edit: Edit, look: Score) -> Node:
        """The source with one more edit."""
        return Node(self.origin, look, (*self.chain, (edit, self.text)))


def shifted(edit: Edit, done: Edit) -> Edit | None:
    """The same edit of a text in which another was made; None where they overlap."""
    if edit.end <= done.start and edit.start < done.start:
        return edit
    if edit.start >= done.end:
        by = len(done.new.encode()) - (done.end - done.start)
        return replace(edit, start=edit.start + by, end=edit.end + by)
    return None


def moved(edit: Edit, done: Iterable[Edit]) -> Edit | None:
    """The same edit of a text in which others were made one after the other; None where it overlaps one."""
    found: Edit | None = edit
    for before in done:
        found = shifted(found, before) if found is not None else None
    return found


def distinct(nodes: Iterable[Node]) -> list[Node]:
    """One node of each effect on the robot as it is, and on the others where that was looked at."""
    kept: list[Node] = []
    for node in nodes:
        if not any(node.look.like(o.look) and (node.whole and o.whole and node.whole.like(o.whole)) for o in kept):
            kept.append(node)
    return kept
