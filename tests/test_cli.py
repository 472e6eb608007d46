"""The command line from outside: exit codes, one line for every failure, nothing half-written, interruption."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import workbench as wb
from small_campaign import SMALL, Workbench, listing
from workbench import cli

pytestmark = pytest.mark.usefixtures("warm_kernels")


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


def process(directory: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "workbench.cli", *arguments],
        cwd=directory, capture_output=True, text=True, timeout=300, check=False, env={**os.environ, **environment},
    )  # fmt: skip


# --- in a process of its own ---


def said(done: subprocess.CompletedProcess[str]) -> list[str]:
    """Lines on stderr without the one of a new installation, that kernels are being compiled."""
    return [line for line in done.stderr.splitlines() if not line.startswith("workbench: compiling ")]


def test_a_run_from_outside(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(SMALL)
    done = process(tmp_path, "run", "small.toml", "--only", "first")
    assert done.returncode == 0, done
    assert "PASSED: all 6 checks in 1 case hold their bounds" in done.stdout
    assert done.stdout.rstrip().endswith("Report: reports/small/report.html")
    assert said(done) == ["[1/1] first"]
    assert {path.name for path in (tmp_path / "reports/small").iterdir()} >= {
        "manifest.json", "summary.csv", "series", "report.html", "report.md", "figures",
    }  # fmt: skip
    assert sorted(path.name for path in tmp_path.iterdir()) == ["reports", "small.toml"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (None, "workbench: small.toml: no such campaign file; those that come along: "),
        (SMALL.replace("0.06, 4.0", "0.6, 4.0", 1), 'case "first": t = 0.05 s, joint q1: |q1| exceeds the rod length'),
    ],
    ids=["missing", "out of the workspace"],
)
def test_bad_input_from_outside(tmp_path: Path, text: str | None, expected: str) -> None:
    if text is not None:
        (tmp_path / "small.toml").write_text(text)
    before = listing(tmp_path)
    done = process(tmp_path, "run", "small.toml")
    assert done.returncode == 2
    assert done.stdout == ""
    (line,) = said(done)
    assert expected in line
    assert listing(tmp_path) == before


WAITS = """
import pathlib, time, workbench

@workbench.candidate("waits", reference="distributed")
def waits(parameters, q, qd, qdd):
    pathlib.Path("waiting").touch()
    time.sleep(50)
    return q
"""


def test_ctrl_c_leaves_the_earlier_run_and_nothing_else(workbench: Workbench) -> None:
    assert workbench.run(SMALL).code == 0
    workbench.write(WAITS, "waits.py")
    before = listing(workbench.directory)
    running = subprocess.Popen(
        [sys.executable, "-m", "workbench.cli", "run", "small.toml", "--candidates", "waits.py"],
        cwd=workbench.directory, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while running.poll() is None and not (workbench.directory / "waiting").exists():
        time.sleep(0.02)
    (workbench.directory / "waiting").unlink()
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=300)
    assert running.returncode == 130
    assert (out, err.splitlines()[-1]) == ("", "workbench: interrupted")
    assert "Traceback" not in err
    assert listing(workbench.directory) == before


# --- usage ---


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["run"], "which CAMPAIGN? A TOML file, or one that comes along: almeida_2010"),
        (["run", "a.toml", "b.toml"], "(b.toml)"),
        (["run", "small.toml", "--bogus"], "--bogus"),
        (["run", "small.toml", "--out"], "Option '--out' requires an argument."),
        (["run", "a\0b.toml"], "null byte"),
        (["rum"], "No such command 'rum'."),
        (["--bogus"], "--bogus"),
    ],
    ids=lambda value: " ".join(value).replace("\0", "0") if isinstance(value, list) else "",
)
def test_wrong_usage_is_one_line(workbench: Workbench, arguments: list[str], expected: str) -> None:
    done = workbench(*arguments)
    assert done.code == 2
    assert len(done.complaint) == 1
    assert done.err.startswith("workbench: ")
    assert expected in done.err
    assert done.out == ""


@pytest.mark.parametrize("arguments", [[], ["--help"]])
def test_help(workbench: Workbench, arguments: list[str]) -> None:
    done = workbench(*arguments)
    assert done.code == 0
    assert "run" in done.out
    assert "Validate closed-form dynamics" in done.out


def test_help_of_run_names_every_option_and_exit_code(workbench: Workbench) -> None:
    done = workbench("run", "--help")
    assert done.code == 0
    for word in ("CAMPAIGN", "--out", "--only", "--set", "--model", "Exit code"):
        assert word in done.out


def test_version(workbench: Workbench) -> None:
    done = workbench("--version")
    assert (done.code, done.out.strip()) == (0, f"workbench {wb.__version__}")


# --- settings ---


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        (["m2"], '--set "m2": expected NAME=VALUE'),
        (["m2="], '--set "m2=": expected NAME=VALUE'),
        (["=3"], '--set "=3": expected NAME=VALUE'),
        (["m2=heavy"], '--set "m2=heavy": expected NAME=VALUE'),
        (["m2=1=2"], '--set "m2=1=2": expected NAME=VALUE'),
        ([""], '--set "": expected NAME=VALUE'),
        (["m2=0.3", "m2=0.4"], "--set m2 is given twice"),
        (["m2=-1"], "parameter m2_left = -1 kg; allowed: > 0"),
        (["m2=nan"], "parameter m2_left = nan kg"),
        (["a2=inf"], "parameter a2_left = inf m"),
        (["paylod=1"], 'unknown parameter "paylod"; did you mean "payload"?'),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_malformed_settings(workbench: Workbench, settings: list[str], expected: str) -> None:
    workbench.write(SMALL)
    before = listing(workbench.directory)
    done = workbench("run", "small.toml", *(word for text in settings for word in ("--set", text)))
    assert done.code == 2
    assert expected in done.err
    assert len(done.complaint) == 1
    assert listing(workbench.directory) == before


def test_unknown_case(workbench: Workbench) -> None:
    done = workbench.run(SMALL, "--only", "frist")
    assert (done.code, done.err) == (2, 'workbench: small.toml: no case "frist"; did you mean "first"?\n')


# --- faults of the workbench itself ---


def fault(*_: object, **__: object) -> None:
    raise ZeroDivisionError("planted\nin two lines")


def test_a_fault_is_one_line_and_no_failed_bound(workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("workbench.campaign.run.resolve_cases", fault)
    done = workbench.run(SMALL)
    assert done.code == cli.INTERNAL
    assert done.complaint == [
        "workbench: internal error, ZeroDivisionError: planted in two lines; WORKBENCH_TRACEBACK=1 shows where"
    ]


def test_a_fault_shows_its_traceback_when_asked(workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("workbench.campaign.run.resolve_cases", fault)
    monkeypatch.setenv("WORKBENCH_TRACEBACK", "1")
    workbench.write(SMALL)
    monkeypatch.setattr(sys, "argv", ["workbench", "run", "small.toml"])
    with pytest.raises(ZeroDivisionError, match="planted"):
        cli.main()


def test_out_of_memory_is_one_line(workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    def exhausted(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr("workbench.campaign.run.compute_case", exhausted)
    before = [workbench.write(SMALL)]
    done = workbench("run", "small.toml")
    assert (done.code, done.complaint) == (2, ["workbench: out of memory; fewer samples need less"])
    assert os.listdir(workbench.directory) == before


def test_a_message_keeps_its_beginning_and_its_end(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli._complain(f"file.toml: {'many words ' * 5000}; name another", 2) == 2
    line = capsys.readouterr().err
    assert line.startswith("workbench: file.toml: many words")
    assert line.endswith("; name another\n")
    assert len(line) < 1500
