"""What a case's torques are spent on: the reference's torque part by part over time, and body by body as one number."""

from __future__ import annotations

from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.cases import Case
from workbench.errors import ParameterError
from workbench.reference import MujocoReference, ReferenceResult
from workbench.reference.terms import torque_terms

MOST_SAMPLES = 5000
"""Of a longer case nothing is stored: 0.1 ms a sample, and more than a figure shows."""


def spent_on(
    case: Case, reference: MujocoReference, mass_model: str, result: ReferenceResult
) -> tuple[dict[str, FloatArray], dict[str, Any]]:
    """Take the reference's torques of a case apart; *result* is what it gave under *mass_model*.

    Returns
    -------
    columns, facts
        ``part_PART_JOINT`` ``(n,)`` in N or N m, which add up to the torque; and root mean squares by part and by body,
        joint by joint. Both empty where there are more actuators than freedoms, too many samples, or summands of
        another kind.
    """
    motion = case.motion
    if reference.excess_actuators or len(motion.t) > MOST_SAMPLES:
        return {}, {}
    try:
        terms = torque_terms(reference, motion.q, motion.qd, motion.qdd, mass_model, case.force, motion.t, known=result)
    except ParameterError:  # a summand that has no name here: no parts rather than parts that do not add up
        return {}, {}
    parts = {key[0]: tau for key, tau in terms.by("part").items()}
    bodies = {key[0]: tau for key, tau in terms.by("body").items()}
    columns = {
        f"part_{part.replace(' ', '_')}_{joint}": tau[:, index]
        for part, tau in parts.items()
        for index, joint in enumerate(terms.joints)
    }

    def sizes(sums: dict[str, FloatArray]) -> dict[str, dict[str, float]]:
        return {
            name: {joint: float(np.sqrt(np.mean(tau[:, i] ** 2))) for i, joint in enumerate(terms.joints)}
            for name, tau in sums.items()
        }

    return columns, {"mass_model": mass_model, "parts": sizes(parts), "bodies": sizes(bodies)}
