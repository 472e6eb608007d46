"""Power balance: what the actuators and the external force put in must be stored or dissipated.

At every instant ``tau . qd + f . xd = dE/dt + dissipation``. The energy E is MuJoCo's own and is differentiated
numerically along a short piece of motion that has the sample's velocity and acceleration. Nothing of the projection
that yields tau enters the right-hand side: no constraint acceleration, no bias force, no multiplier. A wrong torque, a
lost sign or a lost body therefore shows here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray, as_batch, as_batches, as_force
from workbench.errors import ArrayError, MotionError
from workbench.reference.displaced import Displaced
from workbench.reference.energy_jump import energy_jump, losses
from workbench.reference.mujoco_reference import MujocoReference
from workbench.reference.power_terms import Terms, terms_of
from workbench.reference.result import ReferenceResult

MOST_SAMPLES = 150
"""Samples looked at; a longer motion is thinned out evenly, and the samples of greatest power are always kept."""

PEAKS = 30
"""How many of them are those of greatest power."""

FIRST_STEP = 0.05
"""First difference step as a fraction of the motion's time scale. Truncation falls with a high power of the step and
rounding grows with its inverse; over the bundled campaigns they meet at 0.02 to 0.05, near a singular pose lower."""

PLAIN = 5e-12
"""Of the peak power: what the balance of a robot with few bodies reaches, and a large one's no longer does."""

ROUNDING = 2.0
"""Roundings in one term of energy or power: of the coordinate or velocity in it, and of the term."""

HALVINGS = 6
"""How often a sample's step is halved at most, in search of the step where truncation meets rounding."""

CLOSE_ENOUGH = 1e-12
"""A sample is done when halving its step changes dE/dt by less than this fraction of the greatest |dE/dt|."""

FARTHEST = 0.3
"""Metres or radians: at the greatest speed the time scale is no longer than it takes to go so far, so that a motion
without acceleration has a time scale too."""

SHRINKINGS = 6
"""How often the first step is halved where a displaced sample leaves the workspace."""

WEIGHTS = (6 / 7, -15 / 56, 5 / 63, -1 / 56, 1 / 385, -1 / 5544)
"""Twelfth-order central difference: the weights of f(+k h) - f(-k h), k = 1 to 6."""


@dataclass(frozen=True)
class PowerBalance:
    """Power balance of m of the n samples; arrays ``(m,)`` in watts unless said otherwise."""

    samples: np.ndarray
    """which of the n samples, ``(m,)``, increasing"""
    residual: FloatArray
    """tau . qd + f . xd - dE/dt - dissipation"""
    actuators: FloatArray
    """tau . qd"""
    external: FloatArray
    """f . xd"""
    storage: FloatArray
    """dE/dt, kinetic and potential"""
    dissipation: FloatArray
    """damping qvel^2 + frictionloss |qvel|, summed over all freedoms, passive and ball ones too, and what further
    passive forces take that no energy of MuJoCo's holds: fluid, polynomial damping, gravity compensation"""
    peak_power: float
    """max |tau . qd| over all n samples, the normaliser, W"""
    relative: float
    """max |residual| / peak_power, or more where energy jumps between samples of a motion; NaN where the torques hold
    NaN and where nothing moves: a balance of nothing judges nothing, and NaN satisfies no bound"""
    worst_sample: int
    """index into the n samples of the largest |residual|"""
    differentiation: float
    """difference of dE/dt between two step sizes, over peak_power: below it, `relative` says nothing"""
    rounding: float
    """what rounding alone may leave of the balance, over peak_power: machine precision times the terms that cancel in
    it. In a machine of many heavy bodies they are far larger than the power that the actuators put in"""

    @property
    def uncertainty(self) -> float:
        """What the balance holds against the torques, over peak_power.

        It is `relative`; where rounding of the balance's own terms explains that, no more than `PLAIN` is put down to
        the torques.
        """
        return float(np.maximum(np.minimum(self.relative, PLAIN), self.relative - self.rounding))


def power_balance(
    reference: MujocoReference,
    q: ArrayLike,
    qd: ArrayLike,
    qdd: ArrayLike,
    mass_model: str = "distributed",
    external_force: ArrayLike | None = None,
    tau: ArrayLike | None = None,
    along: ArrayLike | None = None,
    *,
    known: ReferenceResult | None = None,
    displaced: Displaced | None = None,
) -> PowerBalance:
    """Hold torques against the rate of MuJoCo's energy.

    Parameters
    ----------
    reference
        The robot.
    q, qd, qdd
        Actuated position, velocity, acceleration, each ``(n, na)``, SI; samples need not form a trajectory.
    mass_model
        ``"distributed"`` or ``"lumped"``: whose energy is taken.
    external_force
        Newtons, paper frame, acting on the platform: ``(3,)`` or ``(n, 3)``.
    tau
        Torques to judge, ``(n, na)``; None judges the reference's own.
    along
        Times ``(n,)`` of samples that are one motion, as for `MujocoReference.inverse_dynamics`.
    known
        What `MujocoReference.inverse_dynamics` gives for these arguments, where it is at hand.
    displaced
        `displaced_samples` of the same motion, where another mass model's balance is struck too.

    Raises
    ------
    MotionError
        As `MujocoReference.inverse_dynamics`.
    ArrayError
        Wrong shapes, no samples, or q, qd, qdd that are not finite.
    """
    na = len(reference.joint_names)
    q, qd, qdd = as_batches(na, q=q, qd=qd, qdd=qdd)
    if not len(q):
        raise ArrayError("q: expected at least one sample, got none")
    force = as_force("external_force", external_force, len(q))
    result = known or reference.inverse_dynamics(q, qd, qdd, mass_model, force, along=along)
    torques = result.tau if tau is None else _same_shape(tau, q)
    power = np.sum(torques * qd, axis=1)
    peak = float(np.abs(power).max())
    kept = _selection(power)
    jump = 0.0 if along is None else energy_jump(reference, result, power, force, mass_model, np.asarray(along))
    displaced = displaced or displaced_samples(reference, result.qpos, q, qd, qdd)
    storage, doubt, steps = _energy_rate(displaced, kept, mass_model)
    qvel = result.qvel[kept]
    terms = terms_of(reference.compiled(mass_model), result.qpos[kept], qvel, result.qacc[kept])
    dissipation = losses(reference, mass_model, result.qpos[kept], qvel)
    external = np.sum(force[kept] * result.xd[kept], axis=1)
    residual = power[kept] + external - storage - dissipation
    size = np.abs(residual)
    return PowerBalance(
        samples=kept,
        residual=residual,
        actuators=power[kept],
        external=external,
        storage=storage,
        dissipation=dissipation,
        peak_power=peak,
        relative=_ratio(max(float(size.max()), jump), peak),
        worst_sample=int(kept[int(np.argmax(np.where(np.isnan(size), np.inf, size)))]),
        differentiation=_ratio(float(doubt.max()), peak),
        rounding=_ratio(float(_rounding(terms, steps).max()), peak),
    )


def _rounding(terms: Terms, steps: FloatArray) -> FloatArray:
    """What rounding leaves of each sample's balance, W: of the energies' difference quotient, and of the forces."""
    quotient = terms.energy * 2.0 * float(np.sum(np.abs(WEIGHTS))) / steps
    found: FloatArray = ROUNDING * np.finfo(np.float64).eps * (quotient + terms.power)
    return found


def _same_shape(tau: ArrayLike, q: FloatArray) -> FloatArray:
    # a candidate may return NaN: that is a finding, not a wrong argument
    torques = np.asarray(tau, dtype=np.float64)
    if torques.shape != q.shape:
        as_batch("tau", np.where(np.isfinite(torques), torques, 0.0), q.shape[1])
        raise ArrayError(f"tau: expected shape {q.shape}, got {torques.shape}", argument="tau", shape=torques.shape)
    return torques


def _selection(power: FloatArray) -> np.ndarray:
    n = len(power)
    if n <= MOST_SAMPLES:
        return np.arange(n)
    even = np.round(np.linspace(0, n - 1, MOST_SAMPLES - PEAKS)).astype(np.int64)
    greatest = np.argsort(-np.abs(power), kind="stable")[:PEAKS]
    return np.unique(np.concatenate([even, greatest]))


def time_scale(qd: FloatArray, qdd: FloatArray) -> float:
    """Seconds in which the fastest-changing joint changes its speed by its greatest speed; inf at rest.

    The least of max|qd_j| / max|qdd_j| over the joints, and of `FARTHEST` / max|qd|.
    """
    speed, acceleration = np.abs(qd).max(axis=0), np.abs(qdd).max(axis=0)
    if not speed.any():
        return float("inf")
    moving = (speed > 0.0) & (acceleration > 0.0)
    changes = speed[moving] / acceleration[moving]
    return float(min(changes.min(initial=np.inf), FARTHEST / speed.max()))


def displaced_samples(
    reference: MujocoReference, qpos: FloatArray, q: FloatArray, qd: FloatArray, qdd: FloatArray
) -> Displaced:
    """What a difference quotient looks at: the samples of a motion, closed at *qpos* ``(n, nq)``, moved both ways."""
    times = np.array([sign * k for k in range(1, len(WEIGHTS) + 1) for sign in (1.0, -1.0)])
    return Displaced(reference, qpos, q, qd, qdd, times)


def _energy_rate(displaced: Displaced, kept: np.ndarray, mass_model: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return dE/dt ``(m,)``, how far it is in doubt, both in watts, and the step that it was found with, s."""
    scale, count = time_scale(displaced.qd[kept], displaced.qdd[kept]), len(kept)
    if not np.isfinite(scale):
        return np.zeros(count), np.zeros(count), np.full(count, np.inf)
    step = FIRST_STEP * scale
    for attempt in range(SHRINKINGS + 1):
        try:
            rate = _difference(displaced, kept, mass_model, step)
            break
        except MotionError:
            # a displaced sample beyond the edge of the workspace; the samples themselves were closed before
            if attempt == SHRINKINGS:
                raise
            step *= 0.5
    best, doubt = rate.copy(), np.full(count, np.inf)
    estimate, steps = rate.copy(), np.full(count, step)
    active = np.arange(count)
    for _ in range(HALVINGS):
        step *= 0.5
        finer = _difference(displaced, kept[active], mass_model, step)
        # Richardson: the error of the twelfth-order difference falls by 2^12 with each halving
        refined = finer + (finer - rate[active]) / 4095.0
        gap = np.abs(refined - estimate[active])
        rate[active], estimate[active] = finer, refined
        better = gap < doubt[active]
        best[active[better]], doubt[active[better]], steps[active[better]] = refined[better], gap[better], step
        # where the gap grows again, rounding has taken over
        active = active[better & (gap > CLOSE_ENOUGH * np.abs(rate).max())]
        if not len(active):
            break
    return best, doubt, steps


def _difference(displaced: Displaced, samples: np.ndarray, mass_model: str, step: float) -> FloatArray:
    """Twelfth-order central difference of the energy along q + qd t + qdd t^2/2."""
    energy = displaced.energy(samples, step, mass_model).reshape(len(samples), len(WEIGHTS), 2)
    rate: FloatArray = (energy[:, :, 0] - energy[:, :, 1]) @ np.array(WEIGHTS) / step
    return rate


def _ratio(numerator: float, denominator: float) -> float:
    if denominator == 0.0:
        return float("nan") if numerator == 0.0 else float("inf")
    return numerator / denominator
