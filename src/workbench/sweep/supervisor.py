"""Local workers, watched one by one: a case that hangs, crashes or is killed is lost alone, and never the run.

Each worker has a pipe of its own and nothing is shared, so none can die with a lock in its hand. The parent writes,
waits and restarts; it computes nothing.
"""

from __future__ import annotations

import contextlib
import pickle
import queue
import signal
import subprocess
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, BinaryIO

from workbench import processes
from workbench.errors import WorkbenchError
from workbench.sweep.record import FAILED, KILLED, TIMEOUT
from workbench.sweep.worker import BROKEN, DONE, HEADER, NO_MEMORY, RAISED, READY, receive

FAILED_STARTS = 20
"""Workers in a row that die before they are ready; then something is wrong with the machine, not with a case."""

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
"""A worker is one thread: there are as many workers as cores, and each thread more takes memory."""

AHEAD = 3
"""Tasks that a worker with quick ones holds: what it computes and what comes next, so that it never waits for more."""

QUICK_S = 0.25
"""A worker whose last task took longer holds one: what waits behind a long task could be another worker's."""

Setup = Callable[[], Callable[[Any], Any]]
"""Called once in each worker; returns the function that is called with each task. Both travel by pickle."""


@dataclass(frozen=True)
class Lost:
    """What became of a task that left no answer."""

    status: str
    reason: str


class _Worker:
    def __init__(self, setup: bytes, inbox: queue.SimpleQueue[Any]) -> None:
        self.process = subprocess.Popen(
            processes.python_module("workbench.sweep.worker"),
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            env=processes.environment(**ONE_THREAD),
            # Ctrl-C in a terminal goes to the parent alone, which ends its workers itself
            start_new_session=True,
        )  # fmt: skip
        self.ready = False
        self.tasks: deque[tuple[int, Any]] = deque()
        """the first is being computed"""
        self.ahead = 1
        self.begun = 0.0
        self.deadline = float("inf")
        self.timed_out = False
        self._write(setup)
        threading.Thread(target=self._listen, args=(inbox,), daemon=True).start()

    def _write(self, data: bytes) -> None:
        stdin = self.process.stdin
        assert stdin is not None
        # a worker that is dead already is noticed by the thread that listens to it
        with contextlib.suppress(BrokenPipeError):
            stdin.write(data)
            stdin.flush()

    def _listen(self, inbox: queue.SimpleQueue[Any]) -> None:
        stream: BinaryIO = self.process.stdout  # type: ignore[assignment]
        try:
            while True:
                inbox.put((self, receive(stream)))
        except BaseException:  # the end of the pipe, in the middle of a message or not: the worker is gone
            inbox.put((self, None))

    def give(self, index: int, task: Any, time_limit: float) -> None:
        if not self.tasks:
            self._start(time_limit)
        self.tasks.append((index, task))
        data = pickle.dumps(task, protocol=pickle.HIGHEST_PROTOCOL)
        self._write(HEADER.pack(len(data)) + data)

    def done(self, time_limit: float) -> int:
        """Its first task is answered; the clock of the next one starts. Returns the number of the first."""
        index, _ = self.tasks.popleft()
        self.ahead = AHEAD if time.monotonic() - self.begun < QUICK_S else 1
        self.deadline = float("inf")
        if self.tasks:
            self._start(time_limit)
        return index

    def _start(self, time_limit: float) -> None:
        self.begun = time.monotonic()
        self.deadline = self.begun + time_limit

    def kill(self) -> None:
        self.process.kill()

    def close(self) -> int:
        """End it and return its exit code."""
        self.process.kill()
        code = self.process.wait()
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()
        return code


class Supervisor:
    """A fixed number of workers.

    Parameters
    ----------
    jobs
        Number of workers.
    setup
        See `Setup`.
    time_limit
        Seconds that one task may take.
    memory_limit
        Megabytes that a worker may grow by.
    retries
        How often a task is tried again after its worker was killed or it ran out of time.
    """

    def __init__(self, jobs: int, setup: Setup, time_limit: float, memory_limit: float, retries: int) -> None:
        self._jobs = jobs
        data = pickle.dumps((setup, memory_limit), protocol=pickle.HIGHEST_PROTOCOL)
        self._setup = HEADER.pack(len(data)) + data
        self._time_limit, self._memory_limit, self._retries = time_limit, memory_limit, retries
        self._inbox: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._workers: list[_Worker] = []
        self._failed_starts = 0
        self._attempts: dict[int, int] = {}
        self._again: list[tuple[int, Any]] = []

    @property
    def pids(self) -> list[int]:
        """Process numbers of the workers."""
        return [worker.process.pid for worker in self._workers]

    def run(self, tasks: Iterator[tuple[int, Any]]) -> Iterator[tuple[int, Any]]:
        """Compute tasks ``(number, task)``; yield each number with its answer or `Lost`, in the order they finish.

        Tasks are taken from the iterator when a worker is free, so it may be endless.

        Raises
        ------
        WorkbenchError
            Workers do not start.
        """
        pending = iter(tasks)
        exhausted = False
        while True:
            while not exhausted or self._again:
                ready = [w for w in self._workers if w.ready and not w.timed_out and len(w.tasks) < w.ahead]
                worker = min(ready, key=lambda w: len(w.tasks), default=None)
                if worker is None or (worker.tasks and len(self._workers) < self._jobs):
                    if len(self._workers) >= self._jobs:
                        break
                    self._hire()
                    continue
                task = self._again.pop() if self._again else next(pending, None)
                if task is None:
                    exhausted = True
                    break
                worker.give(*task, self._time_limit)
            if exhausted and not self._again and not any(w.tasks for w in self._workers):
                return
            found = self._wait()
            if found is not None:
                yield found

    def close(self) -> None:
        """End all workers."""
        for worker in self._workers:
            worker.kill()
        for worker in self._workers:
            worker.close()
        self._workers.clear()

    def _hire(self) -> None:
        self._workers.append(_Worker(self._setup, self._inbox))

    def _wait(self) -> tuple[int, Any] | None:
        now = time.monotonic()
        for worker in self._workers:
            if now > worker.deadline and not worker.timed_out:
                worker.timed_out = True
                worker.kill()
        nearest = min((w.deadline for w in self._workers if not w.timed_out), default=float("inf"))
        try:
            worker, message = self._inbox.get(timeout=min(max(nearest - now, 0.0) + 0.01, 1.0))
        except queue.Empty:
            return None
        if worker not in self._workers:
            return None
        if message is None:
            return self._bury(worker)
        kind, content = message
        if kind == READY:
            worker.ready, self._failed_starts = True, 0
            return None
        if kind == BROKEN:
            raise WorkbenchError(f"workers do not start: {content}")
        if kind == NO_MEMORY:
            return self._bury(worker, memory=True)
        index = worker.done(self._time_limit)
        self._attempts.pop(index, None)
        if worker.timed_out:  # it answered in the moment that it was killed; the answer counts
            self._again += worker.tasks
            worker.tasks.clear()
            self._dismiss(worker)
        return index, content if kind == DONE else Lost(FAILED, content) if kind == RAISED else Lost(KILLED, kind)

    def _dismiss(self, worker: _Worker) -> int:
        self._workers.remove(worker)
        code = worker.close()
        # what it had not begun is another's; the first one is dealt with by whoever dismisses it
        self._again += list(worker.tasks)[:0:-1]
        return code

    def _bury(self, worker: _Worker, memory: bool = False) -> tuple[int, Any] | None:
        """A worker is gone: try its task again, or give it up."""
        code = self._dismiss(worker)
        if not worker.tasks:
            if not worker.ready:
                self._failed_starts += 1
                if self._failed_starts >= FAILED_STARTS:
                    raise WorkbenchError(f"workers do not start: {self._failed_starts} in a row ended by {cause(code)}")
            return None
        index, task = worker.tasks[0]
        attempt = self._attempts.get(index, 0) + 1
        if attempt <= self._retries and not memory:
            self._attempts[index] = attempt
            self._again.append((index, task))
            return None
        self._attempts.pop(index, None)
        tries = f", {attempt} times in a row" if attempt > 1 else ""
        if memory:
            return index, Lost(KILLED, f"needs more memory than allowed: {self._memory_limit:g} MB")
        if worker.timed_out:
            return index, Lost(TIMEOUT, f"takes longer than allowed: {self._time_limit:g} s{tries}")
        return index, Lost(KILLED, f"its worker ended by {cause(code)}{tries}")


def cause(code: int) -> str:
    """Say how a process ended."""
    if code >= 0:
        return f"exit code {code}"
    with contextlib.suppress(ValueError):
        return signal.Signals(-code).name
    return f"signal {-code}"
