"""Two runs side by side: what actuators and joints bear, limits, wanted accuracy, and the page that says it."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from small_campaign import SMALL, Workbench
from workbench.compare.asked import Asked, worst_over_cases
from workbench.compare.outcome import outcome_of
from workbench.compare.page import comparison_page
from workbench.compare.parameters import parameter_changes
from workbench.compare.runs import compare_loaded
from workbench.compare.sections import comparison_sections, ratio_text
from workbench.report.load import load_run

LIMITS = """
[actuators.q2]
peak = 8.2
rms = 8.0
source = "data sheet 7"
"""
LIMITED = SMALL.replace("[[candidate]]", f"good = 0.015\n{LIMITS}\n[[candidate]]", 1)
HEAVY = ("--set", "payload=2.0")


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    bench = Workbench(tmp_path, monkeypatch, capsys)
    assert bench.run(LIMITED, "--quick", "--out", "a").code == 0
    assert bench.run(LIMITED, "--quick", "--out", "b", *HEAVY).code == 0
    return bench


class Page(HTMLParser):
    """Text, headings and addresses of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.text: list[str] = []
        self.addresses: list[str] = []
        self.ids: list[str] = []
        self.feed(text)
        self.words = " ".join(" ".join(self.text).split())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.addresses += [str(found[key]) for key in ("href", "src") if found.get(key) and tag != "use"]
        self.ids += [str(found["id"])] if "id" in found else []

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def test_what_is_compared_is_what_the_series_hold(workbench: Workbench) -> None:
    old, new = load_run(Path("a")), load_run(Path("b"))
    found = compare_loaded(old, new)
    by_key = {(one.case, one.item, one.key): one for one in found.demands}
    assert {case for case, _, _ in by_key} == {"first", "second"}
    for case in ("first", "second"):
        for number, joint in enumerate(("q1", "q2", "q3")):
            for run, which in ((old, "before"), (new, "after")):
                series = run.series(case)
                tau, rate = series[f"ref_distributed_{joint}"], series[f"qd{number + 1}"]
                assert getattr(by_key[case, joint, "peak"], which) == np.abs(tau).max()
                assert getattr(by_key[case, joint, "power"], which) == np.abs(tau * rate).max()
                work = np.trapezoid(np.maximum(tau * rate, 0.0), series["t"])
                assert getattr(by_key[case, joint, "work"], which) == pytest.approx(work, rel=1e-12)
    for one in found.reactions:
        for run, which in ((old, "before"), (new, "after")):
            parts = [run.series(one.case)[f"reaction_{one.item}_{axis}"] for axis in "xyz"]
            assert getattr(one, which) == pytest.approx(np.sqrt(sum(part**2 for part in parts)).max(), rel=1e-12)
    # the other way round is another comparison: the oracle can tell
    assert by_key["second", "q2", "peak"].ratio > 1.05
    back = {(o.case, o.item, o.key): o for o in compare_loaded(new, old).demands}
    assert back["second", "q2", "peak"].ratio == pytest.approx(1 / by_key["second", "q2", "peak"].ratio)


def test_the_largest_over_cases_may_stand_in_different_cases() -> None:
    found = [Asked("a", "q1", "peak", "N", 5.0, 6.0), Asked("b", "q1", "peak", "N", 4.0, 9.0)]
    (worst,) = worst_over_cases(found)
    assert (worst.before, worst.before_in, worst.after, worst.after_in) == (5.0, "a", 9.0, "b")
    assert worst.ratio == pytest.approx(1.8)
    assert not worst.same
    (worst,) = worst_over_cases([Asked("a", "q1", "peak", "N", 5.0, math.nan), found[1]])
    assert math.isnan(worst.after or 0.0)  # what is not known is not small
    assert ratio_text(Asked("a", "q1", "peak", "N", 0.0, 1.0).ratio) == "from 0"
    assert ratio_text(Asked("a", "q1", "peak", "N", 0.0, 0.0).ratio) == "–"
    assert ratio_text(Asked("a", "q1", "peak", "N", None, 1.0).ratio) == "–"


def test_a_motor_that_was_big_enough_and_is_not_any_more(workbench: Workbench) -> None:
    done = workbench("compare", "a", "b")
    assert done.code == 0
    flat = " ".join(done.out.split())
    assert re.search(r"needs attention: q2: its actuator is too small in case second: peak 8\.\d+ N m at", flat)
    assert re.search(r"A: Is lumped good enough, within 1.5 % .*? No: .*? B: Is lumped good enough, .*? Yes", flat)
    assert re.search(r"q2 peak 7.897 N m 8\.\d+ N m ×1\.1", flat)
    # the other way round it is big enough, and that is said too
    back = " ".join(workbench("compare", "b", "a").out.split())
    assert "needs attention: q2" not in back
    assert "Every actuator is big enough: the tightest is q2, peak 7.897 N m in case second, 96.3 %" in back
    assert max(len(line.rstrip()) for line in done.out.splitlines() if "│" not in line and not re.match(
        r"needs attention|[AB]: |worse", line)) <= 80  # fmt: skip


def test_the_page_says_what_the_terminal_says(workbench: Workbench) -> None:
    done = workbench("compare", "a", "b", "--html", "c.html")
    assert "Page: c.html" in done.out
    text = Path("c.html").read_text(encoding="utf-8")
    page = Page(text)
    for heading in ("From A to B", "What was changed", "What the actuators have to give", "Torque and power over time",
                    "What the joints bear", "Errors of both", "What else differs"):  # fmt: skip
        assert heading in page.words
    for line in done.out.splitlines():
        if line.startswith("needs attention: "):
            assert line.removeprefix("needs attention: ") in page.words
        if line.startswith(("A: Is", "B: Is")):
            assert line in page.words
    assert page.words.count("load mass on the platform, the paper's M") == 2  # from 0, and from 1.5 in one case
    assert "Needs attention" in page.words
    # nothing is loaded from elsewhere, and every link leads somewhere
    assert all(address.startswith("#") for address in page.addresses)
    assert {address[1:] for address in page.addresses} <= set(page.ids)
    assert len(set(page.ids)) == len(page.ids)
    assert text.count("<svg") == 4  # torque and power of two cases
    assert text.count("<details") == 2
    assert workbench("compare", "a", "b", "--html", "d.html").code == 0
    assert Path("d.html").read_bytes() == Path("c.html").read_bytes()


def test_cases_that_one_run_alone_computed_are_left_out_and_named(workbench: Workbench) -> None:
    path = workbench.directory / "b/manifest.json"
    manifest = json.loads(path.read_text())
    first = manifest["cases"]["first"]
    manifest["cases"]["first"] = {"status": "not-driven", "message": "out of reach", "parameters": first["parameters"]}
    manifest["cases"]["second"]["peak_speed"] = 1.0
    path.write_text(json.dumps(manifest))
    summary = workbench.directory / "b/summary.csv"
    lines = [line for line in summary.read_text().splitlines() if not line.startswith("first,")]
    summary.write_text("\n".join(lines) + "\n")
    found = compare_loaded(load_run(Path("a")), load_run(Path("b")))
    assert {one.case for one in found.demands} == {"second"}
    assert [(change.what, change.before, change.after) for change in parameter_changes(
        load_run(Path("a")).manifest, load_run(Path("b")).manifest)] == [("payload", 1.5, 2.0)]  # fmt: skip
    assert {one.what for one in found.outcomes} == {"verdict", 'case "first" status'}
    done = workbench("compare", "a", "b", "--html", "c.html")
    assert "OK IN PART: nothing got worse" in done.out
    assert "not computed in both: first." in done.out
    assert "Left out, since not both runs have computed them: first." in " ".join(done.out.split())
    assert "OK IN PART" in Page(Path("c.html").read_text()).words


def test_runs_of_an_earlier_version_say_that_they_know_no_demands(workbench: Workbench) -> None:
    path = workbench.directory / "a/manifest.json"
    manifest = json.loads(path.read_text())
    for case in manifest["cases"].values():
        del case["demand"]
    del manifest["actuators"], manifest["good"]
    path.write_text(json.dumps(manifest))
    done = workbench("compare", "a", "b", "--html", "c.html")
    assert done.code == 0
    words = Page(Path("c.html").read_text()).words
    assert "one of them was written by an earlier version" in words
    assert "Torque and power over time" not in words


def test_hostile_names_stay_text(workbench: Workbench) -> None:
    nasty = "<script>alert(1)</script>&\"'"
    path = workbench.directory / "b/manifest.json"
    manifest = json.loads(path.read_text())
    manifest["title"] = nasty
    manifest["actuators"]["q2"]["source"] = nasty
    manifest["parameters"][0]["meaning"] = nasty
    manifest["cases"]["first"]["title"] = nasty
    path.write_text(json.dumps(manifest))
    old, new = load_run(Path("a")), load_run(Path("b"))
    found = compare_loaded(old, new)
    text = comparison_page(old, new, (nasty, nasty), found, outcome_of(found))
    assert "<script>alert" not in text
    assert "&lt;script&gt;alert(1)" in text


def taken(path: Path) -> None:
    path.mkdir()


@pytest.mark.parametrize(
    ("options", "before", "said"),
    [
        (("--html", "x.html"), taken, "x.html: is a directory; name a file"),
        (("--html", "nowhere/x.html"), None, "there is no directory nowhere"),
        (("--html", "x.html"), lambda path: path.symlink_to("a/manifest.json"), "is a symbolic link"),
        (("--html", "x.html"), os.mkfifo, "is no regular file"),
        (("--good", "3"), None, "--good 3: should be a fraction"),
    ],
)
def test_what_cannot_be_written_or_asked_is_refused_in_a_line(
    workbench: Workbench, options: tuple[str, ...], before: Callable[[Path], Any] | None, said: str
) -> None:
    if before:
        before(workbench.directory / "x.html")
    done = workbench("compare", "a", "b", *options)
    assert done.code == 2
    assert said in done.err
    assert done.out == ""


def test_the_run_before_may_be_a_campaign(workbench: Workbench) -> None:
    done = workbench("compare", "small.toml", "b", "--good", "0.05")
    assert done.code == 0
    assert "A: small.toml" in done.out
    direct = workbench("compare", "a", "b", "--good", "0.05")
    tail = [line for line in direct.out.splitlines()[2:] if "commit" not in line]
    assert [line for line in done.out.splitlines()[2:] if "commit" not in line] == tail
    assert {path.name for path in workbench.directory.iterdir()} == {"a", "b", "small.toml"}
    assert workbench("compare", "no.toml", "b").code == 2
    (workbench.directory / "bad.toml").write_text("name = 3")
    done = workbench("compare", "bad.toml", "b")
    assert done.code == 2
    assert done.err.startswith("workbench: bad.toml: ")


def test_sections_of_one_run_against_itself_say_that_nothing_differs(workbench: Workbench) -> None:
    run = load_run(Path("a"))
    found = compare_loaded(run, run)
    sections = {section.key: section for section in comparison_sections(run, run, found)}
    assert "no parameter differs" in sections["changed"].context["paragraphs"][0]
    assert sections["rest"].context["paragraphs"] == ["Nothing else differs."]
    assert all(one.ratio == 1.0 or one.before == one.after for one in found.demands)
