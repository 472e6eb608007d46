"""The loops of a URDF, which itself can hold none: pairs of frames, in the form that collections of such robots use.

``closed_loop = [["A", "B"], ...]`` with ``type = ["3d", "6d", ...]`` (points meet, or frames coincide), or in its place
``freed = [["ry"], ...]``: frames that coincide but for turns about axes of the first. ``name_mot`` names what is
driven; ``joint_name`` with ``joint_type`` makes joints ``SPHERICAL`` or ``FIXED`` that the URDF could not say so.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from workbench.errors import ModelError

MOST_BYTES = 1_000_000
Axis = Literal["rx", "ry", "rz"]


@dataclass(frozen=True)
class Loop:
    """Two frames that a loop holds together."""

    first: str
    second: str
    freed: tuple[str, ...]
    """turns about axes of the first frame that stay free; all three: only the points meet"""


@dataclass(frozen=True)
class LoopTable:
    """What a loop file says."""

    loops: tuple[Loop, ...] = ()
    actuated: tuple[str, ...] = ()
    changed: tuple[tuple[str, str], ...] = ()
    """joint -> ``SPHERICAL`` or ``FIXED``"""


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid")

    closed_loop: list[Annotated[list[str], Field(min_length=2, max_length=2)]]
    type: list[Literal["3d", "3D", "6d", "6D"]] | None = None
    freed: list[list[Axis]] | None = None
    name_mot: list[str] = []
    joint_name: list[str] = []
    joint_type: list[Literal["SPHERICAL", "FIXED"]] = []


def read_loops(path: Path) -> LoopTable:
    """Read a loop file, ``.toml`` or ``.yaml``.

    Raises
    ------
    ModelError
        Missing, malformed, or lists that do not belong together.
    """
    try:
        with open(path, "rb") as stream:
            text = stream.read(MOST_BYTES + 1)
    except OSError as error:
        raise ModelError(f"{path}: {error.strerror or error}", file=str(path)) from error
    if len(text) > MOST_BYTES:
        raise ModelError(f"{path}: more than {MOST_BYTES} bytes", file=str(path))
    try:
        found = _File.model_validate(_document(path, text.decode("utf-8")))
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise ModelError(
            f"{path}: {key}: {first['msg']}; docs/urdf.md shows a table", file=str(path), key=key
        ) from error
    except UnicodeDecodeError as error:
        raise ModelError(f"{path}: not UTF-8 text", file=str(path)) from error
    count = len(found.closed_loop)
    if found.type is not None and found.freed is not None:
        raise ModelError(f"{path}: type and freed; allowed: one of both", file=str(path))
    for key, values in (("type", found.type), ("freed", found.freed)):
        if values is not None and len(values) != count:
            raise ModelError(f"{path}: {key} has {len(values)} entries, closed_loop {count}; one each", file=str(path))
    if len(found.joint_name) != len(found.joint_type):
        raise ModelError(f"{path}: joint_name and joint_type: one type for each joint", file=str(path))
    if found.freed is not None:
        freed = [tuple(dict.fromkeys(axes)) for axes in found.freed]
    else:
        kinds = found.type or ["6d"] * count
        freed = [("rx", "ry", "rz") if kind.lower() == "3d" else () for kind in kinds]
    for pair, axes in zip(found.closed_loop, freed, strict=True):
        if len(axes) == 2:
            raise ModelError(
                f"{path}: loop {pair[0]}, {pair[1]}: {axes[0]} and {axes[1]} freed, a universal joint; allowed: none,"
                " one or all three turns (put a link of its own between two hinges)",
                file=str(path),
            )
    loops = tuple(Loop(pair[0], pair[1], axes) for pair, axes in zip(found.closed_loop, freed, strict=True))
    changed = tuple(zip(found.joint_name, found.joint_type, strict=True))
    return LoopTable(loops, tuple(found.name_mot), changed)


def _document(path: Path, text: str) -> Any:
    if path.suffix.lower() == ".toml":
        try:
            return tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise ModelError(f"{path}: {error}", file=str(path)) from error
    import yaml  # type: ignore[import-untyped]

    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as error:
        said = " ".join(str(error).split())
        raise ModelError(f"{path}: {said}", file=str(path)) from error
