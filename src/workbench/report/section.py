"""What a section of a report is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workbench.report.plot import Plot


@dataclass(frozen=True)
class Section:
    """One section: ``template`` names a pair of files, ``template.html.j2`` and ``template.md.j2``."""

    key: str
    title: str
    template: str
    context: Mapping[str, Any]
    plots: tuple[Plot, ...] = ()
