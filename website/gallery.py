"""The page of published reports: a picture of each, its verdict, and links."""

from __future__ import annotations

import html
import re
from pathlib import Path

HEAD = """# Published reports

Each of these is a run's own report as it was written, a page in one file. `make reports` computes all of them again.

"""
VERDICT = re.compile(r"^\*\*[^\w*]*([A-Z ]+)\*\*: (.+)$", re.MULTILINE)
FOUND = re.compile(r"^## Is the model enough for control\n\n(.+)$", re.MULTILINE)
"""What a study of control says first: it finds, where other campaigns pass or fail."""


def page(repository: Path) -> str:
    """Give the page, a card per report in reports/published."""
    cards = [_card(path, repository) for path in sorted((repository / "reports" / "published").glob("*/report.md"))]
    return HEAD + '<div class="cards">\n' + "\n".join(cards) + "\n</div>\n"


def _card(path: Path, repository: Path) -> str:
    text = path.read_text(encoding="utf-8").replace("\\", "")
    title = text.partition("\n")[0].removeprefix("# ")
    about = next(line for line in text.splitlines()[1:] if line.strip())
    verdict = VERDICT.search(text)
    found = FOUND.search(text)
    said = f"{verdict[1].capitalize()}: {verdict[2]}" if verdict else f"Found: {found[1]}" if found else ""
    folder = path.parent.relative_to(repository).as_posix()
    about = re.sub(r"^Error report of the campaign \*\*\w+\*\*\. ", "", about)
    return (
        f'<a class="card" href="{folder}/report.html">'
        f'<img src="{folder}/{_picture(path.parent)}" alt="" loading="lazy">'
        f"<strong>{html.escape(title)}</strong><span>{html.escape(about)}</span><em>{html.escape(said)}</em></a>"
    )


def _picture(folder: Path) -> str:
    """The robot where there is a picture of it, else the first figure."""
    drawn = folder / "pictures" / "mechanism.webp"
    found = drawn if drawn.exists() else sorted((folder / "figures").glob("figure-*.svg"))[0]
    return found.relative_to(folder).as_posix()
