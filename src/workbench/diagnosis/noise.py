"""How noisy a formula's own numbers are: single precision, finite differences inside, roots found to few digits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.arrays import FloatArray
from workbench.diagnosis.probes import Plan, ask
from workbench.diagnosis.subject import Subject

STEP = 1e-7
"""Relative move of a pose: over four of them a smooth formula is a parabola to 1e-20."""

SAFETY = 30.0
SEEN = 1e-11
"""Of the joint's largest part: less is rounding, and no noise to speak of."""

JUMP = 1e-3
"""No precision and no step of differences is as noisy: the formula's numbers jump from pose to pose."""


def noise_of(subject: Subject, plan: Plan, floors: FloatArray) -> FloatArray:
    """Noise at each pose ``(s,)`` as a fraction of a joint's largest part: how far four in a row are off a parabola.

    Zero where the formula fails near a pose.
    """
    q = plan.q
    step = STEP * np.maximum(np.abs(q).max(axis=(0, 1)), 0.1)
    rows = []
    for n in range(4):
        moved = replace(plan, q=q + n * step)
        rows.append(ask(moved, lambda q, qd, qdd, force: subject.formula(q, qd, qdd, force, {}))[0])
    bend = np.abs(rows[0] - 3 * rows[1] + 3 * rows[2] - rows[3]) / floors
    found: FloatArray = np.nan_to_num(bend, nan=0.0).max(axis=(0, 2))
    return np.where(found > SEEN, found, 0.0)
