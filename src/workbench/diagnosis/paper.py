"""What edited formulas are asked, written down once: states, the reference's parts there, which lines are run."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from types import FrameType
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.diagnosis.examine import Examined
from workbench.diagnosis.noise import SAFETY
from workbench.diagnosis.parts import REST, design, take_apart
from workbench.diagnosis.probes import Plan
from workbench.diagnosis.shares import reference_torques
from workbench.diagnosis.subject import AFFINE, Parameter, Subject
from workbench.diagnosis.trial import Exam, Paper
from workbench.errors import WorkbenchError

POSES = 4
SHARE_POSES = 2
SINGULAR = 1e8
"""Condition number of a Jacobian, in the units of its joints, beyond which it is not inverted."""


def make_paper(subject: Subject, seen: Examined) -> Paper:
    """Write down what an edited formula is asked: parts at a few poses, and each parameter's share at fewer."""
    source = subject.source
    assert source is not None
    plan = seen.plan.at(POSES)
    splitting = splitting_of(plan, subject.takes_force)
    exams = [Exam(subject.values({}), plan.flat(), _parts(splitting, reference_torques(subject, plan, {})))]
    mixed = sum(label[0] == "mixed" for label in plan.labels)
    forces = len(splitting) - mixed - 3 if subject.takes_force else None
    few = seen.plan.at(SHARE_POSES)
    changes = [{p.name: p.varied} for p in subject.parameters if p.read and p.kind in AFFINE]
    lengths = [{p.name: p.varied} for p in subject.parameters if p.read and p.kind not in AFFINE]
    for change in [*changes, *lengths]:
        try:
            tau = reference_torques(subject, few, change)
            exams.append(Exam(subject.values(change), few.flat(), _parts(splitting, tau)))
        except WorkbenchError:
            continue
    return Paper(
        str(source.file), source.candidate, subject.takes_force, splitting, seen.floors, tuple(exams),
        _pulled(subject, plan), forces, SAFETY * seen.noise,
    )  # fmt: skip


def _pulled(subject: Subject, plan: Plan) -> FloatArray | None:
    """The inverse of J^T at the poses, from the reference's response to forces; None where there is none."""
    q, zero = plan.poses, np.zeros_like(plan.poses)
    rest = subject.torques_of_reference(q, zero, zero, np.zeros((len(q), 3)), {})
    rows = [rest - subject.torques_of_reference(q, zero, zero, np.zeros((len(q), 3)) + axis, {}) for axis in np.eye(3)]
    found = np.stack(rows, axis=1)
    if found.shape[2] != 3 or not np.isfinite(found).all() or np.linalg.cond(found).max() > SINGULAR:
        return None
    return np.asarray(np.linalg.inv(found.swapaxes(1, 2)))


def _parts(splitting: FloatArray, tau: FloatArray) -> FloatArray:
    found: FloatArray = np.einsum("pk,ksn->psn", splitting, tau)
    return found


def splitting_of(plan: Plan, with_force: bool) -> FloatArray:
    """The matrix ``(parts, probes)`` that `take_apart` is, and a row for each state with everything at once."""
    probes = len(plan.labels)
    one = plan.at(1)
    columns = []
    for probe in range(probes):
        tau = np.zeros((probes, 1, len(plan.rates)))
        tau[probe] = 1.0
        parts = {part: values for part, values in take_apart(one, tau, with_force).items() if part.kind != REST}
        columns.append([float(values[0, 0]) for values in parts.values()])
    matrix = np.array(columns).T
    known = [part for part in parts if part.kind != "odd"]
    rows = [i for i, part in enumerate(parts) if part.kind != "odd"]
    mixed = []
    for index, label in enumerate(plan.labels):
        if label[0] == "mixed":
            row = -design(one, known, index) @ matrix[rows]
            row[index] += 1.0
            mixed.append(row)
    return np.vstack([matrix, *mixed])


def groups_of(parameters: Sequence[Parameter]) -> dict[str, list[str]]:
    """Parameter -> those of the same unit: any of them might have been meant."""
    return {p.name: [o.name for o in parameters if o.unit == p.unit and o.name != p.name] for p in parameters}


def missing_in(seen: Examined) -> frozenset[str]:
    """Parameters that are missing from a part somewhere: a term with them may have been left out."""
    shares = [share for share in seen.shares if any(entry.ratio == 0 for entry in share.wrong)]
    return frozenset(share.parameter.name for share in shares)


def lines_run(subject: Subject, plan: Plan) -> set[int] | None:
    """Lines of the formula's file that it runs through; None where that cannot be seen."""
    source = subject.source
    if source is None:
        return None
    file, lines = str(source.file), set()
    q, qd, qdd, force = (array[:, 0] for array in (plan.q, plan.qd, plan.qdd, plan.force))

    def trace(frame: FrameType, event: str, argument: object) -> Any:
        if frame.f_code.co_filename != file:
            return None
        if event == "line":
            lines.add(frame.f_lineno)
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        subject.formula(q, qd, qdd, force, {})
    except WorkbenchError:
        pass
    finally:
        sys.settrace(before)
    return lines or None
