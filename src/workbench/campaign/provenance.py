"""Where numbers come from: versions, machine, hash of the model."""

from __future__ import annotations

import hashlib
import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("mujoco-core", "numpy", "scipy", "pandas", "numba", "pyarrow")


def versions() -> dict[str, str]:
    """Versions of the workbench, Python and the packages whose code makes the numbers."""
    found = {"workbench": _version("parallel-robot-workbench"), "python": platform.python_version()}
    return found | {name.removesuffix("-core"): _version(name) for name in PACKAGES}


def _version(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        from workbench._version import __version__

        return __version__ if distribution == "parallel-robot-workbench" else "unknown"


def machine() -> dict[str, str | int]:
    """System, processor and number of cores."""
    return {
        "system": f"{platform.system()} {platform.release().split('-')[0]}",
        "processor": platform.machine(),
        "cores": os.cpu_count() or 1,
    }


def stamp(path: Path) -> tuple[int, int, int]:
    """What changes when a file is saved, over the old one or in its place: modification time, size and inode.

    Raises
    ------
    OSError
        There is no such file, or it may not be looked at.
    """
    status = path.stat()
    return status.st_mtime_ns, status.st_size, status.st_ino


def sha256(data: bytes) -> str:
    """Hexadecimal SHA-256."""
    return hashlib.sha256(data).hexdigest()
