"""Measure the workbench against the floors and the alternatives, in one run; `make bench`.

Prints a table of times and one of ratios with the limits that they are held to, and writes both as JSON. Exit code 1
means that a limit is not met.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

import engines
import floor
import numpy as np
from samples import Samples, model, scattered, smooth
from timing import Rounds, in_turn

import workbench as wb
from workbench.capabilities.robot import Robot
from workbench.reference.engine import Evaluator

FORMAT = 1
RESULTS = Path(__file__).with_name("results")
ROBOTS = ("asym_2rss_ppap", "planar_4rprp")
LITERAL = {
    "asym_2rss_ppap": ("lumped-appendix", "equation4", "distributed-rotation"),
    "planar_4rprp": ("screws",),
}
"""The papers' own forms, by candidate."""

BATCHES = (1, 100, 5000, 1_000_000)
REFERENCE_SAMPLES = 5000
ONCE = "MuJoCo evaluating the same states once"
MOST_ONCE = 3.0
"""So many times what MuJoCo needs may the reference take along a motion (docs/speed.md says what is between)."""
FREE = 1.8
"""A machine that gives two threads less than so many times the speed of one has no second core to spare."""

IN_SMALL = "distributed, as batches of 5,000"

RUN = "make run"
MOST_RUN = 6.0
"""s of a run of the paper's campaign with its report; six were wanted (docs/speed.md)"""

SLOW_SAMPLES = 250
"""for what goes sample by sample"""


@dataclass(frozen=True)
class Time:
    """One row of the first table."""

    robot: str
    what: str
    batch: int
    median_us: float
    """microseconds a sample (a start, for start-up times)"""
    best_us: float
    rounds: int


@dataclass(frozen=True)
class Ratio:
    """One row of the second table."""

    robot: str
    what: str
    value: float
    limit: float | None
    at_most: bool = True

    @property
    def met(self) -> bool:
        """Whether the limit holds, if there is one."""
        return self.limit is None or (self.value <= self.limit if self.at_most else self.value >= self.limit)


class Bench:
    """Collects times and ratios."""

    def __init__(self, quick: bool) -> None:
        self.times: list[Time] = []
        self.ratios: list[Ratio] = []
        self._quick = quick

    def measure(
        self, robot: str, batch: int, functions: dict[str, Callable[[], object]], rounds: int, seconds: float
    ) -> Rounds:
        """Time functions that treat *batch* samples a call, in turn."""
        found = in_turn(functions, *((5, 1.0) if self._quick else (rounds, seconds)))
        for name in functions:
            per = 1e6 / batch
            self.add(robot, name, batch, per * found.median_s(name), per * found.best_s(name), found)
        return found

    def add(self, robot: str, what: str, batch: int, median: float, best: float, rounds: Rounds) -> None:
        """Keep one time and say so."""
        self.times.append(Time(robot, what, batch, median, best, len(next(iter(rounds.seconds.values())))))
        print(f"{robot:16} {what:44} {batch:>9,} {median:12.4f} {best:12.4f}", flush=True)

    def ratio(self, robot: str, what: str, value: float, limit: float | None = None, at_most: bool = True) -> None:
        """Keep one ratio."""
        self.ratios.append(Ratio(robot, what, value, limit, at_most))


def closed_forms(bench: Bench, robot: str, compiled: floor.Floor | None) -> None:
    """Batches of every size, and the papers' forms."""
    mechanism = wb.load_mechanism(model(robot))
    constants = mechanism.closed_form._constants["distributed"]
    for batch in BATCHES:
        s = smooth(robot, max(batch, 2))
        q, qd, qdd = s.q[:batch], s.qd[:batch], s.qdd[:batch]
        force, tau = np.zeros((batch, 3)), np.empty((batch, 3))

        def run(
            model: str = "distributed", threads: int = 1, q: np.ndarray = q, qd: np.ndarray = qd, qdd: np.ndarray = qdd
        ) -> np.ndarray:
            return mechanism.inverse_dynamics(q, qd, qdd, model, threads=threads)

        functions: dict[str, Callable[[], object]] = {
            "distributed": run,
            "lumped": lambda run=run: run("lumped"),
        }
        if compiled:
            functions |= {
                "C, scalar": compiled.call(robot, False, constants, q, qd, qdd, force, tau),
                "C, vector math library": compiled.call(robot, True, constants, q, qd, qdd, force, tau),
            }
        if batch >= 1_000_000:
            functions |= {
                "distributed, 2 threads": lambda run=run: run(threads=2),
                IN_SMALL: lambda a=s: _small(mechanism, a),
            }
            if compiled:
                functions |= {"C, scalar, 2 threads": compiled.threads(robot, constants, q, qd, qdd, force, tau)}
        if batch == 1:
            functions |= _one_sample(mechanism, compiled, robot, (q[0], qd[0], qdd[0]))
        found = bench.measure(robot, batch, functions, 400 if batch < 1e5 else 30, 8.0)
        if batch <= 5000:
            _papers_forms(bench, mechanism, robot, (q, qd, qdd, force))
        _ratios(bench, robot, batch, found)


def _small(mechanism: Robot, samples: Samples) -> None:
    """Do the same work in small batches, in the same round: the ratio holds on a busy machine too."""
    for _ in range(len(samples.q) // 5000):  # always the same rows, which stay in the cache
        mechanism.inverse_dynamics(samples.q[:5000], samples.qd[:5000], samples.qdd[:5000])


def _papers_forms(bench: Bench, mechanism: Robot, robot: str, arrays: tuple[np.ndarray, ...]) -> None:
    """Apart from the fast ones, which would find their data driven out of the cache."""
    batch = len(arrays[0])
    forms = {
        f"paper's {name}": lambda form=mechanism.candidates[name].function: form(mechanism, *arrays)
        for name in LITERAL[robot]
    }
    found = bench.measure(robot, batch, forms, 40, 4.0)
    own = in_turn({"distributed": lambda: mechanism.inverse_dynamics(*arrays[:3])}, 40, 4.0)
    for name in forms:
        bench.ratio(
            robot, f"{name} : distributed, batch of {batch:,}", found.median_s(name) / own.median_s("distributed")
        )


def _one_sample(
    mechanism: Robot, compiled: floor.Floor | None, robot: str, sample: tuple[np.ndarray, ...]
) -> dict[str, Callable[[], object]]:
    kernel, out, still = mechanism.kernel(), np.empty(3), np.zeros(3)
    functions: dict[str, Callable[[], object]] = {"prepared kernel": lambda: kernel(*sample, still, out)}
    if compiled:
        constants = mechanism.closed_form._constants["distributed"]
        direct = compiled.call(robot, False, constants, *sample, still, out)

        def by_arrays() -> None:
            compiled.call(robot, False, constants, *sample, still, out)()

        functions |= {"C through ctypes, arguments bound": direct, "C through ctypes, arrays": by_arrays}
    return functions


def _ratios(bench: Bench, robot: str, batch: int, found: Rounds) -> None:
    compiled = "C, scalar" in found.seconds
    if batch == 1:
        if compiled:
            one = found.ratio("prepared kernel", "C through ctypes, arguments bound")
            bench.ratio(robot, "prepared kernel : C through ctypes, arguments bound", one, 3.0)
            other = found.ratio("prepared kernel", "C through ctypes, arrays")
            bench.ratio(robot, "prepared kernel : C through ctypes, arrays", other)
        bench.ratio(robot, "public method, one sample, us", 1e6 * found.median_s("distributed"), 15.0)
    if batch == 5000:
        if compiled:
            bench.ratio(robot, "distributed : C scalar, batch of 5,000", found.ratio("distributed", "C, scalar"), 0.8)
            vector = found.ratio("distributed", "C, vector math library")
            bench.ratio(robot, "distributed : C vector, batch of 5,000", vector, 3.0)
        bench.ratio(robot, "lumped : distributed, batch of 5,000", found.ratio("lumped", "distributed"), 1.1)
        bench.ratio(robot, "distributed : lumped, batch of 5,000", found.ratio("distributed", "lumped"), 1.1)
    if batch == 1_000_000:
        bench.ratio(robot, "batch of 1,000,000 : 5,000, per sample", found.ratio("distributed", IN_SMALL), 1.3)
        # what the machine gives to two threads just now; on a busy one the package's threads cannot be judged
        free = found.ratio("C, scalar", "C, scalar, 2 threads") if compiled else 2.0
        if compiled:
            bench.ratio(robot, "control: C scalar, 1 thread : 2 threads", free)
        speed = found.ratio("distributed", "distributed, 2 threads")
        limit = 1.7 if free >= FREE else None
        bench.ratio(robot, "1 thread : 2 threads, batch of 1,000,000", speed, limit, at_most=False)


def reference(bench: Bench, robot: str) -> None:
    """The reference with closure, against MuJoCo's batch, Pinocchio from Python and plain mj_inverse."""
    curve, loose = smooth(robot, REFERENCE_SAMPLES), scattered(robot, REFERENCE_SAMPLES)
    runs = {threads: wb.MujocoReference(model(robot), threads=threads) for threads in (1, 2)}

    times = np.linspace(0.0, 1.0, REFERENCE_SAMPLES)

    def run(s: Samples, threads: int = 1, along: np.ndarray | None = None) -> Callable[[], object]:
        def call() -> object:
            # what was closed before is not to be found again
            runs[threads]._closed = runs[threads].closer._kept = None
            return runs[threads].inverse_dynamics(s.q, s.qd, s.qdd, along=along)

        return call

    closed, engine = runs[1].inverse_dynamics(curve.q, curve.qd, curve.qdd, along=times), runs[1].engine("distributed")

    def once() -> None:
        """What the reference cannot do without: every state placed and evaluated by MuJoCo, nothing else."""

        def block(evaluator: Evaluator, rows: slice) -> None:
            evaluator.move(closed.qpos[rows], closed.qvel[rows])

        engine.in_blocks(block, REFERENCE_SAMPLES)

    few = Samples(*(a[:: REFERENCE_SAMPLES // SLOW_SAMPLES] for a in (curve.q, curve.qd, curve.qdd)))
    functions = {
        "reference, along a motion": run(curve, along=times),
        "reference, scattered samples": run(loose),
        "reference, along a motion, 2 threads": run(curve, 2, times),
        ONCE: once,
    }
    plain = {"mj_inverse (wrong for closed chains)": engines.mj_inverse(robot, few)}
    other = engines.pinocchio(robot, few)
    slow = plain | (
        {"Pinocchio, closure included": other[0], "Pinocchio, configurations given": other[1]} if other else {}
    )
    # one round each, so that times of both kinds can be divided
    scaled = in_turn({**functions, **slow}, 5 if bench._quick else 25, 25.0)
    for name in functions | slow:
        per = 1e6 / (len(curve.q) if name in functions else len(few.q))
        batch = len(curve.q) if name in functions else len(few.q)
        bench.add(robot, name, batch, per * scaled.median_s(name), per * scaled.best_s(name), scaled)
    if other:
        scale = len(few.q) / len(curve.q)
        for name in ("reference, along a motion", "reference, scattered samples"):
            for alternative, limit in (("Pinocchio, closure included", 0.2), ("Pinocchio, configurations given", None)):
                bench.ratio(robot, f"{name} : {alternative}", scale * scaled.ratio(name, alternative), limit)
    bench.ratio(
        robot, f"reference, along a motion : {ONCE}", scaled.ratio("reference, along a motion", ONCE), MOST_ONCE
    )
    threads = scaled.ratio("reference, along a motion", "reference, along a motion, 2 threads")
    bench.ratio(robot, "reference, 1 thread : 2 threads", threads)


def start_up(bench: Bench) -> None:
    """What a user waits for before anything happens."""
    python = [sys.executable, "-c"]
    commands = {
        "python, nothing": [*python, "pass"],
        "import workbench": [*python, "import workbench"],
        "workbench --help": [sys.executable, "-m", "workbench.cli", "--help"],
        "import numpy": [*python, "import numpy"],
    }
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}

    def call(command: list[str]) -> Callable[[], object]:
        return lambda: subprocess.run(command, check=True, capture_output=True, env=environment)

    found = in_turn({name: call(command) for name, command in commands.items()}, 9, 20.0)
    for name in commands:
        bench.add("", name, 1, 1e6 * found.median_s(name), 1e6 * found.best_s(name), found)
    bench.ratio("", "workbench --help, s", found.median_s("workbench --help"), 0.4)
    bench.ratio("", "import workbench : import numpy", found.ratio("import workbench", "import numpy"), 1.0)
    with tempfile.TemporaryDirectory() as folder:
        campaign = str(Path(__file__).parents[1] / "campaigns" / "almeida_2010.toml")
        run = [sys.executable, "-m", "workbench", "run", campaign, "--out", str(Path(folder) / "run")]
        whole = in_turn({RUN: call(run)}, 3, 60.0)
    bench.add("", RUN, 1, 1e6 * whole.median_s(RUN), 1e6 * whole.best_s(RUN), whole)
    bench.ratio("", f"{RUN}, s", whole.median_s(RUN), MOST_RUN)


def machine() -> dict[str, object]:
    """What the times depend on, without names of people or hosts."""
    cpu = ""
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [line.partition(":")[2].strip() for line in info.read_text().splitlines() if "model name" in line]
        cpu = names[0] if names else ""
    return {
        "cpu": cpu or platform.processor(),
        "cores": os.cpu_count(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "load_before": list(os.getloadavg()) if hasattr(os, "getloadavg") else [],
        "packages": {name: metadata.version(name) for name in ("numpy", "numba", "mujoco-core")},
    }


def main() -> int:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="few rounds: to try the benchmark, not to trust it")
    parser.add_argument("--out", type=Path, help="result file; default: results/<date>.json")
    options = parser.parse_args()
    started = datetime.now(UTC)
    conditions = machine()
    bench = Bench(options.quick)
    print(f"{'robot':16} {'what':44} {'batch':>9} {'median us':>12} {'best us':>12}   per sample")
    with tempfile.TemporaryDirectory() as directory:
        compiled = floor.build(Path(directory))
        if compiled is None:
            print("no C compiler: the floors are left out")
        for robot in ROBOTS:
            closed_forms(bench, robot, compiled)
        for robot in ROBOTS:
            reference(bench, robot)
    start_up(bench)
    print(f"\n{'robot':16} {'ratio':64} {'value':>9}  limit")
    for ratio in bench.ratios:
        sign = "<=" if ratio.at_most else ">="
        limit = "" if ratio.limit is None else f"{sign} {ratio.limit:g}{'' if ratio.met else '  NOT MET'}"
        print(f"{ratio.robot:16} {ratio.what:64} {ratio.value:9.4g}  {limit}")
    target = options.out or RESULTS / f"{started:%Y%m%dT%H%M%SZ}.json"
    target.parent.mkdir(parents=True, exist_ok=True)
    content = {
        "format": FORMAT,
        "started": started.isoformat(timespec="seconds"),
        "quick": options.quick,
        "machine": conditions,
        "floors": list(compiled.commands) if compiled else [],
        "times": [asdict(time) for time in bench.times],
        "ratios": [asdict(ratio) | {"met": ratio.met} for ratio in bench.ratios],
    }
    target.write_text(json.dumps(content, indent=1) + "\n")
    print(f"\n{target}")
    return 0 if all(ratio.met for ratio in bench.ratios) else 1


if __name__ == "__main__":
    sys.exit(main())
