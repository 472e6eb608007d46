"""Does the stated uncertainty of recorded torques cover the true error? The study of docs/recorded.md.

Random motions of the 2RSS+PPaP robot are written with few digits and differentiated again; torques carry noise or none.
The true error is known, since the motion is. ``python benchmarks/recorded.py [trials] [seed]`` prints the tables.
"""

from __future__ import annotations

import sys
from collections import defaultdict

import numpy as np

import workbench as wb
from workbench.campaign.recorded import ALARM
from workbench.motion.digits import rounding_of
from workbench.recorded.propagate import uncertainty
from workbench.recorded.smoothing import smooth

DIGITS = (3, 4, 5, 6, 7, 8, 9)
STEPS_MS = (1, 2, 5, 10, 20)
DURATION_S = 1.2
NOISE = 0.003
"""of each torque's peak"""
PLACE = (0.0, 0.03, 0.40)
"""m, of the platform in the middle of its motions"""


def random_motion(
    home: np.ndarray, rng: np.random.Generator, t: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One to three sines per joint, up to 2 Hz, around a pose in the middle of the workspace."""
    q, qd, qdd = np.tile(home, (len(t), 1)), np.zeros((len(t), 3)), np.zeros((len(t), 3))
    for joint, size in enumerate((0.05, 0.12, 0.12)):
        count = int(rng.integers(1, 4))
        for _ in range(count):
            w, phase, a = rng.uniform(2.0, 12.0), rng.uniform(0.0, 2.0 * np.pi), size * rng.uniform(0.3, 1.0) / count
            q[:, joint] += a * np.sin(w * t + phase)
            qd[:, joint] += a * w * np.cos(w * t + phase)
            qdd[:, joint] -= a * w**2 * np.sin(w * t + phase)
    return q, qd, qdd


def trial(robot: object, digits: int, step_ms: int, noisy: bool, rng: np.random.Generator) -> np.ndarray:
    """Per joint: error over stated uncertainty, largest error over band, uncertainty over peak torque; (3, 3)."""
    t = np.arange(round(1e3 * DURATION_S / step_ms) + 1) * 1e-3 * step_ms
    q, qd, qdd = random_motion(robot.inverse_kinematics(np.array([PLACE]))[0], rng, t)  # type: ignore[attr-defined]
    tau = robot.inverse_dynamics(q, qd, qdd)  # type: ignore[attr-defined]
    peak = np.abs(tau).max(axis=0)
    recorded = tau + (NOISE * peak * rng.standard_normal(tau.shape) if noisy else 0.0)
    decimals = digits - 1 - np.floor(np.log10(np.abs(q).max(axis=0))).astype(int)
    written = np.column_stack([np.round(column, d) for column, d in zip(q.T, decimals, strict=True)])
    smoothed = [smooth(t, column, rounding_of(column)[0]) for column in written.T]
    seen = tuple(np.column_stack([getattr(one, name) for one in smoothed]) for name in ("q", "qd", "qdd"))
    noise = np.array([smooth(t, column).sigma for column in recorded.T])
    found = uncertainty(robot.inverse_dynamics, seen, smoothed, noise, np.zeros_like(q))  # type: ignore[attr-defined]
    error = np.abs(recorded - robot.inverse_dynamics(*seen))  # type: ignore[attr-defined]
    return np.column_stack([error.max(axis=0) / found.peak, (error / found.band).max(axis=0), found.peak / peak])


def main(trials: int = 210, seed: int = 1) -> None:
    """Print coverage by digits, by step and in all, with and without noise of the torques."""
    robot = wb.load_mechanism("models/asym_2rss_ppap.xml")
    for noisy in (False, True):
        rng = np.random.default_rng(seed + noisy)
        by: dict[tuple[str, int | str], list[np.ndarray]] = defaultdict(list)
        for number in range(trials):
            digits, step = DIGITS[number % len(DIGITS)], STEPS_MS[(number // len(DIGITS)) % len(STEPS_MS)]
            found = trial(robot, digits, step, noisy, rng)
            for key in (("digits", digits), ("step [ms]", step), ("all", "")):
                by[key].append(found)
        print(f"torques {'with noise of 0.3 %' if noisy else 'without noise'}")
        print("| | | trials | covered | whole curve in the band | false alarms | stated uncertainty, median |")
        print("|---|---|---|---|---|---|---|")
        for (what, value), results in sorted(by.items()):
            all_ = np.array(results)
            covered, inside = (all_[:, :, 0] <= 1.0).mean(), (all_[:, :, 1] <= 1.0).mean()
            alarms = (all_[:, :, 1] > ALARM).mean()
            print(
                f"| {what} | {value} | {len(results)} | {100 * covered:.1f} % | {100 * inside:.1f} % |"
                f" {100 * alarms:.1f} % | {100 * np.median(all_[:, :, 2]):.2g} % |",
                flush=True,
            )


if __name__ == "__main__":
    main(*(int(text) for text in sys.argv[1:]))
