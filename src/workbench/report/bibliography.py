"""The bibliography that lies beside LaTeX tables."""

from __future__ import annotations

import re
from functools import cache
from importlib.resources import files

NAME = "references.bib"
_ENTRY = re.compile(r"^@\w+\{(\w+),", re.MULTILINE)


@cache
def bibliography() -> str:
    """The BibTeX file, as it stands."""
    return files("workbench.report").joinpath(NAME).read_text("utf-8")


@cache
def cited_keys() -> frozenset[str]:
    """Keys that it knows."""
    return frozenset(_ENTRY.findall(bibliography()))
