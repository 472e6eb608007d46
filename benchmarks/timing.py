"""Timing that survives a busy machine: everything compared is called in turn, round after round, in one process.

A ratio is the median over rounds of the quotient of two times of the same round, so that what slows a whole round
cancels; a time is the median over rounds.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

SHORTEST_S = 2e-4
"""A call faster than this is repeated within a round until it takes so long."""


@dataclass(frozen=True)
class Rounds:
    """Times of several functions over the same rounds."""

    seconds: dict[str, list[float]]
    """name -> seconds of one call, one entry a round"""

    def median_s(self, name: str) -> float:
        return statistics.median(self.seconds[name])

    def best_s(self, name: str) -> float:
        return min(self.seconds[name])

    def ratio(self, name: str, to: str) -> float:
        """Median over rounds of the time of *name* over that of *to*."""
        pairs = zip(self.seconds[name], self.seconds[to], strict=True)
        return statistics.median(one / other for one, other in pairs)


def _calls(function: Callable[[], object]) -> int:
    """How many calls take `SHORTEST_S`; one would not say: the second call ever takes ten times what others do."""
    count = 1
    while True:
        begun = time.perf_counter()
        for _ in range(count):
            function()
        passed = time.perf_counter() - begun
        if passed >= SHORTEST_S:
            return max(1, int(count * SHORTEST_S / passed))
        count *= 2


def in_turn(functions: Mapping[str, Callable[[], object]], rounds: int, budget_s: float) -> Rounds:
    """Call the functions in turn, at least 3 and at most *rounds* times, or until *budget_s* seconds have passed."""
    calls: dict[str, int] = {}
    for name, function in functions.items():
        function()  # compiles, fills caches
        calls[name] = _calls(function)
    seconds: dict[str, list[float]] = {name: [] for name in functions}
    start = time.perf_counter()
    done = 0
    while done < 3 or (done < rounds and time.perf_counter() - start < budget_s):
        for name, function in functions.items():
            count = calls[name]
            begun = time.perf_counter()
            for _ in range(count):
                function()
            seconds[name].append((time.perf_counter() - begun) / count)
        done += 1
    return Rounds(seconds)
