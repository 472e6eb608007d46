"""How kernels are compiled: one decorator, so that every kernel has the same arithmetic, cache and first-use message.

Machine code is kept beside the module or, where that directory is read-only, in the user's cache directory. The first
use after installation therefore takes a while, once; a notice (`workbench.notices`) says so.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from workbench.notices import tell
from workbench.shielded import shielded

WITHOUT_COMPILER = "NUMBA_DISABLE_JIT"
"""environment variable for debugging; neither the kernels nor numba's own parts work with it"""

if os.environ.get(WITHOUT_COMPILER, "0") != "0":
    del os.environ[WITHOUT_COMPILER]
    tell(f"{WITHOUT_COMPILER} is not heeded: the kernels need machine code")

with shielded():
    from numba import config, float64, njit, types
    from numba.core.errors import NumbaError

# numba looks for this file of the current directory again before it compiles
if hasattr(config, "_config_fname"):
    config._config_fname = str(Path(__file__).parent / "no_numba_config")

__all__ = ["NumbaError", "borrowing", "compiled", "float64", "inlined", "types"]

OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True}
"""IEEE arithmetic throughout, no fast-math: NaN stays NaN, and a sample's result does not depend on whether it was
computed alone, in a vector register with others, or in another thread. A division by zero is infinite, as in NumPy."""

UNCOUNTED: dict[str, Any] = {"_nrt": False}
"""numba's own name for code without its reference counts"""

ROOT = Path(__file__).parent

KERNEL_FILES = (
    "recorded/kernels.py",
    # each robot that comes with the package keeps its machine code in files of these names
    *(
        path.relative_to(ROOT).as_posix()
        for name in ("kernel", "friction")
        for path in sorted(ROOT.glob(f"robots/*/{name}.py"))
    ),
    *(f"robots/{name}.py" for name in ("blocks", "sine_cosine")),
    *(f"reference/{name}.py" for name in ("kernels", "rows", "linear", "kinds", "tables", "frames")),
    *(f"reference/{name}.py" for name in ("kinematics", "bench", "closing", "sides", "forward_kernels")),
    *(f"reference/{name}.py" for name in ("task_rows", "platform_kernels", "many", "projection")),
)
"""What machine code is made of. A kernel calls into other files, and its cache must not outlive a change in those."""


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a kernel when it is first called with given types, and keep the machine code."""
    return _cached(function, {})


def borrowing(function: Callable[..., Any]) -> Any:
    """As `compiled`, for a kernel that makes no arrays: it borrows its caller's, and counts no references to them.

    A count is an atomic instruction, and every row that is looked at by itself costs two; closing and projecting a
    sample took six hundred, a sixth of their time. What makes an array is refused by the compiler.
    """
    return _cached(function, UNCOUNTED)


def inlined(function: Callable[..., Any]) -> Any:
    """As `borrowing`, for a part of a kernel: it becomes one loop body with its caller, which can be vectorised."""
    return _cached(function, {"forceinline": True, **UNCOUNTED})


def merged(function: Callable[..., Any]) -> Any:
    """A part of a kernel that is written into its caller before that is compiled, and never compiled alone.

    What takes many arrays is costly to call for the compiler: handing sixty over takes seconds to compile.
    """
    return njit(inline="always", **OPTIONS)(function)


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
        return dispatcher  # another numba keeps it elsewhere; its own rule, the kernel's file alone, remains
    return dispatcher


_known: list[str] = []


def _fingerprint() -> str:
    if not _known:
        sources = b"".join((ROOT / name).read_bytes() for name in ("compiled.py", *KERNEL_FILES))
        _known.append(hashlib.sha256(sources).hexdigest())
    return _known[0]


def _announce() -> None:
    try:
        from numba.core import event
    except ImportError:
        return

    class FirstUse(event.Listener):  # type: ignore[misc]
        """Listens to numba's compiler and speaks once; what comes from the cache is not compiled."""

        said = False

        def on_start(self, event: Any) -> None:
            dispatcher = event.data.get("dispatcher")
            kernel = getattr(dispatcher, "py_func", None)
            module = getattr(kernel, "__module__", None) or ""  # what numba makes by itself is of no module
            if self.said or not module.startswith("workbench."):
                return
            self.said = True
            place = getattr(getattr(dispatcher, "_cache", None), "cache_path", None)
            kept = f"kept in {place}" if place else "not kept: no writable cache directory; set NUMBA_CACHE_DIR"
            tell(f"compiling numerical kernels for this machine, once; takes half a minute or more ({kept})")

        def on_end(self, event: Any) -> None:
            pass

    event.register("numba:compile", FirstUse())


_announce()
