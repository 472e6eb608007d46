"""Validate closed-form dynamics of parallel robots against MuJoCo.

>>> import workbench as wb
>>> mech = wb.load_mechanism("models/asym_2rss_ppap.xml", payload=0.5)
>>> ref = wb.MujocoReference("models/asym_2rss_ppap.xml", payload=0.5)

Names are imported when first used, so that ``import workbench`` stays light.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from workbench._version import __version__

if TYPE_CHECKING:
    from workbench.capabilities.load import load_robot
    from workbench.capabilities.load import load_robot as load_mechanism
    from workbench.capabilities.robot import Robot
    from workbench.control.user_controller import controller
    from workbench.diagnosis.surface import diagnose
    from workbench.diagnosis.terms_frame import terms
    from workbench.errors import WorkbenchError
    from workbench.reference import MujocoReference
    from workbench.report.frames import load_run
    from workbench.report.live import run
    from workbench.robots.registration import (
        candidate,
        forward_kinematics,
        inverse_kinematics,
        jacobian,
    )

__all__ = [
    "MujocoReference",
    "Robot",
    "WorkbenchError",
    "__version__",
    "candidate",
    "controller",
    "diagnose",
    "forward_kinematics",
    "inverse_kinematics",
    "jacobian",
    "load_mechanism",
    "load_robot",
    "load_run",
    "run",
    "terms",
]

_HOMES = {
    "MujocoReference": "workbench.reference",
    "WorkbenchError": "workbench.errors",
    "candidate": "workbench.robots.registration",
    "controller": "workbench.control.user_controller",
    "forward_kinematics": "workbench.robots.registration",
    "inverse_kinematics": "workbench.robots.registration",
    "jacobian": "workbench.robots.registration",
    "run": "workbench.report.live",
    "diagnose": "workbench.diagnosis.surface",
    "load_mechanism": "workbench.capabilities.load:load_robot",
    "load_robot": "workbench.capabilities.load",
    "Robot": "workbench.capabilities.robot",
    "load_run": "workbench.report.frames",
    "terms": "workbench.diagnosis.terms_frame",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for."""
    if name in _HOMES:
        module, _, called = _HOMES[name].partition(":")
        return getattr(import_module(module), called or name)
    raise AttributeError(f"module 'workbench' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Public names, loaded or not."""
    return sorted(__all__)
