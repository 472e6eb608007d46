"""Libraries that read settings from the current directory when they are imported, imported without those.

matplotlib reads ``./matplotlibrc`` and numba ``./.numba_config.yaml``, whoever put them there: they could change
figures and numbers, name a directory of compiled code, or end the run. A backend of the environment is read too; the
workbench draws into files and needs none.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

READ_FROM_HERE = ("matplotlibrc", ".numba_config.yaml")
"""Files that make it necessary to look away from the current directory."""


@contextmanager
def shielded(*variables: str) -> Iterator[None]:
    """Hide such files of the current directory, and some environment variables, while a library is imported."""
    hidden = {name: os.environ.pop(name) for name in variables if name in os.environ}
    back = None
    if any(os.path.lexists(name) for name in READ_FROM_HERE):
        with suppress(OSError):
            back = Path.cwd()
            os.chdir(Path(__file__).parent)
    try:
        yield
    finally:
        if back is not None:
            os.chdir(back)
        os.environ.update(hidden)
