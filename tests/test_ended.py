"""A run that is ended from outside: by a signal it tidies up; after a kill the next one does."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from small_campaign import SMALL, listing
from workbench.campaign.lock import locked
from workbench.scratch import LOCK, Scratch
from workbench.staging import EARLIER, recover, staged

pytestmark = [
    pytest.mark.skipif(not Path("/proc/self/cmdline").exists(), reason="looks for processes in /proc"),
    pytest.mark.usefixtures("warm_kernels"),
]

LONG = SMALL.replace("samples = 21", "samples = 12000")


@contextlib.contextmanager
def running(place: Path) -> Iterator[subprocess.Popen[str]]:
    """Start a run with pictures, and go on when it draws."""
    (place / "temporary").mkdir(exist_ok=True)
    command = [sys.executable, "-P", "-m", "workbench", "run", "small.toml", "--quick"]
    with subprocess.Popen(
        command, cwd=place, env={**os.environ, "TMPDIR": str(place / "temporary")}, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    ) as process:  # fmt: skip
        try:
            while not drawing(place) and process.poll() is None:
                time.sleep(0.02)
            yield process
        finally:
            process.kill()


def drawing(place: Path) -> list[str]:
    """Numbers of the processes that draw in the temporary directory of a run."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            if f"{place}/temporary".encode() in path.read_bytes():
                found.append(path.parent.name)
    return found


def gone(place: Path) -> bool:
    for _ in range(6000):
        if not drawing(place):
            return True
        time.sleep(0.02)
    return False


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_signal_ends_a_run_and_leaves_nothing(tmp_path: Path, name: str) -> None:
    (tmp_path / "small.toml").write_text(LONG)
    number = getattr(signal, name)
    with running(tmp_path) as process:
        process.send_signal(number)
        out, err = process.communicate(timeout=300)
    assert (process.returncode, out) == (128 + number, "")
    assert err.splitlines()[-1] == f"workbench: ended by {name}"
    assert gone(tmp_path)
    assert sorted(listing(tmp_path)) == ["small.toml", "temporary"]


def test_what_a_killed_run_left_the_next_one_removes(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(LONG)
    with running(tmp_path) as process:
        process.kill()
        process.communicate(timeout=300)
    assert gone(tmp_path), "the process that draws outlives its run"
    left = list(listing(tmp_path))
    assert any(".small.stage." in name for name in left)
    assert any(name.endswith(LOCK) for name in left)
    (tmp_path / "small.toml").write_text(SMALL)
    done = subprocess.run(
        [sys.executable, "-P", "-m", "workbench", "run", "small.toml", "--quick"], cwd=tmp_path, check=False,
        env={**os.environ, "TMPDIR": str(tmp_path / "temporary")}, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done
    assert [path.name for path in (tmp_path / "reports").iterdir()] == ["small"]
    assert list((tmp_path / "temporary").iterdir()) == []


def test_the_earlier_run_goes_back_after_a_kill_between_two_renames(tmp_path: Path) -> None:
    place = tmp_path / "run"
    with staged(place) as stage:
        (stage / "one").write_text("earlier")
    old = tmp_path / ".run.old.abcd1234"
    old.mkdir()
    place.rename(old / EARLIER)
    (tmp_path / ".run.stage.abcd1234").mkdir()
    mine = [
        tmp_path / name for name in (".run.stage", ".run.stage.my own", ".run.other.abcd1234", ".runs.stage.abcd1234")
    ]
    for path in mine:
        path.mkdir()
    with locked(place):
        recover(place)
    assert (place / "one").read_text() == "earlier"
    assert sorted(tmp_path.iterdir()) == sorted([place, *mine])


def test_a_scratch_directory_in_use_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "workbench_of_somebody").mkdir()
    (tmp_path / "workbench_dead").mkdir()
    (tmp_path / "workbench_dead" / LOCK).touch()
    one = Scratch()
    two = Scratch()
    assert one.path.exists()
    one.close()
    two.close()
    assert [path.name for path in tmp_path.iterdir()] == ["workbench_of_somebody"]
