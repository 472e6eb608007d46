"""The only place that calls the engine: loop closure and constraint-projected inverse dynamics of an MJCF."""

from workbench.reference.mujoco_reference import MujocoReference
from workbench.reference.result import Mobility, ReferenceResult

__all__ = ["Mobility", "MujocoReference", "ReferenceResult"]
