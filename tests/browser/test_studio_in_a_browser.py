"""The studio in a real Chromium: it answers, fits, can be worked by keyboard, says what is wrong, and asks nobody else.

Chromium draws with its software renderer here, which is slow: the tests wait for what is written, never for pictures.
"""

from __future__ import annotations

import re
import shutil
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("viser", reason="the extra studio is not installed")

sys.path.insert(0, str(Path(__file__).parents[1]))

from workbench.studio.life import serve
from workbench.studio.session import Session
from workbench.studio.subject import open_subject

# By hand until they have been seen to pass in a calm minute: on a busy machine a page took longer than four minutes.
pytestmark = pytest.mark.long

REPOSITORY = Path(__file__).resolve().parents[2]
DELTA = REPOSITORY / "examples" / "delta"
WEBGL = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-first-run",
         "--disable-background-networking", "--disable-component-update", "--disable-sync")  # fmt: skip
PATIENCE_MS = 240_000
"""A software renderer on a busy machine."""
DRAWN = """() => [...document.querySelectorAll('.uplot canvas')].every(canvas => {
  const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  let seen = 0;
  for (let i = 0; i < data.length; i += 4) {
    seen += Math.abs(data[i] - 28) + Math.abs(data[i + 1] - 126) + Math.abs(data[i + 2] - 214) < 60;
  }
  return seen > 40;
})"""
"""Whether every plot shows a line in the reference's colour."""
ROBOTS = {
    "asym_2rss_ppap": ("asym_2rss_ppap", (), "pick_and_place"),
    "planar_4rprp": ("planar_4rprp", (), None),
    "delta": (str(DELTA), (str(DELTA / "delta.py"),), None),
    "made up": (str(REPOSITORY / "examples" / "fivebar"), (), None),
}


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium with WebGL by software."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    path = next(
        (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None
    )
    if path is None:
        pytest.skip("no Chromium on this machine")
    with api.sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=path, args=list(WEBGL))
        yield found
        found.close()


@contextmanager
def served(session: Session) -> Iterator[str]:
    """A studio in a thread; ends with the block."""
    ready, ending, urls = threading.Event(), threading.Event(), []

    def started(address: Any) -> None:
        urls.append(address.url)
        ready.set()

    thread = threading.Thread(
        target=serve, args=(session, "127.0.0.1", 18900, started, False, lambda: not ending.is_set()), daemon=True
    )
    thread.start()
    try:
        assert ready.wait(PATIENCE_MS / 1000)
        yield urls[0]
    finally:
        ending.set()
        thread.join(PATIENCE_MS / 1000)
        assert not thread.is_alive()


@contextmanager
def opened(browser: Any, url: str, width: int) -> Iterator[tuple[Any, list[str]]]:
    """A page, and the addresses that it asked for."""
    page = browser.new_page(viewport={"width": width, "height": 700})
    page.set_default_timeout(PATIENCE_MS)
    asked: list[str] = []
    errors: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("websocket", lambda socket: asked.append(socket.url))
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(url)
    yield page, asked
    page.close()
    assert errors == []


def hosts(asked: list[str]) -> set[str]:
    return {found.group(1) for url in asked if (found := re.match(r"(?:blob:)?(?:https?|wss?)://([^/:]+)", url))}


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_is_shown_and_answers_the_keyboard_and_nobody_else_is_asked(browser: Any, name: str) -> None:
    what, candidates, case = ROBOTS[name]
    session = Session(open_subject(what, candidates=candidates), case)
    with served(session) as url, opened(browser, url, 1300) as (page, asked):
        page.wait_for_selector("text=nothing was changed here")
        page.wait_for_selector("text=What the motors need")
        assert page.locator(".uplot").count() == len(session.robot().joints)
        assert page.evaluate("document.documentElement.scrollWidth") <= 1300
        mass = next(k for k in session.knobs if k.unit == "kg" and k.settable and not k.part and k.low > 0)
        before = session.values()[mass.members[0]]
        slider = page.locator(
            f"xpath=//*[normalize-space(text())='{mass.name} [kg]']/following::*[@role='slider'][1]"
        ).first
        slider.focus()
        page.keyboard.press("ArrowRight")
        page.wait_for_selector("text=Changed here")
        assert session.values()[mass.members[0]] == pytest.approx(before + mass.step, rel=1e-6)
        page.wait_for_selector("text=change")
        page.get_by_role("button", name="Worst moment").click()
        page.wait_for_function(DRAWN)
        page.get_by_role("button", name="Undo").click()
        page.wait_for_selector("text=nothing was changed here")
        assert session.values()[mass.members[0]] == before
        assert hosts(asked) == {"127.0.0.1"}


def test_a_narrow_window_has_all_and_errors_are_said(browser: Any) -> None:
    session = Session(open_subject("asym_2rss_ppap"), "pick_and_place")
    with served(session) as url, opened(browser, url, 700) as (page, asked):
        page.wait_for_selector("canvas")
        assert page.evaluate("document.documentElement.scrollWidth") <= 700
        assert hosts(asked) == {"127.0.0.1"}
