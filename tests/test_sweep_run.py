"""A sweep run, stopped, gone on with, disturbed: the same files in the end, and one line where it cannot go on."""

from __future__ import annotations

import errno
import io
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import workbench as wb
from exact_csv import read_exact
from small_campaign import SMALL, Workbench, listing
from sweep_campaign import SWEEP
from workbench.campaign.lock import holder, lock_path, locked
from workbench.errors import OutputError
from workbench.sweep import files, identity
from workbench.sweep import run as sweep_run
from workbench.sweep.evaluate import Context
from workbench.sweep.journal import Journal
from workbench.sweep.record import Record, lost, parse_line
from workbench.sweep.run import SweepOptions

FEW = SWEEP.replace("samples = 40", "samples = 10")
RESULTS = ("cases", "summary", "series", "sweep.json")


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


class Inline:
    """A pool that computes in this process: for tests of everything but the workers."""

    after: int | None = None
    """number of cases after which somebody presses Ctrl-C"""

    def __init__(self, context: Context, options: SweepOptions, tasks: int) -> None:
        self._compute = context.setup()

    def run(self, tasks: Iterator[tuple[int, Any]]) -> Iterator[tuple[int, Any]]:
        for count, (index, task) in enumerate(tasks):
            if count == self.after:
                raise KeyboardInterrupt
            yield index, self._compute(task)

    def close(self) -> None:
        pass


@pytest.fixture
def inline(monkeypatch: pytest.MonkeyPatch) -> type[Inline]:
    monkeypatch.setattr(Inline, "after", None)
    monkeypatch.setattr(sweep_run, "make_pool", Inline)
    return Inline


def results(directory: Path) -> dict[str, bytes | None]:
    found = {k: v for k, v in listing(directory).items() if k.split(os.sep)[0] in RESULTS}
    assert {"sweep.json", "cases/part-00000.parquet", "summary/part-00000.parquet"} <= found.keys()
    return found


def manifest(directory: Path) -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((directory / "manifest.json").read_text(encoding="utf-8"))
    return loaded


@pytest.fixture
def calm(workbench: Workbench, inline: type[Inline]) -> Path:
    """A run that nobody disturbed."""
    done = workbench.run(FEW, "--out", "calm")
    assert done.code == 0, done
    return workbench.directory / "calm"


# --- what stands in the files ---


def test_the_files_of_a_sweep(calm: Path) -> None:
    assert sorted(p.name for p in calm.iterdir()) == ["cases", "manifest.json", "state.json", "summary", "sweep.json"]
    cases, rows = pd.read_parquet(calm / "cases"), pd.read_parquet(calm / "summary")
    assert cases["index"].tolist() == list(range(10))
    assert cases["case"].tolist() == [f"variant-{i:06d}" for i in range(10)]
    counts = cases.status.value_counts().to_dict()
    assert counts.keys() == {"passed", "filtered"}
    assert (cases.reason[cases.status == "filtered"].str.contains("cannot meet")).all()
    summary, record = json.loads((calm / "sweep.json").read_text()), manifest(calm)
    assert {k: v for k, v in summary["counts"].items() if v} == counts
    assert record["sweep"]["counts"] == summary["counts"]
    assert len(rows) == 6 * counts["passed"]
    assert rows["index"].is_monotonic_increasing
    assert sum(reason["cases"] for reason in summary["reasons"]) == counts["filtered"]


def test_numbers_are_those_of_the_python_interface(calm: Path) -> None:
    cases, rows = pd.read_parquet(calm / "cases"), pd.read_parquet(calm / "summary")
    one = cases[cases.status == "passed"].iloc[0]
    a2 = wb.load_mechanism("models/asym_2rss_ppap.xml").parameters.a2 * one["parameters.a2"]
    changes = {"a2_left": a2, "a2_right": a2, "payload": one["parameters.payload"]}
    t = np.linspace(0.0, 1.0, 11) / one["speed"]
    rate = np.array([5.0, 10.0, 15.0]) * one["speed"]
    offset, amplitude, phase = np.array([0.0, 0.75, 0.8]), np.array([0.08, 0.22, 0.2]), np.array([0.0, 0.0, 1.0])
    angle = np.outer(t, rate) + phase
    motion = offset + amplitude * np.sin(angle), amplitude * rate * np.cos(angle), -amplitude * rate**2 * np.sin(angle)
    tau = wb.load_mechanism("models/asym_2rss_ppap.xml", **changes).inverse_dynamics(*motion, "lumped")
    ref = wb.MujocoReference("models/asym_2rss_ppap.xml", **changes).inverse_dynamics(*motion).tau
    expected = np.abs(tau - ref).max(axis=0) / np.abs(ref).max(axis=0)
    found = rows[(rows["index"] == one["index"]) & (rows.candidate == "lumped")].peak_error
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert (expected > 1e-4).all()


def test_statistics_are_those_of_the_rows(calm: Path) -> None:
    rows, summary = pd.read_parquet(calm / "summary"), json.loads((calm / "sweep.json").read_text())
    lumped = rows[rows.candidate == "lumped"]
    worst = lumped.groupby("case").peak_error.max()
    entry = next(e for e in summary["errors"] if (e["candidate"], e["joint"]) == ("lumped", "any"))
    assert entry["max"] == worst.max()
    assert entry["worst_case"] == worst.idxmax()
    assert entry["quantiles"]["0.5"] == pytest.approx(worst.median())
    assert entry["below"]["0.02"] == (worst < 0.02).mean()
    assert summary["worst"][0]["case"] == worst.idxmax()
    cases = pd.read_parquet(calm / "cases").set_index("case")
    ranks = cases.loc[worst.index, "speed"].rank().corr(worst.rank())
    driver = next(d for d in summary["drivers"] if d["key"] == "speed")
    assert driver["rank_correlation"] == pytest.approx(ranks)
    assert sum(b["cases"] for b in summary["bins"] if b["key"] == "speed") == len(worst)


def test_every_key_is_documented(calm: Path, repository: Path) -> None:
    from workbench.campaign import sweep_spec as spec

    text = (repository / "docs" / "sweeps.md").read_text(encoding="utf-8")
    summary = json.loads((calm / "sweep.json").read_text())
    keys = {key for model in (spec.SweepSpec, spec.Vary, spec.Filter) for key in model.model_fields}
    keys |= {*summary, *summary["keys"][0], *summary["errors"][0], *summary["drivers"][0], *summary["bins"][0]}
    keys |= {*summary["worst"][0], *summary["reasons"][0], *(c for c, _ in files.CASE_COLUMNS)}
    assert sorted(key for key in keys - {"candidate", "reference"} if f"`{key}`" not in text) == []


def test_time_series_are_kept_where_asked(workbench: Workbench, inline: type[Inline]) -> None:
    text = FEW.replace("[sweep]", '[sweep]\nkeep_series = "all"').replace("samples = 10", "samples = 4")
    assert workbench.run(text, "--out", "run").code == 0
    run = workbench.directory / "run"
    cases = pd.read_parquet(run / "cases")
    kept = cases[cases.series != ""]
    assert set(kept.status) == {"passed"}
    assert sorted(p.stem for p in (run / "series").iterdir()) == kept["case"].tolist()
    frame = pd.read_parquet(run / "series" / f"{kept['case'].iloc[0]}.parquet")
    assert len(frame) == 11
    assert {"t", "q1", "ref_distributed_q1", "cand_lumped_q3"} <= set(frame.columns)
    # a torn one is computed again
    before = results(run)
    torn = run / "series" / f"{kept['case'].iloc[0]}.parquet"
    torn.write_bytes(torn.read_bytes()[:100])
    assert workbench("run", "small.toml", "--out", "run").code == 0
    assert results(run) == before
    assert manifest(run)["computed"] == 1


# --- stopping and going on ---


def test_interrupted_and_gone_on_with(workbench: Workbench, calm: Path, inline: type[Inline]) -> None:
    before = listing(workbench.directory)
    for computed in (4, 3):
        inline.after = computed
        done = workbench("run", "small.toml", "--out", "run")
        assert done.code == 130
    run = workbench.directory / "run"
    kept = "7 of 10 cases are finished and kept in run; the same command goes on with the rest"
    assert done.complaint[-2:] == [f"workbench: {kept}", "workbench: interrupted"]
    assert not (run / "manifest.json").exists()
    assert "run (sweep): stopped" in workbench("status", "run").out
    assert "7 of 10 cases finished" in workbench("status", "run").out
    inline.after = None
    assert workbench("run", "small.toml", "--out", "run").code == 0
    assert manifest(run)["computed"] == 3
    assert results(run) == results(calm)
    assert "run (sweep): finished" in workbench("status", "run").out
    after = listing(workbench.directory)
    assert {k: v for k, v in after.items() if not k.startswith("run")} == before  # no lock, nothing beside


def test_a_finished_run_computes_nothing_more(workbench: Workbench, calm: Path) -> None:
    before = results(calm)
    assert workbench("run", "small.toml", "--out", "calm").code == 0
    assert manifest(calm)["computed"] == 0
    assert results(calm) == before


def test_only_what_changed_is_computed_again(workbench: Workbench, calm: Path) -> None:
    # more Sobol points begin with the same
    assert workbench.run(FEW.replace("samples = 10", "samples = 12"), "--out", "calm").code == 0
    assert manifest(calm)["computed"] == 2
    assert workbench.run(FEW, "--out", "calm").code == 0
    assert manifest(calm)["computed"] == 0
    # texts determine no number, a bound does
    printed = FEW.replace("bound = 1e-9", "bound = 1e-9\nprinted_cost = { us = 6.2 }")
    assert workbench.run(printed, "--out", "calm").code == 0
    assert manifest(calm)["computed"] == 0
    assert workbench.run(FEW.replace("A small campaign", "Another title"), "--out", "calm").code == 0
    assert (manifest(calm)["computed"], manifest(calm)["title"]) == (0, "Another title")
    assert workbench.run(FEW.replace("1e-9", "2e-9"), "--out", "calm").code == 0
    assert manifest(calm)["computed"] == 10
    # another robot takes the place of a finished sweep when asked, and not before
    before = listing(calm)
    refused = workbench.run(FEW, "--out", "calm", "--set", "m3=1.5")
    assert refused.code == 2
    assert "--replace" in refused.complaint[0]
    assert listing(calm) == before
    assert workbench.run(FEW, "--out", "calm", "--set", "m3=1.5", "--replace").code == 0
    assert manifest(calm)["computed"] == 10
    assert not list(calm.parent.glob(".calm.before"))


def test_the_earlier_sweep_stands_until_the_one_in_its_place_is_finished(
    workbench: Workbench, calm: Path, inline: type[Inline], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = listing(calm)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("workbench.sweep.files.write_parts", full)
        assert workbench.run(FEW, "--out", "calm", "--set", "m3=1.5", "--replace").code == 2
    assert listing(calm.parent / ".calm.before") == before
    # the same command goes on, and then the earlier one goes
    assert workbench.run(FEW, "--out", "calm", "--set", "m3=1.5", "--replace").code == 0
    assert not (calm.parent / ".calm.before").exists()


def test_a_model_saved_while_the_sweep_runs(
    workbench: Workbench, calm: Path, inline: type[Inline], monkeypatch: pytest.MonkeyPatch, repository: Path
) -> None:
    model = workbench.directory / "robot.xml"
    text = (repository / "models" / "asym_2rss_ppap.xml").read_text(encoding="utf-8")
    model.write_text(text, encoding="utf-8")
    command = ("run", "small.toml", "--out", "run", "--model", "robot.xml")

    class Edited(inline):  # type: ignore[misc, valid-type]
        def run(self, tasks: Iterator[tuple[int, Any]]) -> Iterator[tuple[int, Any]]:
            for count, (index, task) in enumerate(tasks):
                if count == 3:
                    os.utime(model, (0, 0))  # saved, but the same
                if count == 5:
                    model.write_text(text.replace('mass="0.45"', 'mass="0.46"'), encoding="utf-8")
                yield index, self._compute(task)

    monkeypatch.setattr(sweep_run, "make_pool", Edited)
    done = workbench(*command)
    assert done.code == 2
    assert done.complaint == [
        "workbench: robot.xml: was changed while the sweep ran; 5 of 10 cases, of the file as it was, are kept in run;"
        " the same command goes on with them if the file is put back, and else starts anew"
    ]
    monkeypatch.setattr(sweep_run, "make_pool", inline)
    model.write_text(text, encoding="utf-8")
    assert workbench(*command).code == 0
    assert manifest(workbench.directory / "run")["computed"] == 5
    assert (
        results(workbench.directory / "run")["summary/part-00000.parquet"]
        == (results(calm)["summary/part-00000.parquet"])
    )


def test_nothing_but_cases_left_out_proves_nothing(workbench: Workbench, inline: type[Inline]) -> None:
    nothing = FEW.replace("offset = [0.0,", "offset = [0.5,")
    done = workbench.run(nothing, "--out", "run")
    assert done.code == 4
    assert "NOTHING JUDGED: all 10 cases were left out by the filter" in done.out
    assert manifest(workbench.directory / "run")["status"] == "nothing-judged"


def test_fresh_starts_over(workbench: Workbench, calm: Path) -> None:
    before = results(calm)
    assert workbench("run", "small.toml", "--out", "calm", "--fresh").code == 0
    assert manifest(calm)["computed"] == 10
    assert results(calm) == before


@pytest.mark.parametrize("what", ["numpy", "code"])
def test_other_versions_are_refused(
    workbench: Workbench, calm: Path, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    before = listing(calm)
    other = {**identity.versions(), what: "9.9.9"}
    monkeypatch.setattr("workbench.sweep.resumable.versions", lambda: other)
    done = workbench("run", "small.toml", "--out", "calm")
    assert done.code == 2
    assert len(done.complaint) == 1
    assert f"this is {what} 9.9.9; results of different versions are never mixed: --fresh" in done.complaint[0]
    assert listing(calm) == before
    assert workbench("run", "small.toml", "--out", "calm", "--fresh").code == 0


def test_a_directory_of_something_else_is_refused(workbench: Workbench, inline: type[Inline]) -> None:
    mine = workbench.directory / "mine"
    mine.mkdir()
    (mine / "thesis.txt").write_text("years of work")
    done = workbench.run(FEW, "--out", "mine", "--fresh")
    assert done.code == 2
    assert "holds files that are no run of the workbench" in done.complaint[0]
    assert (mine / "thesis.txt").read_text() == "years of work"


# --- torn files ---


@pytest.mark.parametrize("stopped", [False, True])
def test_torn_files_cost_no_more_than_their_cases(
    workbench: Workbench, calm: Path, inline: type[Inline], stopped: bool
) -> None:
    chance = random.Random(2010)
    run = workbench.directory / "run"
    for _ in range(6):
        inline.after = 6 if stopped else None
        workbench("run", "small.toml", "--out", "run", "--fresh")
        victims = [path for path in sorted(run.rglob("*")) if path.is_file()]
        for victim in chance.sample(victims, 2):
            os.truncate(victim, chance.randrange(victim.stat().st_size))
        inline.after = None
        done = workbench("run", "small.toml", "--out", "run")
        assert done.code == 0, (victims, done)
        assert results(run) == results(calm)


def test_an_altered_line_of_the_journal_is_not_believed(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    records = [Record(i, "k", "passed", "", [{"peak_error": 0.1 + i}], {"condition": 2.0}) for i in range(3)]
    with Journal(path, 3) as journal:
        for record in reversed(records):
            journal.append(record)
    assert [parse_line(line) for line in path.read_bytes().splitlines(keepends=True)] == records[::-1]
    content = path.read_bytes()
    for position in (4, len(content) // 2, len(content) - 30):
        altered = bytearray(content)
        altered[position] ^= 1
        path.write_bytes(altered)
        with Journal(path, 3) as journal:
            assert len(list(journal.missing())) == 1
            assert all(journal.read(i) == records[i] for i in range(3) if i in journal)
    # the last record of a case counts; a torn end goes before anything is added
    path.write_bytes(content[:-10])
    with Journal(path, 3) as journal:
        assert list(journal.missing()) == [0]
        journal.append(lost(0, "k", "killed", "x"))
        journal.append(records[0])
    with Journal(path, 3) as journal:
        assert [journal.read(i) for i in range(3)] == records


# --- locks ---


def test_two_runs_at_once(workbench: Workbench, inline: type[Inline]) -> None:
    workbench.write(FEW)
    workbench.write(SMALL, "plain.toml")
    with locked(workbench.directory / "run"):
        for name in ("small.toml", "plain.toml"):
            done = workbench("run", name, "--out", "run")
            assert done.code == 2
            busy = f"run: another run (process {os.getpid()}) is writing it; wait for its end or name another place"
            assert done.complaint == [f"workbench: {busy}"]
        assert holder(workbench.directory / "run") == os.getpid()
        assert not (workbench.directory / "run").exists()
    assert holder(workbench.directory / "run") is None
    assert workbench("run", "small.toml", "--out", "run").code == 0


def test_the_lock_of_a_dead_run_holds_nobody_off(workbench: Workbench, inline: type[Inline]) -> None:
    run = workbench.directory / "run"
    code = (
        "import time\nfrom pathlib import Path\nfrom workbench.campaign.lock import locked\n"
        f"with locked(Path({str(run)!r})):\n    print('held', flush=True)\n    time.sleep(600)"
    )
    path = os.pathsep.join(p for p in sys.path if p)
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, env=os.environ | {"PYTHONPATH": path}, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    with pytest.raises(OutputError, match=f"process {process.pid}"), locked(run):
        pass
    process.kill()
    process.wait()
    process.stdout.close()
    assert lock_path(run).exists()
    # neither a living process with the number in it, nor a time in the future, makes it a held one
    lock_path(run).write_text(f"{os.getpid()}\n")
    os.utime(lock_path(run), (time.time() + 1e6, time.time() + 1e6))
    assert workbench.run(FEW, "--out", "run").code == 0
    assert not lock_path(run).exists()


# --- disks and clocks ---


def test_a_full_disk(workbench: Workbench, calm: Path, inline: type[Inline], monkeypatch: pytest.MonkeyPatch) -> None:
    room = [9000]

    class Full(io.FileIO):
        def write(self, data: Any) -> int:
            if room[0] <= 0:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            written = super().write(data[: room[0]])
            room[0] -= written
            return written

    fdopen = os.fdopen
    monkeypatch.setattr(os, "fdopen", lambda descriptor, mode, buffering=-1: Full(descriptor, mode))
    done = workbench("run", "small.toml", "--out", "run")
    assert done.code == 2
    assert len(done.complaint) == 1
    assert "No space left on device; " in done.complaint[0]
    assert "of 10 cases were finished before and are kept" in done.complaint[0]
    monkeypatch.setattr(os, "fdopen", fdopen)
    kept = int(done.complaint[0].split("; ")[1].split(" of")[0])
    assert 0 < kept < 10
    assert workbench("run", "small.toml", "--out", "run").code == 0
    assert manifest(workbench.directory / "run")["computed"] == 10 - kept
    assert results(workbench.directory / "run") == results(calm)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    place = tmp_path / "disk"
    place.mkdir()
    if os.name != "posix" or os.geteuid() != 0:
        pytest.skip("mounting needs root")
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=24k", "none", str(place)], capture_output=True).returncode:
        pytest.skip("mounting is not allowed here")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def test_a_small_disk_and_a_read_only_one(
    workbench: Workbench, calm: Path, inline: type[Inline], small_disk: Path
) -> None:
    out = os.fspath(small_disk / "run")
    done = workbench("run", "small.toml", "--out", out)
    assert done.code == 2
    assert len(done.complaint) == 1
    assert "No space left on device" in done.complaint[0]
    kept = int(workbench("status", out).out.splitlines()[1].split(" of")[0])
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    done = workbench("run", "small.toml", "--out", out)
    assert done.code == 2
    assert len(done.complaint) == 1
    assert "cannot be written" in done.complaint[0] or "Read-only" in done.complaint[0]
    subprocess.run(["mount", "-o", "remount,rw,size=10m", str(small_disk)], check=True)
    assert workbench("run", "small.toml", "--out", out).code == 0
    assert manifest(Path(out))["computed"] == 10 - kept
    assert results(Path(out)) == results(calm)


def test_a_clock_that_is_set_back(
    workbench: Workbench, calm: Path, inline: type[Inline], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [1e9]

    def backwards() -> float:
        now[0] -= 3600.0
        return now[0]

    inline.after = 4
    assert workbench("run", "small.toml", "--out", "run").code == 130
    for path in (workbench.directory / "run").rglob("*"):
        os.utime(path, (4e9, 4e9))
    inline.after = None
    monkeypatch.setattr(time, "time", backwards)
    assert workbench("run", "small.toml", "--out", "run").code == 0
    assert results(workbench.directory / "run") == results(calm)


def test_status_of_what_is_no_run(workbench: Workbench) -> None:
    done = workbench("status", "nowhere")
    assert (done.code, done.complaint) == (2, ["workbench: nowhere: holds no run of the workbench"])


def test_status_of_a_campaign_without_sweep(workbench: Workbench) -> None:
    workbench.run(SMALL, "--quick")
    assert "reports/small (small): finished" in workbench("status", "reports/small").out
    assert "2 of 2 cases finished" in workbench("status", "reports/small").out


# --- real processes ---


def start(name: str, out: str, *options: str) -> subprocess.Popen[bytes]:
    path = os.pathsep.join(p for p in sys.path if p)
    return subprocess.Popen(
        [sys.executable, "-m", "workbench.cli", "run", name, "--out", out, *options],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=os.environ | {"PYTHONPATH": path},
    )  # fmt: skip


@pytest.mark.slow
def test_the_runner_killed_at_twenty_random_moments(workbench: Workbench) -> None:
    chance = random.Random(5)
    # enough that even a fast machine is killed while it computes, time and again
    name = workbench.write(SWEEP.replace("samples = 40", "samples = 1500"))
    assert workbench("run", name, "--out", "calm", "--jobs", "2").code == 0
    kills = 0
    for _ in range(200):
        if kills == 20:
            break
        process = start(name, "run", "--jobs", str(chance.choice([1, 2, 4])), *(["--fresh"] if kills == 0 else []))
        try:
            process.communicate(timeout=chance.uniform(0.3, 6.0))
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
            process.communicate()
            kills += 1
        else:
            assert process.returncode == 0
            # finished before its time: the next one is killed while it reads all of it back
    assert kills == 20
    done = workbench("run", name, "--out", "run", "--jobs", "4")
    assert done.code == 0, done
    assert results(workbench.directory / "run") == results(workbench.directory / "calm")


@pytest.mark.slow
def test_ctrl_c_on_real_workers(workbench: Workbench) -> None:
    name = workbench.write(SWEEP.replace("samples = 40", "samples = 5000"))
    process = start(name, "run", "--jobs", "2")
    journal = workbench.directory / "run" / "journal.jsonl"
    deadline = time.monotonic() + 300
    while (
        process.poll() is None
        and (not journal.exists() or journal.stat().st_size < 20_000)
        and time.monotonic() < deadline
    ):
        time.sleep(0.05)
    assert f"running, process {process.pid}" in workbench("status", "run").out
    refused = workbench("run", name, "--out", "run")
    assert refused.code == 2
    assert f"another run (process {process.pid}) is writing it" in refused.complaint[-1]
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=300)
    assert process.returncode == 130
    assert b"of 5000 cases are finished and kept in run; the same command goes on with the rest" in err
    assert b"Traceback" not in err


@pytest.mark.slow
def test_a_cluster_whose_worker_is_killed_gives_the_same_bytes(workbench: Workbench) -> None:
    distributed = pytest.importorskip("distributed", reason="needs the extra cluster")
    text = SWEEP.replace("samples = 40", "samples = 200")
    name = workbench.write(text)
    assert workbench("run", name, "--out", "calm", "--jobs", "2").code == 0
    path = os.pathsep.join(p for p in sys.path if p)
    with (
        pytest.MonkeyPatch.context() as patch,
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster,
    ):
        patch.setenv("PYTHONPATH", path)
        process = start(name, "run", "--scheduler", cluster.scheduler_address)
        journal = workbench.directory / "run" / "journal.jsonl"
        deadline = time.monotonic() + 300
        while (
            process.poll() is None
            and (not journal.exists() or not journal.stat().st_size)
            and time.monotonic() < deadline
        ):
            time.sleep(0.05)
        os.kill(next(iter(cluster.workers.values())).process.pid, signal.SIGKILL)
        out, err = process.communicate(timeout=300)
    assert process.returncode == 0, (out, err)
    assert results(workbench.directory / "run") == results(workbench.directory / "calm")
    nobody = workbench("run", name, "--out", "other", "--scheduler", "tcp://127.0.0.1:9")
    assert nobody.code == 2
    assert not (workbench.directory / "other").exists()
    assert "scheduler tcp://127.0.0.1:9: nobody answers" in nobody.complaint[-1]


def test_what_is_no_address_of_a_scheduler(workbench: Workbench) -> None:
    pytest.importorskip("distributed")
    done = workbench.run(FEW, "--out", "run", "--scheduler", "nonsense")
    assert done.code == 2
    assert done.complaint == [
        "workbench: scheduler nonsense: missing port number in address 'nonsense'; allowed: like tcp://host:8786"
    ]


@pytest.mark.usefixtures("inline_workers")
def test_one_case_of_a_sweep_by_itself_has_the_same_numbers_and_all_evidence(workbench: Workbench) -> None:
    name = workbench.write(SWEEP)
    assert workbench("run", name, "--out", "run", "--jobs", "1").code == 0
    errors = pd.read_parquet(workbench.directory / "run" / "summary")
    case = errors[errors["kind"] == "modelling"].sort_values("peak_error")["case"].iloc[-1]
    workbench.gather_evidence()
    done = workbench("run", name, "--only", case)
    assert done.code == 0, done
    directory = workbench.directory / "reports" / "sweep-cases"
    alone = read_exact(directory / "summary.csv")
    alone = alone[alone["kind"] != "contrast"]
    expected = errors[errors["case"] == case]
    assert len(expected) == len(alone) == 6
    for column in ("candidate", "joint", "peak_error", "peak_reference", "worst_time_s"):
        assert alone[column].tolist() == expected[column].tolist()
    facts = manifest(directory)["cases"][case]
    assert "Of the sweep: parameters." in facts["description"]
    assert facts["evidence"]
