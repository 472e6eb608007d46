"""Compile `floor.c` on the spot and call it: how fast the same equations are in C, scalar and in vectors."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SOURCE = Path(__file__).with_name("floor.c")
SCALAR = ("-O3", "-march=native")
VECTOR = ("-O3", "-march=native", "-ffast-math", "-fopenmp-simd")
LIBRARIES = (("-lmvec", "-lm"), ("-lm",))
"""glibc's vector math library where there is one"""

PREFIX = {"asym_2rss_ppap": "asym", "planar_4rprp": "planar"}


@dataclass(frozen=True)
class Floor:
    """The two libraries, and how they were compiled."""

    scalar: ctypes.CDLL
    vector: ctypes.CDLL
    commands: tuple[str, str]

    def call(self, robot: str, vector: bool, *arrays: np.ndarray) -> Callable[[], None]:
        """Bind constants, q, qd, qdd, force, tau: what remains is the call through ctypes."""
        library, suffix = (self.vector, "blocks") if vector else (self.scalar, "rows")
        function = getattr(library, f"{PREFIX[robot]}_{suffix}")
        function.restype = None
        pointers = [ctypes.c_void_p(array.ctypes.data) for array in arrays]
        count = ctypes.c_int64(arrays[-1].size // 3)

        def bound() -> None:
            function(*pointers, count)

        bound.keeps = arrays  # type: ignore[attr-defined]
        return bound

    def threads(self, robot: str, constants: np.ndarray, *arrays: np.ndarray) -> Callable[[], None]:
        """Return the scalar form in two threads, a half each; ctypes lets go of the interpreter's lock."""
        half = len(arrays[0]) // 2
        parts = [
            self.call(robot, False, constants, *(a[rows] for a in arrays)) for rows in (slice(half), slice(half, None))
        ]
        pool = ThreadPoolExecutor(1)

        def both() -> None:
            other = pool.submit(parts[1])
            parts[0]()
            other.result()

        return both


def build(directory: Path) -> Floor | None:
    """Compile both forms into *directory*; None where there is no C compiler."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        return None
    scalar = _compile(compiler, SCALAR, directory / "floor_scalar.so")
    vector = _compile(compiler, VECTOR, directory / "floor_vector.so")
    if scalar is None or vector is None:
        return None
    return Floor(ctypes.CDLL(scalar[0]), ctypes.CDLL(vector[0]), (scalar[1], vector[1]))


def _compile(compiler: str, options: tuple[str, ...], target: Path) -> tuple[str, str] | None:
    for libraries in LIBRARIES:
        # compiled and linked in two steps: linked with -ffast-math, the library would switch off subnormal numbers in
        # the whole process that loads it
        part = target.with_suffix(".o")
        object_file = [compiler, *options, "-fPIC", "-c", "-o", str(part), str(SOURCE)]
        if subprocess.run(object_file, check=False, capture_output=True).returncode:
            return None
        command = [compiler, "-shared", "-o", str(target), str(part), *libraries]
        if subprocess.run(command, check=False, capture_output=True).returncode == 0:
            return str(target), " ".join([Path(compiler).name, *options, *libraries])
    return None
