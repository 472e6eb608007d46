"""The same cases on an existing Dask cluster.

Each task of Dask is a few cases, computed by a worker process of our own beside Dask's (`supervisor`): limits of time
and memory, and what becomes of a case that dies, are the same as on one machine, and so are the numbers.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from functools import partial
from itertools import islice
from typing import Any

from workbench.errors import MissingExtraError, WorkbenchError
from workbench.sweep.record import KILLED
from workbench.sweep.supervisor import Lost, Setup, Supervisor

CHUNK = 16
"""Cases of one Dask task; a scheduler handles some hundred tasks a second."""

AHEAD = 3
"""Chunks per thread of the cluster that are handed out: enough that none waits, few enough that memory stays flat."""

PATIENCE_S = 10

_local = threading.local()


def compute_chunk(
    setup: Setup, limits: tuple[float, float, int], tasks: list[tuple[int, Any]]
) -> list[tuple[int, Any]]:
    """Compute a few tasks on a worker of the cluster; its own worker process is kept for the next chunk."""
    known = getattr(_local, "pool", None)
    if known is None or known[0] != (setup, limits):
        if known is not None:
            known[1].close()
        known = ((setup, limits), Supervisor(1, setup, *limits))
        _local.pool = known
    return list(known[1].run(iter(tasks)))


class ClusterPool:
    """A connection to a Dask scheduler.

    Raises
    ------
    MissingExtraError
        Dask is not installed.
    WorkbenchError
        It is no address, or nobody answers at it.
    """

    def __init__(self, address: str, setup: Setup, time_limit: float, memory_limit: float, retries: int) -> None:
        try:
            from distributed import Client
            from distributed.comm.addressing import parse_address, parse_host_port
        except ImportError as error:
            raise MissingExtraError(
                "--scheduler needs the extra cluster: pip install 'parallel-robot-workbench[cluster]'"
            ) from error
        try:  # an address without a port would leave a client behind that is neither connected nor closed
            scheme, place = parse_address(address)
            if scheme in ("tcp", "tls", "ws", "wss"):
                parse_host_port(place)
        except ValueError as error:
            raise WorkbenchError(f"scheduler {address}: {error}; allowed: like tcp://host:8786") from error
        try:
            self._client = Client(address, timeout=PATIENCE_S, set_as_default=False)
        except (OSError, ValueError) as error:
            raise WorkbenchError(f"scheduler {address}: nobody answers: {error}") from error
        except Exception as error:  # no certificate for TLS, a transport that is not installed: each has its own kind
            raise WorkbenchError(f"scheduler {address}: cannot be reached this way: {error}") from error
        self._compute = partial(compute_chunk, setup, (time_limit, memory_limit, retries))

    def run(self, tasks: Iterator[tuple[int, Any]]) -> Iterator[tuple[int, Any]]:
        """Yield each task's number with its answer or `Lost`, in the order they finish.

        Raises
        ------
        WorkbenchError
            A worker of the cluster cannot compute for this run, or the connection is lost.
        """
        from distributed import as_completed

        waiting: dict[str, list[tuple[int, Any]]] = {}
        futures = as_completed(loop=self._client.loop)
        source = iter(tasks)

        def submit() -> bool:
            chunk = list(islice(source, CHUNK))
            if chunk:
                future = self._client.submit(self._compute, chunk, pure=False)
                waiting[future.key] = chunk
                futures.add(future)
            return bool(chunk)

        while len(waiting) < AHEAD * max(1, sum(self._client.nthreads().values())) and submit():
            pass
        for future in futures:
            chunk = waiting.pop(future.key)
            yield from self._answers(future, chunk)
            future.release()
            submit()

    def _answers(self, future: Any, chunk: list[tuple[int, Any]]) -> list[tuple[int, Any]]:
        from distributed import KilledWorker

        try:
            answers: list[tuple[int, Any]] = future.result()
        except KilledWorker:
            return [
                (index, Lost(KILLED, "the cluster's workers died on it, or on a case beside it")) for index, _ in chunk
            ]
        except WorkbenchError:
            raise
        except Exception as error:
            raise WorkbenchError(f"cluster: {type(error).__name__}: {error}") from error
        return answers

    def close(self) -> None:
        """Give up what is still waiting and disconnect; the cluster stays."""
        with contextlib.suppress(Exception):
            self._client.close(timeout=PATIENCE_S)
