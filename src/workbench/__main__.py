"""The command line, as ``workbench`` and as ``python -m workbench``: nothing is imported from the current directory."""

from __future__ import annotations

import os
import sys
from typing import NoReturn


def leave_current_directory_out() -> None:
    """Take the current directory off the module path, where only an empty entry of PYTHONPATH put it there.

    ``PYTHONPATH=$PYTHONPATH:/more`` with an unset variable begins with an empty entry; who means the directory writes
    it, or a dot. Libraries that start a Python of their own are told the same.
    """
    os.environ.setdefault("PYTHONSAFEPATH", "1")
    entries = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    if sys.flags.ignore_environment or "" not in entries or len(entries) == 1:
        return
    try:
        here = os.getcwd()
        meant = any(entry and os.path.abspath(entry) == here for entry in entries)
    except OSError:
        return
    if not meant and here in sys.path[: len(entries) + 1]:
        sys.path.remove(here)


def main() -> NoReturn:
    """Run the command line."""
    leave_current_directory_out()
    from workbench.cli import main as run
    from workbench.no_exit import for_good

    for_good()
    run()


if __name__ == "__main__":
    if not sys.flags.safe_path:
        del sys.path[0]  # where `python -m` puts the current directory
    main()
