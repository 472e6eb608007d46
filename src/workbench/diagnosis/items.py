"""By body and direction: which summand of the reference's torque an error is a simple multiple of."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations

import numpy as np

from workbench.arrays import FloatArray
from workbench.diagnosis.entries import ratio_of, simple
from workbench.diagnosis.parts import INERTIA, VELOCITY, WEIGHT, Part, Parts
from workbench.diagnosis.probes import Plan
from workbench.diagnosis.subject import Subject
from workbench.reference import terms
from workbench.reference.terms import JOINTS, torque_terms

FITS = 1e-6
"""Of an error: how much of it may be left when an item is taken off."""

MOST_ITEMS = 60

Items = dict[Part, dict[tuple[str, str], FloatArray]]
"""part -> (body, direction) -> ``(s, na)``"""


def items_of(subject: Subject, plan: Plan) -> Items:
    """The reference's weight, inertia and velocity parts, body by body and direction by direction."""
    wanted = [label for label in plan.labels if label[0] in ("rest", "acceleration", "rate", "rates")]
    kept = [label for label in wanted if label == ("rest",) or label[-1] == 1]
    rows = [plan.labels.index(label) for label in kept]
    states = [array[rows] for array in (plan.q, plan.qd, plan.qdd)]
    s, na = plan.q.shape[1:]
    q, qd, qdd = (array.reshape(-1, na) for array in states)
    found = torque_terms(subject.reference({}), q, qd, qdd, subject.mass_model)
    by = {key: tau.reshape(len(rows), s, na) for key, tau in found.by("part", "body", "direction").items()}
    items: Items = {}
    for index, label in enumerate(kept):
        kind = {"rest": terms.WEIGHT, "acceleration": terms.ACCELERATION}.get(str(label[0]), terms.VELOCITY)
        part = _part(label)
        items[part] = {
            (body, axis): tau[index] for (name, body, axis), tau in by.items() if name == kind and body != JOINTS
        }
    for part in [part for part in items if part.kind == VELOCITY and part.of[0] != part.of[1]]:
        j, k = part.of
        for key in items[part]:
            alone = [items[Part(VELOCITY, (i, i))].get(key, 0.0) for i in (j, k)]
            items[part][key] = items[part][key] - alone[0] - alone[1]
    return items


def _part(label: tuple[str | int, ...]) -> Part:
    kind = {"rest": WEIGHT, "acceleration": INERTIA}.get(str(label[0]), VELOCITY)
    joints = tuple(int(number) for number in label[1:-1])
    return Part(kind, (joints * 2 if label[0] == "rate" else joints))


Fit = list[tuple[str, str, Fraction | float]]
"""(body, direction, how many times too much) of each item"""


def explain(items: Items, formula: Parts, reference: Parts, part: Part, joints: list[int]) -> list[Fit]:
    """Items whose multiples are the error of some joints of a part.

    Returns
    -------
    list
        Every single item that fits, each as ``[(body, direction, how many times too much)]``; where none does, every
        pair of two with simple fractions. Bodies that move alike cannot be told apart and all appear.
    """
    if part not in items:
        return []
    poses = len(next(iter(items[part].values()), np.zeros((0, 1))))
    gap = (formula[part] - reference[part])[:poses, joints].ravel()
    if not np.isfinite(gap).all() or not gap.any():
        return []
    slack = FITS * float(np.abs(gap).max())
    columns = {key: tau[:, joints].ravel() for key, tau in items[part].items() if np.abs(tau[:, joints]).max() > slack}
    singles: list[Fit] = []
    for (body, axis), column in columns.items():
        ratio = ratio_of(gap, column)
        if ratio is not None and ratio != 0 and isinstance(ratio, Fraction):
            singles.append([(body, axis, ratio)])
    if singles or len(columns) > MOST_ITEMS:
        return singles
    pairs: list[Fit] = []
    for one, two in combinations(columns, 2):
        matrix = np.stack([columns[one], columns[two]], axis=1)
        sizes, _, rank, _ = np.linalg.lstsq(matrix, gap, rcond=1e-9)
        if rank < 2 or np.abs(matrix @ sizes - gap).max() > slack:
            continue
        ratios = [simple(float(size)) for size in sizes]
        if all(isinstance(ratio, Fraction) for ratio in ratios):
            pairs.append([(*one, ratios[0]), (*two, ratios[1])])
    return pairs
