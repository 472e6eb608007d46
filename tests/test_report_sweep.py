"""The report of a sweep: it counts what is stored, shows every outcome as what it is, and refuses what is torn."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import workbench as wb
from exact_csv import read_exact
from small_campaign import Workbench
from sweep_campaign import SWEEP
from sweep_store import KEYS, STATUSES, make_sweep
from test_report import NASTY, markdown_tables, parse, remove, replace, truncate
from workbench.commands.sweeps import report_apart
from workbench.errors import OutputError
from workbench.report import build_report
from workbench.report.load import read_manifest
from workbench.report.sweep.cases import rerun_command
from workbench.report.sweep.load import SweepRun, load_sweep
from workbench.report.sweep.verdict import verdict
from workbench.report.text import percent
from workbench.sweep import run as sweep_run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep in which cases end in every way there is, with its report."""
    folder = make_sweep(tmp_path_factory.mktemp("sweep") / "run")
    (folder / "series").mkdir()
    (folder / "series" / "design-000010.parquet").write_bytes(b"")
    build_report(folder, ["html", "md", "pdf"])
    return folder


def loaded(folder: Path) -> SweepRun:
    return load_sweep(folder, read_manifest(folder))


def lumped(folder: Path) -> pd.DataFrame:
    """Error of the worst joint of each design, with the numbers that make it; by pandas alone."""
    rows = pd.read_parquet(folder / "summary")
    worst = rows[rows.candidate == "lumped"].groupby("index").peak_error.max().rename("error")
    return pd.read_parquet(folder / "cases").set_index("index").join(worst, how="inner")


# --- the verdict ---


def test_every_outcome_is_counted_and_looks_as_what_it_is(run: Path) -> None:
    counts = pd.read_parquet(run / "cases").status.value_counts()
    assert set(counts.index) == set(STATUSES)
    table = parse(run).tables["outcomes"]
    assert {int(row[1]) for row in table[1:]} == set(counts)
    badges = [found["class"] for _, found in parse(run).tags if "status-" in (found.get("class") or "")]
    assert {f"status status-{status}" for status in STATUSES} <= set(badges)
    status, sentence = verdict(loaded(run))
    assert status.key == "failed"
    said = ["of 300 cases 2 failed", "2 gave results that are not finite", "2 ran out of time", "2 lost their worker"]
    for part in (*said, f"{counts['passed']} passed", f"{counts['filtered']} of 300 were left out"):
        assert part in sentence


def test_a_good_sweep_passes_and_says_how_near_it_came(tmp_path: Path) -> None:
    found = loaded(make_sweep(tmp_path / "run", good=True))
    status, sentence = verdict(found)
    assert status.key == "passed"
    assert sentence.startswith("all 240 cases that were computed hold every bound (worst is distributed on joint q")
    assert "against a bound of 1e-09" in sentence
    assert "60 of 300 were left out by the filter" in sentence


@pytest.mark.parametrize(
    ("counts", "key"),
    [
        ({"passed": 299, "timeout": 1}, "error"),
        ({"passed": 298, "killed": 1, "failed": 1}, "failed"),
        ({"filtered": 300}, "unjudged"),
        ({"passed": 1, "filtered": 299}, "passed"),
        ({"passed": 299, "invalid": 1}, "error"),
    ],
)
def test_lost_cases_are_no_failures_of_a_formula(tmp_path: Path, counts: dict[str, int], key: str) -> None:
    def edit(manifest: Any, summary: dict[str, Any], cases: Any, rows: Any) -> None:
        summary["counts"] = dict.fromkeys(STATUSES, 0) | counts

    assert verdict(loaded(make_sweep(tmp_path / "run", good=True, edit=edit)))[0].key == key


def test_without_a_bound_nothing_is_verified(tmp_path: Path) -> None:
    def edit(manifest: Any, summary: Any, cases: Any, rows: pd.DataFrame) -> None:
        rows["bound"] = np.nan

    assert verdict(loaded(make_sweep(tmp_path / "run", good=True, edit=edit)))[0].key == "unjudged"


# --- the numbers ---


def test_shares_and_quantiles_are_those_of_the_rows(run: Path) -> None:
    errors = lumped(run).error
    table = parse(run).tables["errors-1"]
    assert table[0][1:6] == ["Below 1 %", "Below 2 %", "Below 3 %", "Below 5 %", "Below 10 %"]
    shown = dict(zip(table[0], table[1], strict=True))
    for limit in (0.01, 0.02, 0.03, 0.05, 0.1):
        assert shown[f"Below {100 * limit:g} %"] == percent(float((errors < limit).mean()))
    assert shown["Median"] == percent(errors.median())
    assert shown["Largest"] == percent(errors.max())
    text = (run / "report.md").read_text(encoding="utf-8")
    assert (
        f"half of the designs stay below {percent(errors.median())}, 95 % below {percent(errors.quantile(0.95))}"
        in text
    )
    assert "rises with speed (+0." in text
    assert "falls with payload (-0." in text


@pytest.mark.usefixtures("undrawn")
def test_a_spoilt_row_shows(run: Path, tmp_path: Path) -> None:
    def edit(manifest: Any, summary: Any, cases: Any, rows: pd.DataFrame) -> None:
        rows.loc[rows["index"] < 40, "peak_error"] = 0.5

    folder = make_sweep(tmp_path / "run", edit=edit)
    build_report(folder, ["html"])
    assert parse(folder).tables["errors-1"][1][1:6] != parse(run).tables["errors-1"][1][1:6]
    assert parse(folder).tables["map-1"] != parse(run).tables["map-1"]


def test_the_map_holds_the_median_the_largest_and_the_count_of_each_cell(run: Path) -> None:
    found = lumped(run)
    table = parse(run).tables["map-1"]
    strongest = json.loads((run / "sweep.json").read_text())["drivers"][:2]
    across, down = (driver["key"] for driver in strongest)
    assert table[0][0].split(" ")[0] == down.removeprefix("parameters.")
    bins = len(table) - 1
    assert bins == len(table[0]) - 1 >= 3
    edges = {
        key: np.linspace(0.0, 2.0, bins + 1)
        if key == KEYS[1]
        else np.geomspace(0.25 if key == "speed" else 0.5, 2, bins + 1)
        for key in (across, down)
    }
    edges = {key: [*e[:-1], 2.0001] for key, e in edges.items()}
    counted = 0
    for row, cells in enumerate(reversed(table[1:])):
        for column, cell in enumerate(cells[1:]):
            inside = found[
                (found[across] >= edges[across][column]) & (found[across] < edges[across][column + 1])
                & (found[down] >= edges[down][row]) & (found[down] < edges[down][row + 1])
            ]  # fmt: skip
            counted += len(inside)
            expected = f"{percent(inside.error.median())}, {percent(inside.error.max())} ({len(inside)})"
            assert cell == (expected if len(inside) else "–")
    assert counted == len(found)


@pytest.mark.usefixtures("undrawn")
def test_a_number_with_few_values_has_a_column_for_each(tmp_path: Path) -> None:
    def edit(manifest: Any, summary: Any, cases: pd.DataFrame, rows: Any) -> None:
        cases["speed"] = np.array([0.5, 1.0, 2.0])[cases["index"] % 3]

    folder = make_sweep(tmp_path / "run", edit=edit)
    build_report(folder, ["md"])
    table = next(
        t for t in markdown_tables((folder / "report.md").read_text()) if "\\ speed" in t[0][0].replace("\\\\", "\\")
    )
    assert table[0][1:] == ["0.5", "1", "2"]


def test_the_worst_designs_come_first_with_all_their_numbers(run: Path) -> None:
    found = lumped(run).sort_values("error", ascending=False)
    table = parse(run).tables["worst-1"]
    assert [row[0] for row in table[1:]] == found.case.iloc[:10].tolist()
    assert table[0] == ["Case", "τ1 [N]", "τ2 [N·m]", "τ3 [N·m]", "m2 [factor]", "payload [kg]", "speed [factor]"]
    for row, design in zip(table[1:], found.itertuples(), strict=False):
        assert max(row[1:4], key=lambda text: float(text.split()[0])) == percent(design.error)
    for row, value in zip(table[1:], found[KEYS[1]], strict=False):
        assert float(row[5]) == pytest.approx(value, rel=1e-3)


def test_kept_series_are_linked_and_others_are_not(run: Path) -> None:
    links = [a["href"] for tag, a in parse(run).tags if tag == "a" and (a.get("href") or "").startswith("series/")]
    assert "series/design-000010.parquet" in links
    assert all((run / link).is_file() for link in links)
    assert "(series/design-000010.parquet)" in (run / "report.md").read_text(encoding="utf-8")
    table = parse(run).tables["not-passed"]
    assert {row[1].split()[-1].lower() for row in table[1:]} == {"failed", "invalid", "out", "killed"}
    assert [row[2] for row in table[1:]].count("series") == 1


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (
            "workbench run c.toml --jobs 4 --out=there --set a1=0.3 --fresh",
            "workbench run c.toml --set a1=0.3 --only x-1",
        ),
        ("workbench run c.toml --out 'my dir' --model m.xml", "workbench run c.toml --model m.xml --only x-1"),
        ("workbench run c.toml --jobs=2 --retry-failed", "workbench run c.toml --only x-1"),
        ("", "workbench run campaigns/design_sweep.toml --only x-1"),
        ("workbench run 'torn", ""),
    ],
)
def test_the_command_for_one_design_keeps_what_makes_its_numbers(run: Path, command: str, said: str) -> None:
    found = loaded(run)
    object.__setattr__(found, "manifest", found.manifest.model_copy(update={"command": command}))
    assert rerun_command(found, "x-1") == said


# --- the page ---


def test_the_same_results_give_the_same_bytes(run: Path, tmp_path: Path) -> None:
    again = make_sweep(tmp_path / "again")
    (again / "series").mkdir()
    (again / "series" / "design-000010.parquet").write_bytes(b"")
    written = build_report(again, ["html", "md", "pdf"])
    assert {path.suffix for path in written} == {".bib", ".html", ".md", ".pdf", ".svg", ".tex"}
    for path in written:
        assert path.read_bytes() == (run / path.relative_to(again)).read_bytes(), path.name


def test_tables_are_whole_in_every_format(run: Path) -> None:
    page = parse(run).tables
    tables = markdown_tables((run / "report.md").read_text(encoding="utf-8"))
    assert len(tables) == len(page)
    for table, same in zip(tables, page.values(), strict=True):
        assert len(table) == len(same) + 1
        assert all(len(row) == len(table[0]) for row in table)
    assert {path.stem for path in (run / "tables").glob("*.tex")} == set(page)


def test_user_text_is_shown_as_text(tmp_path: Path) -> None:
    nasty = NASTY + "x" * 300

    def edit(manifest: dict[str, Any], summary: dict[str, Any], cases: pd.DataFrame, rows: pd.DataFrame) -> None:
        manifest["title"] = manifest["description"] = manifest["command"] = nasty
        manifest["candidates"][nasty] = {"mass_model": nasty, "description": nasty, "source": nasty}
        cases["case"] = [f"../{nasty}-{i}" for i in cases["index"]]
        cases["reason"] = nasty
        rows["candidate"] = rows.candidate.replace("lumped", nasty)
        cases[nasty] = cases.pop("speed")
        for record in [
            *summary["errors"],
            *summary["drivers"],
            *summary["bins"],
            *summary["reasons"],
            *summary["keys"],
        ]:
            for key, value in record.items():
                if value in ("lumped", "speed") or key in ("worst_case", "example", "reason", "meaning"):
                    record[key] = nasty

    folder = make_sweep(tmp_path / "run", edit=edit)
    build_report(folder, ["html", "md", "pdf"])
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.count("<script") == 1
    assert not [tag for tag, _ in parse(folder).tags if tag in ("img", "b")]
    assert not [a for tag, a in parse(folder).tags if tag == "a" and not (a.get("href") or "#").startswith("#")]
    text = (folder / "report.md").read_text(encoding="utf-8")
    outside = re.sub(r"^(`{3,})text\n.*?\n\1$", "", text, flags=re.DOTALL | re.MULTILINE)
    outside = re.sub(r'<img src="[^"]*" alt="[^"]*" width="[^"]*">', "", outside)
    assert "<script" not in outside
    assert not re.search(r"(?<!\\)\]\(http", outside)
    for path in (folder / "figures").glob("*.svg"):
        ElementTree.fromstring(path.read_text(encoding="utf-8"))
        assert re.fullmatch(r"[a-z0-9-]{1,110}\.svg", path.name)


def test_ten_thousand_cases_stay_small(tmp_path: Path) -> None:
    folder = make_sweep(tmp_path / "run", count=10_000)
    build_report(folder, ["html"])
    assert (folder / "report.html").stat().st_size < 5e5


def test_sweeps_of_one_number_or_without_a_modelling_error_have_fewer_sections(tmp_path: Path) -> None:
    def one(manifest: Any, summary: dict[str, Any], cases: Any, rows: Any) -> None:
        summary["keys"] = summary["keys"][2:]
        summary["drivers"] = [d for d in summary["drivers"] if d["key"] == "speed"]

    def verified(manifest: Any, summary: dict[str, Any], cases: Any, rows: Any) -> None:
        summary["drivers"] = summary["bins"] = []
        summary["errors"] = [e for e in summary["errors"] if e["kind"] == "verification"]

    def nothing(manifest: Any, summary: dict[str, Any], cases: pd.DataFrame, rows: pd.DataFrame) -> None:
        verified(manifest, summary, cases, rows)
        cases["status"] = "filtered"
        summary["counts"] = {"filtered": len(cases)}
        rows["kind"] = "contrast"

    sections = {}
    for name, edit in (("one", one), ("verified", verified), ("nothing", nothing)):
        folder = make_sweep(tmp_path / name, edit=edit)
        build_report(folder)
        page = (folder / "report.html").read_text(encoding="utf-8")
        sections[name] = set(re.findall(r'<section id="(\w+)"', page)) & {"errors", "drivers", "maps", "worst"}
    assert sections == {"one": {"errors", "drivers", "worst"}, "verified": {"errors", "worst"}, "nothing": set()}


# --- what is torn ---


def drop(name: str, column: str) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        path = folder / name / "part-00000.parquet"
        pd.read_parquet(path).drop(columns=[column]).to_parquet(path, index=False)

    return spoil


def shift(folder: Path) -> None:
    path = folder / "summary" / "part-00000.parquet"
    table = pd.read_parquet(path)
    table["index"] += 200
    table.to_parquet(path, index=False)


def halve(folder: Path) -> None:
    path = folder / "cases" / "part-00000.parquet"
    pd.read_parquet(path).iloc[::2].to_parquet(path, index=False)


def stop(folder: Path) -> None:
    (folder / "manifest.json").rename(folder / "journal.jsonl")


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (remove("sweep.json"), "sweep.json: missing"),
        (truncate("sweep.json"), "sweep.json: not valid JSON"),
        (replace("sweep.json", '"format": 1', '"format": 3'), "format 3 is not supported; allowed: 1"),
        (replace("sweep.json", '"counts"', '"count"'), "key 'counts': Field required"),
        (replace("sweep.json", '"key": "speed"', '"key": "sped"'), 'column "sped" is missing'),
        (drop("cases", "status"), 'column "status" is missing'),
        (drop("summary", "peak_error"), 'column "peak_error" is missing'),
        (truncate("summary/part-00000.parquet"), "part-00000.parquet: not a readable Parquet file"),
        (remove("cases/part-00000.parquet"), "cases: no part-*.parquet"),
        (halve, "150 cases; sweep.json counts 300"),
        (shift, "allowed: 0 to 299"),
        (stop, "holds a sweep that is not finished; the same workbench run command goes on with it"),
    ],
)  # fmt: skip
def test_torn_results_give_one_line(tmp_path: Path, spoil: Callable[[Path], None], said: str) -> None:
    folder = make_sweep(tmp_path / "run")
    spoil(folder)
    with pytest.raises(OutputError) as caught:
        build_report(folder)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not (folder / "report.html").exists()


def test_what_needs_a_run_without_a_sweep_says_so(run: Path) -> None:
    with pytest.raises(OutputError, match=r"holds a sweep of 300 cases.*pandas\.read_parquet"):
        wb.load_run(run)


# --- the command line ---


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    from test_sweep_run import Inline

    monkeypatch.setattr(sweep_run, "make_pool", Inline)
    found = Workbench(tmp_path, monkeypatch, capsys)
    monkeypatch.setattr("workbench.commands.sweeps.report_apart", report_apart)
    return found


FEW = SWEEP.replace("samples = 40", "samples = 10")


def test_a_sweep_ends_with_its_report_and_one_design_can_be_run_alone(workbench: Workbench) -> None:
    done = workbench.run(FEW, "--out", "many")
    assert done.code == 0
    assert f"Report: {Path('many') / 'report.html'}" in done.out
    many = workbench.directory / "many"
    rows = pd.read_parquet(many / "summary")
    worst = rows[rows.candidate == "lumped"].sort_values("peak_error").case.iloc[-1]
    assert parse(many).tables["worst-1"][1][0] == worst
    assert f"--only {worst}" in (many / "report.md").read_text(encoding="utf-8")
    alone = workbench.run(FEW, "--quick", "--only", worst, "--out", "one")
    assert alone.code == 0
    one = read_exact(workbench.directory / "one" / "summary.csv").set_index(["candidate", "joint"]).peak_error
    same = rows[rows.case == worst].set_index(["candidate", "joint"]).peak_error
    pd.testing.assert_series_equal(one[same.index], same, check_exact=True)
    other = rows[rows.case != worst].groupby("case").get_group(rows.case[rows.case != worst].iloc[0])
    assert not np.allclose(other.set_index(["candidate", "joint"]).peak_error[same.index], same, rtol=1e-6, atol=0)


def test_a_report_that_cannot_be_written_is_one_line_and_costs_no_result(
    workbench: Workbench, monkeypatch: pytest.MonkeyPatch
) -> None:
    (workbench.directory / "many").mkdir()
    with monkeypatch.context() as patched:
        patched.setattr("workbench.commands.sweeps.report_apart", lambda directory: None)
        assert workbench.run(FEW, "--out", "many").code == 0
    (workbench.directory / "many" / "figures").write_text("in the way")
    done = workbench.run(FEW, "--out", "many")
    assert done.code == 2
    assert len(done.complaint) == 1
    assert "the report cannot be written" in done.complaint[0]
    assert (workbench.directory / "many" / "summary").is_dir()
