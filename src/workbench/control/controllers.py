"""The controllers: what torque follows from what is measured and what is asked for.

With e = q_d - q and gains kp = omega^2, kd = 2 zeta omega, M0 the diagonal of the reference's mass matrix at home:

- ``pd``: M0 (kp e + kd e');
- ``pd + weight``: the same, and the model's torques at rest at the measured coordinates;
- ``feed-forward + pd``: the same, and the model's torques on the motion that is asked for;
- ``computed torque``: the model's torques at the measured state for the acceleration qdd_d + kp e + kd e'.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from workbench.arrays import FloatArray
from workbench.control.sampling import Desired

Law = Callable[[int, FloatArray, FloatArray], FloatArray]
"""Tick, measured q and qd ``(na,)`` -> torques ``(na,)``."""


class Model(Protocol):
    """A formula with its robot and the external force that it knows: q, qd, qdd ``(n, na)`` -> tau ``(n, na)``."""

    def batch(self, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        """Torques of many samples."""

    def one(self, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        """Torques ``(na,)`` of one sample; the array is written over by the next call."""


@dataclass(frozen=True)
class Gains:
    """The same for all models."""

    bandwidth: float
    """Hz"""
    damping: float
    """ratio"""
    mass: FloatArray
    """``(na,)`` diagonal of the mass matrix at home, kg and kg m^2"""

    @property
    def kp(self) -> float:
        """Stiffness per mass, 1/s^2."""
        return (2.0 * math.pi * self.bandwidth) ** 2

    @property
    def kd(self) -> float:
        """Damping per mass, 1/s."""
        return 2.0 * self.damping * 2.0 * math.pi * self.bandwidth


def law_of(controller: str, model: Model | None, gains: Gains, desired: Desired) -> Law:
    """One of the package's own controllers, on a motion."""
    stiffness, damping = gains.mass * gains.kp, gains.mass * gains.kd
    kp, kd = gains.kp, gains.kd
    zero = np.zeros_like(desired.q[0])
    if controller == "computed torque":
        known = _needed(controller, model)

        def computed(k: int, q: FloatArray, qd: FloatArray) -> FloatArray:
            return known.one(q, qd, desired.qdd[k] + kp * (desired.q[k] - q) + kd * (desired.rates[k] - qd))

        return computed
    fed = np.zeros_like(desired.q)
    if controller == "feed-forward + pd":
        fed = _needed(controller, model).batch(desired.q, desired.qd, desired.qdd)

    def pd(k: int, q: FloatArray, qd: FloatArray) -> FloatArray:
        found: FloatArray = fed[k] + stiffness * (desired.q[k] - q) + damping * (desired.rates[k] - qd)
        return found

    if controller != "pd + weight":
        return pd
    weighing = _needed(controller, model)
    return lambda k, q, qd: pd(k, q, qd) + weighing.one(q, zero, zero)


def _needed(controller: str, model: Any) -> Model:
    if model is None:
        raise ValueError(f'controller "{controller}" needs a model')
    found: Model = model
    return found
