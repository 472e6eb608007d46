"""The report in a browser with the network off: it asks for nothing, nothing fails, and what moves moves together."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from test_report import NASTY, make_run
from workbench.report import build_report

pytestmark = pytest.mark.browser

WIDTHS = (375, 768, 1280, 1920)


def all_outcomes(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
    """Let the campaign hold a failed, an undecided, a declared and an invalid case, and hostile names."""
    nasty = NASTY + "x" * 300
    manifest["title"] = nasty
    manifest["cases"]["sim1"]["title"] = nasty
    manifest["cases"]["sim1"]["status"] = "failed"
    manifest["candidates"][nasty] = {"mass_model": "lumped", "description": nasty}
    for row in rows:
        row["uncertainty"] = 1e-13
        if row["candidate"] == "lumped-appendix":
            row["candidate"] = nasty
    rows[0] |= {"verdict": "fail", "peak_error": 0.5}
    rows[1] |= {"verdict": "undecided", "uncertainty": 5e-11}
    rows[2] |= {"verdict": "expected-fail", "kind": "expected-failure", "peak_error": 1.0}
    manifest["cases"]["slow"] = {"status": "timeout", "message": "takes longer than allowed: 60 s"}
    manifest["cases"]["odd"] = {"status": "invalid", "message": "case odd: a1 is -0.2 m; allowed: above 0"}
    manifest["cases"]["sim2"]["status"] = "undecided"


@pytest.fixture(scope="module", params=["plain", "hostile"])
def page_file(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = make_run(
        tmp_path_factory.mktemp("browser") / "run", edit=all_outcomes if request.param == "hostile" else None
    )
    build_report(run, ["html"])
    return run / "report.html"


@pytest.fixture(scope="module")
def plain_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of names as people give them: hostile ones of 400 letters need more room than a screen has."""
    run = make_run(tmp_path_factory.mktemp("plain") / "run")
    build_report(run, ["html"])
    return run / "report.html"


@contextmanager
def opened(
    chromium: Any, file: Path, width: int = 1280, scheme: str = "light", **options: Any
) -> Iterator[tuple[Any, list[str]]]:
    """Open a file without a network; yield the page and what went wrong or was asked for."""
    context = chromium.new_context(
        viewport={"width": width, "height": 900}, color_scheme=scheme, offline=True, **options
    )
    page = context.new_page()
    trouble: list[str] = []
    page.on("console", lambda message: trouble.append(message.text))
    page.on("pageerror", lambda error: trouble.append(str(error)))
    page.on("dialog", lambda dialog: trouble.append(f"dialog {dialog.message}"))
    page.on("request", lambda request: None if request.url == file.as_uri() else trouble.append(request.url))
    page.goto(file.as_uri())
    yield page, trouble
    context.close()


def open_all(page: Any) -> None:
    """Open whatever is folded."""
    page.evaluate("() => { for (const folded of document.querySelectorAll('details')) folded.open = true; }")


def fault_of(script: str) -> str:
    return f"<script>{script}</script></body>"


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", WIDTHS)
def test_nothing_is_asked_for_and_every_figure_is_seen(chromium: Any, page_file: Path, width: int, scheme: str) -> None:
    with opened(chromium, page_file, width, scheme) as (page, trouble):
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        open_all(page)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        drawings = page.locator("figure svg")
        assert drawings.count() == 2 * 9 + 7
        for index in range(drawings.count()):
            box = drawings.nth(index).bounding_box()
            assert box["width"] > 200
            assert box["height"] > 90  # two cases at a glance are a flat figure
        colours = page.evaluate("""() => {
            const of = (element, name) => getComputedStyle(element).getPropertyValue(name);
            return [of(document.body, "background-color"), of(document.body, "color"),
                of(document.querySelector("figure svg text"), "fill")]; }""")
        dark = [sum(int(part) for part in colour[4:-1].split(",")) < 3 * 128 for colour in colours]
        assert dark == ([True, False, False] if scheme == "dark" else [False, True, True])
        assert trouble == []


def test_trouble_is_seen(chromium: Any, page_file: Path, tmp_path: Path) -> None:
    spoilt = tmp_path / "spoilt.html"
    text = page_file.read_text(encoding="utf-8")
    spoilt.write_text(text.replace("</body>", fault_of("alert(1)")), encoding="utf-8")
    with opened(chromium, spoilt) as (_, trouble):
        assert any("Content Security Policy" in line for line in trouble)  # and it does not run
        assert not any(line.startswith("dialog") for line in trouble)
    policy = text.index('<meta http-equiv="Content-Security-Policy"')
    unguarded = text[:policy] + text[text.index(">", policy) + 1 :]
    loads = '<img src="https://example.org/x.png"></body>'
    spoilt.write_text(unguarded.replace("</body>", loads), encoding="utf-8")
    with opened(chromium, spoilt) as (_, trouble):
        assert any("example.org" in line for line in trouble)


def test_tables_sort_by_the_number_behind_the_text(chromium: Any, page_file: Path) -> None:
    with opened(chromium, page_file) as (page, trouble):
        open_all(page)
        table = page.locator("#table-case-sim2-modelling")
        column = 3
        values = f"(t) => [...t.tBodies[0].rows].map(r => Number(r.cells[{column}].dataset.value))"
        before = table.evaluate(values)
        button = table.locator("th button").nth(column)
        button.focus()
        page.keyboard.press("Enter")
        assert table.evaluate(values) == sorted(before, reverse=True)
        assert table.locator("th").nth(column).get_attribute("aria-sort") == "descending"
        page.keyboard.press("Space")
        assert table.evaluate(values) == sorted(before)
        page.keyboard.press("Enter")
        assert table.evaluate(values) == before
        assert trouble == []


def test_tables_filter(chromium: Any, page_file: Path) -> None:
    with opened(chromium, page_file) as (page, _):
        open_all(page)
        table = page.locator(".table", has=page.locator("#table-case-sim2-verification"))
        table.locator("input").fill("τ2 rotation")
        shown = table.locator("tbody tr:visible")
        assert shown.count() == 1
        assert shown.first.locator("td").first.inner_text() == "distributed-rotation"
        assert table.locator("output").inner_text().strip() == "1 of 12 rows"


MARKERS = """(article) => [...document.querySelectorAll(`figure[data-case="${article.id}"]`)].map((figure) =>
    [...figure.querySelectorAll(".cursor")].map((c) => [c.getAttribute("visibility"), Number(c.getAttribute("x1"))]))"""
MOVED = """(presses) => {
    const slider = document.querySelector("#case-sim1 input[type=range]");
    const share = (slider.value - slider.min) / (slider.max - slider.min);
    return share > 0.1 * presses - 0.05 && document.querySelector("#case-sim1 .readout").textContent !== ""; }"""
"""Whether so many presses of a key have arrived: the browser tells the page of them when it likes."""
DRAWN = (
    """(article) => document.querySelector(`#plot-${article.id}-mechanism .wb-line-1-driven path`).getAttribute("d")"""
)


def test_the_slider_moves_every_marker(chromium: Any, page_file: Path) -> None:
    with opened(chromium, page_file) as (page, trouble):
        article = page.locator("#case-sim1")
        slider = article.locator("input[type=range]")
        before = article.evaluate(DRAWN)
        slider.focus()
        for _ in range(3):
            page.keyboard.press("PageUp")
        page.wait_for_function(MOVED, arg=3)
        first = article.evaluate(MARKERS)
        timed = [lines for lines in first if lines]
        assert len(timed) >= 7 + 4  # motion, torques, reactions, and the campaign's figures of this case
        assert all(visible == "visible" for lines in timed for visible, _ in lines)
        page.keyboard.press("PageUp")
        page.wait_for_function(MOVED, arg=4)
        second = [lines for lines in article.evaluate(MARKERS) if lines]
        for one, other in zip(timed, second, strict=True):
            assert all(b[1] > a[1] + 1 for a, b in zip(one, other, strict=True))
        assert article.evaluate(DRAWN) != before
        other_case = page.locator("#case-sim2").evaluate(MARKERS)
        assert all(visible == "hidden" for lines in other_case for visible, _ in lines)
        readouts = article.locator(".readout").all_text_contents()  # one is folded
        assert all(text.startswith("t = ") for text in readouts)
        assert trouble == []


def test_the_values_under_the_slider_are_those_of_the_series(chromium: Any, page_file: Path) -> None:
    import pandas as pd

    series = pd.read_parquet(page_file.parent / "series" / "sim2.parquet")
    with opened(chromium, page_file) as (page, _):
        open_all(page)
        article = page.locator("#case-sim2")
        sample = 77
        article.locator("input[type=range]").evaluate(
            f"(e) => {{ e.step = 'any'; e.value = {series['t'][sample]}; e.dispatchEvent(new Event('input')); }}"
        )
        told = page.locator("#plot-case-sim2-platform .readout").inner_text()
        shown = dict(part.split(" ") for part in told.partition(": ")[2].split(", "))
        for k in range(3):
            true, wrong = series[f"x{k + 1}"][sample], series[f"x{k + 1}"][sample + 4]
            assert abs(float(shown[f"x{k + 1}"]) - true) < 0.004
            assert abs(float(shown[f"x{k + 1}"]) - wrong) > 0.004


def test_zoom_stretches_the_time_of_all_plots_and_goes_back(chromium: Any, page_file: Path) -> None:
    path = """() => document.querySelector("#plot-case-sim1-torque-1 .wb-curve-0-0 path").getAttribute("d")"""
    with opened(chromium, page_file) as (page, trouble):
        article = page.locator("#case-sim1")
        whole = page.evaluate(path)
        article.get_by_role("button", name="Zoom in on the time").click()
        zoomed = page.evaluate(path)
        assert zoomed != whole
        assert article.locator(".ticks text").count() > 7
        article.get_by_role("button", name="Show the whole time").click()
        assert article.locator(".ticks").count() == 0
        numbers = """(d) => { const p = document.createElementNS("http://www.w3.org/2000/svg", "path");
            p.setAttribute("d", d); return p.getTotalLength(); }"""
        assert page.evaluate(numbers, page.evaluate(path)) == pytest.approx(page.evaluate(numbers, whole), rel=1e-3)
        assert trouble == []


def test_play_moves_the_time(chromium: Any, page_file: Path) -> None:
    with opened(chromium, page_file) as (page, _):
        article = page.locator("#case-sim1")
        article.get_by_role("button", name="Play").click()
        page.wait_for_function("() => document.querySelector('#case-sim1 input[type=range]').value > 0.3")
        article.get_by_role("button", name="Pause").click()


def test_outcomes_differ_at_a_glance(chromium: Any, page_file: Path) -> None:
    with opened(chromium, page_file) as (page, _):
        looks = page.evaluate("""() => Object.fromEntries([...document.querySelectorAll(".status")].map((badge) => {
            const style = getComputedStyle(badge);
            const look = [style.color, style.backgroundColor, style.borderTopStyle].join(" ");
            return [badge.className.split("status-")[1], look]; }))""")
        assert len(set(looks.values())) == len(looks)
        assert {"passed", "error", "measured", "undecided", "refuted"} <= set(looks)
        if page.locator("#case-slow").count():
            assert {"failed", "expected", "timeout", "invalid"} <= set(looks)
            edges = page.evaluate("""() => [...document.querySelectorAll("article.case")].map((article) => {
                const style = getComputedStyle(article);
                return [style.borderLeftStyle, style.borderLeftColor].join(" "); })""")
            assert len(set(edges)) == 5  # failed, error, timed out, invalid, undecided


def test_names_are_text(chromium: Any, page_file: Path) -> None:
    with opened(chromium, page_file) as (page, trouble):
        open_all(page)
        assert page.locator("script").count() == 1
        assert page.locator("main img, main b").count() == 0
        assert trouble == []


def test_readable_without_a_script(chromium: Any, page_file: Path) -> None:
    with opened(chromium, page_file, java_script_enabled=False) as (page, trouble):
        assert page.locator("figure svg").count() == 2 * 9 + 7
        assert page.locator(".times, .sort, .filter").count() == 0
        assert page.locator("#table-worst-verification tbody tr").count() >= 12
        assert trouble == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_serious_fault(chromium: Any, page_file: Path, axe: str, scheme: str) -> None:
    with opened(chromium, page_file, scheme=scheme, bypass_csp=True) as (page, _):
        open_all(page)
        page.locator("#case-sim1 input[type=range]").press("PageUp")
        page.evaluate(axe)
        found = page.evaluate("() => axe.run(document)")
        serious = [
            (fault["id"], fault["nodes"][0]["html"][:150], fault["nodes"][0]["failureSummary"][:300])
            for fault in found["violations"]
            if fault["impact"] in ("serious", "critical")
        ]
        assert serious == []
        assert len(found["passes"]) > 20
        page.evaluate("() => { document.querySelector('.times input').removeAttribute('aria-label');"
                      " document.querySelector('h1').style.color = 'transparent'; }")  # fmt: skip
        spoilt = page.evaluate("() => axe.run(document)")
        assert {fault["id"] for fault in spoilt["violations"]} >= {"label"}


def test_the_first_screen_holds_what_and_how_it_came_out(chromium: Any, plain_file: Path) -> None:
    with opened(chromium, plain_file, width=1300) as (page, _):
        for what in (".verdict", ".compared", ".still svg", "#plot-figure-at-a-glance svg", "nav.contents a"):
            box = page.locator(what).first.bounding_box()
            assert box["height"] > 0, what
            assert box["y"] < 900, what


def test_what_to_look_at_stands_first(chromium: Any, page_file: Path) -> None:
    with opened(chromium, page_file) as (page, _):
        hostile = page.locator("#case-slow").count() > 0
        listed = page.locator(".findings li").all_inner_texts()
        assert any("was not computed" in text for text in listed)
        assert hostile == any("against a bound" in text for text in listed)


def test_folded_cases_open_by_what_leads_to_them_and_for_print(chromium: Any, page_file: Path) -> None:
    shut = "() => [...document.querySelectorAll('details:not(.extra):not([open])')].length"
    with opened(chromium, page_file) as (page, trouble):
        assert page.locator("#case-sim1 details.fold").get_attribute("open") is not None
        assert page.locator("#case-sim2 details.fold").get_attribute("open") is None
        before = page.evaluate(shut)
        assert before > 1
        page.locator("#table-cases a[href='#case-sim2']").click()
        page.wait_for_function("() => document.querySelector('#case-sim2 details.fold').open")
        assert page.evaluate("() => document.querySelector('#case-sim2').getBoundingClientRect().top") < 200
        page.evaluate("() => window.dispatchEvent(new Event('beforeprint'))")
        assert page.evaluate(shut) == 0
        page.evaluate("() => window.dispatchEvent(new Event('afterprint'))")
        assert page.evaluate(shut) == before - 1
        page.get_by_role("button", name="Open all").click()
        assert page.evaluate("() => [...document.querySelectorAll('details.fold')].every((fold) => fold.open)")
        assert trouble == []


def test_the_contents_stay_in_sight(chromium: Any, page_file: Path) -> None:
    with opened(chromium, page_file) as (page, _):
        page.locator("nav.contents a[href='#limits']").click()
        page.wait_for_function("() => scrollY > 1000")
        assert abs(page.locator("nav.contents").bounding_box()["y"]) < 2
        heading = page.locator("#limits-heading").bounding_box()
        assert 0 <= heading["y"] < 900


def test_a_figure_opens_large_and_goes_back(chromium: Any, page_file: Path) -> None:
    place = "() => [...document.querySelectorAll('figure')].findIndex((f) => f.id === 'plot-case-sim1-torque-1')"
    with opened(chromium, page_file) as (page, trouble):
        figure = page.locator("#plot-case-sim1-torque-1")
        small, at = figure.locator("svg").bounding_box()["width"], page.evaluate(place)
        figure.locator(".enlarge").focus()
        page.keyboard.press("Enter")
        assert page.locator("dialog.large #plot-case-sim1-torque-1").count() == 1
        assert figure.locator("svg").bounding_box()["width"] > 1.5 * small
        page.keyboard.press("Escape")
        page.wait_for_function("() => !document.querySelector('dialog figure')")
        assert page.evaluate(place) == at
        assert figure.locator("svg").bounding_box()["width"] == pytest.approx(small)
        assert trouble == []


def test_no_table_of_a_case_is_clipped(chromium: Any, plain_file: Path) -> None:
    clipped = """() => [...document.querySelectorAll('article .scroll')]
        .filter((box) => box.scrollWidth > box.clientWidth + 1).map((box) => box.querySelector('table').id)"""
    with opened(chromium, plain_file, width=1300) as (page, _):
        open_all(page)
        assert page.evaluate(clipped) == []
        page.set_viewport_size({"width": 700, "height": 900})
        assert page.evaluate(clipped) != []
