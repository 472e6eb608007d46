"""How the reference's cost grows with samples and joints, on towers of four-bars; exponents by least squares of logs.

python benchmarks/growth.py [--stages 2 5 10 20] [--samples 101 1001 5001]
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

HEAD = '<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81"><flag contact="disable"/></option>'


def tower(stages: int) -> str:
    """*stages* planar four-bars, each on the coupler of the one below: three joints, a loop and a motor each."""
    inside, loops, motors = "", "", ""
    for k in reversed(range(stages)):
        height = 0.09 + 0.002 * (k % 5)
        inside = (
            f'<body name="crank{k}"><joint name="q{k}" axis="0 1 0"/>'
            f'<geom type="capsule" fromto="0 0 0 0 0 {height}" size=".01" mass="0.5"/>'
            f'<body name="coupler{k}" pos="0 0 {height}"><joint name="a{k}" axis="0 1 0"/>'
            f'<geom type="capsule" fromto="0 0 0 .2 0 .03" size=".01" mass="0.5"/><site name="top{k}"/>'
            f'<body name="rocker{k}" pos="0.2 0 0"><joint name="b{k}" axis="0 1 0"/>'
            f'<geom type="capsule" fromto="0 0 0 0.02 0 {-height}" size=".01" mass="0.5"/>'
            f'<site name="s{k}" pos="0 0 {-height}"/></body>'
            f'<body name="next{k}" pos="0.1 0 0.02" euler="0 0 0.2">{inside}</body></body></body>'
            f'<site name="f{k}" pos="0.2 0 0"/>'
        )
        loops += f'<connect name="loop{k}" site1="s{k}" site2="f{k}"/>'
        motors += f'<motor joint="q{k}"/>'
    said = f'<text name="base_body" data="world"/><text name="platform_site" data="top{stages - 1}"/>'
    return (
        f'{HEAD}<custom>{said}</custom><worldbody><body name="ground">{inside}</body></worldbody>'
        f"<equality>{loops}</equality><actuator>{motors}</actuator></mujoco>"
    )


def seconds(path: Path, samples: int, calls: int) -> float:
    """Least CPU time of one motion's inverse dynamics; the reference is made and its kernels are compiled before."""
    import workbench as wb

    reference = wb.MujocoReference(path)
    t = np.linspace(0.0, 1.0, samples)[:, None]
    rate = 2.0 * np.pi
    least = np.inf
    for call in range(calls):
        size = 0.05 + 1e-6 * call  # another motion each time, so that nothing is at hand
        q = reference.home + size * np.sin(rate * t)
        qd, qdd = size * rate * np.cos(rate * t) + 0 * q, -size * rate**2 * np.sin(rate * t) + 0 * q
        clock = time.process_time()
        reference.inverse_dynamics(q, qd, qdd, along=t[:, 0])
        least = min(least, time.process_time() - clock)
    return least


def exponent(sizes: list[int], values: list[float]) -> float:
    """Slope of the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def main() -> None:
    """Measure and print a table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--stages", type=int, nargs="+", default=[2, 5, 10, 20])
    parser.add_argument("--samples", type=int, nargs="+", default=[101, 1001, 5001])
    parser.add_argument("--calls", type=int, default=5)
    given = parser.parse_args()
    table: dict[tuple[int, int], float] = {}
    with tempfile.TemporaryDirectory() as folder:
        for stages in given.stages:
            path = Path(folder) / f"tower{stages}.xml"
            path.write_text(tower(stages))
            for samples in given.samples:
                table[stages, samples] = seconds(path, samples, given.calls)
    print("| joints | loops | " + " | ".join(f"{n} samples, us each" for n in given.samples) + " | exponent |")
    print("|---" * (3 + len(given.samples)) + "|")
    for stages in given.stages:
        row = [table[stages, n] for n in given.samples]
        cells = [f"{1e6 * value / n:.1f}" for value, n in zip(row, given.samples, strict=True)]
        print(f"| {3 * stages} | {stages} | {' | '.join(cells)} | {exponent(given.samples, row):.2f} |")
    fits = [exponent(given.stages, [table[stages, n] for stages in given.stages]) for n in given.samples]
    print("| exponent in joints | | " + " | ".join(f"{fit:.2f}" for fit in fits) + " | |")


if __name__ == "__main__":
    main()
