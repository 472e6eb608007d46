"""The parts of a torque, from the answers to the probes: weight, inertia, velocity products, friction, force."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from workbench.arrays import FloatArray
from workbench.diagnosis.probes import Plan

WEIGHT, INERTIA, VELOCITY, VISCOUS, DRY, FORCE, REST = (
    "weight", "inertia", "velocity", "viscous friction", "dry friction", "external force", "remainder",
)  # fmt: skip
ODD = "odd"
"""what is no part of any mechanism's torque: even in accelerations, or no square of a rate"""


@dataclass(frozen=True)
class Part:
    """One part of a torque: its kind, and the joints or the axis that it goes with."""

    kind: str
    of: tuple[int, ...] = ()

    def label(self, joints: tuple[str, ...]) -> str:
        """Name the part as a reader writes it."""
        names = [joints[i] for i in self.of] if self.kind not in (FORCE, WEIGHT, REST) else []
        if self.kind == INERTIA:
            return f"{names[0]}''"
        if self.kind == VELOCITY:
            return f"{names[0]}'^2" if names[0] == names[1] else f"{names[0]}' {names[1]}'"
        if self.kind in (VISCOUS, DRY):
            return f"{self.kind} {names[0]}'"
        if self.kind == FORCE:
            return f"force F{'xyz'[self.of[0]]}"
        if self.kind == ODD:
            return f"not of second degree {names[0]}"
        return self.kind


Parts = dict[Part, FloatArray]
"""part -> torques ``(s, na)`` of that part at the probes' rates, accelerations and force, N and N m"""


def take_apart(plan: Plan, tau: FloatArray, with_force: bool) -> Parts:
    """Split the answers ``(k, s, na)``; an entry is NaN where what it needs is.

    A formula that fails at rest or where a rate is zero is fitted from the states at which it answers.
    """
    na = tau.shape[2]
    at = {label: tau[i] for i, label in enumerate(plan.labels)}
    parts: Parts = {}
    rest = at["rest",]
    parts[Part(WEIGHT)] = rest
    for j in range(na):
        up, down = at["acceleration", j, 1], at["acceleration", j, -1]
        parts[Part(INERTIA, (j,))] = (up - down) / 2
        single, double = _even(at, rest, j, 1), _even(at, rest, j, 2)
        odd = (up + down) / 2 - rest, double - 4 * single
        parts[Part(ODD, (j,))] = np.where(np.abs(odd[0]) > np.abs(odd[1]), odd[0], odd[1])
        slow, fast = ((at["rate", j, n] - at["rate", j, -n]) / 2 for n in (1, 2))
        parts[Part(VISCOUS, (j,))] = fast - slow
        parts[Part(DRY, (j,))] = 2 * slow - fast
        parts[Part(VELOCITY, (j, j))] = single
    for j, k in combinations(range(na), 2):
        both = (at["rates", j, k, 1] + at["rates", j, k, -1]) / 2 - rest
        parts[Part(VELOCITY, (j, k))] = both - parts[Part(VELOCITY, (j, j))] - parts[Part(VELOCITY, (k, k))]
    if with_force:
        for axis in range(3):
            parts[Part(FORCE, (axis,))] = at["force", axis] - rest
    if not all(np.isfinite(values).all() for values in parts.values()):
        parts = _fitted(plan, tau, parts)
    parts[Part(REST)] = _remainder(plan, at, parts, with_force)
    return parts


def _even(at: dict[tuple[str | int, ...], FloatArray], rest: FloatArray, joint: int, size: int) -> FloatArray:
    even: FloatArray = (at["rate", joint, size] + at["rate", joint, -size]) / 2 - rest
    return even


def design(plan: Plan, parts: list[Part], index: int) -> FloatArray:
    """Weights of the parts in the torque of probe *index*."""
    qd, qdd, force = plan.qd[index, 0] / plan.rates, plan.qdd[index, 0] / plan.accelerations, plan.force[index, 0]
    row = np.zeros(len(parts))
    for column, part in enumerate(parts):
        of = part.of
        if part.kind == WEIGHT:
            row[column] = 1.0
        elif part.kind == INERTIA:
            row[column] = qdd[of[0]]
        elif part.kind == VELOCITY:
            row[column] = qd[of[0]] * qd[of[1]]
        elif part.kind == VISCOUS:
            row[column] = qd[of[0]]
        elif part.kind == DRY:
            row[column] = np.sign(qd[of[0]])
        elif part.kind == FORCE:
            row[column] = force[of[0]] / plan.push
    return row


def _fitted(plan: Plan, tau: FloatArray, parts: Parts) -> Parts:
    """Fill what direct probing could not give, pose by pose, from the states that the formula answers."""
    known = [part for part in parts if part.kind != ODD]
    matrix = np.array([design(plan, known, i) for i in range(len(plan.labels))])
    filled = {part: values.copy() for part, values in parts.items()}
    for pose in range(tau.shape[1]):
        rows = np.isfinite(tau[:, pose]).all(axis=1)
        if all(np.isfinite(filled[part][pose]).all() for part in known) or not rows.any():
            continue
        solution, _, rank, _ = np.linalg.lstsq(matrix[rows], tau[rows, pose], rcond=1e-9)
        _, values, right = np.linalg.svd(matrix[rows])
        null = right[int((values > 1e-9 * values[0]).sum()) :] if rank < len(known) else np.zeros((0, len(known)))
        for column, part in enumerate(known):
            if not np.isfinite(filled[part][pose]).all() and (np.abs(null[:, column]) < 1e-9).all():
                filled[part][pose] = solution[column]
    return filled


def _remainder(plan: Plan, at: dict[tuple[str | int, ...], FloatArray], parts: Parts, with_force: bool) -> FloatArray:
    """What the states with everything at once have beyond the sum of the parts; the largest of them."""
    known = [part for part in parts if part.kind != ODD]
    worst = np.zeros_like(at["rest",])
    for index, label in enumerate(plan.labels):
        if label[0] != "mixed":
            continue
        row = design(plan, known, index)
        total = sum(weight * parts[part] for weight, part in zip(row, known, strict=True) if weight)
        gap = at[label] - total
        worst = np.where(np.abs(gap) > np.abs(worst), gap, worst)
    return worst
