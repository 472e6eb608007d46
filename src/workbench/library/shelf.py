"""Which robots the library holds, and where each part of one lies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from workbench.data_files import bundled_directory, bundled_names
from workbench.errors import SpecError, did_you_mean
from workbench.library.card import FILE, Card, read_card
from workbench.robots.robot_file import RobotFile, read_robot_file

ALL = "all"


@dataclass(frozen=True)
class Entry:
    """A robot of the library."""

    name: str
    folder: Path
    robot: RobotFile
    card: Card

    @property
    def campaign(self) -> Path:
        """The campaign that checks it."""
        return self.folder / f"{self.name}.toml"

    @property
    def formulas(self) -> tuple[Path, ...]:
        """Files with its closed forms. They come with the package, so asking for the robot by name runs them."""
        return tuple(self.robot.formulas)

    @property
    def picture(self) -> Path | None:
        """Its picture."""
        return self.folder / self.card.picture if self.card.picture else None

    @property
    def readme(self) -> Path:
        """Derivation, sources and findings."""
        return self.folder / "README.md"


def robot_names() -> tuple[str, ...]:
    """Names of the robots, sorted."""
    folders = {Path(name).parent.name for name in bundled_names("examples")}
    return tuple(sorted(name for name in folders if (bundled_directory("examples") / name / FILE).is_file()))


def entry(name: str) -> Entry:
    """Read one robot.

    Raises
    ------
    SpecError
        No such robot, with the nearest there is; or its files are wrong.
    """
    known = robot_names()
    if name not in known:
        raise SpecError(f'no robot "{name}" in the library{did_you_mean(name, known)}', name=name)
    folder = bundled_directory("examples") / name
    return Entry(name, folder, read_robot_file(folder / "robot.toml"), read_card(folder))


def entries(names: Sequence[str] = (ALL,)) -> list[Entry]:
    """Read robots by their names, each once, in the order given; ``all`` stands for every one.

    Raises
    ------
    SpecError
        As `entry`.
    """
    wanted = [known for name in names for known in (robot_names() if name == ALL else (name,))]
    return [entry(name) for name in dict.fromkeys(wanted)]
