"""Two versions side by side: the reference along a motion, CPU time, in turns; and what torques differ by.

    python benchmarks/paired.py ../before/src --robots models/asym_2rss_ppap.xml models/planar_4rprp.xml

Each measurement is a process of its own with one of the two sources on its path; least of many calls, so that what else
the machine does counts little. MuJoCo's own evaluation of the same states, once, stands beside.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parents[1] / "src"
SWING, FREQUENCY = 0.15, (0.5, 0.8, 1.1, 0.6, 0.9, 0.7)
SLIDE = 0.05
"""m: what slides moves less"""


def measure(robot: str, samples: int, calls: int) -> dict[str, object]:
    """CPU microseconds a sample of this process's own version, MuJoCo's alone, and the torques."""
    import workbench as wb

    made = wb.load_robot(robot)
    reference = made.reference
    count = len(reference.home)
    t = np.linspace(0.0, 2.0, samples)[:, None]
    rate = 2.0 * np.pi * np.resize(FREQUENCY, count)
    size = np.where(reference.actuated_slides, SLIDE, SWING)
    q = reference.home + size * np.sin(rate * t)
    qd, qdd = size * rate * np.cos(rate * t), -size * rate**2 * np.sin(rate * t)
    # two motions in turn, so that nothing is at hand from the call before
    motions = [(q, qd, qdd), (q[:-1], qd[:-1], qdd[:-1])]
    least, found = np.inf, None
    for call in range(2 * calls):
        motion = motions[call % 2]
        clock = time.process_time()
        result = reference.inverse_dynamics(*motion, along=t[: len(motion[0]), 0])
        least = min(least, (time.process_time() - clock) / len(motion[0]))
        found = result if call % 2 == 0 else found
    assert found is not None
    engine = reference._engine("distributed")
    alone = []
    for _ in range(calls):
        clock = time.process_time()
        engine.in_blocks(lambda evaluator, rows: evaluator.move(found.qpos[rows], found.qvel[rows]) and None, samples)
        alone.append((time.process_time() - clock) / samples)
    return {"us": 1e6 * least, "mujoco_us": 1e6 * min(alone), "tau": found.tau.tolist()}


def main() -> None:
    """Compare."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("before", help="the other version's src directory")
    parser.add_argument("--robots", nargs="+", required=True)
    parser.add_argument("--samples", type=int, default=5000)
    parser.add_argument("--calls", type=int, default=8)
    parser.add_argument("--rounds", type=int, default=3)
    given = parser.parse_args()
    if given.before == "-":
        print(json.dumps(measure(given.robots[0], given.samples, given.calls)))
        return
    for robot in given.robots:
        least: dict[str, dict[str, object]] = {}
        for _ in range(given.rounds):
            for name, source in (("before", given.before), ("now", str(HERE))):
                command = [sys.executable, __file__, "-", "--robots", robot, "--samples", str(given.samples)]
                command += ["--calls", str(given.calls)]
                path = {**os.environ, "PYTHONPATH": str(Path(source).resolve())}
                run = subprocess.run(command, env=path, capture_output=True, text=True, check=True)
                one = json.loads(run.stdout)
                if name not in least or one["us"] < least[name]["us"]:
                    least[name] = one
        before, now = least["before"], least["now"]
        tau = [np.array(one["tau"]) for one in (before, now)]
        gap = float((np.abs(tau[0] - tau[1]).max(axis=0) / np.abs(tau[0]).max(axis=0)).max())
        print(
            f"{robot}: {before['us']:.2f} -> {now['us']:.2f} us a sample, ratio {now['us'] / before['us']:.3f};"
            f" MuJoCo once {now['mujoco_us']:.2f} us, ratio to it {now['us'] / now['mujoco_us']:.2f};"
            f" torques differ by {gap:.1e} of their peak",
            flush=True,
        )


if __name__ == "__main__":
    main()
