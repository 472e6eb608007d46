"""The studio in a real Chromium: it answers, fits, can be worked by keyboard, says what is wrong, and asks nobody else.

Chromium draws a scene by software here, which takes a second of processor time a picture and everything else with it.
So the page is put together without its graphics hardware, and its scene is set up and not drawn; what is written and
plotted is waited for, one condition after the other, and never for a time.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("viser", reason="the extra studio is not installed")

sys.path.insert(0, str(Path(__file__).parents[1]))

from workbench.studio.life import serve
from workbench.studio.session import Session
from workbench.studio.subject import open_subject

REPOSITORY = Path(__file__).resolve().parents[2]
DELTA = REPOSITORY / "examples" / "delta"
RRR = REPOSITORY / "examples" / "rrr"
WEBGL = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-first-run",
         "--disable-gpu-compositing", "--disable-background-networking", "--disable-component-update",
         "--disable-sync")  # fmt: skip
PATIENCE_MS = 240_000
"""A busy machine."""
UNDRAWN = """(() => {
  const drawing = ['drawElements', 'drawArrays', 'drawRangeElements', 'drawElementsInstanced', 'drawArraysInstanced'];
  for (const name of drawing) WebGL2RenderingContext.prototype[name] = () => {};
})()"""
"""Leaves the scene's pictures empty; all else of it is there."""
DRAWN = """() => [...document.querySelectorAll('.uplot canvas')].every(canvas => {
  if (!canvas.width || !canvas.height) return false;
  const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  let seen = 0;
  for (let i = 0; i < data.length; i += 4) {
    const [red, green, blue] = [data[i], data[i + 1], data[i + 2]];
    seen += Math.max(red, green, blue) - Math.min(red, green, blue) > 60;
  }
  return seen > 200;
})"""
"""Whether every plot shows lines: whatever else is drawn in it is grey, but for the dot at the moment."""
ROBOTS = {
    "planar_4rprp": ("planar_4rprp", (), None),
    "3-RRR": (str(RRR), (str(RRR / "rrr.py"),), None),
    "delta": (str(DELTA), (str(DELTA / "delta.py"),), None),
    "made up": (str(REPOSITORY / "examples" / "fivebar"), (), None),
}


@pytest.fixture(scope="module")
def browser(launch: Callable[[Sequence[str]], Any]) -> Iterator[Any]:
    """Chromium with WebGL by software."""
    found = launch(WEBGL)
    yield found
    found.close()


@contextmanager
def served(session: Session, dark: bool = False) -> Iterator[str]:
    """A studio in a thread; ends with the block."""
    ready, ending, urls = threading.Event(), threading.Event(), []

    def started(address: Any) -> None:
        urls.append(address.url)
        ready.set()

    thread = threading.Thread(
        target=serve, args=(session, "127.0.0.1", 18900, started, dark, lambda: not ending.is_set()), daemon=True
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
def opened(browser: Any, url: str, width: int = 1300) -> Iterator[tuple[Any, list[str]]]:
    """A page, and the addresses that it asked for: none but this machine's."""
    page = browser.new_page(viewport={"width": width, "height": 600})
    page.set_default_timeout(PATIENCE_MS)
    asked: list[str] = []
    errors: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("websocket", lambda socket: asked.append(socket.url))
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.add_init_script(UNDRAWN)
    page.goto(url)
    yield page, asked
    page.close()
    assert errors == []
    assert hosts(asked) == {"127.0.0.1"}


def hosts(asked: list[str]) -> set[str]:
    return {found.group(1) for url in asked if (found := re.match(r"(?:blob:)?(?:https?|wss?)://([^/:]+)", url))}


def slider(page: Any, label: str) -> Any:
    """The slider behind a label."""
    return page.locator(f"xpath=//*[normalize-space(text())='{label}']/following::*[@role='slider'][1]").first


def field(page: Any, label: str) -> Any:
    """The number field behind a label."""
    return page.locator(f"xpath=//*[normalize-space(text())='{label}']/following::input[@inputmode][1]").first


def wait_for(page: Any, text: str) -> None:
    """Wait for a text, in its own upper and lower case: "Changed here" is not "nothing was changed here"."""
    page.get_by_text(re.compile(re.escape(text))).first.wait_for()


@pytest.mark.browser
def test_the_papers_robot_is_moved_by_mouse_keyboard_and_number(browser: Any, tmp_path: Path) -> None:
    """One page from opening to keeping, since a page takes long to open here."""
    model = tmp_path / "asym_2rss_ppap.xml"
    shutil.copy(REPOSITORY / "models" / "asym_2rss_ppap.xml", model)
    session = Session(open_subject("almeida_2010", model=model), "pick_and_place")
    with served(session) as url, opened(browser, url) as (page, _):
        wait_for(page, "nothing was changed here")
        wait_for(page, "What the motors need")
        assert page.locator(".uplot").count() == 3
        assert page.evaluate("document.documentElement.scrollWidth") <= 1300
        # a drag, beyond the slider's end, is one step
        most = session.knob("a1").high
        box = slider(page, "a1 [m]").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        for step in range(1, 5):
            page.mouse.move(x + 80 * step, y)
        page.mouse.up()
        wait_for(page, f"a1 from 0.2 to {most:g} m")
        wait_for(page, "The paper's claims are not about this robot")
        assert session.values()["a1_left"] == most
        page.wait_for_function(DRAWN)
        page.get_by_role("button", name="Undo").click()
        wait_for(page, "nothing was changed here")
        page.get_by_role("button", name="Redo").click()
        wait_for(page, f"a1 from 0.2 to {most:g} m")
        # a number, typed
        field(page, "m3 [kg]").fill("0.6")
        wait_for(page, "m3 from 0.45 to 0.6 kg")
        assert session.values()["a1_left"] == most
        # keys: a step of a slider, then all the way back, and that undone
        slider(page, "m2 [kg]").focus()
        page.keyboard.press("ArrowRight")
        wait_for(page, "m2 from 0.3")
        page.get_by_role("button", name="Back to the paper").click()
        wait_for(page, "nothing was changed here")
        page.get_by_role("button", name="Undo").click()
        wait_for(page, "m3 from 0.45 to 0.6 kg")
        # time
        page.get_by_role("button", name="Worst moment").click()
        wait_for(page, f"t = {session.good.t[session.good.worst_moment()]:.4g} s")
        page.get_by_role("button", name="Play").click()
        page.get_by_role("button", name="Pause").wait_for()
        page.get_by_role("button", name="Pause").click()
        page.get_by_role("button", name="Play").wait_for()
        # what others can run
        page.get_by_role("tab", name="Keep", exact=True).click()
        page.get_by_role("button", name="Command with --set").click()
        wait_for(page, "--set m3=0.6")
        with page.expect_download() as download:
            page.get_by_role("button", name="Table (CSV)").click()
        table = Path(download.value.path()).read_text(encoding="utf-8")
        assert table.startswith("t,q1,q2,q3,")
        assert len(table.splitlines()) == 1 + len(session.good.t)
        # a broken file is said, and the last state that works stays
        whole = model.read_text(encoding="utf-8")
        model.write_text(whole[:2000], encoding="utf-8")
        wait_for(page, "Shown is the last state that works")
        assert session.values()["m3"] == 0.6
        model.write_text(whole, encoding="utf-8")
        page.get_by_text("Shown is the last state that works").wait_for(state="detached")


@pytest.mark.browser
def test_a_run_is_opened_in_a_narrow_dark_window_that_has_room_for_the_scene(browser: Any, tmp_path: Path) -> None:
    run = [sys.executable, "-m", "workbench.cli", "run", "almeida_2010", "--only", "pick_and_place", "--quick"]
    made = subprocess.run(
        [*run, "--no-pictures", "--set", "m2*=0.5", "--out", str(tmp_path)], capture_output=True, text=True, timeout=600
    )
    assert made.returncode == 0, made.stderr
    session = Session(open_subject(str(tmp_path)))
    with served(session, dark=True) as url, opened(browser, url, 700) as (page, _):
        wait_for(page, f"As run in {tmp_path}; nothing was changed here")
        wait_for(page, "The paper's claims are not about this robot")
        wait_for(page, "What the motors need")
        page.wait_for_function("document.querySelector('canvas[data-engine]').getBoundingClientRect().width > 300")
        assert page.evaluate("document.documentElement.scrollWidth") <= 700
        assert page.evaluate("document.documentElement.dataset.mantineColorScheme") == "dark"
        page.get_by_role("tab", name="Look", exact=True).click()
        page.get_by_role("checkbox", name="drag the platform").check()
        page.get_by_label("workspace slice").click()
        page.get_by_role("option", name="y z").click()
        wait_for(page, "in reach, plane y z")


@pytest.mark.browser
@pytest.mark.parametrize("name", ROBOTS)
def test_every_kind_of_robot_is_shown_and_answers_the_keyboard(browser: Any, name: str) -> None:
    what, candidates, case = ROBOTS[name]
    session = Session(open_subject(what, candidates=candidates), case)
    with served(session) as url, opened(browser, url) as (page, _):
        wait_for(page, "nothing was changed here")
        wait_for(page, "What the motors need")
        assert page.locator(".uplot").count() == len(session.robot().joints)
        assert page.evaluate("document.documentElement.scrollWidth") <= 1300
        mass = next(k for k in session.knobs if k.unit == "kg" and k.settable and not k.part and k.low > 0)
        before = session.values()[mass.members[0]]
        slider(page, f"{mass.name} [kg]").focus()
        page.keyboard.press("ArrowRight")
        wait_for(page, "Changed here")
        assert session.values()[mass.members[0]] == pytest.approx(before + mass.step, abs=mass.step)
        page.get_by_role("button", name="Worst moment").click()
        page.wait_for_function(DRAWN)
        page.get_by_role("button", name="Undo").click()
        wait_for(page, "nothing was changed here")
        assert session.values()[mass.members[0]] == before
