"""Robots by path or name."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path

from workbench.capabilities.defaults import robot_of_model
from workbench.capabilities.robot import Robot
from workbench.robots.load import read_base, with_overrides
from workbench.robots.robot_file import RobotFile


def robot_with(path: str | Path, parameters: Mapping[str, float], robot: RobotFile | None = None) -> Robot:
    """Load a robot with parameters changed; *robot* describes it, where another description than its own counts.

    Raises
    ------
    ModelError, ParameterError, SpecError
        See `load_robot`.
    """
    base = read_base(path, robot=robot)
    if base.loaded.description is None:
        base = dataclasses.replace(base, loaded=robot_of_model(base.loaded))
    loaded = with_overrides(base, parameters)
    return Robot(base, loaded.values, loaded)


def load_robot(path: str | Path, **parameters: float) -> Robot:
    """Load a robot; nothing of its folder is run.

    Parameters
    ----------
    path
        A folder with a robot file, the robot file, an MJCF, ``models/NAME.xml``, or a name of a robot that comes along.
    **parameters
        Changes by name, SI: ``payload=0.5``, ``a2_left=0.31``.

    Raises
    ------
    ModelError, ParameterError, SpecError
        See `workbench.robots.load.load_model`.
    """
    return robot_with(path, parameters)
