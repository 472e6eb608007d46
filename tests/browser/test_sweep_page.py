"""The report of a sweep in a browser with the network off: it asks for nothing, fits, and can be read by anybody."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from test_report_page import WIDTHS, opened

from sweep_store import STATUSES, make_sweep
from test_report import NASTY
from workbench.report import build_report

pytestmark = pytest.mark.browser

FIGURES = 2 + 2 + 3
"""distributions of two comparisons, drivers and courses, maps over three pairs of numbers"""


def hostile(manifest: dict[str, Any], summary: dict[str, Any], cases: pd.DataFrame, rows: pd.DataFrame) -> None:
    """Let names and reasons be what an attacker would write."""
    nasty = NASTY + "x" * 300
    manifest["title"] = manifest["description"] = manifest["command"] = nasty
    manifest["candidates"][nasty] = manifest["candidates"].pop("lumped")
    cases["case"] = [f"../{nasty}-{i}" for i in cases["index"]]
    cases["reason"] = nasty
    rows["candidate"] = rows.candidate.replace("lumped", nasty)
    cases[nasty] = cases.pop("speed")
    for record in [record for name in ("errors", "drivers", "bins", "reasons", "keys") for record in summary[name]]:
        for key, value in record.items():
            if value in ("lumped", "speed") or key in ("worst_case", "example", "reason", "meaning"):
                record[key] = nasty


@pytest.fixture(scope="module", params=["plain", "hostile"])
def sweep_file(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_sweep(
        tmp_path_factory.mktemp("browser") / "sweep", 2000, edit=hostile if request.param == "hostile" else None
    )
    build_report(folder, ["html"])
    return folder / "report.html"


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", WIDTHS)
def test_nothing_is_asked_for_and_all_is_seen(chromium: Any, sweep_file: Path, width: int, scheme: str) -> None:
    with opened(chromium, sweep_file, width, scheme) as (page, trouble):
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        drawings = page.locator("figure svg")
        assert drawings.count() == FIGURES
        for index in range(drawings.count()):
            box = drawings.nth(index).bounding_box()
            assert box["width"] > 200
            assert box["height"] > 80
        assert page.locator("script").count() == 1
        assert page.locator("main img, main b").count() == 0
        assert trouble == []


def test_every_outcome_looks_as_what_it_is(chromium: Any, sweep_file: Path) -> None:
    with opened(chromium, sweep_file) as (page, _):
        looks = page.evaluate("""() => Object.fromEntries([...document.querySelectorAll(".status")].map((badge) => {
            const style = getComputedStyle(badge);
            const look = [style.color, style.backgroundColor, style.borderTopStyle, style.borderTopColor].join(" ");
            return [badge.className.split("status-")[1], look]; }))""")
        assert set(looks) >= set(STATUSES)
        assert len(set(looks.values())) == len(looks)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_what_stands_on_a_cell_can_be_read(chromium: Any, sweep_file: Path, scheme: str) -> None:
    """Contrast of the numbers of a map with their cells, as WCAG 2 counts it: 4.5 is asked of small print."""
    with opened(chromium, sweep_file, scheme=scheme) as (page, _):
        contrast = page.evaluate("""() => {
            const light = (colour) => colour.match(/[\\d.]+/g).slice(0, 3).map((v) => v / 255)
                .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4))
                .reduce((sum, c, k) => sum + c * [0.2126, 0.7152, 0.0722][k], 0);
            const svg = document.querySelector('[id^="plot-figure-map"] svg');
            const cells = [...svg.querySelectorAll("path")].filter((p) => /rgb/.test(getComputedStyle(p).fill))
                .map((p) => [p.getBoundingClientRect(), getComputedStyle(p).fill]);
            const found = [];
            for (const text of svg.querySelectorAll("text")) {
                const box = text.getBoundingClientRect();
                const [x, y] = [(box.left + box.right) / 2, (box.top + box.bottom) / 2];
                const under = cells.filter(([b]) => b.width < 80)
                    .filter(([b]) => b.left < x && x < b.right && b.top < y && y < b.bottom);
                if (!under.length) continue;
                const pair = [light(getComputedStyle(text).fill), light(under.at(-1)[1])].sort((a, b) => a - b);
                found.push((pair[1] + 0.05) / (pair[0] + 0.05));
            }
            return found; }""")
        assert len(contrast) > 50
        assert min(contrast) > 4.5


def test_tables_sort_and_filter(chromium: Any, sweep_file: Path) -> None:
    with opened(chromium, sweep_file) as (page, trouble):
        table = page.locator("#table-worst-1")
        values = "(t) => [...t.tBodies[0].rows].map(r => Number(r.cells[2].dataset.value))"
        before = table.evaluate(values)
        table.locator("th button").nth(2).press("Enter")
        assert table.evaluate(values) == sorted(before, reverse=True)
        box = page.locator(".table", has=table)
        box.locator("input").fill("no such design")
        assert table.locator("tbody tr:visible").count() == 0
        assert trouble == []


CELLS = """(table) => [...table.tBodies[0].rows].map((row) => [...row.querySelectorAll("td")].map((cell) =>
    [cell.firstChild.textContent, cell.querySelector("small")?.textContent ?? ""]))"""


def test_any_two_numbers_can_be_mapped(chromium: Any, sweep_file: Path) -> None:
    with opened(chromium, sweep_file) as (page, trouble):
        picker = page.locator(".picker")
        table, (what, across, down) = picker.locator("table"), picker.locator("select").all()
        static = page.locator("#table-map-1 tbody tr").evaluate_all(
            "(rows) => rows.map((row) => [...row.cells].slice(1).map((cell) => cell.textContent))"
        )
        medians = [[f"{float(cell.split(' ')[0]):g} %" if "%" in cell else cell for cell in row] for row in static]
        counts = [[cell.partition("(")[2].strip(")") for cell in row] for row in static]
        shown = table.evaluate(CELLS)
        assert [[cell[0] for cell in row] for row in shown] == medians
        assert [[cell[1] for cell in row] for row in shown] == counts
        what.select_option("3")
        largest = [[cell.partition(", ")[2].partition(" ")[0] for cell in row] for row in static]
        for row, cells in zip(table.evaluate(CELLS), largest, strict=True):
            assert [cell[0] for cell in row] == [f"{float(cell):g} %" if cell else "–" for cell in cells]
        what.select_option("2")
        first, second = across.input_value(), down.input_value()
        across.select_option(second)
        assert "different" in picker.locator(".shows").inner_text()
        assert table.locator("tr").count() == 0
        down.select_option(first)
        turned = [list(column) for column in zip(*shown[::-1], strict=True)][::-1]
        assert table.evaluate(CELLS) == turned
        assert trouble == []


def test_readable_without_a_script(chromium: Any, sweep_file: Path) -> None:
    with opened(chromium, sweep_file, java_script_enabled=False) as (page, trouble):
        assert page.locator("figure svg").count() == FIGURES
        assert page.locator("#table-map-1 tbody tr").count() == 8
        assert page.locator(".picker *").count() == 0
        assert trouble == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_serious_fault(chromium: Any, sweep_file: Path, axe: str, scheme: str) -> None:
    with opened(chromium, sweep_file, scheme=scheme, bypass_csp=True) as (page, _):
        page.evaluate(axe)
        found = page.evaluate("() => axe.run(document)")
        serious = [
            (fault["id"], fault["nodes"][0]["html"][:150], fault["nodes"][0]["failureSummary"][:300])
            for fault in found["violations"]
            if fault["impact"] in ("serious", "critical")
        ]
        assert serious == []
        assert len(found["passes"]) > 15
        page.evaluate("() => document.querySelector('input[type=search]').closest('label').replaceWith("
                      "document.querySelector('input[type=search]'))")  # fmt: skip
        spoilt = page.evaluate("() => axe.run(document)")
        assert {fault["id"] for fault in spoilt["violations"]} >= {"label"}
