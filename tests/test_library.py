"""The library of robots: its record and page are about the robots there are, and its commands say so."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from typer.testing import CliRunner

import workbench as wb
from workbench.cli import app
from workbench.errors import OutputError, SpecError
from workbench.library.card import read_card
from workbench.library.copy import copy_folder
from workbench.library.page import page
from workbench.library.record import read_record, write_record
from workbench.library.shelf import entries, entry, robot_names

NAMES = robot_names()


def test_every_folder_with_a_robot_file_is_in_the_library(repository: Path) -> None:
    assert set(NAMES) == {path.parent.name for path in (repository / "examples").glob("*/robot.toml")}
    assert len(NAMES) >= 8


@pytest.mark.parametrize("name", NAMES)
def test_a_robot_is_whole(name: str) -> None:
    found = entry(name)
    assert found.campaign.is_file()
    assert found.readme.is_file()
    assert found.formulas
    assert found.robot.spec.name == name
    assert found.picture is not None
    assert found.picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize("name", NAMES)
def test_the_record_says_that_it_is_verified(name: str) -> None:
    figures, card = read_record().robots[name], entry(name).card
    assert figures.status == "passed"
    assert figures.error < figures.bound <= 1e-10
    assert figures.spread is not None
    assert figures.spread < 1e-10
    assert figures.power is not None
    assert figures.power < 1e-8
    assert figures.replay_verdict == "converges"
    assert figures.mobility == card.mobility.mobility
    assert figures.redundant == figures.rows - figures.rank
    assert (figures.workspace is not None) == card.workspace


def test_the_page_is_what_is_generated_now(repository: Path) -> None:
    written = (repository / "docs" / "library.md").read_text(encoding="utf-8")
    assert written == page(entries(), read_record()), "python benchmarks/library.py --page"
    assert set(read_record().robots) == set(NAMES)
    for target in re.findall(r"\]\((\.\./[^)]+)\)", written):
        assert (repository / "docs" / target).exists(), target


def test_the_record_reads_back_as_it_was_written(tmp_path: Path) -> None:
    record = read_record()
    write_record(record, tmp_path / "library.json")
    assert read_record(tmp_path / "library.json") == record
    assert read_record(tmp_path / "none.json").robots == {}


def test_the_list_names_all_and_one_shows_its_card() -> None:
    listed = CliRunner().invoke(app, ["robots"]).output
    assert all(re.search(rf"^\s+{name}\s", listed, re.MULTILINE) for name in NAMES)
    shown = CliRunner().invoke(app, ["robots", "rrr"]).output
    assert "3-R*RR" in shown
    assert "rrr.png" in shown.replace("\n", "").replace(" ", "")
    found = json.loads(CliRunner().invoke(app, ["robots", "--json"]).output)
    assert [one["name"] for one in found] == list(NAMES)
    assert found[0]["figures"]["mobility"] == found[0]["card"]["mobility_gogu"]


def test_an_unknown_robot_is_one_line() -> None:
    with pytest.raises(SpecError, match=r'no robot "rr" in the library.*"rrr"'):
        entry("rr")


def test_a_copy_is_the_folder_and_replaces_nothing(tmp_path: Path) -> None:
    copy_folder(entry("rrr"), tmp_path / "mine")
    assert (tmp_path / "mine" / "rrr.toml").is_file()
    with pytest.raises(OutputError, match="exists already"):
        copy_folder(entry("rrr"), tmp_path / "mine")
    assert CliRunner().invoke(app, ["robots", "--copy", str(tmp_path / "other")]).exception is not None


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        ("topology", "topologie", 'topologie: unknown key.*"topology"'),
        ("joints = 9", "joints = 3", "mobility: -3 freedoms"),
        ('kind = "planar"', 'kind = "flat"', "kind = 'flat'"),
    ],
)
def test_a_wrong_card_is_one_line(tmp_path: Path, right: str, wrong: str, message: str) -> None:
    shutil.copytree(entry("rrr").folder, tmp_path / "rrr")
    path = tmp_path / "rrr" / "card.toml"
    path.write_text(path.read_text(encoding="utf-8").replace(right, wrong, 1), encoding="utf-8")
    with pytest.raises(SpecError, match=message) as caught:
        read_card(tmp_path / "rrr")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("beside", [["campaign.toml"], ["--set", "m1=1"], ["--only", "sines"], ["--dry-run"]])
def test_robots_run_their_own_campaign_and_nothing_beside_it(beside: list[str]) -> None:
    error = CliRunner().invoke(app, ["run", "--robots", "rrr", *beside]).exception
    assert isinstance(error, SpecError)
    assert "its own campaign" in str(error) or "own campaign as it is" in str(error)


def test_a_robot_of_the_library_runs_by_its_name(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["run", "--robots", "fourbar", "--quick", "--no-pictures", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert "1 of 1 robots hold every bound" in done.output
    assert (tmp_path / "fourbar" / "report.html").is_file()


def test_a_broken_formula_of_the_library_is_exit_code_1(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(entry("fourbar").folder, tmp_path / "examples" / "fourbar")
    code = tmp_path / "examples" / "fourbar" / "fourbar.py"
    code.write_text(code.read_text().replace("tau[:, None]", "1.000001 * tau[:, None]"))
    monkeypatch.setattr("workbench.library.shelf.bundled_directory", lambda kind: tmp_path / "examples")
    monkeypatch.setattr("workbench.library.shelf.bundled_names", lambda kind: ("fourbar/robot.toml",))
    arguments = ["run", "--robots", "all", "--quick", "--no-pictures", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 1, done.output
    assert "0 of 1 robots" in done.output
    (tmp_path / "examples" / "fourbar" / "fourbar.toml").write_text("format = 2\n")
    assert CliRunner().invoke(app, arguments).exit_code == 2


@pytest.mark.slow
def test_a_wheel_carries_the_library(repository: Path, tmp_path: Path) -> None:
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", tmp_path], cwd=repository, check=True
    )
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
    code = "from workbench.__main__ import main; main()"
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "site"), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code, "robots", "--json"], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert [one["name"] for one in found] == list(NAMES)
    library = tmp_path / "site" / "workbench" / "data" / "examples"
    assert all(Path(one["picture"]).is_relative_to(library) and Path(one["picture"]).is_file() for one in found)
    assert all(one["figures"]["status"] == "passed" for one in found)


def test_positions_of_a_series_are_named_as_positions() -> None:
    """x1 to x3 are x, y, z whatever the task coordinates are: a planar robot's z is not its ry."""
    for name in ("rrr", "rps", "stewart", "delta"):
        assert wb.load_robot(entry(name).folder).position_axes == ("x", "y", "z")
    assert wb.load_robot("asym_2rss_ppap").position_axes == ("x1", "x2", "x3")


def test_a_robot_with_six_freedoms_has_a_report(tmp_path: Path) -> None:
    arguments = ["run", "--robots", "stewart", "--quick", "--no-pictures", "--out", str(tmp_path)]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    manifest = json.loads((tmp_path / "stewart" / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["platform_axes"] == ["x", "y", "z"]
    assert (tmp_path / "stewart" / "report.html").is_file()
