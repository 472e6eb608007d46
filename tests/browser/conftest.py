"""A real Chromium for the report's page, where there is one; a clear reason to skip where there is none."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--no-first-run",
)  # fmt: skip


@pytest.fixture(scope="session")
def launch() -> Iterator[Callable[[Sequence[str]], Any]]:
    """Starts a browser with flags; one driver for all of them, since a second one cannot be had in a process."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: pip install '.[dev]'")
    path = next((found for name in NAMES if (found := shutil.which(name))), None)
    if path is None:
        pytest.skip(f"no Chromium on this machine; looked for {', '.join(NAMES)} (apt-get install chromium)")
    with api.sync_playwright() as playwright:
        yield lambda flags: playwright.chromium.launch(executable_path=path, args=list(flags))


@pytest.fixture(scope="session")
def chromium(launch: Callable[[Sequence[str]], Any]) -> Iterator[Any]:
    """A browser without windows."""
    browser = launch(FLAGS)
    yield browser
    browser.close()


@pytest.fixture(scope="session")
def axe() -> str:
    """Source of the accessibility checker."""
    package = pytest.importorskip("axe_playwright_python", reason="axe-playwright-python is not installed")
    return (Path(package.__file__).parent / "axe.min.js").read_text(encoding="utf-8")
