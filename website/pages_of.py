"""Which pages the site has, and in which order."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

LEFT_OUT = ("build", "docs", "reports", "src", "tests")
"""Folders without pages of their own."""


@dataclass(frozen=True)
class Section:
    """A heading of the side bar and the pages below it, by their names without ending."""

    title: str
    pages: tuple[str, ...]


def repository_pages(repository: Path) -> tuple[str, ...]:
    """Pages that lie in the repository: documents, READMEs of folders, the project's own papers."""
    found = [*sorted((repository / "docs").rglob("*.md")), *below(repository, "README.md")]
    found += [path for path in sorted(repository.glob("*.md")) if path.name != "README.md"]
    return tuple(path.relative_to(repository).with_suffix("").as_posix() for path in found)


def below(repository: Path, name: str) -> list[Path]:
    """Files of a name in the repository's folders that have pages, its top left out."""
    tops = [path for path in sorted(repository.iterdir()) if path.is_dir() and path.name not in LEFT_OUT]
    return [path for top in tops if not top.name.startswith(".") for path in sorted(top.rglob(name))]


def sections(website: Path, pages: tuple[str, ...]) -> tuple[Section, ...]:
    """Sections of navigation.toml with the pages that there are; every page stands in one, READMEs below their list.

    Parameters
    ----------
    website
        The folder that holds navigation.toml.
    pages
        Every page of the site but the first.
    """
    table = tomllib.loads((website / "navigation.toml").read_text(encoding="utf-8"))["section"]
    named = [_expanded(section["pages"], pages) for section in table]
    placed = {page for group in named for page in group}
    others = tuple(page for page in pages if page not in placed and not page.endswith("/README"))
    return tuple(
        Section(section["title"], group + (others if section.get("others") else ()))
        for section, group in zip(table, named, strict=True)
    )


def _expanded(patterns: list[str], pages: tuple[str, ...]) -> tuple[str, ...]:
    """Pages that patterns name; ``folder/*`` is the rest of a folder."""
    found: list[str] = []
    for pattern in patterns:
        folder, star, _ = pattern.partition("*")
        found += [
            page for page in pages if (page.startswith(folder) if star else page == pattern) and page not in found
        ]
    return tuple(found)
