"""What each case asks of its actuators, and the limits that it is held against: `workbench.campaign.margins`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

from workbench.arrays import FloatArray
from workbench.campaign.cases import Case
from workbench.campaign.spec import Campaign
from workbench.capabilities.robot import Robot
from workbench.demand import demand_of
from workbench.reference import ReferenceResult
from workbench.robots.actuators import check_joints

PREFERRED = "distributed"
"""Masses under which the demand is taken, where the run has them: the model as it is."""


def limits_of(campaign: Campaign, robot: Robot, where: str) -> dict[str, Any]:
    """Limits for the manifest, by joint: those of the robot file, and over them the campaign's, joint by joint.

    Raises
    ------
    SpecError
        The campaign names a joint that is not actuated.
    """
    own = campaign.actuators or {}
    check_joints(own, robot.joints, where)
    found = {**robot.description.robot.spec.actuators, **own}
    return {joint: found[joint].model_dump() for joint in robot.joints if joint in found}


def demand_facts(case: Case, results: Mapping[str, ReferenceResult]) -> dict[str, Any]:
    """What the case asks of each actuator by the reference, for the manifest."""
    mass_model = PREFERRED if PREFERRED in results else next(iter(results))
    motion, tau = case.motion, results[mass_model].tau
    columns: Iterable[tuple[FloatArray, FloatArray]] = zip(motion.qd.T, tau.T, strict=True)
    joints = zip(case.robot.joints, columns, strict=True)
    return {
        "mass_model": mass_model,
        "joints": {joint: asdict(demand_of(motion.t, speed, force)) for joint, (speed, force) in joints},
    }
