"""What a section of a report is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from workbench.report.plot import Plot
from workbench.report.tables import Table

SHORT = {
    "The papers' claims": "Claims",
    "Worst errors first": "Worst errors",
    "Is it good enough": "Good enough",
    "What the actuators have to give": "Actuators",
    "Can the reference be believed": "Reference",
    "Figures of the papers, redrawn": "Figures",
    "How to reproduce": "Reproduce",
    "Limits and caveats": "Limits",
    "How large the errors are": "Errors",
    "What drives the error": "Drivers",
    "Error over two numbers": "Maps",
    "The worst designs": "Worst designs",
    "The robot in motion, its error enlarged": "Film",
    "What did not pass, and what was left out": "Not passed",
}
"""Titles of sections in the list of contents, which stays in sight and has one line."""


@dataclass(frozen=True)
class Section:
    """One section: ``template`` names a pair of files, ``template.html.j2`` and ``template.md.j2``."""

    key: str
    title: str
    template: str
    context: Mapping[str, Any]
    plots: tuple[Plot, ...] = ()
    is_open: bool = True
    """whether the page shows it before it is asked for"""

    @property
    def short(self) -> str:
        """The title in the list of contents."""
        return SHORT.get(self.title, self.title)


def plain_section(key: str, title: str, paragraphs: Sequence[str], tables: Sequence[Table]) -> Section:
    """Return a section of sentences and the tables that hold them up."""
    context = {"paragraphs": list(paragraphs), "tables": list(tables), "figures": (), "note": ""}
    return Section(key, title, "sweep", context)
