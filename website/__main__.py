"""Build the site into build/site/html, warnings as errors, and check every link of what was built."""

from __future__ import annotations

import shutil
import sys
import time
from pathlib import Path

from sphinx.cmd.build import main as sphinx

from website.links import findings
from website.stage import stage

LABELS = {
    '<p class="caption" role="heading">': '<p class="caption" role="heading" aria-level="2">',
    '<aside class="sidebar-drawer">': '<aside class="sidebar-drawer" aria-label="Pages">',
    '<aside class="toc-drawer">': '<aside class="toc-drawer" aria-label="On this page">',
}
"""What the theme leaves out for screen readers."""

REPOSITORY = Path(__file__).resolve().parents[1]


def build(repository: Path, out: Path) -> int:
    """Stage, build and check; the number of what is wrong."""
    source, html = out / "source", out / "html"
    shutil.rmtree(html, ignore_errors=True)
    stage(repository, source, out / "extra")
    options = ["-q", "-W", "--keep-going", "-E", "-j", "auto", "-b", "html", "-c", str(repository / "website")]
    code = sphinx([*options, "-d", str(out / "doctrees"), str(source), str(html)])
    for page in html.rglob("*.html") if not code else ():
        if not page.is_relative_to(html / "reports"):
            page.write_text(_labelled(page.read_text(encoding="utf-8")), encoding="utf-8")
    wrong = findings(html) if html.is_dir() else []
    for line in wrong:
        print(line, file=sys.stderr)
    return int(code) or len(wrong)


def _labelled(text: str) -> str:
    for found, put in LABELS.items():
        text = text.replace(found, put)
    return text


def main() -> None:
    """Build, say how long it took and where it lies."""
    begun = time.monotonic()
    out = REPOSITORY / "build" / "site"
    if build(REPOSITORY, out):
        sys.exit("make docs: the site has faults; they stand above")
    pages = len(list((out / "html").rglob("*.html")))
    print(f"{pages} pages in {time.monotonic() - begun:.0f} s: {(out / 'html' / 'index.html').relative_to(REPOSITORY)}")


if __name__ == "__main__":
    main()
