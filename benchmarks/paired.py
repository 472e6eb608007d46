"""Two versions side by side: the reference along a motion, CPU time, in turns; and what torques differ by.

    python benchmarks/paired.py ../before/src --robots models/asym_2rss_ppap.xml models/planar_4rprp.xml

Each version is a process of its own with its source on its path, and they are called in turn, one call each, least of
many calls, so that what else the machine does counts little and alike. MuJoCo's own evaluation of the same states,
once, stands beside, in the process and the turn of the version of this file.
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


def serve(robot: str, samples: int) -> None:
    """Answer each line of standard input by a line: CPU microseconds a sample, MuJoCo's alone; at the end torques."""
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
    whole = reference.inverse_dynamics(*motions[0], along=t[:, 0])
    engine = (getattr(reference, "engine", None) or reference._engine)("distributed")  # versions name it differently
    for call, line in enumerate(sys.stdin):
        if not line.strip():
            break
        motion = motions[(call + 1) % 2]
        clock = time.process_time()
        reference.inverse_dynamics(*motion, along=t[: len(motion[0]), 0])
        us = (time.process_time() - clock) / len(motion[0])
        clock = time.process_time()
        engine.in_blocks(lambda evaluator, rows: evaluator.move(whole.qpos[rows], whole.qvel[rows]) and None, samples)
        alone = (time.process_time() - clock) / samples
        print(json.dumps([1e6 * us, 1e6 * alone]), flush=True)
    print(json.dumps(whole.tau.tolist()), flush=True)


class Side:
    """One version, in a process of its own."""

    def __init__(self, source: str, robot: str, samples: int) -> None:
        path = {**os.environ, "PYTHONPATH": str(Path(source).resolve())}
        command = [sys.executable, __file__, "-", "--robots", robot, "--samples", str(samples)]
        self._process = subprocess.Popen(command, env=path, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def ask(self, line: str) -> list[object]:
        """The answer to a line."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()
        answer: list[object] = json.loads(self._process.stdout.readline())
        return answer


def main() -> None:
    """Compare."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("before", help="the other version's src directory")
    parser.add_argument("--robots", nargs="+", required=True)
    parser.add_argument("--samples", type=int, default=5000)
    parser.add_argument("--rounds", type=int, default=40, help="calls of each version")
    given = parser.parse_args()
    if given.before == "-":
        serve(given.robots[0], given.samples)
        return
    for robot in given.robots:
        sides = [Side(source, robot, given.samples) for source in (given.before, str(HERE))]
        times = np.array([[side.ask("go") for side in sides] for _ in range(given.rounds)], dtype=np.float64)
        before, now = times[:, :, 0].min(axis=0)
        mujoco = float(times[:, 1, 1].min())
        tau = [np.array(side.ask("")) for side in sides]
        gap = float((np.abs(tau[0] - tau[1]).max(axis=0) / np.abs(tau[0]).max(axis=0)).max())
        print(
            f"{robot}: {before:.2f} -> {now:.2f} us a sample, ratio {now / before:.3f}"
            f" (median of ratios in one turn {np.median(times[:, 1, 0] / times[:, 0, 0]):.3f});"
            f" MuJoCo once {mujoco:.2f} us, ratio to it {now / mujoco:.2f}"
            f" ({np.median(times[:, 1, 0] / times[:, 1, 1]):.2f}); torques differ by {gap:.1e} of their peak",
            flush=True,
        )


if __name__ == "__main__":
    main()
