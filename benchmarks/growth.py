"""How cost grows: samples, joints, loops, candidates, cases, workers; exponents by least squares of logarithms.

    python benchmarks/growth.py [--quick] [--figure growth.svg]

CPU time, least of some calls, since others may use the machine; each size in a process of its own, whose peak memory
beyond that of the smallest one stands beside. Prints tables in Markdown.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import resource
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import machines
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
CALLS = 4

SIZES: dict[str, tuple[int, ...]] = {
    "joints": (6, 15, 30, 60),
    "samples": (101, 501, 2001, 8001),
    "legs": (6, 8, 10, 12),
    "candidates": (1, 2, 4, 8),
    "cases": (100, 300, 1000, 3000),
    "cases by two workers": (100, 300, 1000, 3000),
}
QUICK = {
    "joints": (6, 15),
    "samples": (101, 501),
    "legs": (6, 8),
    "candidates": (1, 2),
    "cases": (6, 12),
    "cases by two workers": (6, 12),
}
MOST = {"joints": 3.0, "samples": 1.1, "legs": 3.0, "candidates": 1.1, "cases": 1.1, "cases by two workers": 1.1}
"""Exponents that are no more than they have to be."""


def least(work: Callable[[int], object]) -> float:
    """Least CPU seconds of some calls, the first of which, which compiles, does not count."""
    work(0)
    found = np.inf
    for call in range(1, CALLS + 1):
        clock = time.process_time()
        work(call)
        found = min(found, time.process_time() - clock)
    return float(found)


def reference_seconds(text: str, samples: int) -> float:
    """Inverse dynamics of one motion by the reference."""
    import workbench as wb

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.xml"
        path.write_text(text)
        reference = wb.MujocoReference(path)
    t, rate = np.linspace(0.0, 1.0, samples)[:, None], 2.0 * np.pi

    def motion(call: int) -> object:
        size = 0.02 + 1e-6 * call  # another motion each time, so that nothing is at hand
        push = machines.together(reference, size * np.sin(rate * t))
        speed = machines.together(reference, size * rate * np.cos(rate * t))
        rise = machines.together(reference, -size * rate**2 * np.sin(rate * t))
        return reference.inverse_dynamics(reference.home + push, speed, rise, along=t[:, 0])

    return least(motion)


def candidates_seconds(count: int) -> float:
    """One case of the paper's campaign with so many candidates."""
    from workbench.campaign.candidate_spec import CandidateSpec
    from workbench.campaign.cases import resolve_cases
    from workbench.campaign.compare import compute_case
    from workbench.campaign.evidence import Effort
    from workbench.campaign.spec import load_campaign

    file = ROOT / "campaigns" / "almeida_2010.toml"
    campaign = load_campaign(file)[0]
    case = resolve_cases(campaign, file, only=(campaign.case[0].name,))[0]
    names = (list(case.robot.candidates) * count)[:count]
    # every row is computed; what torques cost is the closed forms' own matter and small beside
    wanted = campaign.model_copy(
        update={"candidate": [CandidateSpec(name=name, reference="distributed") for name in names]}
    )
    return least(lambda _: compute_case(wanted, case, Effort.of_many()))


def sweep_seconds(count: int, jobs: int) -> float:
    """A sweep of so many cases of the design sweep, in full: CPU of this process, which writes, and of its workers."""
    from workbench.campaign.evidence import Effort
    from workbench.campaign.spec import load_campaign
    from workbench.sweep.run import SweepOptions, run_sweep

    text = (ROOT / "campaigns" / "design_sweep.toml").read_text()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "sweep.toml"
        file.write_text(text.replace("samples = 10000", f"samples = {count}"))
        campaign = load_campaign(file)[0]
        threading.Thread(target=watch_workers, daemon=True).start()
        before = cpu_seconds()
        run_sweep(campaign, file, Path(folder) / "out", effort=Effort.of_many(), options=SweepOptions(jobs=jobs))
        return cpu_seconds() - before


WORKERS = [0.0]
"""peak memory in MB of workers that this process began"""


def watch_workers() -> None:
    """Add to `WORKERS`; what the system says at the end counts a worker as large as this process was before it."""
    children = Path(f"/proc/self/task/{os.getpid()}/children")
    while True:
        for pid in children.read_text().split():
            with contextlib.suppress(OSError, StopIteration):  # it is gone
                lines = Path(f"/proc/{pid}/status").read_text().splitlines()
                peak = next(line for line in lines if line.startswith("VmHWM"))
                command = Path(f"/proc/{pid}/cmdline").read_bytes()
                if b"workbench.sweep.worker" in command:
                    WORKERS.append(int(peak.split()[1]) / 1024)
        time.sleep(0.05)


def cpu_seconds() -> float:
    """CPU of this process and of those that it has ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


MEASURES: dict[str, Callable[[int], float]] = {
    "joints": lambda n: reference_seconds(machines.tower(n // 3), 501),
    "samples": lambda n: reference_seconds(machines.tower(3), n),
    "legs": lambda n: reference_seconds(machines.stewart(n), 501),
    "candidates": candidates_seconds,
    "cases": lambda n: sweep_seconds(n, 1),
    "cases by two workers": lambda n: sweep_seconds(n, 2),
}


def measured(what: str, size: int) -> tuple[float, float, float]:
    """CPU seconds, and peak memory, MB, of a process of its own and of the largest that it began."""
    run = subprocess.run(
        [sys.executable, __file__, "--one", what, str(size)], check=True, capture_output=True, text=True
    )
    seconds, memory, worker = json.loads(run.stdout)
    return float(seconds), float(memory), float(worker)


def exponent(sizes: tuple[int, ...], values: list[float]) -> float:
    """Slope of the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def draw(found: dict[str, list[tuple[float, float, float]]], sizes: dict[str, tuple[int, ...]], path: Path) -> None:
    """All series over their sizes, both as multiples of the smallest."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    mpl.rcParams |= {"svg.hashsalt": "growth", "svg.fonttype": "none"}
    figure = Figure(figsize=(6.4, 4.0))
    axes = figure.add_subplot()
    for what, rows in found.items():
        if len(rows) < 2:
            continue
        x, y = np.array(sizes[what]) / sizes[what][0], np.array([row[0] for row in rows]) / rows[0][0]
        axes.loglog(x, y, "o-", label=f"{what} from {sizes[what][0]}")
    reach, most = np.array(axes.get_xlim()), 3.0 * axes.get_ylim()[1]
    for power in (1, 2, 3):
        axes.loglog(reach, reach**power, ":", color="0.6", linewidth=0.8)
    axes.set(xlabel="size, of the smallest", ylabel="CPU time, of the smallest's", ylim=(0.7, most))
    axes.legend(frameon=False, fontsize=8)
    figure.savefig(path, bbox_inches="tight", metadata={"Date": None})


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", nargs="+", choices=list(SIZES), default=list(SIZES))
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        seconds = MEASURES[given.one[0]](int(given.one[1]))
        print(json.dumps([seconds, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, max(WORKERS)]))
        return
    sizes = QUICK if given.quick else SIZES
    found: dict[str, list[tuple[float, float, float]]] = {}
    for what in given.only:
        found[what] = [measured(what, size) for size in sizes[what]]
        print(f"\n| {what} | " + " | ".join(map(str, sizes[what])) + " | exponent |")
        print("|---" * (len(sizes[what]) + 2) + "|")
        seconds, memory, worker = zip(*found[what], strict=True)
        fit = f"{exponent(sizes[what], list(seconds)):.2f}" if len(seconds) > 1 else ""
        note = "" if not fit or what not in MOST or float(fit) <= MOST[what] else f" (more than {MOST[what]:g})"
        print("| CPU, ms | " + " | ".join(f"{1e3 * value:.3g}" for value in seconds) + f" | {fit}{note} |")
        print("| peak memory, MB | " + " | ".join(f"{value:.0f}" for value in memory) + " | |", flush=True)
        if any(worker):
            print("| of a worker, MB | " + " | ".join(f"{value:.0f}" for value in worker) + " | |", flush=True)
    if given.figure:
        draw(found, sizes, given.figure)


if __name__ == "__main__":
    main()
