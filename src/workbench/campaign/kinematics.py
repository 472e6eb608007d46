"""A user's kinematics held against the reference: forward, inverse, Jacobian, coordinate by coordinate."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.cases import Case
from workbench.campaign.platform import Platform
from workbench.campaign.user_candidates import UserCandidate
from workbench.campaign.verdict import FAIL, PASS
from workbench.errors import CandidateError
from workbench.reference import MujocoReference
from workbench.robots.registration import FORWARD, INVERSE

TURN = 2.0 * np.pi


@dataclass(frozen=True)
class KinematicsRow:
    """One coordinate of one formula in one case."""

    name: str
    kind: str
    coordinate: str
    """task coordinate, for inverse kinematics the joint"""
    error: float
    """largest over the samples, over `scale`"""
    scale: float
    """largest value of the case's coordinates of that unit; of a Jacobian the row's largest entry"""
    unit: str
    bound: float
    verdict: str


@dataclass(frozen=True)
class KinematicsChecks:
    """What came out for one case."""

    rows: list[KinematicsRow] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)

    def noted(self, facts: dict[str, Any]) -> dict[str, Any]:
        """Return a case's facts with the rows in them; a row beyond its bound fails the case."""
        if not self.rows and not self.faults:
            return facts
        beyond = [
            f'{row.kind} "{row.name}", {row.coordinate}: {row.error:.2g} (allowed: {row.bound:g})'
            for row in self.rows
            if row.verdict == FAIL
        ]
        noted = facts | {"kinematics_checks": [asdict(row) for row in self.rows]}
        if beyond or self.faults:
            said = [*([facts["message"]] if facts["message"] else []), *self.faults, *beyond]
            noted |= {"status": "failed", "message": "; ".join(said)}
        return noted


def check_kinematics(case: Case, reference: MujocoReference, platform: Platform) -> KinematicsChecks:
    """Hold every kinematics formula that was offered to the case's robot against the reference."""
    checks, motion, robot = KinematicsChecks(), case.motion, case.robot
    x = platform.task[0]
    for formula in robot.offered_kinematics:
        try:
            if formula.kind == FORWARD:
                checks.rows.extend(_rows(formula, formula.kinematics(robot, motion.q, x), x, robot, task=True))
            elif formula.kind == INVERSE:
                found = formula.kinematics(robot, x, motion.q)
                checks.rows.extend(_rows(formula, found, motion.q, robot, task=False))
            else:
                expected = reference.jacobian(motion.q, robot.coordinates)
                checks.rows.extend(
                    _jacobian_rows(formula, formula.kinematics(robot, motion.q, expected), expected, robot)
                )
        except CandidateError as error:
            checks.faults.append(str(error))
    return checks


def _rows(
    formula: UserCandidate, found: FloatArray, expected: FloatArray, robot: Any, *, task: bool
) -> list[KinematicsRow]:
    names = robot.coordinates if task else robot.joints
    units = tuple(robot.task_units if task else robot.coordinate_units)
    rows = []
    for i, (name, unit) in enumerate(zip(names, units, strict=True)):
        alike = [j for j, other in enumerate(units) if other == unit]
        off = found[:, i] - expected[:, i]
        if unit == "rad":  # whole turns are the same pose
            off = off - TURN * np.round(off / TURN)
        rows.append(_row(formula, name, unit, off, expected[:, alike]))
    return rows


def _jacobian_rows(formula: UserCandidate, found: FloatArray, expected: FloatArray, robot: Any) -> list[KinematicsRow]:
    return [
        _row(formula, name, f"{unit} per unit of q", found[:, i] - expected[:, i], expected[:, i])
        for i, (name, unit) in enumerate(zip(robot.coordinates, robot.task_units, strict=True))
    ]


def _row(formula: UserCandidate, coordinate: str, unit: str, off: FloatArray, alike: FloatArray) -> KinematicsRow:
    bound = formula.registration.bound
    assert bound is not None
    scale = float(np.abs(alike).max()) or 1.0
    error = float(np.abs(off).max()) / scale
    verdict = PASS if error <= bound else FAIL
    return KinematicsRow(formula.name, formula.kind, coordinate, error, scale, unit, float(bound), verdict)
