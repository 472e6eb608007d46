"""A worker process: reads tasks from its standard input, answers on its standard output, dies with its parent.

Run as ``python -m workbench.sweep.worker``. A process of its own, and no thread pool or forked copy: whatever
happens to it (a signal, a crash in C, memory) happens to the one case that it is computing.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import struct
import sys
import threading
from typing import Any, BinaryIO

from workbench.no_exit import for_good

READY = "ready"
DONE = "done"
RAISED = "raised"
NO_MEMORY = "memory"
BROKEN = "broken"

HEADER = struct.Struct("<Q")


def send(stream: BinaryIO, message: object) -> None:
    """Write one message: its length, then its pickle."""
    data = pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)
    stream.write(HEADER.pack(len(data)) + data)
    stream.flush()


def receive(stream: BinaryIO) -> Any:
    """Read one message.

    Raises
    ------
    EOFError
        The other side is gone, in the middle of a message or between two.
    """
    return pickle.loads(_exactly(stream, HEADER.unpack(_exactly(stream, HEADER.size))[0]))


def _exactly(stream: BinaryIO, size: int) -> bytes:
    data = stream.read(size)
    if len(data) < size:
        raise EOFError
    return data


def limit_memory(megabytes: float) -> None:
    """Let this process grow by so much from here on; more raises MemoryError. Without effect where unsupported."""
    try:
        import resource

        with open("/proc/self/statm", "rb") as stream:
            used = int(stream.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + int(megabytes * 1e6), resource.getrlimit(resource.RLIMIT_AS)[1]))
    except (ImportError, OSError, ValueError):
        return


def _feed(stream: BinaryIO, tasks: queue.SimpleQueue[Any]) -> None:
    """Hand tasks on; end the process when the parent is gone, even in the middle of a case."""
    while True:
        try:
            tasks.put(receive(stream))
        except BaseException:
            os._exit(0)


def main() -> int:
    """Serve until the parent goes."""
    for_good()
    source = os.fdopen(os.dup(0), "rb")
    sink = os.fdopen(os.dup(1), "wb")
    # what a candidate prints must not end up between the answers
    os.dup2(2, 1)
    tasks: queue.SimpleQueue[Any] = queue.SimpleQueue()
    try:
        setup, megabytes = receive(source)
        function = setup()
        limit_memory(megabytes)
    except EOFError:
        return 0
    except BaseException as error:
        send(sink, (BROKEN, f"{type(error).__name__}: {error}"))
        return 1
    threading.Thread(target=_feed, args=(source, tasks), daemon=True).start()
    send(sink, (READY, None))
    while True:
        task = tasks.get()
        try:
            answer: tuple[str, Any] = (DONE, function(task))
        except MemoryError:
            send(sink, (NO_MEMORY, None))
            os._exit(1)
        except BaseException as error:
            answer = (RAISED, f"{type(error).__name__}: {error}")
        try:
            send(sink, answer)
        except BrokenPipeError:
            os._exit(0)


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        sys.exit(main())
