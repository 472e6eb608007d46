"""How noisy a formula's own numbers are: single precision, finite differences inside, roots found to few digits."""

from __future__ import annotations

import numpy as np

from workbench.arrays import FloatArray
from workbench.diagnosis.probes import Plan
from workbench.diagnosis.subject import Subject
from workbench.errors import WorkbenchError

STEP = 1e-7
"""Relative move of a pose: over four of them a smooth formula is a parabola to 1e-20."""

FIRST_POSES = 6
SAFETY = 30.0
SEEN = 1e-11
"""Of the joint's largest part: less is rounding, and no noise to speak of."""


def noise_of(subject: Subject, plan: Plan, floors: FloatArray) -> float:
    """Noise as a fraction of a joint's largest part: how far four poses in a row are off a parabola."""
    small = plan.at(FIRST_POSES)
    q, qd, qdd, force = small.flat()
    step = STEP * np.maximum(np.abs(q).max(axis=0), 0.1)
    try:
        rows = [subject.formula(q + n * step, qd, qdd, force, {}) for n in range(4)]
    except WorkbenchError:
        return 0.0
    bend = np.abs(rows[0] - 3 * rows[1] + 3 * rows[2] - rows[3]).max(axis=0) / floors
    found = float(bend.max())
    return found if found > SEEN else 0.0
