"""The rendered frames in a browser: the time slider shows the frame of its moment, and still nothing is loaded."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from test_report_page import WIDTHS, opened

from stored_pictures import TIMES, store_pictures
from test_report import make_run
from workbench.report import build_report

pytestmark = pytest.mark.browser

SHOWN = """(figure) => {
    const [box, image] = [".film", "img"].map((name) => figure.querySelector(name).getBoundingClientRect());
    return [Math.round((box.left - image.left) / box.width), Math.round((box.top - image.top) / box.height),
        image.width / box.width, image.height / box.height]; }"""
"""Column and row of the frame that is seen, and how many there are each way."""


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = store_pictures(make_run(tmp_path_factory.mktemp("film") / "run"))
    build_report(run, ["html"])
    return run / "report.html"


@pytest.mark.parametrize("width", WIDTHS)
def test_the_slider_shows_the_frame_of_its_moment(chromium: Any, filmed: Path, width: int) -> None:
    with opened(chromium, filmed, width) as (page, trouble):
        figure, slider = page.locator("#film-case-sim1"), page.locator("#case-sim1 input[type=range]")
        assert page.locator("figure[data-film]").count() == 1
        assert figure.bounding_box()["width"] > 200
        seen = []
        for time in TIMES:
            slider.evaluate(f"(e) => {{ e.step = 'any'; e.value = {time}; e.dispatchEvent(new Event('input')); }}")
            column, row, columns, rows = figure.evaluate(SHOWN)
            assert columns == pytest.approx(2, abs=0.02)
            assert rows == pytest.approx(3, abs=0.03)
            seen.append(row * 2 + column)
        assert seen == list(range(len(TIMES)))
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert trouble == []


def test_the_first_frame_stands_there_without_a_script(chromium: Any, filmed: Path) -> None:
    with opened(chromium, filmed, java_script_enabled=False) as (page, trouble):
        box = page.locator("#film-case-sim1 .film").bounding_box()
        assert box["width"] / box["height"] == pytest.approx(4 / 3, rel=0.02)
        assert page.locator("#film-case-sim1 .film").get_attribute("aria-label").startswith("The robot's model")
        assert trouble == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_serious_fault(chromium: Any, filmed: Path, axe: str, scheme: str) -> None:
    with opened(chromium, filmed, scheme=scheme, bypass_csp=True) as (page, _):
        page.evaluate(axe)
        found = page.evaluate("() => axe.run(document.querySelector('#film-case-sim1'))")
        assert [fault["id"] for fault in found["violations"] if fault["impact"] in ("serious", "critical")] == []
        page.evaluate("() => document.querySelector('.film').removeAttribute('aria-label')")
        spoilt = page.evaluate("() => axe.run(document.querySelector('#film-case-sim1'))")
        assert {fault["id"] for fault in spoilt["violations"]} >= {"role-img-alt"}
