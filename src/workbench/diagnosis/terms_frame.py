"""Torques term by term as a tidy frame."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from workbench.campaign.cases import resolve_cases
from workbench.campaign.spec import load_campaign
from workbench.reference.terms import torque_terms

if TYPE_CHECKING:
    import pandas as pd


def terms(
    campaign: str | Path, *, case: str | None = None, model: Path | None = None, mass_model: str = "distributed"
) -> pd.DataFrame:
    """Take the reference's torque apart over a campaign's motions: which part, which body, which direction.

    Parameters
    ----------
    campaign
        Campaign file, or the name of one that comes with the package.
    case
        One case only; None is all.
    model
        A model in place of the campaign's.
    mass_model
        ``"distributed"`` or ``"lumped"``.

    Returns
    -------
    pandas.DataFrame
        One row per case, sample, joint and item, with the columns ``case``, ``t`` (s), ``joint``, ``part`` (weight,
        acceleration, velocity, springs, friction, external force), ``body``, ``direction`` (x, y, z of the base frame,
        turning) and ``torque``, in the unit that ``frame.attrs["units"]["torque"]`` has for the joint. Grouped over
        items the torques add up to the reference's, to rounding.

    Raises
    ------
    WorkbenchError
        Bad input, or more actuators than freedoms.
    """
    import numpy as np
    import pandas as pd

    spec, file = load_campaign(campaign)
    # candidates do not matter here, and the user's own are not asked for
    spec = spec.model_copy(update={"candidate": [], "figure": [], "claim": []})
    pieces = []
    units: dict[str, Any] = {}
    for one in resolve_cases(spec, file, model, (case,) if case else ()):
        reference = one.robot.reference
        motion = one.motion
        found = torque_terms(reference, motion.q, motion.qd, motion.qdd, mass_model, one.force, motion.t)
        units = dict(zip(found.joints, one.robot.force_units, strict=True))
        n, na = found.tau.shape
        at = {"case": one.name, "t": np.repeat(motion.t, na), "joint": np.tile(found.joints, n)}
        pieces += [
            pd.DataFrame(
                at | {"part": item.part, "body": item.body, "direction": item.direction, "torque": item.tau.ravel()}
            )
            for item in found.items
        ]
    frame = pd.concat(pieces, ignore_index=True)
    frame.attrs = {"units": {"t": "s", "torque": units}}
    return frame
