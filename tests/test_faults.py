"""Whatever happens to a worker costs the one case that it computes, and that one has a reason."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import sweep_faults
import sweep_tasks
from inline_pool import Inline
from small_campaign import Workbench
from sweep_campaign import SWEEP
from test_report import parse
from workbench.errors import WorkbenchError
from workbench.report.build import build_report
from workbench.sweep import run as sweep_run
from workbench.sweep.evaluate import Context
from workbench.sweep.run import SweepOptions
from workbench.sweep.supervisor import Lost, Supervisor, cause


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


# --- the supervisor alone ---


def compute(
    tasks: list[tuple[str, float]], jobs: int = 2, time_limit: float = 30.0, memory: float = 400.0, retries: int = 1
) -> dict[int, Any]:
    pool = Supervisor(jobs, sweep_tasks.echo_setup, time_limit, memory, retries)
    try:
        found = list(pool.run(iter(list(enumerate(tasks)))))
    finally:
        pool.close()
    assert len({index for index, _ in found}) == len(found)
    return dict(found)


def test_every_task_is_answered_once() -> None:
    assert compute([("", float(i)) for i in range(200)]) == {i: float(i) for i in range(200)}


def test_each_fault_costs_its_own_task() -> None:
    faults = ["", "raise", "", "os._exit", "kill", "", "segfault", "memory", "print", "exit", ""]
    # a limit that no busy machine comes near: what hangs is another test
    found = compute([(fault, float(i)) for i, fault in enumerate(faults)], time_limit=300.0)
    lost = {faults[i]: answer for i, answer in found.items() if isinstance(answer, Lost)}
    assert {i for i, answer in found.items() if not isinstance(answer, Lost)} == {0, 2, 5, 8, 10}
    assert {fault: answer.status for fault, answer in lost.items()} == {
        "raise": "failed", "exit": "failed", "os._exit": "killed", "kill": "killed", "segfault": "killed",
        "memory": "killed",
    }  # fmt: skip
    assert lost["raise"].reason == "ValueError: planted"
    assert lost["os._exit"].reason == "its worker ended by exit code 3, 2 times in a row"
    assert lost["kill"].reason == "its worker ended by SIGKILL, 2 times in a row"
    assert lost["segfault"].reason == "its worker ended by SIGSEGV, 2 times in a row"
    assert lost["memory"].reason == "needs more memory than allowed: 400 MB"


def test_what_hangs_is_stopped_and_tried_again() -> None:
    (lost,) = compute([("hang", 0.0)], time_limit=0.5).values()
    assert lost == Lost("timeout", "takes longer than allowed: 0.5 s, 2 times in a row")


def test_large_answers_come_through() -> None:
    found = compute([("large", 3e7), ("large", 1.0)], memory=1000.0)
    assert [len(found[i]) for i in (0, 1)] == [30_000_000, 1]


def test_workers_that_do_not_start_end_the_run() -> None:
    pool = Supervisor(2, sweep_tasks.broken_setup, 10.0, 400.0, 1)
    with pytest.raises(WorkbenchError, match="workers do not start: RuntimeError: nothing here"):
        list(pool.run(iter([(0, ("", 0.0))])))
    pool.close()
    assert pool.pids == []


def test_tasks_are_taken_only_as_fast_as_they_are_computed() -> None:
    taken: list[int] = []

    def endless() -> Iterator[tuple[int, tuple[str, float]]]:
        for index in range(10**9):
            taken.append(index)
            yield index, ("", 0.0)

    pool = Supervisor(2, sweep_tasks.echo_setup, 10.0, 400.0, 1)
    for count, _ in enumerate(pool.run(endless())):
        if count == 50:
            break
    pool.close()
    assert len(taken) < 60


def alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state not in ("Z", "X")


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks at processes through /proc")
def test_workers_die_with_their_parent_even_in_the_middle_of_a_case() -> None:
    code = (
        "import itertools, sys, threading, time, sweep_tasks\n"
        "from workbench.sweep.supervisor import Supervisor\n"
        "pool = Supervisor(2, sweep_tasks.echo_setup, 600.0, 400.0, 1)\n"
        "def tell():\n"
        "    while sum(len(w.tasks) for w in pool._workers) < 2: time.sleep(0.01)\n"
        "    print(*pool.pids, flush=True)\n"
        "threading.Thread(target=tell, daemon=True).start()\n"
        "list(pool.run(((i, ('hang', 0.0)) for i in itertools.count())))\n"
    )
    path = os.pathsep.join(p for p in sys.path if p)
    parent = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, env=os.environ | {"PYTHONPATH": path}, text=True
    )
    assert parent.stdout is not None
    pids = [int(pid) for pid in parent.stdout.readline().split()]
    assert len(pids) == 2
    assert all(map(alive, pids))
    parent.kill()
    parent.wait()
    parent.stdout.close()
    deadline = time.monotonic() + 120
    while any(map(alive, pids)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(map(alive, pids))


def test_how_a_process_ended_is_said() -> None:
    assert [cause(3), cause(-9), cause(-11), cause(-250)] == ["exit code 3", "SIGKILL", "SIGSEGV", "signal 250"]


# --- a whole sweep ---

FAULTS = {3: "raise", 5: "hang", 8: "os._exit", 13: "kill", 18: "memory", 21: "nan", 24: "segfault", 27: "inf"}
EXPECTED = {
    3: "failed", 5: "timeout", 8: "killed", 13: "killed", 18: "killed", 21: "invalid", 24: "killed", 27: "invalid",
}  # fmt: skip
LIMITS = {"time_limit = 20.0": "time_limit = 5.0\nmemory_limit = 800.0\nretries = 1\nkeep_series = 'failed'"}


def plant(monkeypatch: pytest.MonkeyPatch, setup: Callable[[Context], Any]) -> None:
    """Make the runner hand another setup to its workers."""

    def make_pool(context: Context, options: SweepOptions, tasks: int) -> Supervisor:
        assert context.campaign.sweep is not None
        sweep = context.campaign.sweep
        return Supervisor(2, setup(context), sweep.time_limit, sweep.memory_limit, sweep.retries)

    monkeypatch.setattr(sweep_run, "make_pool", make_pool)


def limited(text: str) -> str:
    for old, new in LIMITS.items():
        text = text.replace(old, new)
    # all cases are within reach, so that each fault is met
    return text.replace("low = 0.8\nhigh = 1.2", "low = 0.98\nhigh = 1.02")


def cases(directory: Path) -> pd.DataFrame:
    return pd.read_parquet(directory / "cases").set_index("index")


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the limit needs Linux")
def test_what_writes_series_is_no_cases_memory(workbench: Workbench) -> None:
    # its library reserves a gigabyte of addresses when it is first used; one case takes 160 MB
    tight = SWEEP.replace("time_limit = 20.0", "time_limit = 60.0\nmemory_limit = 512.0\nkeep_series = 'all'")
    done = workbench.run(tight.replace("samples = 40", "samples = 3"), "--out", "run", "--jobs", "1")
    assert done.code == 0, done
    assert set(cases(workbench.directory / "run").status) <= {"passed", "filtered"}


@pytest.mark.slow
def test_each_faulty_case_has_one_status_and_all_others_are_done(
    workbench: Workbench, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant(monkeypatch, sweep_faults.with_faults(FAULTS))
    done = workbench.run(limited(SWEEP), "--out", "run")
    assert done.code == 1, done
    found = cases(workbench.directory / "run")
    assert len(found) == 40
    assert {i: s for i, s in found.status.items() if s != "passed"} == EXPECTED
    assert (found.reason[list(EXPECTED)] != "").all()
    assert found.reason[21] == "distributed against distributed, q1: peak_error is nan"
    lost = "2 gave results that are not finite numbers, 1 ran out of time and 4 lost their worker"
    assert f"FAILED: of 40 cases 1 failed, {lost}; 32 passed." in done.out
    assert "internal error" not in done.err
    # time series stand for those that left any, and did not pass
    names = sorted(path.name for path in (workbench.directory / "run" / "series").iterdir())
    assert names == ["variant-000021.parquet", "variant-000027.parquet"]
    # the report counts each as what it is
    build_report(workbench.directory / "run", ["html"])
    table = parse(workbench.directory / "run").tables["not-passed"]
    assert {int(row[0].rpartition("-")[2]): row[1].split()[-1].lower() for row in table[1:]} == {
        index: {"timeout": "out"}.get(status, status) for index, status in EXPECTED.items()
    }
    # what failed is tried again where that is asked for, and only then
    monkeypatch.undo()
    monkeypatch.chdir(workbench.directory)
    again = workbench("run", "small.toml", "--out", "run")
    assert again.code == 1
    assert cases(workbench.directory / "run").status.to_dict() == found.status.to_dict()
    repaired = workbench("run", "small.toml", "--out", "run", "--retry-failed")
    assert repaired.code == 0, repaired
    undisturbed = workbench("run", "small.toml", "--out", "other")
    assert undisturbed.code == 0
    assert same_results(workbench.directory / "run", workbench.directory / "other")


def same_results(one: Path, other: Path) -> bool:
    names = sorted(str(p.relative_to(one)) for f in ("cases", "summary", "series", "sweep.json") for p in tree(one / f))
    assert names == sorted(
        str(p.relative_to(other)) for f in ("cases", "summary", "series", "sweep.json") for p in tree(other / f)
    )
    assert any(name.startswith("cases") for name in names)
    return all((one / name).read_bytes() == (other / name).read_bytes() for name in names)


def tree(path: Path) -> list[Path]:
    return [path] if path.is_file() else [p for p in path.rglob("*") if p.is_file()]


def test_a_worker_killed_once_leaves_no_trace(workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    text = SWEEP.replace("samples = 40", "samples = 12")
    with monkeypatch.context() as patched:
        patched.setattr("workbench.sweep.computing.Supervisor", Inline)
        assert workbench.run(text, "--out", "calm").code == 0
    marker = workbench.directory / "killed"
    plant(monkeypatch, lambda context: partial(sweep_faults.once_setup, context, str(marker), 2))
    assert workbench.run(text, "--out", "disturbed").code == 0
    assert marker.exists()
    assert same_results(workbench.directory / "calm", workbench.directory / "disturbed")


@pytest.mark.slow
def test_same_results_sees_a_difference(workbench: Workbench) -> None:
    text = SWEEP.replace("samples = 40", "samples = 6")
    assert workbench.run(text, "--out", "one").code == 0
    assert workbench.run(text, "--out", "other", "--set", "m3=1.3000001").code == 0
    assert not same_results(workbench.directory / "one", workbench.directory / "other")


def test_a_worker_of_another_version_computes_nothing(workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    make_pool = sweep_run.make_pool

    def tampered(context: Context, options: SweepOptions, tasks: int) -> Any:
        import dataclasses

        return make_pool(dataclasses.replace(context, common="0" * 32), options, tasks)

    monkeypatch.setattr(sweep_run, "make_pool", tampered)
    done = workbench.run(SWEEP, "--out", "run")
    assert done.code == 2
    assert done.complaint[-1].endswith("model, formulas, code or versions of this worker are not those of the run")


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2, 4])
def test_workers_killed_at_random(workbench: Workbench, monkeypatch: pytest.MonkeyPatch, jobs: int) -> None:
    """Same bytes as an undisturbed run, whoever is killed when."""
    import random

    text = SWEEP.replace("samples = 40", "samples = 150").replace("time_limit", "retries = 100\ntime_limit")
    name = workbench.write(text)
    assert workbench("run", name, "--out", "calm", "--jobs", "2").code == 0
    pools: list[Supervisor] = []
    make_pool = sweep_run.make_pool

    def caught(context: Context, options: SweepOptions, tasks: int) -> Any:
        pools.append(make_pool(context, options, tasks))
        return pools[-1]

    monkeypatch.setattr(sweep_run, "make_pool", caught)
    chance, killed, over = random.Random(jobs), [0], threading.Event()
    moments = sorted(chance.sample(range(3, 140), 5))  # finished cases, so that a fast machine is no safer
    journal = workbench.directory / "disturbed" / "journal.jsonl"

    def hunt() -> None:
        while not over.wait(0.005) and killed[0] < len(moments):
            # not yet there, or no more; a process that has just ended by itself
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):
                if pools and journal.read_bytes().count(b"\n") >= moments[killed[0]]:
                    os.kill(chance.choice(pools[-1].pids), signal.SIGKILL)
                    killed[0] += 1

    hunter = threading.Thread(target=hunt)
    hunter.start()
    try:
        done = workbench("run", name, "--out", "disturbed", "--jobs", str(jobs))
    finally:
        over.set()
        hunter.join()
    assert done.code == 0, done
    assert killed[0] >= 2
    assert same_results(workbench.directory / "calm", workbench.directory / "disturbed")
