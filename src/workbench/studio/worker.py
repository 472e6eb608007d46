"""One thread that does what was asked for last: requests that were overtaken are never begun."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable


class Worker:
    """Runs jobs one after the other; of jobs with the same key only the latest counts.

    Parameters
    ----------
    failed
        Told of an exception that a job lets through; the thread goes on.
    """

    def __init__(self, failed: Callable[[BaseException], None]) -> None:
        self._failed = failed
        self._jobs: dict[Hashable, Callable[[], None]] = {}
        self._change = threading.Condition()
        self._busy = self._ending = False
        self._thread = threading.Thread(target=self._run, name="studio", daemon=True)
        self._thread.start()

    def ask(self, key: Hashable, job: Callable[[], None], *, drop: tuple[Hashable, ...] = ()) -> None:
        """Ask for a job; jobs under the keys in *drop* that wait are forgotten."""
        with self._change:
            for other in (key, *drop):
                self._jobs.pop(other, None)
            self._jobs[key] = job
            self._change.notify_all()

    @property
    def waiting(self) -> bool:
        """Whether a job waits, so that one that may be cut short should be."""
        return bool(self._jobs) or self._ending

    def idle(self, timeout: float) -> bool:
        """Wait until nothing is to be done; false where that takes longer than *timeout* seconds."""
        with self._change:
            return self._change.wait_for(lambda: not self._jobs and not self._busy, timeout)

    def end(self) -> None:
        """Begin no further job, and wait for the one that runs."""
        with self._change:
            self._ending = True
            self._jobs.clear()
            self._change.notify_all()
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout=5.0)

    def _run(self) -> None:
        while True:
            with self._change:
                self._busy = False
                self._change.notify_all()
                self._change.wait_for(lambda: bool(self._jobs) or self._ending)
                if self._ending:
                    return
                job = self._jobs.pop(next(iter(self._jobs)))
                self._busy = True
            try:
                job()
            except Exception as error:
                self._failed(error)
