"""Processes of the workbench's own, in which nothing runs that merely lies in the current directory.

Python puts the current directory on the module path of ``python -m`` and ``python -c``: a file ``mujoco.py`` beside a
campaign would be imported in place of MuJoCo. Every process that the workbench starts is therefore made here: it looks
for modules where this process does, in the same order, and nowhere else.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping

NO_CURRENT_DIRECTORY = "PYTHONSAFEPATH"
"""environment variable: tells the Python processes that libraries start to leave the current directory alone"""

BEGIN = (
    "import sys; sys.path[:] = __import__('json').loads(sys.argv[1]); module = sys.argv[2]; del sys.argv[1:3];"
    " __import__('runpy').run_module(module, run_name='__main__', alter_sys=True)"
)
BEGIN_CODE = "import sys; sys.path[:] = __import__('json').loads(sys.argv[1]); exec(sys.argv[2])"


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def module_path() -> list[str]:
    """Where this process looks for modules, without what stands for the current directory, wherever that is."""
    return [entry for entry in sys.path if isinstance(entry, str) and os.path.isabs(entry)]


def python_module(module: str, *arguments: str) -> list[str]:
    """Return the command that runs a module of the workbench in a process of its own, as ``python -m`` does."""
    return [*_interpreter(), "-c", BEGIN, json.dumps(module_path()), module, *arguments]


def python_code(code: str) -> list[str]:
    """Return the command that runs a few lines of Python in a process of their own, as ``python -c`` does."""
    return [*_interpreter(), "-c", BEGIN_CODE, json.dumps(module_path()), code]


def _interpreter() -> list[str]:
    # -E: PYTHONINSPECT, PYTHONWARNINGS and their like import or run what they name
    flags = [sys.executable, "-P", "-E"]
    if sys.flags.no_user_site:
        flags.append("-s")
    return [*flags, "-X", "utf8"] if sys.flags.utf8_mode else flags


def environment(**more: str) -> Mapping[str, str]:
    """Return the environment of such a process: this one's, with *more*."""
    return {**os.environ, NO_CURRENT_DIRECTORY: "1", **more}
