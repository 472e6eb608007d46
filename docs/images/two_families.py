"""Draw docs/images/two_families.png from a run: python docs/images/two_families.py reports/almeida_2010."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd

mpl.use("Agg")
from matplotlib import pyplot as plt

CASE, BOUND = "simulation_2", 1e-10
BLACK, BLUE, ORANGE = "#222222", "#0072b2", "#d55e00"


def draw(run: Path, target: Path) -> None:
    """Torques of simulation 2 above, errors over the peak of the reference below, for tau2 and tau3."""
    frame = pd.read_parquet(run / "series" / f"{CASE}.parquet")
    figure, axes = plt.subplots(2, 2, figsize=(9, 4.6), sharex=True, height_ratios=[1.2, 1], layout="constrained")
    for column, (joint, name) in enumerate((("q2", r"$\tau_2$"), ("q3", r"$\tau_3$"))):
        above, below = axes[0, column], axes[1, column]
        reference = frame[f"ref_distributed_{joint}"]
        peak = np.abs(reference).max()
        above.plot(frame.t, reference, color=BLACK, lw=4, alpha=0.25, label="MuJoCo")
        for candidate, colour, style in (("distributed", BLUE, "-"), ("lumped", ORANGE, "--")):
            torque = frame[f"cand_{candidate}_{joint}"]
            above.plot(frame.t, torque, color=colour, lw=1.1, ls=style, label=f"closed form, {candidate} masses")
            below.semilogy(frame.t, np.maximum(np.abs(torque - reference) / peak, 1e-18), color=colour, lw=0.9)
        below.axhline(BOUND, color=BLACK, lw=0.8, ls=":")
        below.set(ylim=(1e-18, 3), yticks=[1e-16, 1e-12, 1e-8, 1e-4, 1], xlabel="t in s")
        above.set_ylabel(f"{name} in N m")
        below.set_ylabel(f"error of {name}\nover its peak")
        below.text(frame.t.iloc[-1], 2 * BOUND, "bound", ha="right", va="bottom", fontsize=8)
        above.grid(alpha=0.3)
        below.grid(alpha=0.3)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    figure.savefig(target, dpi=130, metadata={"Software": None})


if __name__ == "__main__":
    draw(Path(sys.argv[1]), Path(__file__).with_suffix(".png"))
