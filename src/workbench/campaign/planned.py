"""From a campaign's table of a motion to the motion itself: samples, and a function of time where formulas give it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import assert_never

import numpy as np

from workbench.arrays import FloatArray
from workbench.campaign.motion_spec import (
    CsvMotion,
    CycleMotion,
    Motion,
    MultiSineMotion,
    PlannedMotion,
    PlatformCsvMotion,
    PlatformMultiSineMotion,
    PlatformSineMotion,
    SineMotion,
    TableMotion,
)
from workbench.errors import ParameterError
from workbench.motion import (
    JointMotion,
    PickAndPlace,
    PlatformMotion,
    judged,
    multi_sine,
    pick_and_place,
    platform_multi_sine,
    platform_sine,
    read_joints,
    read_platform,
    sine,
    time_grid,
)


def planned_motion(
    motion: PlannedMotion,
    located: Callable[[str], Path],
    robot: str,
    joints: tuple[str, ...],
    units: tuple[str, ...],
    coordinates: tuple[str, ...],
) -> JointMotion | PlatformMotion:
    """Build a motion at the times that it asks for; tables are judged before they are used.

    Parameters
    ----------
    motion
        From the campaign.
    located
        Finds a file that the campaign names.
    robot
        The robot's name, for messages.
    joints, units
        Its actuated joints in order, and ``m`` or ``rad`` for each.
    coordinates
        Its task coordinates.

    Raises
    ------
    MotionError
        As the functions of `workbench.motion`, and tables that cannot be believed.
    ParameterError
        Another number of joints or coordinates than the robot has.
    """
    if isinstance(motion, CsvMotion):
        return judged(read_joints(located(motion.file), joints, units=units))
    if isinstance(motion, PlatformCsvMotion):
        return judged(read_platform(located(motion.file), coordinates))
    if isinstance(motion, CycleMotion):
        return pick_and_place(**motion.model_dump(exclude={"kind"}), coordinates=coordinates)
    if isinstance(motion, SineMotion | MultiSineMotion):
        _check_count(motion, f"{robot} has {len(joints)} actuated joints", joints, "joint(s)")
    elif isinstance(motion, PlatformSineMotion | PlatformMultiSineMotion):
        said = f"{robot} has {len(coordinates)} task coordinates"
        _check_count(motion, said, coordinates, "coordinate(s)")
    formula = formula_of(motion, coordinates)
    assert formula is not None
    return formula(time_grid(motion.start, motion.stop, samples=motion.samples, rate=motion.rate))


def _check_count(
    motion: SineMotion | MultiSineMotion | PlatformSineMotion | PlatformMultiSineMotion,
    said: str,
    names: tuple[str, ...],
    what: str,
) -> None:
    count = len(motion.amplitude) if isinstance(motion, SineMotion | PlatformSineMotion) else len(motion.terms)
    if len(motion.offset) != len(names) or count != len(names):
        raise ParameterError(f"motion: {len(motion.offset)} offset(s) and {count} {what}; {said}: {', '.join(names)}")


def formula_of(
    motion: Motion, coordinates: tuple[str, ...]
) -> Callable[[FloatArray], JointMotion | PlatformMotion] | None:
    """Return a motion as a function of times ``(n,)``, exact beyond its samples too; None where a table gives it."""
    if isinstance(motion, SineMotion):
        return lambda t: sine(t, motion.offset, motion.amplitude, motion.frequency, motion.phase)
    if isinstance(motion, MultiSineMotion):
        return lambda t: multi_sine(t, motion.offset, motion.terms)
    if isinstance(motion, PlatformSineMotion):
        return lambda t: platform_sine(t, motion.offset, motion.amplitude, motion.frequency, motion.phase, coordinates)
    if isinstance(motion, PlatformMultiSineMotion):
        return lambda t: platform_multi_sine(t, motion.offset, motion.terms, coordinates)
    if isinstance(motion, CycleMotion):
        plan = PickAndPlace(**motion.model_dump(exclude={"kind", "samples", "rate"}), coordinates=coordinates)
        # rounding of a time at either end is no other time: the cycle rests there
        return lambda t: plan.sample(np.clip(t, 0.0, plan.duration))
    if isinstance(motion, TableMotion):
        return None
    assert_never(motion)
