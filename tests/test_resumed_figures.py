"""A run that was killed and gone on with has the figures of one that nobody disturbed, byte for byte."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
from pathlib import Path

import pytest

from small_campaign import CANDIDATES, CASES, HEAD
from sweep_campaign import SWEEP

pytestmark = [pytest.mark.long, pytest.mark.usefixtures("warm_kernels")]

COMMAND = (sys.executable, "-P", "-m", "workbench", "run", "c.toml", "--quick", "--no-pictures")


def begin(place: Path, out: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen([*COMMAND, "--out", out], cwd=place, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def figures(directory: Path) -> dict[str, bytes]:
    found = {path.name: path.read_bytes() for path in sorted((directory / "figures").iterdir())}
    assert len(found) > 2
    return found


def kill_when(process: subprocess.Popen[bytes], marks: str, place: Path) -> None:
    """Kill a run as soon as something lies in its place that speaks of a finished case."""
    while process.poll() is None:
        with contextlib.suppress(FileNotFoundError):  # moved to its place in this moment
            if any(path.stat().st_size for path in place.glob(marks)):
                break
        time.sleep(0.01)
    process.kill()
    process.wait()


@pytest.mark.parametrize(
    ("campaign", "marks"),
    [
        (SWEEP.replace("samples = 40", "samples = 60"), "killed/journal.jsonl"),
        (HEAD + CANDIDATES + CASES, ".killed.stage.*/series"),
    ],
    ids=["sweep", "cases"],
)
def test_figures_after_a_kill(tmp_path: Path, campaign: str, marks: str) -> None:
    (tmp_path / "c.toml").write_text(campaign)
    assert begin(tmp_path, "calm").wait(600) == 0
    for _ in range(2):
        kill_when(begin(tmp_path, "killed"), marks, tmp_path)
    assert begin(tmp_path, "killed").wait(600) == 0
    assert figures(tmp_path / "killed") == figures(tmp_path / "calm")
    other = figures(tmp_path / "calm")
    (tmp_path / "c.toml").write_text(campaign.replace("0.75", "0.76"))
    assert begin(tmp_path, "other").wait(600) == 0
    assert figures(tmp_path / "other") != other
