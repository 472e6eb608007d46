"""Rendered pictures in a report: those that the run has stored, or the reason why there are none."""

from __future__ import annotations

import base64
from collections.abc import Callable
from pathlib import Path

import pytest

from stored_pictures import TIMES, store_pictures
from test_report import make_run, parse, remove, replace, truncate
from workbench.errors import OutputError
from workbench.report import build_report


def films(run: Path) -> list[dict[str, str]]:
    found = [attributes for tag, attributes in parse(run).tags if tag == "figure" and "data-film" in attributes]
    return [{name: value or "" for name, value in attributes.items()} for attributes in found]


@pytest.mark.usefixtures("undrawn")
def test_the_page_holds_the_stored_frames_in_the_case_that_they_show(tmp_path: Path) -> None:
    run = store_pictures(make_run(tmp_path / "run", samples=30))
    build_report(run, ["html", "md", "pdf"])
    (film,) = films(run)
    assert film["data-case"] == "case-sim1"
    assert [float(t) for t in film["data-film"].split()] == list(TIMES)
    sheet = base64.b64encode((run / "pictures" / "film.webp").read_bytes()).decode()
    still = base64.b64encode((run / "pictures" / "mechanism.webp").read_bytes()).decode()
    shown = [f"data:image/webp;base64,{data}" for data in (still, sheet)]  # on the first screen, and in the case
    assert [a["src"] for tag, a in parse(run).tags if tag == "img"] == shown
    text = (run / "report.md").read_text(encoding="utf-8")
    assert text.count('<img src="pictures/mechanism.webp" alt="The robot') == 1
    assert b"/Subtype/Image" in (run / "report.pdf").read_bytes().replace(b" ", b"")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"note": "no offscreen OpenGL on this machine (tried egl)"}, "No rendered picture: no offscreen OpenGL"),
        ({"note": "<b>x</b>"}, "No rendered picture: &lt;b&gt;x"),
        ({"model_sha256": "0" * 63 + "1"}, "No rendered picture: the stored pictures show another model."),
    ],
)
@pytest.mark.usefixtures("undrawn")
def test_without_pictures_the_drawing_stands_alone_and_the_reason_is_said(
    tmp_path: Path, changes: dict[str, str], said: str
) -> None:
    run = store_pictures(make_run(tmp_path / "run", samples=30), **changes)
    build_report(run)
    page = (run / "report.html").read_text(encoding="utf-8")
    assert films(run) == []
    assert page.count(said) == 1
    assert "plot-case-sim1-mechanism" in page
    assert "No rendered picture" in (run / "report.md").read_text(encoding="utf-8")


@pytest.mark.usefixtures("undrawn")
def test_a_run_that_was_told_to_draw_none_does_not_speak_of_them(tmp_path: Path) -> None:
    run = make_run(tmp_path / "run", samples=30)
    build_report(run)
    assert "rendered" not in (run / "report.md").read_text(encoding="utf-8")
    assert films(run) == []


def grow(run: Path) -> None:
    path = run / "pictures" / "film.webp"
    path.write_bytes(path.read_bytes() + bytes(1_000_000))


def disguise(run: Path) -> None:
    (run / "pictures" / "mechanism.webp").write_bytes(b"<svg onload='alert(1)'/>")


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (truncate("pictures/pictures.json"), "pictures.json: not valid JSON"),
        (replace("pictures/pictures.json", '"format": 1', '"format": 2'), "format 2 is not supported; allowed: 1"),
        (replace("pictures/pictures.json", '"sim1"', '"sim7"'), "case 'sim7' with 5 frames; needed: a case of the run"),
        (replace("pictures/pictures.json", '"columns": 2', '"columns": 0'), "needed: a case of the run"),
        (remove("pictures/film.webp"), "film.webp: cannot be read"),
        (grow, "allowed: a WebP picture of at most 1000000 bytes"),
        (disguise, "mechanism.webp: 24 bytes; allowed: a WebP picture"),
    ],
)
@pytest.mark.usefixtures("undrawn")
def test_torn_pictures_give_one_line(tmp_path: Path, spoil: Callable[[Path], None], said: str) -> None:
    run = store_pictures(make_run(tmp_path / "run", cases=1, samples=20))
    spoil(run)
    with pytest.raises(OutputError) as caught:
        build_report(run)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
