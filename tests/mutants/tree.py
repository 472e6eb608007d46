"""A copy of the repository, into which faults are planted; the checkout itself is never touched."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COPY = ROOT / "build" / "mutants" / "tree"
CACHE = ROOT / "build" / "mutants" / "kernels"
"""Machine code of the kernels without a fault."""

COPIED = ("src", "tests", "models", "campaigns", "examples", "docs", "reports/published", "pyproject.toml", "README.md")


def renew() -> Path:
    """Bring the copy up to date; files that have not changed keep their date, so that compiled kernels stay valid."""
    wanted: set[Path] = set()
    for name in COPIED:
        source = ROOT / name
        for path in sorted(source.rglob("*")) if source.is_dir() else [source]:
            if path.is_file() and "__pycache__" not in path.parts:
                wanted.add(path.relative_to(ROOT))
    for path in sorted(COPY.rglob("*")) if COPY.exists() else []:
        if path.is_file() and "__pycache__" not in path.parts and path.relative_to(COPY) not in wanted:
            path.unlink()
    for name in sorted(wanted):
        there = COPY / name
        content = (ROOT / name).read_bytes()
        if not there.exists() or there.read_bytes() != content:
            there.parent.mkdir(parents=True, exist_ok=True)
            there.write_bytes(content)
    return COPY


def source_of(module: str) -> str:
    """The text of a module of the package, such as ``reference/rows.py``, as it is."""
    return (ROOT / "src" / "workbench" / module).read_text(encoding="utf-8")


@contextmanager
def planted(module: str, text: str) -> Iterator[None]:
    """The copy with another text of one module; afterwards as before, to the date."""
    path = COPY / "src" / "workbench" / module
    before, dates = path.read_bytes(), path.stat()
    path.write_text(text, encoding="utf-8")
    try:
        yield
    finally:
        path.write_bytes(before)
        os.utime(path, ns=(dates.st_atime_ns, dates.st_mtime_ns))
        for stale in path.parent.glob(f"__pycache__/{path.stem}.*.pyc"):
            stale.unlink()


@contextmanager
def own_cache() -> Iterator[Path]:
    """A copy of the kernels' machine code that a fault may spoil."""
    place = CACHE.with_name("kernels-of-a-mutant")
    shutil.rmtree(place, ignore_errors=True)
    if CACHE.exists():
        shutil.copytree(CACHE, place)
    try:
        yield place
    finally:
        shutil.rmtree(place, ignore_errors=True)
