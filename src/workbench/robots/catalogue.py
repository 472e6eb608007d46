"""Where a robot is found: a folder, a robot file, an MJCF, or the name of a robot that comes with the package."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import mujoco

from workbench.errors import ModelError, SpecError, did_you_mean
from workbench.mjcf.compile import custom_text, find_model
from workbench.robots.robot_file import FILE, RobotFile, read_robot_file

HOME = Path(__file__).parent

NAMED = "mechanism"
"""``<custom><text name="mechanism" data="...">`` of an MJCF names the robot of the package that it describes."""


@lru_cache(maxsize=1)
def bundled_robots() -> dict[str, Path]:
    """Name of each robot that comes with the package -> its robot file."""
    return {path.parent.name: path for path in sorted(HOME.glob(f"*/{FILE}"))}


@lru_cache(maxsize=32)
def bundled_robot(name: str) -> RobotFile:
    """Read the robot file of a robot that comes with the package.

    Raises
    ------
    SpecError
        There is none of that name.
    """
    known = bundled_robots()
    if name not in known:
        raise SpecError(f'no robot "{name}" comes along{did_you_mean(name, known)}', name=name)
    return read_robot_file(known[name], shown=f"robots/{name}/{FILE}", builtin=True)


@dataclass(frozen=True)
class Source:
    """An MJCF and the robot file that goes with it, if there is one."""

    model: Path
    shown: str
    """the model's name as the user wrote it, for messages"""
    robot: RobotFile | None


def find_source(path: str | Path) -> Source:
    """Find a robot.

    Parameters
    ----------
    path
        A folder with a robot file, a robot file (``.toml``), an MJCF (``.xml``), ``models/NAME.xml``, or the name of a
        robot that comes along. An MJCF goes with the robot that its ``<custom>`` names, else with the robot file beside
        it whose model it is.

    Raises
    ------
    SpecError, ModelError
        No such robot, or a robot file that is wrong.
    """
    place = Path(path)
    if str(path) in bundled_robots() and not place.exists():
        robot = bundled_robot(str(path))
        return Source(robot.model, robot.spec.model, robot)
    try:
        folder, file = place.is_dir(), place.suffix == ".toml" and place.is_file()
    except (OSError, ValueError) as error:
        raise ModelError(f"{str(path)!r}: {getattr(error, 'strerror', None) or error}", file=str(path)) from error
    if folder and (place / FILE).is_file():
        place, file = place / FILE, True
    if file:
        robot = read_robot_file(place)
        return Source(robot.model, str(robot.model), robot)
    if folder:
        raise ModelError(f"{path}: is a directory without {FILE}; a robot is a folder with one, or an XML file")
    if place.suffix == ".toml":
        raise ModelError(f"{path}: no such robot or model file", file=str(path))
    return Source(find_model(path), str(path), None)


def robot_beside(model: Path) -> RobotFile | None:
    """The robot file in a model's own folder whose model it is; None where there is none.

    Raises
    ------
    SpecError
        It is there and wrong.
    """
    file = model.parent / FILE
    if not file.is_file():
        return None
    robot = read_robot_file(file)
    return robot if robot.model.resolve() == model.resolve() else None


def robot_named(model: mujoco.MjModel, file: str) -> RobotFile | None:
    """The robot of the package that a compiled model names in its ``<custom>``; None where it names none.

    Raises
    ------
    ModelError
        It names one that does not exist.
    """
    name = custom_text(model, NAMED)
    if name is None:
        return None
    if name not in bundled_robots():
        raise ModelError(f'{file}: unknown mechanism "{name}"{did_you_mean(name, bundled_robots())}', file=file)
    return bundled_robot(name)
