"""States at which a formula is asked, so that its answers can be taken apart: at rest, one rate or acceleration alone.

The torque of a mechanism whose loops do not depend on time is affine in accelerations and external force and quadratic
in rates, but for friction. So few states at each pose take it apart exactly, and some more tell whether it is so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from workbench.arrays import FloatArray
from workbench.diagnosis.subject import Subject
from workbench.errors import MotionError
from workbench.reference import MujocoReference

POSES = 40
SEED = 20100
MIXED = 3
"""States with all rates, accelerations and forces at once, which must be the sum of what was found apart."""

JITTER = 0.08
"""How far a pose is moved off the motion, as a fraction of the motion's range: so that no two joints go alike."""


@dataclass(frozen=True)
class Plan:
    """States of all probes: ``(k, s, na)`` each, k probes at s poses, and the force ``(k, s, 3)``."""

    labels: tuple[tuple[str | int, ...], ...]
    q: FloatArray
    qd: FloatArray
    qdd: FloatArray
    force: FloatArray
    rates: FloatArray
    """``(na,)`` the rate that a joint is moved with, m/s or rad/s"""
    accelerations: FloatArray
    push: float
    """newtons"""
    poses: FloatArray = field(repr=False)
    """``(s, na)``"""

    def flat(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """The same as batches ``(k s, ...)``."""
        na = self.q.shape[2]
        return (
            self.q.reshape(-1, na), self.qd.reshape(-1, na), self.qdd.reshape(-1, na), self.force.reshape(-1, 3),
        )  # fmt: skip

    def at(self, poses: int) -> Plan:
        """The same probes at the first few poses."""
        return self.of(np.arange(min(poses, len(self.poses))))

    def of(self, poses: NDArray[np.int_]) -> Plan:
        """The same probes at some of the poses, by number."""
        return Plan(
            self.labels, self.q[:, poses], self.qd[:, poses], self.qdd[:, poses], self.force[:, poses],
            self.rates, self.accelerations, self.push, self.poses[poses],
        )  # fmt: skip


def choose_poses(subject: Subject, count: int = POSES) -> FloatArray:
    """Poses ``(count, na)`` inside the range of the motions, off their tracks, that the reference reaches."""
    q, rng = subject.motion[0], np.random.default_rng(SEED)
    span = np.ptp(q, axis=0)
    # a joint that stands still in all motions moves a little with those of its kind
    reach = JITTER * np.where(span > 0.05 * span.max(initial=0.0), span, 0.3 * span.max(initial=0.0))
    reach = np.where(reach > 0.0, reach, 0.01)
    picked = q[rng.permutation(len(q))[np.arange(count) % len(q)]]
    moved = picked + reach * rng.uniform(-1.0, 1.0, picked.shape)
    reference = subject.reference({})
    if reference.excess_actuators:
        return np.asarray(picked)
    if _in_reach(reference, moved):
        return np.asarray(moved)
    return np.array([_reached(reference, kept, aim) for kept, aim in zip(picked, moved, strict=True)])


def _in_reach(reference: MujocoReference, poses: FloatArray) -> bool:
    zero = np.zeros_like(poses)
    try:
        reference.inverse_dynamics(poses, zero, zero)
    except MotionError:
        return False
    return True


def _reached(reference: MujocoReference, kept: FloatArray, aim: FloatArray) -> FloatArray:
    """The nearest point to *aim*, on the way from a pose of the motion, that is in reach."""
    for share in (1.0, 0.3, 0.1):
        pose = kept + share * (aim - kept)
        if _in_reach(reference, pose[None]):
            return np.asarray(pose)
    return kept


def make_plan(subject: Subject, poses: FloatArray, mixed: int = MIXED) -> Plan:
    """Lay out the states: sizes of rates and accelerations are those of the motions, so that parts weigh as there.

    *mixed* is the number of states with everything at once; of a formula that fails at rest they tell the parts.
    """
    s, na = poses.shape
    rates = _typical(subject.motion[1], 1.0)
    accelerations = _typical(subject.motion[2], 10.0)
    masses = np.asarray(subject.reference({}).compiled(subject.mass_model).body_mass)
    push = max(float(masses[1:].sum()), 0.1) * 10.0
    rows: list[tuple[tuple[str | int, ...], FloatArray, FloatArray, FloatArray]] = []
    zero, none = np.zeros(na), np.zeros(3)
    eye = np.eye(na)

    def add(label: tuple[str | int, ...], qd: FloatArray, qdd: FloatArray, force: FloatArray) -> None:
        rows.append((label, qd, qdd, force))

    add(("rest",), zero, zero, none)
    for j in range(na):
        for sign in (1, -1):
            add(("acceleration", j, sign), zero, sign * accelerations[j] * eye[j], none)
        for sign in (1, -1, 2, -2):
            add(("rate", j, sign), sign * rates[j] * eye[j], zero, none)
    for j, k in combinations(range(na), 2):
        for sign in (1, -1):
            add(("rates", j, k, sign), sign * (rates[j] * eye[j] + rates[k] * eye[k]), zero, none)
    for axis in range(3):
        add(("force", axis), zero, zero, push * np.eye(3)[axis])
    rng = np.random.default_rng(SEED + 1)
    for number in range(mixed):
        sign = rng.choice([-1.0, 1.0], na)
        sizes = rng.uniform(0.4, 1.0, (3, max(na, 3)))
        turn = rng.choice([-1.0, 1.0], 3)
        add(
            ("mixed", number),
            sign * sizes[0, :na] * rates,
            sizes[1, :na] * accelerations * rng.choice([-1.0, 1.0], na),
            turn * sizes[2, :3] * push,
        )
    labels = tuple(row[0] for row in rows)
    qd, qdd, force = (np.repeat(np.array([row[i] for row in rows])[:, None], s, axis=1) for i in (1, 2, 3))
    q = np.repeat(poses[None], len(rows), axis=0)
    if not subject.takes_force:
        force = np.zeros_like(force)
    return Plan(labels, q, qd, qdd, force, rates, accelerations, push, poses)


def _typical(values: FloatArray, otherwise: float) -> FloatArray:
    """Half of the largest size in the motions; of the other joints' where one never moves."""
    sizes = np.abs(values).max(axis=0) / 2
    filling = sizes.max(initial=0.0) or otherwise
    return np.asarray(np.where(sizes > 1e-3 * filling, sizes, filling))


Torques = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]


def ask(plan: Plan, torques: Torques) -> tuple[FloatArray, dict[tuple[str | int, ...], str]]:
    """Ask for the torques of all states; where some fail, pose by pose and probe by probe.

    A pose at which the formula fails at rest and with everything moving is one at which it fails.

    Returns
    -------
    tau, failures
        ``(k, s, na)``, NaN where it failed, and by probe what was said of the first failure.
    """
    from workbench.errors import WorkbenchError

    try:
        return torques(*plan.flat()).reshape(plan.q.shape), {}
    except WorkbenchError:
        pass
    found = np.full(plan.q.shape, np.nan)
    failures: dict[tuple[str | int, ...], str] = {}
    every = list(range(len(plan.labels)))

    def answered(probes: list[int], poses: list[int]) -> bool:
        states = (array[np.ix_(probes, poses)] for array in (plan.q, plan.qd, plan.qdd, plan.force))
        try:
            tau = torques(*(array.reshape(-1, array.shape[2]) for array in states))
        except WorkbenchError as error:
            if len(probes) == 1:
                failures.setdefault(plan.labels[probes[0]], str(error))
            return False
        found[np.ix_(probes, poses)] = tau.reshape(len(probes), len(poses), -1)
        return True

    poses = [pose for pose in range(plan.q.shape[1]) if not answered(every, [pose])]
    if not poses:  # it fails only on all of them at once
        return found, {plan.labels[0]: "it fails where all states are asked at once, and answers one pose at a time"}
    hard = [probe for probe in every if not answered([probe], poses)]
    ends = [probe for probe in hard if plan.labels[probe] in (("rest",), ("mixed", 0))]
    for pose in poses:
        fine = [answered([probe], [pose]) for probe in ends]
        if len(ends) < 2 or any(fine):
            for probe in hard:
                if probe not in ends:
                    answered([probe], [pose])
    return found, failures
