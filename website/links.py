"""What is wrong with a built site's links: targets that are not there, and what a page would fetch from elsewhere."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

FETCHES = {
    ("link", "href"),
    ("script", "src"),
    ("img", "src"),
    ("iframe", "src"),
    ("source", "src"),
    ("video", "src"),
    ("object", "data"),
}
"""Attributes whose target a browser loads by itself."""

STYLE_URL = re.compile(r"""url\(\s*["']?(?!data:)([^"')]+)""")


class Page(HTMLParser):
    """The anchors of a page, and what it refers to: tag, attribute, target."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.targets: list[tuple[str, str, str]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note anchors and targets of an element."""
        for name, value in attrs:
            if name == "id" or (tag == "a" and name == "name"):
                self.anchors.add(value or "")
            elif name in ("href", "src", "data", "poster") and value:
                self.targets.append((tag, name, value))


def findings(site: Path) -> list[str]:
    """Every fault, as ``page: what``; reports are pages of their own, of which only the anchors count."""
    pages = {path.resolve(): Page(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html"))}
    found = [
        f"{path.relative_to(site.resolve())}: {what}"
        for path, page in pages.items()
        for what in _of_page(path, page, pages)
    ]
    for style in sorted(site.rglob("*.css")):
        for target in STYLE_URL.findall(style.read_text(encoding="utf-8")):
            here = not urlsplit(target).netloc and (style.parent / unquote(urlsplit(target).path)).exists()
            found += [] if here else [f"{style.relative_to(site)}: loads {target}"]
    return found


def _of_page(path: Path, page: Page, pages: dict[Path, Page]) -> Iterator[str]:
    for tag, attribute, target in page.targets:
        parts = urlsplit(target)
        if parts.scheme or parts.netloc:
            if (tag, attribute) in FETCHES and parts.scheme != "data":
                yield f"loads {target}"
            continue
        file = (path.parent / unquote(parts.path)).resolve() if parts.path else path
        if file.is_dir():
            yield f"link to the folder {target}"
        elif not file.exists():
            yield f"dead link {target}"
        elif parts.fragment and file in pages and unquote(parts.fragment) not in pages[file].anchors:
            yield f"dead anchor {target}"
