"""Prescribed motions: sinusoids, a pick-and-place cycle, and motions read from a table, which are judged before use.

A `JointMotion` is planned in actuated coordinates, a `PlatformMotion` in platform space; whoever knows the mechanism
turns the second into the first. Nothing here knows a mechanism: workspace limits are checked where they are known.
"""

from workbench.motion.base import (
    COORDINATES,
    MAX_SAMPLES,
    POSITION,
    Consistency,
    JointMotion,
    PlatformMotion,
    time_grid,
)
from workbench.motion.cycle import LAWS, PickAndPlace, pick_and_place, time_law
from workbench.motion.harmonic import Harmonic, multi_sine, platform_multi_sine, platform_sine, sine
from workbench.motion.judge import judged
from workbench.motion.table import Tabulated, from_csv, platform_from_csv, read_joints, read_platform

__all__ = [
    "COORDINATES",
    "LAWS",
    "MAX_SAMPLES",
    "POSITION",
    "Consistency",
    "Harmonic",
    "JointMotion",
    "PickAndPlace",
    "PlatformMotion",
    "Tabulated",
    "from_csv",
    "judged",
    "multi_sine",
    "pick_and_place",
    "platform_from_csv",
    "platform_multi_sine",
    "platform_sine",
    "read_joints",
    "read_platform",
    "sine",
    "time_grid",
    "time_law",
]
