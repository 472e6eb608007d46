"""What every mechanism's torque has, reference or not: a symmetric positive mass matrix, passivity, an energy."""

from __future__ import annotations

import numpy as np

from workbench.arrays import FloatArray
from workbench.diagnosis.parts import FORCE, INERTIA, VELOCITY, WEIGHT, Part, Parts
from workbench.diagnosis.probes import Plan
from workbench.diagnosis.result import STRUCTURE, Finding, percent
from workbench.diagnosis.subject import Subject
from workbench.errors import WorkbenchError

SYMMETRIC = 1e-7
STEP = 1e-5
PASSIVE = 1e-4
"""Of the largest velocity product: finite differences of the mass matrix reach 1e-7 or so."""
CURL_POSES = 6


def mass_matrix(parts: Parts, plan: Plan) -> FloatArray:
    """M ``(s, na, na)``, row by joint, in kg, kg m and kg m^2."""
    na = len(plan.rates)
    return np.stack([parts[Part(INERTIA, (j,))] / plan.accelerations[j] for j in range(na)], axis=2)


def structure_findings(subject: Subject, plan: Plan, parts: Parts, noise: float) -> list[Finding]:
    """Check the formula against itself; nothing here looks at the reference."""
    joints = subject.joints
    found: list[Finding] = []
    mass = mass_matrix(parts, plan)
    good = np.isfinite(mass).all(axis=(1, 2))
    if not good.any():
        return found
    mass = mass[good]
    scale = np.sqrt(np.abs(np.einsum("sii->si", mass)).max(axis=0))
    scaled = mass / np.maximum(np.outer(scale, scale), 1e-300)
    skew = np.abs(scaled - scaled.swapaxes(1, 2)).max(axis=0)
    pairs = [(i, j) for i in range(len(joints)) for j in range(i) if skew[i, j] > max(SYMMETRIC, 100 * noise)]
    if pairs:
        named = ", ".join(f"{joints[j]} and {joints[i]}" for i, j in pairs)
        found.append(
            Finding(
                STRUCTURE,
                f"the mass matrix is not symmetric between {named} (by up to"
                f" {percent(max(skew[p] for p in pairs))}): one of the two entries is wrong",
                tuple(dict.fromkeys(joints[k] for p in pairs for k in p)),
                tuple(dict.fromkeys(f"{joints[k]}''" for p in pairs for k in p)),
            )
        )
    least = np.linalg.eigvalsh((scaled + scaled.swapaxes(1, 2)) / 2).min()
    if least <= -SYMMETRIC:
        found.append(
            Finding(STRUCTURE, "the mass matrix is not positive definite: there is motion with negative energy", joints)
        )
    if not pairs:
        found += _passivity(subject, plan, parts, joints, noise)
    return found


def _slopes(subject: Subject, plan: Plan) -> tuple[FloatArray, FloatArray, FloatArray | None] | None:
    """Derivatives by q of M, of the weight, and of J: ``(s, na, na, na)``, ``(s, na, na)``, ``(s, na, 3, na)``."""
    small = plan.at(CURL_POSES)
    s, na = small.poses.shape
    columns = []
    for j in range(na):
        step = np.zeros(na)
        step[j] = STEP * max(float(np.ptp(subject.motion[0][:, j])), 0.05)
        sides = []
        for sign in (1, -1):
            q = small.poses + sign * step
            zero, none = np.zeros_like(q), np.zeros((s, 3))
            try:
                rest = subject.formula(q, zero, zero, none, {})
                rows = [subject.formula(q, zero, zero + a * e, none, {}) - rest for a, e in _units(plan)]
            except WorkbenchError:
                return None
            sides.append((np.stack([r / a for r, a in zip(rows, plan.accelerations, strict=True)], axis=2), rest))
        columns.append(tuple((one - other) / (2 * step[j]) for one, other in zip(*sides, strict=True)))
    return np.stack([c[0] for c in columns], axis=1), np.stack([c[1] for c in columns], axis=1), None


def _units(plan: Plan) -> list[tuple[float, FloatArray]]:
    return list(zip(plan.accelerations, np.eye(len(plan.accelerations)), strict=True))


def _passivity(subject: Subject, plan: Plan, parts: Parts, joints: tuple[str, ...], noise: float) -> list[Finding]:
    """Mdot - 2 C must do no work, and the weight must be a gradient: else energy comes from nowhere."""
    slopes = _slopes(subject, plan)
    if slopes is None or noise > PASSIVE * STEP:
        return []
    by_q, weight_by_q, _ = slopes
    small = plan.at(CURL_POSES)
    s, na = small.poses.shape
    qd = np.ones((s, 1)) * plan.rates
    velocity = sum(parts[Part(VELOCITY, (i, j))][:s] for i in range(na) for j in range(i, na))
    moved = np.einsum("skij,sk,sj->si", by_q, qd, qd)
    kinetic = np.einsum("sijk,sj,sk->si", by_q, qd, qd) / 2
    gap = np.abs(velocity - (moved - kinetic)).max(axis=0)
    size = max(float(np.abs(velocity).max()), float(np.abs(moved).max()), float(np.abs(kinetic).max()))
    found = []
    wrong = [i for i in range(na) if size > 0.0 and gap[i] > PASSIVE * size]
    if wrong:
        named = ", ".join(f"tau_{joints[i]}" for i in wrong)
        found.append(
            Finding(
                STRUCTURE,
                f"velocity terms and mass matrix do not belong together in {named} (Mdot - 2 C does work, off by"
                f" {percent(float(gap.max()) / size)}): one of the two is wrong",
                tuple(joints[i] for i in wrong),
            )
        )
    rest = parts[Part(WEIGHT)][:s]
    curl = np.abs(weight_by_q - weight_by_q.swapaxes(1, 2))
    limit = PASSIVE * max(float(np.abs(weight_by_q).max()), float(np.abs(rest).max()))
    loops = [(i, j) for i in range(na) for j in range(i) if limit > 0 and curl[:, i, j].max() > limit]
    if loops:
        named = ", ".join(f"{joints[j]} and {joints[i]}" for i, j in loops)
        found.append(
            Finding(
                STRUCTURE,
                f"the weight is no gradient of an energy between {named}: a round trip would gain some",
                tuple(dict.fromkeys(joints[k] for p in loops for k in p)),
                ("weight",),
            )
        )
    return found


__all__ = ["FORCE", "mass_matrix", "structure_findings"]
