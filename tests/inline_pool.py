"""A pool that computes what a sweep or a study consists of in the process of the test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any


class Inline:
    """Runs tasks in this process; *before* is called with the number of each."""

    before: Callable[[int], None] = staticmethod(lambda count: None)

    def __init__(self, jobs: int, setup: Callable[[], Callable[[Any], Any]], *limits: float) -> None:
        self._compute = setup()

    def run(self, tasks: Iterator[tuple[int, Any]]) -> Iterator[tuple[int, Any]]:
        for count, (index, task) in enumerate(tasks):
            type(self).before(count)
            yield index, self._compute(task)

    def close(self) -> None:
        pass
