"""Build the site into build/site/html, warnings as errors, and check every link of what was built."""

from __future__ import annotations

import shutil
import sys
import time
from pathlib import Path

from sphinx.cmd.build import main as sphinx

from website.links import findings
from website.stage import stage

REPOSITORY = Path(__file__).resolve().parents[1]


def build(repository: Path, out: Path) -> int:
    """Stage, build and check; the number of what is wrong."""
    source, html = out / "source", out / "html"
    shutil.rmtree(html, ignore_errors=True)
    stage(repository, source, out / "extra")
    options = ["-q", "-W", "--keep-going", "-E", "-j", "auto", "-b", "html", "-c", str(repository / "website")]
    code = sphinx([*options, "-d", str(out / "doctrees"), str(source), str(html)])
    wrong = findings(html) if html.is_dir() else []
    for line in wrong:
        print(line, file=sys.stderr)
    return int(code) or len(wrong)


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
