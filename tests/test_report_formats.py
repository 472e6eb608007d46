"""PDF, LaTeX and the command that rebuilds a report."""

from __future__ import annotations

import json
import re
from html import unescape
from pathlib import Path
from typing import Any

import pytest

from small_campaign import Workbench
from test_report import NASTY, make_run, parse
from workbench.campaign.changed import ANOTHER, NOT_JUDGED
from workbench.errors import OutputError
from workbench.report import pdf
from workbench.report.build import build_report
from workbench.report.latex import latex_text


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_run(tmp_path_factory.mktemp("formats") / "run", cases=1, samples=40)
    build_report(folder, ["html", "pdf"], "paper")
    return folder


def test_pdf_holds_pages_and_figures_without_pictures(run: Path, tmp_path: Path) -> None:
    data = (run / "report.pdf").read_bytes()
    assert data.startswith(b"%PDF-")
    assert len(re.findall(rb"/Type\s*/Page\b", data)) >= 4
    assert b"CreationDate" not in data
    figures = {path.name for path in (run / "figures").iterdir()}
    assert {"case-sim1-torque-1.pdf", "case-sim1-mechanism.pdf", "case-sim1-reactions.pdf"} <= figures
    assert not [name for name in figures if name.endswith(".svg")]
    again = make_run(tmp_path / "again", cases=1, samples=40)
    build_report(again, ["pdf"], "paper")
    assert (again / "report.pdf").read_bytes() == data
    assert not (again / "report.html").exists()


@pytest.mark.usefixtures("undrawn")
def test_pages_have_contents_links_and_the_size_that_is_asked_for(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "run", cases=1, samples=20)
    sizes = {}
    for paper in ("a4", "letter"):
        build_report(folder, ["pdf"], paper=paper)
        data = (folder / "report.pdf").read_bytes()
        sizes[paper] = set(re.findall(rb"/MediaBox\s*\[([\d. ]+)\]", data))
        assert b"/Outlines" in data
        assert len(re.findall(rb"/Subtype\s*/Link", data)) > 10
    assert sizes == {"a4": {b"0 0 595.2756 841.8898"}, "letter": {b"0 0 612 792"}}
    with pytest.raises(OutputError, match="unknown paper 'a3'; allowed: a4, letter"):
        build_report(folder, ["pdf"], paper="a3")


@pytest.mark.usefixtures("undrawn")
def test_the_pdf_says_what_the_page_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def edit(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        manifest["figures"][0]["not_about"] = "a2 0.2 -> 0.3 m (--set)"
        change = {"name": "a2", "unit": "m", "before": 0.2, "after": 0.3, "by": "--set", "cases": ["sim1"]}
        manifest["changes"] = {"model": "", "parameters": [change]}

    folder = make_run(tmp_path / "run", cases=1, samples=20, edit=edit)
    monkeypatch.setattr(pdf, "_compiled", lambda main, parts: parts.get("report.json", "").encode())
    build_report(folder, ["html", "pdf"])
    told = json.loads((folder / "report.pdf").read_bytes())
    page = (folder / "report.html").read_text(encoding="utf-8")
    for said in (f"{ANOTHER}.", NOT_JUDGED, "Not for the robot of the source: a2 0.2 -&gt; 0.3 m (--set)."):
        assert said in page
        assert unescape(said) in json.dumps(told)
    # figures come in the order of the page: a wide one does not overtake those before it
    cases = next(section for section in told["sections"] if section["key"] == "cases")
    drawn = [plot["file"].removesuffix(".svg") for block in cases["blocks"] for plot in block.get("plots", ())]
    shown = re.findall(r'<figure id="plot-(case-[^"]*)"', page)
    assert sorted(drawn) == sorted(shown)
    assert drawn.index("case-sim1-torque-3") < drawn.index("case-sim1-mechanism") < drawn.index("case-sim1-reactions")


def test_every_table_is_there_as_latex(run: Path) -> None:
    tables = parse(run).tables
    assert {path.name for path in (run / "tables").iterdir()} == {
        "references.bib", "paper.tex", *(f"{name}.tex" for name in tables)
    }  # fmt: skip
    claims = (run / "tables" / "claims.tex").read_text(encoding="utf-8")
    assert claims.count(r"\\") == 1 + len(tables["claims"][1:])
    assert r"below 0.1 \% & $1.7\times10^{-13}$ \%" in claims
    for path in (run / "tables").glob("*.tex"):
        text = path.read_text(encoding="utf-8")
        for part in text.split(r"\begin{tabular}")[1:]:
            widths = {len(re.findall(r"(?<!\\)&", line)) for line in part.splitlines() if line.endswith(r"\\")}
            assert len(widths) == 1
        assert text.count("{") - text.count(r"\{") == text.count("}") - text.count(r"\}")


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("a_b & 5 %", r"a\_b \& 5 \%"),
        ("1.25e-13 of N·m", r"$1.25\times10^{-13}$ of N$\cdot$m"),
        ("[Paper2010] 4", "{}[Paper2010] 4"),
        ("\\input{x}", r"\textbackslash{}input\{x\}"),
        ("case1e-3x", "case1e-3x"),
        ("m/s²", "m/s$^2$"),
    ],
)
def test_latex_escaping(text: str, written: str) -> None:
    assert latex_text(text) == written


def test_hostile_names_survive_every_format(tmp_path: Path) -> None:
    def edit(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        manifest["title"] = manifest["command"] = NASTY + "x" * 300
        manifest["cases"]["sim1"]["title"] = NASTY
        manifest["claims"][0]["text"] = NASTY + r"\end{table}\input{secret}"

    folder = make_run(tmp_path / "run", cases=1, samples=20, edit=edit)
    build_report(folder, ["html", "md", "pdf"])
    claims = (folder / "tables" / "claims.tex").read_text(encoding="utf-8")
    assert r"\input" not in claims
    assert claims.count(r"\end{table") == 1


def test_an_unknown_format_or_style_is_refused(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "run", cases=1, samples=20)
    with pytest.raises(OutputError, match="unknown format 'docx'; allowed: html, md, pdf, csv, mat"):
        build_report(folder, ["docx"])
    with pytest.raises(OutputError, match="unknown style 'loud'; allowed: page, paper"):
        build_report(folder, ["md"], "loud")


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    made = Workbench(tmp_path, monkeypatch, capsys)
    monkeypatch.setattr("workbench.report.build_report", build_report)
    return made


@pytest.mark.usefixtures("undrawn")
def test_the_command_rebuilds_what_is_asked_for(workbench: Workbench) -> None:
    folder = make_run(workbench.directory / "run", cases=1, samples=20)
    done = workbench("report", folder, "--format", "md")
    assert (done.code, done.out.split()) == (0, [str(folder / "report.md")])
    assert not (folder / "report.html").exists()
    done = workbench("report", folder)
    assert [Path(line).name for line in done.out.split()] == ["report.html", "report.md"]


def test_the_command_refuses_in_one_line(workbench: Workbench) -> None:
    folder = make_run(workbench.directory / "run", cases=1, samples=20)
    for arguments, said in (
        (["report", folder, "--format", "docx"], "unknown format"),
        (["report", folder, "--style", "loud"], "unknown style"),
        (["report", workbench.directory / "nothing"], "manifest.json: missing"),
    ):
        done = workbench(*arguments)
        assert done.code == 2
        assert len(done.complaint) == 1
        assert said in done.complaint[0]


def test_only_the_head_tells_one_run_from_another(tmp_path: Path) -> None:
    def later(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        manifest |= {"started": "2031-02-02T00:00:00Z", "finished": "2031-02-02T00:01:00Z", "seconds": 60.0}
        manifest |= {"git_commit": "fedcba9", "machine": {"system": "other", "cores": 64}}
        for candidate in manifest["candidates"].values():
            candidate["cost_us"] *= 2

    def result(manifest: dict[str, Any], rows: list[dict[str, Any]]) -> None:
        rows[0]["rms_error"] *= 2

    first, second, third = (
        make_run(tmp_path / str(number), cases=1, samples=20, edit=edit)
        for number, edit in enumerate((None, later, result))
    )
    for folder in (first, second, third):
        build_report(folder)
    for name, end in (("report.html", "</header>"), ("report.md", "## Verdict")):
        texts = [(folder / name).read_text(encoding="utf-8") for folder in (first, second, third)]
        heads, bodies = zip(*(text.split(end) for text in texts), strict=True)
        assert heads[0] != heads[1]
        assert bodies[0] == bodies[1] != bodies[2]
        assert ("6.2" in heads[0], "12" in heads[1]) == (True, True)
