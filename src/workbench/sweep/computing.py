"""Compute what a journal does not hold, by workers of this machine or of a cluster; each part is kept as it ends."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Protocol

from workbench.errors import SpecError
from workbench.processes import cores
from workbench.sweep.evaluate import Answer, Packed
from workbench.sweep.inputs import Inputs
from workbench.sweep.journal import Journal
from workbench.sweep.progress import Meter, Show
from workbench.sweep.record import lost
from workbench.sweep.resumable import Held, SweepOptions
from workbench.sweep.supervisor import Lost, Setup, Supervisor

SYNC_EVERY_S = 5.0
"""A power cut costs no more than the parts of so many seconds; a killed process costs none."""


class SweepInterrupted(KeyboardInterrupt):
    """Ctrl-C during a sweep or a study; the message says what is kept and how to go on."""


class Pool(Protocol):
    """What computes tasks: local workers, or a cluster."""

    def run(self, tasks: Iterator[tuple[int, Any]]) -> Iterator[tuple[int, Packed | Lost]]:
        """Yield each task's number with its answer, in the order they finish."""

    def close(self) -> None:
        """End what was started."""


Limits = tuple[float, float, int]
"""Seconds and GB that a part may take, and how often one whose worker died is tried again."""


def start_pool(setup: Setup, limits: Limits, options: SweepOptions, tasks: int) -> Pool:
    """Start what computes the parts of a run.

    Raises
    ------
    WorkbenchError
        The cluster cannot be reached, or its extra is not installed.
    """
    if options.scheduler:
        from workbench.sweep.cluster import ClusterPool

        return ClusterPool(options.scheduler, setup, *limits)
    return Supervisor(max(1, min(options.jobs or cores(), tasks)), setup, *limits)


@dataclass(frozen=True)
class Work:
    """What is computed: its parts by number."""

    start: Callable[[int], Pool]
    """starts workers for so many parts"""
    task: Callable[[int], Any]
    """what a worker needs to know of a part"""
    key: Callable[[int], str]
    """`identity.case_key` of a part"""
    keep: Callable[[Packed], None] = lambda answer: None
    """writes what does not stand in the journal"""


def compute_missing(held: Held, work: Work, journal: Journal, inputs: Inputs, show: Show | None) -> int:
    """Compute the parts that are not in the journal and add them to it; return how many that was.

    Raises
    ------
    SpecError
        A file that parts are made of was changed in the meantime.
    OutputError
        The system refuses a write; finished parts are kept.
    SweepInterrupted
        Ctrl-C.
    """
    counts, total = journal.counts(), held.total
    before = sum(counts.values())
    meter = Meter(held.path, before, total, counts, show)
    held.done = before
    if before == total:
        return 0
    pool: Pool | None = None
    synced = time.monotonic()
    try:
        pool = work.start(total - before)
        for index, found in pool.run((index, work.task(index)) for index in journal.missing()):
            _refuse_changed(inputs, held)
            if isinstance(found, Lost):
                found = Answer(lost(index, work.key(index), found.status, found.reason)).packed()
            work.keep(found)
            journal.add(found.index, found.status, found.line)
            held.done += 1
            meter.count(found.status)
            if time.monotonic() - synced > SYNC_EVERY_S:
                journal.sync()
                synced = time.monotonic()
    except KeyboardInterrupt:
        journal.sync()
        raise SweepInterrupted(
            f"{held.done} of {total} {held.kind.parts} are finished and kept in {held.path}; the same command goes on"
            " with the rest"
        ) from None
    finally:
        if pool is not None:
            pool.close()
    meter.tell(force=True)
    return total - before


def _refuse_changed(inputs: Inputs, held: Held) -> None:
    path = inputs.changed()
    if path is not None:
        raise SpecError(
            f"{path}: was changed while the {held.kind.what} ran; {held.done} of {held.total} {held.kind.parts}, of the"
            f" file as it was, are kept in {held.path}; the same command goes on with them if the file is put back, and"
            " else starts anew",
            file=str(path),
        )
