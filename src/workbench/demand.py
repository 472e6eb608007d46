"""What a motion asks of an actuator: peak and root mean square of its force or torque, speed, power, work.

Mechanical figures at the joint, behind the gear. What a motor loses, its own rotor where the model has no armature, and
what a drive can feed back are not in them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.arrays import FloatArray


@dataclass(frozen=True)
class Demand:
    """Of one actuator over one case; SI, force or torque as the joint slides or turns."""

    peak: float
    """largest size of force or torque, N or N m"""
    peak_at_s: float
    rms: float
    """root mean square over time, N or N m: what heats a motor, if the case is repeated without pause"""
    speed: float
    """largest size of speed, m/s or rad/s"""
    speed_at_s: float
    power: float
    """largest size of mechanical power, W, driving or braking"""
    power_at_s: float
    braking: float
    """largest power that flows back from the joint, W; 0 where it always drives"""
    work: float
    """what the actuator puts in while it drives, J; nothing of it is won back"""
    returned: float
    """what flows back while it brakes, J"""


def demand_of(time: FloatArray, speed: FloatArray, force: FloatArray) -> Demand:
    """Return what one actuator has to give.

    Parameters
    ----------
    time, speed, force
        Shape ``(n,)``, s (rising, not necessarily evenly), m/s or rad/s, N or N m.

    Returns
    -------
    Demand
        Integrals over time by the trapezoidal rule. A force that is not a number makes figures that are not.
    """
    power = force * speed
    steps = np.diff(time)
    span = float(steps.sum())

    def integral(values: FloatArray) -> float:
        return float(np.sum(0.5 * (values[1:] + values[:-1]) * steps))

    def largest(values: FloatArray) -> tuple[float, float]:
        size = np.abs(values)
        at = int(np.argmax(np.where(np.isnan(size), np.inf, size)))
        return float(size[at]), float(time[at])

    mean_square = integral(force**2) / span if span > 0 else float(np.mean(force**2))
    return Demand(
        *largest(force),
        float(np.sqrt(mean_square)),
        *largest(speed),
        *largest(power),
        braking=float(np.max(np.maximum(-power, 0.0))),
        work=integral(np.maximum(power, 0.0)),
        returned=integral(np.maximum(-power, 0.0)),
    )
