"""Kinematics first: a wrong Jacobian, recognised from the response to the force on the platform or to its mass."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from workbench.arrays import FloatArray
from workbench.diagnosis.entries import ratio_of, show_ratio
from workbench.diagnosis.parts import FORCE, WEIGHT, Part, Parts
from workbench.diagnosis.shares import Share
from workbench.diagnosis.subject import MASS

APART = 1e-7
"""Relative: rows and columns of two Jacobians that differ by more are different."""


@dataclass(frozen=True)
class WrongJacobian:
    """What is wrong with J, xd = J qd."""

    joints: tuple[int, ...]
    """columns of J that are wrong"""
    sentence: str


def _columns(parts: Parts) -> FloatArray | None:
    """J ``(s, 3, na)`` from the response to forces, up to the probe's newtons; None where it is not there."""
    found = [parts.get(Part(FORCE, (axis,))) for axis in range(3)]
    if any(tau is None or not np.isfinite(tau).all() for tau in found):
        return None
    return -np.stack([tau for tau in found if tau is not None], axis=1)


def wrong_jacobian(
    formula: Parts, reference: Parts, shares: list[Share], joints: tuple[str, ...], noise: float = 0.0
) -> WrongJacobian | None:
    """Tell whether the formula's Jacobian is wrong, and where.

    Of a formula that is told the external force J is seen as it is; of others the platform's mass stands for a force.
    *noise* is what the formula's own numbers are off by, as a fraction of the largest.
    """
    masses = [share for share in shares if share.parameter.kind == MASS]
    ours, theirs = _columns(formula), _columns(reference)
    if ours is None or theirs is None:
        return _from_masses(masses, joints)
    scale = float(np.abs(theirs).max()) or 1.0
    gap = np.abs(ours - theirs).max(axis=(0, 1)) / scale
    apart = max(APART, noise)
    wrong = tuple(int(j) for j in np.flatnonzero(gap > apart))
    if not wrong:
        return None
    if masses and not any(_wrong_weight(share, j) for share in masses for j in wrong):
        return None  # the force itself enters wrongly; where masses hang the Jacobian is right
    if not masses and isinstance(ratio_of(ours.ravel(), theirs.ravel()), Fraction):
        return None
    return WrongJacobian(wrong, _where(ours, theirs, wrong, joints, apart))


def _wrong_weight(share: Share, joint: int) -> bool:
    return any(entry.joint == joint and entry.part == Part(WEIGHT) for entry in share.wrong)


def _where(ours: FloatArray, theirs: FloatArray, wrong: tuple[int, ...], joints: tuple[str, ...], apart: float) -> str:
    names = ", ".join(joints[j] for j in wrong)
    text = (
        f"the platform's velocity per {names}' is wrong (column {', '.join(str(j + 1) for j in wrong)} of J, xd = J qd)"
    )
    for j in wrong:
        along = _per_pose_ratio(ours[:, :, j], theirs[:, :, j], apart)
        if along is not None:
            ratio = ratio_of(ours[:, :, j].ravel(), theirs[:, :, j].ravel())
            if ratio is not None:
                text += f"; {joints[j]}: the whole column {show_ratio(ratio)}"
            else:
                text += (
                    f"; {joints[j]}: its direction is right, its size is not: look at the actuator's side,"
                    f" entry {j + 1} of J_q in J_x xd = J_q qd"
                )
    if len(wrong) > 1 and ours.shape[1] == ours.shape[2]:
        text += _rows(ours, theirs, joints, apart)
    return text


def _per_pose_ratio(ours: FloatArray, theirs: FloatArray, apart: float) -> FloatArray | None:
    """``(s,)`` ours / theirs where the two vectors are parallel at every pose, else None."""
    power = (theirs**2).sum(axis=1)
    if not (power > 0.0).all():
        return None
    ratio: FloatArray = (ours * theirs).sum(axis=1) / power
    rest = np.abs(ours - ratio[:, None] * theirs).max()
    return ratio if rest < apart * float(np.abs(theirs).max()) else None


def _rows(ours: FloatArray, theirs: FloatArray, joints: tuple[str, ...], apart: float) -> str:
    """Rows of the inverse: each belongs to one limb, so a mistake in one limb's equation spoils one row alone."""
    try:
        mine, right = np.linalg.inv(ours), np.linalg.inv(theirs)
    except np.linalg.LinAlgError:
        return "; it is singular"
    size = np.abs(right).max(axis=(0, 2))
    gap = np.abs(mine - right).max(axis=0) / size[:, None]
    rows = [i for i in range(len(joints)) if gap[i].max() > apart]
    if len(rows) != 1:
        return ""
    row = rows[0]
    bad = ", ".join("xyz"[c] for c in np.flatnonzero(gap[row] > apart))
    return f"; all of it is in the equation of {joints[row]}'s limb (row {row + 1} of J^-1, along {bad})"


def _from_masses(masses: list[Share], joints: tuple[str, ...]) -> WrongJacobian | None:
    """Without a force: in wrong kinematics several masses hang wrongly from the same joint, at no fixed ratio."""
    counts: dict[int, list[str]] = {}
    for share in masses:
        for entry in share.wrong:
            if entry.part == Part(WEIGHT) and entry.ratio is None:
                counts.setdefault(entry.joint, []).append(share.parameter.name)
    wrong = tuple(sorted(j for j, names in counts.items() if len(names) >= 2))
    if not wrong:
        return None
    named = ", ".join(joints[j] for j in wrong)
    which = sorted({name for j in wrong for name in counts[j]})
    return WrongJacobian(
        wrong,
        f"the virtual displacements per {named} are wrong: {', '.join(which)} all hang wrongly there, at no fixed ratio"
        " (a Jacobian or a position; the formula is not told the external force, which would say more)",
    )
