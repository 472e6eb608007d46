"""Drawings that stand in figures/ already, for a PDF of the same results: they need not be drawn again.

A file in the run directory says what they were drawn from and by what: results, this package's own source, the
libraries that draw. Where any of that is another, or a drawing is not the one that was written, all are drawn anew.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from workbench.report.plot import Plot
from workbench.report.svg import standalone

NAME = "drawn.json"
FORMAT = 1
LIBRARIES = ("matplotlib", "numpy")
_HEAD = re.compile(r"\A<\?xml[^>]*\?>\n(<svg[^>]*>)<title>[^<]*</title>")
_ELSEWHERE = re.compile(r'href="(?!#|data:image/png;base64,)|<script|<!DOCTYPE|@import|url\((?!#)', re.IGNORECASE)
"""What no drawing of ours has: whoever wrote such a file, it is not taken."""


def digest_of(run_dir: Path) -> str:
    """Tell results and drawing code from all others, SHA-256."""
    found = hashlib.sha256(repr([(name, version(name)) for name in LIBRARIES]).encode())
    package = Path(__file__).parents[1]
    stored = [run_dir / "manifest.json", run_dir / "summary.csv", *sorted((run_dir / "series").glob("*"))]
    for root, paths in ((package, sorted(package.rglob("*.py"))), (run_dir, stored)):
        for path in paths:
            if path.is_file():
                found.update(f"\n{path.relative_to(root)} {path.stat().st_size}\n".encode())
                found.update(path.read_bytes())
    return found.hexdigest()


def note(run_dir: Path, style: str, files: Mapping[Path, bytes]) -> bytes:
    """The file that says what the drawings among *files* were drawn from."""
    drawings = {path.name: content for path, content in files.items() if path.suffix == ".svg"}
    told: dict[str, Any] = {
        "format": FORMAT,
        "from": digest_of(run_dir),
        "style": style,
        "drawings": {name: hashlib.sha256(content).hexdigest() for name, content in sorted(drawings.items())},
    }
    return (json.dumps(told, indent=1) + "\n").encode()


def take(folder: Path, run_dir: Path, style: str, plots: Sequence[Plot]) -> bool:
    """Give *plots* the drawings that stand in *folder*, all or none; whether they could be taken."""
    try:
        told = json.loads((run_dir / NAME).read_text(encoding="utf-8"))
        if (told["format"], told["style"], told["from"]) != (FORMAT, style, digest_of(run_dir)):
            return False
        found = [_drawing(folder / f"{plot.key}.svg", told["drawings"], plot) for plot in plots]
    except (OSError, ValueError, KeyError, TypeError, AttributeError):  # none there, or a broken one
        return False
    if None in found:
        return False
    for plot, svg in zip(plots, found, strict=True):
        vars(plot)["svg"] = svg  # where the property keeps it
    return True


def _drawing(path: Path, digests: Mapping[str, str], plot: Plot) -> str | None:
    content = path.read_bytes()
    text = content.decode("utf-8")
    if hashlib.sha256(content).hexdigest() != digests[path.name] or _ELSEWHERE.search(text):
        return None
    bare, heads = _HEAD.subn(lambda match: match[1], text)
    # as it would be written from what was taken: else it is none of ours, or of another plot
    return bare if heads == 1 and standalone(bare, plot.alt) == text else None
