"""Commands that the documentation shows: in blocks, where a reader copies them, and within lines, by name."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt

PROGRAMS = ("workbench", "make", "pip", "python", "dask")
START = re.compile(rf"^(?:\$ )?((?:[A-Z_]+=\S+ )?(?:{'|'.join(PROGRAMS)})(?: .*)?)$")
REMARK = re.compile(r"\s{2,}\S.*$|\s+# .*$")
"""What a line says of its command: behind two blanks, or a comment."""

OPTION = re.compile(r"--[a-z][a-z-]*")


@dataclass(frozen=True)
class Command:
    """A command as a page shows it."""

    page: str
    line: int
    text: str
    block: bool
    """True: on a line of its own in a block; False: named within a sentence"""

    @property
    def synopsis(self) -> bool:
        """Whether it shows how a command is called, with NAMES for what a reader puts in."""
        return bool(
            re.search(r"\[|\bDIR\b|\bFILE\b|\b[A-Z]{3,}\b(?!=)|…|\.\.\.", re.sub(r"[A-Z_]+=\S+", "", self.text))
        )

    @property
    def words(self) -> list[str]:
        """Words of the command, as a shell takes them apart."""
        return shlex.split(self.text.replace("[", "").replace("]", ""), comments=True)

    @property
    def options(self) -> list[str]:
        """Options that it names."""
        return OPTION.findall(self.text)


def pages(repository: Path) -> list[Path]:
    """Every page that the site or the repository's front shows."""
    own = [*repository.glob("*.md"), *(repository / "docs").rglob("*.md"), *(repository / "website").rglob("*.md")]
    return sorted({*own, *(repository / "examples").rglob("*.md"), *repository.glob("robots/**/*.md")})


def commands(page: Path, repository: Path) -> Iterator[Command]:
    """Commands of a page, in order."""
    name = page.relative_to(repository).as_posix()
    for token in MarkdownIt().enable("table").parse(page.read_text(encoding="utf-8")):
        line = token.map[0] + 1 if token.map else 0
        if token.type in ("fence", "code_block") and token.info.split(" ")[0] not in ("python", "xml", "toml", "diff"):
            for number, text in enumerate(token.content.splitlines(), start=line + (token.type == "fence")):
                if found := START.match(REMARK.sub("", text.strip())):
                    for part in re.split(r" \|\| | && | \| ", found[1])[:1]:
                        yield Command(name, number, part.strip(), True)
        elif token.type == "inline":
            for child in token.children or ():
                if child.type == "code_inline" and (found := START.match(child.content.strip())):
                    yield Command(name, line, found[1], False)
