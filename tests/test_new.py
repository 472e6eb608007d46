"""``workbench new``: what it writes runs at once, as it says; what it cannot do is one line."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import workbench as wb
from small_campaign import Workbench


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


@pytest.mark.parametrize("joints", [("crank",), ("left", "right")])
def test_what_it_writes_runs_at_once(workbench: Workbench, joints: tuple[str, ...]) -> None:
    workbench.gather_evidence()
    options = [part for joint in joints for part in ("--actuated", joint)]
    done = workbench("new", "mine", *options, "--loops", str(len(joints)))
    assert done.code == 0, done.err
    done = workbench("run", "mine/mine.toml", "--candidates", "mine/mine.py", "--out", "out")
    assert done.code == 4, done.err  # the sketch has no bound: nothing is judged
    run = wb.load_run("out")
    assert run.manifest.joints == joints
    assert run.manifest.cases["first"].mobility == len(joints)
    assert run.manifest.cases["first"].evidence.power_balance["distributed"].relative < 1e-8
    assert 0 < run.summary["peak_error"].max() < 10


def test_its_robot_has_parameters_and_stays_whole_when_one_is_set(workbench: Workbench) -> None:
    assert workbench("new", "mine", "--actuated", "left", "--actuated", "right").code == 0
    done = workbench("model", "set", "mine", "b=0.5", "--out", "mine/long.xml")
    assert done.code == 0, done.err
    changed = Path("mine/long.xml").read_text().splitlines()
    assert sum('fromto="0 0 0 0.5 0 0"' in line for line in changed) == 2
    assert sum('pos="0.25 0 0"' in line for line in changed) == 2
    for number, model in (("by_set", ()), ("by_file", ("--model", "mine/long.xml"))):
        change = model or ("--set", "b=0.5")
        command = ("run", "mine/mine.toml", "--candidates", "mine/mine.py", "--quick", "--out", number)
        done = workbench(*command, *change)
        assert done.code == 4, done.err
    by_set, by_file = (wb.load_run(name).series("first") for name in ("by_set", "by_file"))
    assert by_set.filter(like="ref_").equals(by_file.filter(like="ref_"))


RUNS = {"octave": "octave-cli", "c": "cc", "r": "Rscript", "program": "awk"}


@pytest.mark.parametrize("language", RUNS)
def test_a_beginning_in_another_language_gives_what_the_python_one_gives(workbench: Workbench, language: str) -> None:
    if shutil.which(RUNS[language]) is None:
        pytest.skip(f"{RUNS[language]} is not installed")
    done = workbench("new", "mine", "--actuated", "left", "--actuated", "right", "--language", language)
    assert done.code == 0, done.err
    (other,) = Path("mine").glob(f"mine_{language}*")
    done = workbench("run", "mine/mine.toml", "--candidates", "mine/mine.py", "--candidates", str(other), "--out", "o")
    assert done.code == 4, done.err  # no bound yet, so nothing is judged
    errors = wb.load_run("o").summary.pivot(index="joint", columns="candidate", values="peak_error")
    (name,) = [column for column in errors if column.startswith("mine") and column != "mine"]
    assert (errors[name] - errors["mine"]).abs().max() < 1e-12
    assert errors["mine"].min() > 1e-3


def test_the_test_that_it_writes_passes_and_can_fail(workbench: Workbench) -> None:
    assert workbench("new", "mine").code == 0
    # its bound, drawn to where a right formula belongs, does not hold for the sketch
    text = Path("mine/test_mine.py").read_text()
    assert text.count("< 10.0") == 1
    Path("mine/test_twin.py").write_text(text.replace("< 10.0", "< 1e-10"))
    done = pytest_in("mine")
    assert "1 failed, 1 passed" in done.stdout, done.stdout + done.stderr
    assert "FAILED test_twin.py" in done.stdout


def pytest_in(directory: str) -> subprocess.CompletedProcess[str]:
    """Run pytest as a user would, without this repository's settings."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-c", os.devnull, "--rootdir", "."]
    return subprocess.run(command, cwd=directory, capture_output=True, text=True)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("new", "a b"), 'DIR "a b"; allowed'),
        (("new", "mine", "--actuated", "1x"), '--actuated "1x"; allowed'),
        (("new", "mine", "--actuated", "elbow1"), "none called elbow1"),
        (("new", "mine", "--loops", "2"), "--loops 2 with 1 driven joint"),
        (("new", "full"), "full: exists and is not an empty directory"),
    ],
)
def test_a_request_that_cannot_be_met_is_one_line(
    workbench: Workbench, arguments: tuple[str, ...], message: str
) -> None:
    Path("full").mkdir()
    Path("full/file").touch()
    done = workbench(*arguments)
    assert done.code == 2
    assert message in done.err
    assert not Path("mine").exists()
