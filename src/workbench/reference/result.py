"""What the reference says: one result of n samples, and the freedoms it counted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import MotionError


def refuse_overflow(what: str, values: FloatArray, rates: FloatArray) -> None:
    """Refuse samples whose results ``(n, m)`` are no finite numbers.

    Raises
    ------
    MotionError
        Naming the first sample and its rates ``(n, k)``.
    """
    bad = ~np.isfinite(values).all(axis=1)
    if bad.any():
        sample = int(np.argmax(bad))
        raise MotionError(
            f"sample {sample}: rates so large that {what} overflow ({', '.join(f'{v:.3g}' for v in rates[sample])})",
            sample=sample,
            value=rates[sample].tolist(),
        )


@dataclass(frozen=True)
class ReferenceResult:
    """Inverse dynamics of n samples; arrays float64, SI, platform quantities in the paper's (base body's) frame."""

    tau: FloatArray
    """``(n, na)`` actuator forces (N) and torques (N m); of least norm where there are more actuators than freedoms"""
    x: FloatArray
    """``(n, 3)`` platform position, m"""
    xd: FloatArray
    xdd: FloatArray
    rotation: FloatArray
    """``(n, 3, 3)`` of the platform site: vector in the base's frame = rotation @ vector in the site's frame"""
    omega: FloatArray
    """``(n, 3)`` angular velocity of the platform, rad/s"""
    alpha: FloatArray
    """``(n, 3)`` angular acceleration of the platform, rad/s^2"""
    reactions: dict[str, FloatArray]
    """force ``(n, 3)`` in N, base frame, that the parent exerts on the child body at each joint, and that the second
    site's body exerts on the first's at each loop closure; none where there are more actuators than freedoms, and none
    where a fluid or a spatial tendon acts on bodies"""
    closure_residual: FloatArray
    """``(n,)`` largest open loop coordinate, m (rad for turns)"""
    velocity_residual: FloatArray
    acceleration_residual: FloatArray
    rank: np.ndarray
    """``(n,)`` rank of the loop constraints on the passive freedoms"""
    condition: FloatArray
    """``(n,)`` estimate of the condition number of the passive loop Jacobian, from the pivots of its QR factor"""
    energy: FloatArray
    """``(n, 2)`` potential and kinetic energy, J"""
    qpos: FloatArray
    qvel: FloatArray
    qacc: FloatArray
    slack: FloatArray
    """``(n, na)`` what the loops' disagreement is worth in each torque, N or N m, where a file's digits keep them from
    closing together; zero where they close"""


@dataclass(frozen=True)
class Mobility:
    """Freedoms counted from the constraint Jacobian at the home pose."""

    mobility: int
    """freedoms left for the actuators: joint freedoms less rank less idle freedoms"""
    joint_freedoms: int
    constraint_rows: int
    rank: int
    redundant_rows: int
    idle_freedoms: int
    """spins of rods between two spherical joints about their own axes"""
