"""By parameter: what each is worth in each part, in the formula and in the reference."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from workbench.arrays import FloatArray
from workbench.diagnosis.entries import WRONG_MARK, Entry, compare_parts, ratio_of
from workbench.diagnosis.parts import Part, Parts, take_apart
from workbench.diagnosis.probes import Plan, ask
from workbench.diagnosis.subject import AFFINE, Changes, Parameter, Subject
from workbench.errors import WorkbenchError

SHARE_RIGHT = 1e-6
SHARE_NOTHING = 1e-10
"""As `RIGHT` and `NOTHING` of entries, for differences of two torques."""


@dataclass(frozen=True)
class Share:
    """One parameter's shares, held against the reference's."""

    parameter: Parameter
    entries: tuple[Entry, ...]
    formula: Parts
    reference: Parts
    accelerations: FloatArray
    """``(na,)`` that the inertia parts were taken at"""

    def acceleration(self, joint: int) -> float:
        """What the inertia part of a joint was taken at, m/s^2 or rad/s^2."""
        return float(self.accelerations[joint])

    @property
    def wrong(self) -> tuple[Entry, ...]:
        """Where the formula has another share than the reference."""
        return tuple(entry for entry in self.entries if entry.status == WRONG_MARK)


def both_sides(subject: Subject, plan: Plan, changes: Changes) -> tuple[Parts, Parts, dict[tuple[str | int, ...], str]]:
    """Parts of formula and reference at a plan's states, and by probe what the formula said where it failed."""
    tau, failures = ask(plan, lambda q, qd, qdd, force: subject.formula(q, qd, qdd, force, changes))
    wanted = reference_torques(subject, plan, changes)
    with_force = subject.takes_force
    return take_apart(plan, tau, with_force), take_apart(plan, wanted, with_force), failures


def reference_torques(subject: Subject, plan: Plan, changes: Changes) -> FloatArray:
    """The reference's answers ``(k, s, na)``."""
    tau = subject.torques_of_reference(*plan.flat(), changes)
    return tau.reshape(plan.q.shape)


def share_of(
    subject: Subject,
    plan: Plan,
    parameter: Parameter,
    formula: Parts,
    reference: Parts,
    floors: FloatArray,
    noise: FloatArray | None = None,
) -> Share | None:
    """Vary one parameter on both sides; None where either side refuses the other value.

    *formula* and *reference* are the parts without the change, at the same plan; *noise* as in `compare_parts`.
    """
    try:
        moved_f, moved_r, _ = both_sides(subject, plan, {parameter.name: parameter.varied})
    except WorkbenchError:
        return None
    found = {part: moved_f[part] - values for part, values in formula.items() if part in moved_f}
    wanted = {part: moved_r[part] - values for part, values in reference.items() if part in moved_r}
    entries = compare_parts(found, wanted, floors, SHARE_RIGHT, SHARE_NOTHING, noise)
    return Share(parameter, tuple(entries), found, wanted, plan.accelerations)


def unread_ratio(share: Share, formula: Parts, reference: Parts, part: Part, joint: int) -> Fraction | float | None:
    """Formula / reference of an affine parameter that the formula never reads, where it explains an entry's error.

    0 where the entry lacks just what the parameter is worth there; another number where one stands in its place.
    """
    parameter = share.parameter
    if parameter.kind not in AFFINE or part not in share.reference:
        return None
    step = parameter.varied - parameter.value
    worth = share.reference[part][:, joint] * (parameter.value / step)
    gap = (formula[part] - reference[part])[: len(worth), joint]
    ratio = ratio_of(gap, worth) if np.abs(worth).max() > 0.0 else None
    return None if ratio is None or ratio == 0 else 1 + ratio
