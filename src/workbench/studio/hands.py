"""What is done by hand on the page, taken in one after the other, in the order in which it was done.

viser runs what listens to an input in a pool of threads, which overtake each other and read the input's value when they
come to it: by then the page may have put the input somewhere else, and the hand's value would be lost. So a value is
taken where it arrives, in the server's own loop, and the page puts inputs somewhere in that loop, too.
"""

from __future__ import annotations

import asyncio
import queue
import threading
from collections import Counter
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

STOPPED_S = 0.2
"""How often a waiting page looks whether the server still goes on."""


class Hands:
    """Listens to inputs, and puts them somewhere.

    Parameters
    ----------
    loop
        The server's.
    failed
        Told of an exception that something lets through; the thread goes on.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, failed: Callable[[BaseException], None]) -> None:
        self._loop, self._failed = loop, failed
        self._acts: queue.SimpleQueue[Callable[[], object] | None] = queue.SimpleQueue()
        self._ahead: Counter[int] = Counter()
        """input -> values of a hand that are not taken in yet; changed in the server's loop alone"""
        self._left = 0
        self._change = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="studio hands", daemon=True)
        self._thread.start()

    def listen(self, handle: Any, act: Callable[[Any], object], touched: Callable[[], object] | None = None) -> None:
        """Tell *act* each value that a hand gives an input; *touched* at once, in the server's loop: may not wait."""

        async def moved(event: Any) -> None:
            if event.client_id is None:
                return  # the page itself put it there
            if touched is not None:
                touched()
            self._ahead[id(handle)] += 1
            self.do(partial(self._take, handle, act, event.target.value))

        handle.on_update(moved)

    def click(self, button: Any, act: Callable[[Any], object]) -> None:
        """Tell *act* the value of a button, or of a group of them, that is clicked."""

        async def clicked(event: Any) -> None:
            if event.client_id is not None:
                self.do(partial(act, event.target.value))

        button.on_click(clicked)

    def do(self, act: Callable[[], object]) -> None:
        """Do something after all that was done by hand before."""
        with self._change:
            self._left += 1
        self._acts.put(act)

    def put(self, places: Iterable[tuple[Any, Any]]) -> None:
        """Put inputs at values, apart from those at which a hand is ahead of what was computed."""
        wanted, done = list(places), threading.Event()

        def place() -> None:
            try:
                for handle, value in wanted:
                    if not self._ahead[id(handle)]:
                        handle.value = value
            except Exception as error:
                self._failed(error)
            finally:
                done.set()

        if self._in_the_loop(place):
            while not done.wait(STOPPED_S) and self._loop.is_running():
                pass

    def idle(self, timeout: float) -> bool:
        """Wait until all is taken in; false where that takes longer than *timeout* seconds."""
        with self._change:
            return self._change.wait_for(lambda: not self._left, timeout)

    def end(self) -> None:
        """Take in nothing more."""
        self._acts.put(None)
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout=5.0)

    def _take(self, handle: Any, act: Callable[[Any], object], value: Any) -> None:
        try:
            act(value)
        finally:
            self._in_the_loop(partial(self._ahead.subtract, (id(handle),)))

    def _in_the_loop(self, act: Callable[[], object]) -> bool:
        """Have something done in the server's loop; false where the server has ended."""
        try:
            self._loop.call_soon_threadsafe(act)
        except RuntimeError:
            if not self._loop.is_closed():
                raise
            return False
        return True

    def _run(self) -> None:
        while (act := self._acts.get()) is not None:
            try:
                act()
            except Exception as error:
                self._failed(error)
            finally:
                with self._change:
                    self._left -= 1
                    self._change.notify_all()
