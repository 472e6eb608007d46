"""How nearly loops have to close.

That is to the rounding of the numbers that make them, or, where a file's digits do not allow it, within a tolerance
whose worth in torque is computed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError
from workbench.mjcf.compile import custom_text

CLOSED = 1e-13
"""Largest residual of a closed loop in a robot of a metre or less, metres (for turns: radians); a larger one, or one
that stands further from the origin, is held to as many times that. Rounding alone leaves a tenth of it."""

DIGITS = 1e-5
"""Of a robot's size: how far loops may stay open that cannot all close since the file's numbers have six digits or so,
where nothing else is said."""

RANK = 1e-9
"""Singular values below this fraction of the largest are zero where loops close to rounding."""

INCONSISTENT = 1e-9
"""Of the fastest speed: velocity residual from which on the actuated motion cannot be followed."""

KEY = "closure_tolerance"
"""``<custom><text name="closure_tolerance" data="1e-4"/>``: metres, instead of `DIGITS` of the robot's size."""

SPREAD = 10.0
"""Of loops of few digits: how many times as far as they may stay open their rows may disagree, by unit of speed."""


@dataclass(frozen=True)
class Tolerance:
    """Bounds of one model."""

    size: float
    """m, at least 1: the robot's extent"""
    closed: float
    """m: loops that close by rounding are at most so far open"""
    allowed: float
    """m: loops of few digits may stay so far open"""
    few_digits: bool = False
    """whether the loops agree only to some digits, so that they are closed by least squares"""

    @property
    def residual(self) -> float:
        """Largest residual of a loop that counts as closed, m."""
        return self.allowed if self.few_digits else self.closed

    @property
    def floor(self) -> float:
        """Residual at which Newton has reached rounding, m."""
        return 0.01 * self.closed

    @property
    def relative(self) -> float:
        """The fraction below which a singular value is one of a redundant row, or of noise."""
        return self.allowed / self.size if self.few_digits else RANK

    @property
    def velocity(self) -> float:
        """Largest velocity residual, as a fraction of the fastest actuated speed."""
        return SPREAD * self.allowed if self.few_digits else INCONSISTENT * self.size


def tolerance_of(model: mujoco.MjModel, drawn: mujoco.MjData, file: str) -> Tolerance:
    """Measure a model in its home pose, in which *drawn* has its positions.

    Raises
    ------
    ModelError
        A closure tolerance that is no positive number.
    """
    places = np.vstack([drawn.xpos[1:], drawn.site_xpos]) if model.nbody > 1 else np.zeros((1, 3))
    size = max(1.0, float(np.linalg.norm(np.ptp(places, axis=0))))
    far = max(1.0, float(np.abs(places).max(initial=0.0)))
    said = custom_text(model, KEY)
    allowed = DIGITS * size
    if said is not None:
        try:
            allowed = float(said)
        except ValueError:
            allowed = math.nan
        if not 0.0 < allowed < math.inf:
            raise ModelError(
                f'{file}: <text name="{KEY}" data="{said}">; allowed: a positive number of metres', file=file, key=KEY
            )
    return Tolerance(size, CLOSED * max(size, far), allowed)


def rank_of(jacobian: FloatArray, tolerance: Tolerance) -> int:
    """Rank of constraint rows ``(m, nv)``."""
    if not len(jacobian):
        return 0
    if tolerance.few_digits:
        values = np.linalg.svd(jacobian, compute_uv=False)
        return int(np.count_nonzero(values > tolerance.relative * values[0]))
    return int(np.linalg.matrix_rank(jacobian, tol=RANK * tolerance.size))


def few_digits_note(tolerance: Tolerance, gap: float) -> str:
    """What a reader should know of loops of few digits that are open by *gap* metres at home."""
    at_home = f", open by {gap:.2g} m at home" if gap > tolerance.closed else ""
    return (
        f"loops that agree only to some digits: they are closed by least squares{at_home}; what that is worth in torque"
        " is in the error budget"
    )


def weights_of(model: mujoco.MjModel, size: float) -> tuple[FloatArray, FloatArray]:
    """What a unit of each velocity ``(nv,)`` and of each coordinate ``(nq,)`` counts: lengths by the robot's size."""
    velocities, coordinates = np.ones(model.nv), np.ones(model.nq)
    kinds = np.asarray(model.jnt_type)
    for kind, lengths in ((mujoco.mjtJoint.mjJNT_SLIDE, 1), (mujoco.mjtJoint.mjJNT_FREE, 3)):
        joints = np.flatnonzero(kinds == kind.value)
        for array, first in ((velocities, model.jnt_dofadr), (coordinates, model.jnt_qposadr)):
            array[np.asarray(first)[joints][:, None] + np.arange(lengths)] = 1.0 / size
    return velocities, coordinates
