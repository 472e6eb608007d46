"""The numbers that a robot's sources give: those of the model that comes with the package."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from workbench.robots.catalogue import bundled_robot
from workbench.robots.description import Description
from workbench.robots.load import read_base

FILE = "the file"
"""Source of a number that is not the published one."""


def published_values(described: Description) -> Mapping[str, float] | None:
    """Parameters as the robot's sources give them, SI; None where nothing but the model at hand says them."""
    return _of(described.name) if described.robot.builtin else None


@lru_cache(maxsize=8)
def _of(name: str) -> Mapping[str, float]:
    robot = bundled_robot(name)
    return dict(read_base(robot.model, robot=robot).loaded.values or {})


def source_of(described: Description, name: str, value: float) -> str:
    """Where a number comes from: its published source, as long as it is the published number."""
    published = published_values(described)
    changed = published is not None and published.get(name) != value
    return FILE if changed else described.table.infos[name].source
