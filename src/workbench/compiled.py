"""How kernels are compiled: one decorator, so that every kernel has the same arithmetic, cache and first-use message.

Machine code is kept beside the module or, where that directory is read-only, in the user's cache directory. The first
use after installation therefore takes a while, once; the logger ``workbench`` says so at level INFO, and libraries that
embed the workbench decide themselves whether that is shown.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit

LOGGER = logging.getLogger("workbench")

OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True}
"""IEEE arithmetic throughout, no fast-math: NaN stays NaN, and a sample's result does not depend on whether it was
computed alone, in a vector register with others, or in another thread. A division by zero is infinite, as in NumPy."""

KERNEL_FILES = ("mechanisms/*_kernel.py", "mechanisms/blocks.py", "mechanisms/sine_cosine.py", "reference/*.py")
"""What machine code is made of. A kernel calls into other files, and its cache must not outlive a change in those."""


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a kernel when it is first called with given types, and keep the machine code."""
    return _cached(function, {})


def inlined(function: Callable[..., Any]) -> Any:
    """As `compiled`, for a part of a kernel: it becomes one loop body with its caller, which can then be vectorised."""
    return _cached(function, {"forceinline": True})


def _cached(function: Callable[..., Any], more: dict[str, Any]) -> Any:
    try:
        dispatcher = njit(cache=True, **OPTIONS, **more)(function)
    except RuntimeError:
        # neither the package's directory nor the user's cache can be written
        return njit(**OPTIONS, **more)(function)
    try:
        cache_file = dispatcher._cache._cache_file
        cache_file._source_stamp = (cache_file._source_stamp, _fingerprint())
    except AttributeError:
        # another numba keeps it elsewhere; its own rule, the kernel's file alone, remains
        LOGGER.debug("kernels' cache knows only the file of each kernel itself")
    return dispatcher


_known: list[str] = []


def _fingerprint() -> str:
    if not _known:
        root = Path(__file__).parent
        sources = sorted(path for pattern in KERNEL_FILES for path in root.glob(pattern))
        _known.append(hashlib.sha256(b"".join(path.read_bytes() for path in (Path(__file__), *sources))).hexdigest())
    return _known[0]


class _FirstUse:
    """Listens to numba's compiler and speaks once."""

    def __init__(self) -> None:
        self.said = False

    def on_start(self, event: Any) -> None:
        dispatcher = event.data.get("dispatcher")
        kernel = getattr(dispatcher, "py_func", None)
        if self.said or not getattr(kernel, "__module__", "").startswith("workbench."):
            return
        self.said = True
        place = getattr(getattr(dispatcher, "_cache", None), "cache_path", None)
        kept = f"kept in {place}" if place else "not kept: no writable cache directory; set NUMBA_CACHE_DIR"
        LOGGER.info("compiling numerical kernels for this machine, once, some seconds (%s)", kept)

    def on_end(self, event: Any) -> None:
        """Nothing to say."""


def _announce() -> None:
    try:
        from numba.core import event
    except ImportError:
        return

    class Listener(event.Listener):  # type: ignore[misc]
        def __init__(self) -> None:
            self._first_use = _FirstUse()

        def on_start(self, event: Any) -> None:
            self._first_use.on_start(event)

        def on_end(self, event: Any) -> None:
            self._first_use.on_end(event)

    event.register("numba:compile", Listener())


_announce()
