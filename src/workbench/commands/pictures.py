"""Options of ``workbench model view`` and ``render``, read and checked."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.errors import ParameterError, SpecError

if TYPE_CHECKING:
    from workbench.rendering.poses import Poses


LEAST, MOST = 1e-4, 1e4
"""Of speeds and of pictures a second."""


def positive(name: str, value: float) -> None:
    """Refuse what is not a positive number that a film can have.

    Raises
    ------
    ParameterError
        Naming the option.
    """
    if not LEAST < value < MOST:
        raise ParameterError(f"--{name} {value:g}; allowed: a positive number, {LEAST:g} to {MOST:g}", value=value)


def size_of(text: str) -> tuple[int, int]:
    """Read ``640x480``.

    Raises
    ------
    ParameterError
        Anything else.
    """
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    if match is None:
        raise ParameterError(f'--size "{text}"; allowed: width and height in pixels, such as 640x480')
    return int(match[1]), int(match[2])


def poses_of(
    path: Path, campaign: Path | None, case: str | None, start: float | None, stop: float | None, step: float
) -> Poses:
    """Return the home pose, or with a campaign the poses of a case, *step* seconds of the motion apart.

    Raises
    ------
    WorkbenchError
        Bad input; or options of a motion without one.
    """
    from workbench.rendering.poses import home_pose, motion_poses

    if campaign is not None:
        return motion_poses(path, campaign, case, start, stop, step)
    for name, value in (("case", case), ("start", start), ("stop", stop)):
        if value is not None:
            raise SpecError(f"--{name} {value}: of which campaign? Give --campaign FILE", option=name)
    return home_pose(path)
