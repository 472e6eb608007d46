"""The paper's own conditions against singular poses, beside det J_r; [GarciaMurillo2016] section 5, Figures 7 and 8.

They are the paper's claims, not a test that the workbench trusts: det J_r = b Px Py / (q1 q2 q3) decides, and the
conditions as printed are neither necessary nor sufficient for it to differ from zero; see
docs/derivations/planar_4rprp.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray, as_batch
from workbench.robots.planar_4rprp.closed_form import Planar4Rprp
from workbench.robots.planar_4rprp.kernel import SINGULAR


@dataclass(frozen=True)
class PaperCondition:
    """One inequality of the paper over a whole motion."""

    name: str
    printed: bool
    """False: the paper only says that "a similar relation should be established" """
    value: float
    limit: float
    relation: str
    """``>`` or ``<``: what the paper demands of value and limit"""
    holds: bool
    unit: str


def paper_singularity_conditions(mechanism: Planar4Rprp, q: ArrayLike) -> tuple[PaperCondition, ...]:
    """Evaluate the paper's conditions over a motion.

    Parameters
    ----------
    mechanism
        The 4-RPRP robot.
    q
        Limb lengths over the motion, ``(n, 3)``, metres.

    Returns
    -------
    tuple of PaperCondition
        The two inequalities printed for limb 1 in loop H1; those for limb 3 and for loop H2 that the text asks for; and
        Figure 7's: w2 and w4 are never parallel.

    Raises
    ------
    MotionError
        A sample outside the workspace.
    """
    lengths = as_batch("q", q)
    parameters = mechanism.parameters
    q4 = mechanism.passive_length(lengths)
    loops = (("q1", lengths[:, 0], "q3", lengths[:, 2], "b"), ("q2", lengths[:, 1], "q4", q4, "a"))
    conditions = []
    for first, one, second, two, side in loops:
        width = getattr(parameters, side)
        printed = first == "q1"
        conditions += [
            _more(f"min {first} + min {second} > {side}", printed, one.min() + two.min(), width),
            _less(f"max {second} < sqrt(min {first}^2 + {side}^2)", printed, two.max(), np.hypot(one.min(), width)),
            _less(f"max {first} < sqrt(min {second}^2 + {side}^2)", False, one.max(), np.hypot(two.min(), width)),
        ]
    sine = parallelism(mechanism, lengths)
    figure_7 = "w2 not parallel to w4 (Figure 7): |w2 x w4| > 0"
    conditions.append(_more(figure_7, True, sine.min(), SINGULAR, unit="1"))
    return tuple(conditions)


def parallelism(mechanism: Planar4Rprp, q: ArrayLike) -> FloatArray:
    """|w2 x w4| ``(n,)``, zero where limbs 2 and 4 are in line; the paper calls that a direct singularity."""
    x = mechanism.forward_kinematics(q)
    p = mechanism.parameters
    low = x[:, 1] - p.h
    left, right = np.hypot(x[:, 0], low), np.hypot(p.a - x[:, 0], low)
    result: FloatArray = np.abs(low) * p.a / (left * right)
    return result


def _more(name: str, printed: bool, value: float, limit: float, unit: str = "m") -> PaperCondition:
    return PaperCondition(name, printed, float(value), float(limit), ">", bool(value > limit), unit)


def _less(name: str, printed: bool, value: float, limit: float) -> PaperCondition:
    return PaperCondition(name, printed, float(value), float(limit), "<", bool(value < limit), "m")
