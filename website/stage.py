"""Gather what Sphinx reads: pages of the repository with links that a site can follow, and pages that are made."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path

from markdown_it import MarkdownIt

from website import command_line, gallery, python_api, robot_pages, schema_pages
from website.equations import UnreadableError, equations
from website.pages_of import Section, repository_pages, sections

LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")
FENCE = re.compile(r"^ {0,3}(```+|~~~+)")
REPORTS = "reports/published"

MADE: dict[str, Callable[[Path], str]] = {
    "reference/command-line": command_line.page,
    "reference/campaign-file": schema_pages.campaign_page,
    "reference/robot-file": schema_pages.robot_page,
    "reference/python": python_api.page,
    "gallery": gallery.page,
    "robots": robot_pages.page,
}
"""page -> what writes it, given the repository"""


class DeadLinkError(Exception):
    """A page links to what the repository does not have."""


def stage(repository: Path, source: Path, extra: Path) -> None:
    """Write Sphinx's source tree, and the files that the site carries as they are.

    Raises
    ------
    DeadLinkError
        A page links to what is not there; every such link, one a line.
    """
    for directory in (source, extra):
        shutil.rmtree(directory, ignore_errors=True)
        directory.mkdir(parents=True)
    shutil.copytree(repository / REPORTS, extra / REPORTS)
    pages = repository_pages(repository)
    texts = {page: (repository / f"{page}.md").read_text(encoding="utf-8") for page in pages}
    texts |= {name: make(repository) for name, make in MADE.items()}
    website = Path(__file__).resolve().parent
    index = (website / "pages" / "index.md").read_text(encoding="utf-8")
    texts["index"] = index + _toctrees(sections(website, tuple(page for page in texts if page != "index")))
    dead = _dead_in_readme(repository)
    for page, text in texts.items():
        target = source / f"{page}.md"
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(_linked(text, page, repository, source, set(texts), dead), encoding="utf-8")
    if dead:
        raise DeadLinkError("\n".join(dead))


def _dead_in_readme(repository: Path) -> list[str]:
    """Dead links of README.md, which is no page of the site."""
    targets = (match[2] for match in LINK.findall((repository / "README.md").read_text(encoding="utf-8")))
    paths = (target.partition("#")[0] for target in targets if not re.match(r"[a-z]+:", target))
    return [f"README.md: dead link {path}" for path in paths if path and not (repository / path).exists()]


def _toctrees(found: tuple[Section, ...]) -> str:
    trees = [
        "\n".join(("", "```{toctree}", ":hidden:", f":caption: {section.title}", "", *section.pages, "```", ""))
        for section in found
    ]
    return "".join(trees)


def _linked(text: str, page: str, repository: Path, source: Path, pages: set[str], dead: list[str]) -> str:
    """Give the page with links that the site can follow; files that it links to are laid beside it."""
    folder = (repository / page).parent

    def followed(match: re.Match[str]) -> str:
        image, label, target = match.groups()
        path, _, _ = target.partition("#")
        if not path or re.match(r"[a-z]+:", path):
            return match[0]
        there = Path(os.path.normpath(folder / path))
        name = there.relative_to(repository).as_posix()
        if there.is_dir() and f"{name}/README" in pages:
            return f"[{label}]({path.rstrip('/')}/README.md)"
        if name == "README.md":
            return f"[{label}]({os.path.relpath(repository / 'index.md', folder)})"
        if name.removesuffix(".md") in pages and path.endswith(".md"):
            return match[0]
        if name.startswith(REPORTS) and there.exists() and not image:
            return f'<a href="{target}">{label}</a>'
        if there.is_dir() and not image:
            return label
        if there.is_file():
            copy = source / name
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(there, copy)
            return f"{image}[{label}]({path})"
        dead.append(f"{page}.md: dead link {target}")
        return match[0]

    lines, fence = [], ""
    for line in _with_equations(text).splitlines():
        mark = FENCE.match(line)
        if mark and (not fence or line.strip() == fence):
            fence = "" if fence else mark[1]
        lines.append(line if fence or mark or line.startswith("    ") else LINK.sub(followed, line))
    return "\n".join(lines) + "\n"


def _with_equations(text: str) -> str:
    """Give the page with its indented equations set; blocks that are none stay as they are."""
    lines = text.splitlines()
    for token in reversed(MarkdownIt("commonmark").parse(text)):
        if token.type == "code_block" and token.level == 0 and token.map:
            try:
                tex = equations(token.content)
            except UnreadableError:
                continue
            first, last = token.map
            lines[first:last] = ["```math", *tex.splitlines(), "```", ""]
    return "\n".join(lines)
