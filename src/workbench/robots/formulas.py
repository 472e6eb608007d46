"""Formulas of robots that come with the package: imported, as the package's own code, when first asked for."""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module

from workbench.robots.closed_form import ClosedForm
from workbench.robots.registration import CLASS_MARK
from workbench.robots.robot_file import RobotFile


def bundled_closed_form(robot: RobotFile) -> type[ClosedForm] | None:
    """The class that a robot of the package registers (`workbench.robots.registration.closed_form`), or None."""
    return _find(robot.path.parent.name, tuple(path.stem for path in robot.formulas))


@lru_cache(maxsize=64)
def _find(folder: str, stems: tuple[str, ...]) -> type[ClosedForm] | None:
    for stem in stems:
        module = import_module(f"workbench.robots.{folder}.{stem}")
        for value in vars(module).values():
            if isinstance(value, type) and issubclass(value, ClosedForm) and CLASS_MARK in vars(value):
                return value
    return None
