"""Saving a file while a campaign is watched: the table comes again, an error is shown, and the watch goes on."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from own_mechanisms import CAMPAIGN, FOURBAR
from small_campaign import SMALL, Workbench, listing
from talking_process import TalkingProcess
from workbench.campaign.rerun import compute_errors, files_of, stamps
from workbench.errors import SpecError

MODELS = Path(__file__).resolve().parents[1] / "models"
ASYM = "models/asym_2rss_ppap.xml"
PATIENCE = 300.0
"""Seconds for one pass on a busy machine."""


class Watch(TalkingProcess):
    """A watch in a process of its own."""

    def __init__(self, directory: Path, *options: str) -> None:
        super().__init__("watch", *options, cwd=directory, patience=PATIENCE)
        self.directory = directory

    def shown(self) -> str:
        """What one pass shows."""
        lines = []
        while not lines or not lines[-1].startswith("watching "):
            lines.append(self.line())
        return "".join(lines)

    def until(self, expected: str) -> str:
        """What the first pass shows that holds the expected text: a pass may catch a save half-way, or come twice."""
        while expected not in (shown := self.shown()):
            pass
        return shown


def save(path: Path, text: str, by_renaming: bool = False) -> float:
    """Save as editors do: over the old file, or beside it and then moved."""
    place = path.with_name(f".{path.name}.swp") if by_renaming else path
    place.write_text(text, encoding="utf-8")
    if by_renaming:
        os.replace(place, path)
    return time.monotonic()


@pytest.fixture
def watched(tmp_path: Path) -> Iterator[Watch]:
    (tmp_path / "models").mkdir()
    (tmp_path / ASYM).write_text((MODELS / Path(ASYM).name).read_text())
    (tmp_path / "small.toml").write_text(SMALL)
    with Watch(tmp_path, "small.toml") as watch:
        yield watch


def test_a_session(watched: Watch) -> None:
    model, campaign = watched.directory / ASYM, watched.directory / "small.toml"
    text = model.read_text()
    before = listing(watched.directory)
    first = watched.shown()
    assert "12 within their bounds" in first
    assert "asym_2rss_ppap.xml" in first.splitlines()[-1]
    assert " = " not in first  # nothing to compare with

    save(model, text.replace('mass="0.45"', 'mass="0.9"'))
    shown = watched.until("m3: 0.45 -> 0.9\n")
    assert "12 within their bounds" in shown
    assert " ~ " in shown
    assert "x1." in shown or "/1." in shown or "/2." in shown

    save(model, text.replace('mass="0.45"', 'mass="0.9"').replace("0 0 0.15", "0.001 0 0.15", 1), by_renaming=True)
    shown = watched.until('inertial "rod_left" pos is 0.001; the closed form needs 0')
    assert len(shown.splitlines()) == 2

    save(campaign, SMALL + "\nfoo =")
    watched.until("small.toml: not valid TOML")
    save(campaign, SMALL.replace("bound = 1e-10", "bound = 1e-25"))
    save(model, text)
    assert "pass -> fail" in watched.until("beyond their bounds")

    save(campaign, SMALL, by_renaming=True)
    watched.until("12 within their bounds")
    watched.process.send_signal(signal.SIGINT)
    assert watched.rest().endswith("stopped\n")
    assert watched.process.returncode == 0
    assert listing(watched.directory) == before


def test_only_one_case_and_another_model(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(SMALL)
    (tmp_path / "own.xml").write_text((MODELS / Path(ASYM).name).read_text())
    options = "small.toml", "--only", "first", "--model", "own.xml", "--set", "a2*=1.01"
    with Watch(tmp_path, *options) as watch:
        shown = watch.shown()
        assert "6 within their bounds" in shown
        assert "own.xml" in shown.splitlines()[-1]
        save(tmp_path / "own.xml", (tmp_path / "own.xml").read_text().replace('pos="0 0 0.3"', 'pos="0 0 0.31"'))
        watch.until("a2_left: 0.303 -> 0.3131")


FORMULA = """import workbench
@workbench.candidate("mine", bound=1e-10)
def mine(p, q, qd, qdd):
    return 1.0 * (
        p.m1 * p.a1**2 / 3 * qdd)
"""


def test_a_formula_of_ones_own_is_run_again_when_it_is_saved(tmp_path: Path) -> None:
    (tmp_path / "fourbar.xml").write_text(FOURBAR)
    (tmp_path / "own.toml").write_text(CAMPAIGN)
    code = tmp_path / "mine.py"
    code.write_text(FORMULA)
    before = listing(tmp_path)
    with Watch(tmp_path, "own.toml", "--candidates", "mine.py") as watch:
        first = watch.shown()
        assert "1 beyond their bounds" in first
        assert "mine.py" in first.splitlines()[-1]
        save(code, FORMULA.replace("1.0 * (", "1.0 * "))
        watch.until("mine.py:5: unmatched ')'")
        save(code, FORMULA.replace("1.0 *", "9.0 *"))
        shown = watch.until("1 beyond their bounds")
        assert " x" in shown or " /" in shown
    assert set(listing(tmp_path)) == set(before)


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("nowhere.toml",), "nowhere.toml: no such campaign file"),
        (("small.toml", "--set", "a2"), '--set "a2": expected NAME=VALUE'),
        (("small.toml", "--factor", "0"), "factor 0; allowed"),
        (("small.toml", "--candidates", "absent.py"), "absent.py: no such Python file"),
        ((), "Missing argument 'CAMPAIGN'"),
    ],
)
def test_bad_input_is_one_line(workbench: Workbench, options: tuple[str, ...], expected: str) -> None:
    workbench.write(SMALL)
    done = workbench("watch", *options)
    assert done.code == 2
    assert expected in done.err
    assert len(done.complaint) == 1


def test_files_of_a_campaign(workbench: Workbench) -> None:
    workbench.write(SMALL)
    assert [file.name for file in files_of("small.toml")] == ["small.toml", "asym_2rss_ppap.xml"]
    own = workbench.directory / "own.xml"
    own.write_text("<mujoco/>")
    assert files_of("small.toml", own) == (Path("small.toml"), own)
    workbench.write("nonsense")
    assert files_of("small.toml") == (Path("small.toml"),)
    before = stamps(files_of("small.toml"))
    workbench.write("more nonsense")
    assert stamps(files_of("small.toml")) != before
    assert stamps([Path("gone")]) == {Path("gone"): None}
    with pytest.raises(SpecError, match="not valid TOML"):
        compute_errors("small.toml")


@pytest.mark.slow
def test_every_save_of_the_papers_model_is_followed(tmp_path: Path) -> None:
    """The 2010 paper's campaign, all its cases; how long it takes is measured, not tested."""
    campaign = MODELS.parent / "campaigns/almeida_2010.toml"
    (tmp_path / "models").mkdir()
    (tmp_path / "campaigns").mkdir()
    (tmp_path / "campaigns/almeida_2010.toml").write_text(campaign.read_text())
    model = tmp_path / ASYM
    text = (MODELS / Path(ASYM).name).read_text()
    model.write_text(text)
    with Watch(tmp_path, "campaigns/almeida_2010.toml") as watch:
        watch.shown()
        for mass in ("0.5", "0.6", "0.7"):
            save(model, text.replace('mass="0.45"', f'mass="{mass}"'))
            watch.until(f"-> {mass}\n")
