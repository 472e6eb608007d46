"""What power cannot account for between the samples of a motion: energy that jumps with another assembly."""

from __future__ import annotations

import numpy as np

from workbench.arrays import FloatArray
from workbench.reference.mujoco_reference import MujocoReference
from workbench.reference.power_terms import further_losses
from workbench.reference.result import ReferenceResult

ENERGY_ROUNDING = 1e-13
"""Of the energy: what its rounding may pretend between two samples."""


def losses(reference: MujocoReference, mass_model: str, qpos: FloatArray, qvel: FloatArray) -> FloatArray:
    """What friction, damping and other passive forces take, ``(m,)`` in watts, at ``(m, nq)`` and ``(m, nv)``."""
    model, rub = reference.compiled(mass_model), reference.structure.friction
    dry = rub.passive.copy()
    dry[reference.structure.actuated] = rub.actuated
    taken: FloatArray = qvel**2 @ np.asarray(model.dof_damping) + np.abs(qvel) @ dry
    taken = taken + np.abs(qvel @ rub.tendon_rows.T) @ rub.tendon
    return taken + further_losses(model, qpos, qvel)


def energy_jump(
    reference: MujocoReference,
    result: ReferenceResult,
    power: FloatArray,
    force: FloatArray,
    mass_model: str,
    t: FloatArray,
) -> float:
    """Largest change of energy between neighbours that no power between them accounts for, in watts over the step.

    Whatever rule integrates the power over a step, its error is below the step times how much the power changes around
    it; a motion that goes on has nothing beyond that, one that jumps to another assembly has its gap in height.
    """
    if len(t) < 2:
        return 0.0
    lost = losses(reference, mass_model, result.qpos, result.qvel)
    put_in = power + np.sum(force * result.xd, axis=1) - lost
    change = np.diff(result.energy.sum(axis=1)) / np.diff(t)
    around = np.stack([np.roll(put_in, shift) for shift in (1, 0, -1, -2)])
    around[0, 0], around[2:, -1], around[3, -2:] = put_in[0], put_in[-1], put_in[-1]
    low, high = around.min(axis=0)[:-1], around.max(axis=0)[:-1]
    # as much again to both sides: between the samples the power may peak
    room = high - low
    unexplained = np.maximum(change - (high + room), (low - room) - change)
    if np.isnan(unexplained).any():
        return float("nan")
    explained = ENERGY_ROUNDING * float(np.abs(result.energy).max() / np.diff(t).min())
    return max(0.0, float(unexplained.max()) - explained)
