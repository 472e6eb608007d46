"""``robot.toml``: what the MJCF of a robot cannot say of itself; every key is explained in docs/robots.md.

A robot file is data: nothing in it runs code, and the files that it names lie in its own folder. Formulas that it names
run only when a command line asks for them.
"""

from __future__ import annotations

import keyword
import math
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationError, model_validator

from workbench.data_files import bundled
from workbench.documents import Form, read_toml, shorten
from workbench.errors import SpecError, WorkbenchError, did_you_mean
from workbench.mjcf.setup import Setup
from workbench.robots.actuators import ActuatorSpec, check_joints
from workbench.robots.parameters import Bar, ParameterInfo, ParameterTable, Target
from workbench.robots.places import kind_of, meaning_of, parse_place
from workbench.schema import Finite, Name, Strict

FILE = "robot.toml"
FORMAT = 1
Coordinate = Literal["x", "y", "z", "rx", "ry", "rz"]
Identifier = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_]{0,39}$")]
Range = Annotated[list[Finite], Field(min_length=2, max_length=2)]
Ignorable = Literal["contacts", "limits", "springs", "tendons", "free bodies"]

BOUND = re.compile(r"(>=|<=|>|<)\s*(\S+)")
BETWEEN = re.compile(r"(\S+)\s+to\s+(\S+)")


class PlatformSpec(Strict):
    """What moves: a site, and the coordinates that a task is given in."""

    site: str = ""
    """site whose motion is recorded and on which external forces act"""
    body: str = ""
    """the body whose origin is the platform, where the model has no site there"""
    coordinates: Annotated[list[Coordinate], Field(min_length=1, max_length=6)] | None = None
    """task coordinates: positions (m) and angles (rad) in the base body's frame; x y z where not said"""
    names: list[str] | None = None
    """what the robot's source calls them; the coordinates themselves where not said"""

    @model_validator(mode="after")
    def _one_place(self) -> PlatformSpec:
        if bool(self.site) == bool(self.body):
            raise ValueError("give either site or body")
        return self

    @model_validator(mode="after")
    def _each_once(self) -> PlatformSpec:
        if len(set(self.task)) < len(self.task):
            raise ValueError("each coordinate once")
        if self.names is not None and len(self.names) != len(self.task):
            raise ValueError(f"{len(self.names)} names for {len(self.task)} coordinates; one each")
        return self

    @property
    def task(self) -> tuple[str, ...]:
        """The task coordinates."""
        return tuple(self.coordinates or ("x", "y", "z"))


class ParameterSpec(Strict):
    """One parameter: where the MJCF holds it, and what a user should know of it."""

    at: Annotated[list[str], Field(min_length=1)]
    """read from the first place; all must agree, and all are written"""
    follows: list[str] = Field(default_factory=list)
    """written where they stand, neither read nor compared: visible geoms"""
    unit: str | None = None
    """for show; that of the first place where not said"""
    meaning: str = ""
    """in words"""
    source: str = ""
    """where the number is from"""
    allowed: str = ""
    """``> 0``, ``>= 0``, ``0 to 1``"""


class BarSpec(Strict):
    """Bodies, or parameters, that stay a uniform slender bar when mass or length is set."""

    mass: str
    """parameter that holds its mass"""
    length: str | None = None
    """parameter that holds its length"""
    half_length: str | None = None
    """or half of it"""
    inertia: list[str] = Field(default_factory=list)
    """parameters that hold the bar's transverse inertia"""
    centre: str | None = None
    """parameter that holds the place of the mass centre, as a fraction of the length"""
    bodies: list[str] = Field(default_factory=list)
    """bodies whose own numbers follow: inertial, or the geom that gives it"""

    @model_validator(mode="after")
    def _one_length(self) -> BarSpec:
        if (self.length is None) == (self.half_length is None):
            raise ValueError("a bar has either length or half_length, the name of a parameter")
        if not (self.inertia or self.bodies):
            raise ValueError("a bar names bodies, or the parameters of its inertia")
        return self


class RobotSpec(Strict):
    """A whole robot file."""

    format: Literal[1] = 1
    """version of this format"""
    name: Name
    """names reports and rows"""
    title: str = ""
    """heading"""
    description: str = ""
    """a paragraph"""
    reference: str = ""
    """bibliography key of the source, explained in docs/references.md"""
    model: str
    """the MJCF, in the folder of this file or below"""
    actuated: Annotated[list[str], Field(min_length=1)]
    """driven joints (hinge or slide), in the order of q and tau"""
    platform: PlatformSpec
    """what moves"""
    base: str = "world"
    """fixed body in whose frame platform and forces are given"""
    keyframe: str = ""
    """pose of the MJCF from which the loops are closed; ``home``, or the model as drawn, where not said"""
    initial: dict[str, Finite] = Field(default_factory=dict)
    """joint = coordinate, m or rad, over the keyframe's: picks the assembly branch"""
    lumped: list[str] = Field(default_factory=list)
    """bars that lose their rotational inertia in the mass model ``lumped``"""
    ignore: list[Ignorable] = Field(default_factory=list)
    """what of the file may be left out without refusal"""
    fix_base: str = ""
    """body on a free joint that is held where it is drawn"""
    formulas: list[str] = Field(default_factory=list)
    """files with formulas of this robot; a command line runs them, ``--candidates``"""
    limits: dict[str, Range] = Field(default_factory=dict)
    """actuated joint = ``[low, high]``, m or rad, that a workspace is computed for"""
    actuators: dict[str, ActuatorSpec] = Field(default_factory=dict)
    """what the actuators can give, by joint; a run says by how much it is too little"""
    groups: dict[Identifier, Annotated[list[str], Field(min_length=1)]] = Field(default_factory=dict)
    """name = parameters that it sets at once"""
    parameters: dict[Identifier, ParameterSpec] = Field(default_factory=dict)
    """numbers with names"""
    bars: list[BarSpec] = Field(default_factory=list)
    """bodies that stay uniform bars"""


FORM = Form(
    RobotSpec,
    sections={"platform": PlatformSpec, "parameters": ParameterSpec, "bars": BarSpec, "actuators": ActuatorSpec},
)


@dataclass(frozen=True, eq=False)
class RobotFile:
    """A robot file, read and checked by itself; what it says of the model is checked when the model is loaded."""

    path: Path
    shown: str
    """the name under which messages speak of it"""
    spec: RobotSpec
    builtin: bool = False
    """True: it comes with the package, and its formulas are the package's own"""
    section: str = "parameters"
    """where its parameters stand, for messages: ``read`` in a campaign"""

    def __eq__(self, other: object) -> bool:
        """Two robot files are the same where they say the same of the same folder."""
        return isinstance(other, RobotFile) and self._identity == other._identity

    def __hash__(self) -> int:
        """Hash of what the file says."""
        return hash(self._identity)

    @cached_property
    def _identity(self) -> tuple[str, str, str]:
        return str(self.path), self.shown, self.spec.model_dump_json()

    @cached_property
    def model(self) -> Path:
        """Where the MJCF lies.

        Raises
        ------
        SpecError
            Not below the robot file's folder, or no such file.
        """
        return self._beside(self.spec.model, "model")

    @cached_property
    def formulas(self) -> tuple[Path, ...]:
        """Python files with formulas.

        Raises
        ------
        SpecError
            As `model`.
        """
        return tuple(self._beside(name, "formulas") for name in self.spec.formulas)

    def _beside(self, name: str, key: str) -> Path:
        where, relative = f'{self.shown}: {key} = "{shorten(name)}"', Path(name)
        if relative.is_absolute() or ".." in relative.parts:
            raise SpecError(f"{where}: allowed: a path below the robot file's folder, without ..", key=key)
        home = self.path.resolve().parent
        try:
            found = home / relative
            if found.is_file():
                if not found.resolve().is_relative_to(home):
                    raise SpecError(f"{where}: a link that leads out of {self.path.parent}", key=key)
                return self.path.parent / relative
        except (OSError, ValueError) as error:
            raise SpecError(f"{where}: {getattr(error, 'strerror', None) or error}", key=key) from error
        if key == "model" and relative.parts[:1] == ("models",) and len(relative.parts) == 2:
            try:
                return bundled("models", relative.name)
            except WorkbenchError as error:
                raise SpecError(f"{where}: {error}", key=key) from error
        raise SpecError(f"{where}: no such file", key=key)

    @cached_property
    def setup(self) -> Setup:
        """What the reference has to know beside the MJCF."""
        spec = self.spec
        return Setup(
            actuated=tuple(spec.actuated),
            platform_site=spec.platform.site,
            platform_body=spec.platform.body,
            base_body=spec.base,
            keyframe=spec.keyframe,
            initial=tuple(spec.initial.items()),
            lumped_bodies=tuple(spec.lumped),
            ignore=tuple(spec.ignore),
            fix_base=spec.fix_base,
        )

    @cached_property
    def targets(self) -> tuple[Target, ...]:
        """Every place that a parameter names, in the order of the file."""
        found: list[Target] = []
        for name, parameter in self.spec.parameters.items():
            where = f"{self.shown}: {self._key(name, 'at')}"
            for number, text in enumerate(parameter.at):
                target = parse_place(text, name, where)
                if number == 0:
                    if target.of.count(name) != 1:
                        raise SpecError(f'{where} "{text}": the first place has to hold {name} once, to read it')
                    target = Target(**{**vars(target), "reads": name})
                found.append(target)
            where = f"{self.shown}: {self._key(name, 'follows')}"
            found += [parse_place(text, name, where, optional=True) for text in parameter.follows]
        for target in found:
            for other in target.of:
                if other not in self.spec.parameters:
                    hint = did_you_mean(other, self.spec.parameters)
                    raise SpecError(f'{self.shown}: "{target.words}" is a product with "{other}", no parameter{hint}')
        return tuple(found)

    @cached_property
    def table(self) -> ParameterTable:
        """The parameters with their ranges, groups and bars."""
        spec = self.spec
        read = {target.reads: target for target in self.targets if target.reads}
        infos = {name: self._info(name, parameter, read[name]) for name, parameter in spec.parameters.items()}
        for group, members in spec.groups.items():
            if group in infos:
                raise SpecError(f"{self.shown}: groups.{group}: is a parameter too; choose another name")
            for member in members:
                self._known(member, f"groups.{group}")
        bars = []
        for number, bar in enumerate(spec.bars):
            names = [bar.mass, bar.length or bar.half_length or "", *bar.inertia, *([bar.centre] if bar.centre else [])]
            for name in names:
                self._known(name, f"bars[{number + 1}]")
            bars.append(Bar(bar.mass, names[1], bar.half_length is not None, tuple(bar.inertia), bar.centre))
        return ParameterTable(infos, {g: tuple(m) for g, m in spec.groups.items()}, tuple(bars))

    def key_of(self, target: Target) -> str:
        """Key of the place that a target stands for, for messages."""
        return self._key(target.reads or target.of[0], "follows" if target.optional else "at")

    def _key(self, name: str, key: str = "") -> str:
        return f"read.{name}" if self.section == "read" else ".".join(["parameters", name, *([key] if key else [])])

    def _known(self, name: str, key: str) -> None:
        if name not in self.spec.parameters:
            raise SpecError(f'{self.shown}: {key}: no parameter "{name}"{did_you_mean(name, self.spec.parameters)}')

    def _info(self, name: str, parameter: ParameterSpec, target: Target) -> ParameterInfo:
        where = f"{self.shown}: {self._key(name)}"
        if keyword.iskeyword(name) or name.startswith("__"):
            raise SpecError(
                f"{where}: formulas read p.NAME, and this name cannot stand there; allowed: letters, digits and _, none"
                ' of the words of Python, such as "lambda"',
                key=name,
            )
        units = kind_of(target).unit.split("|")
        unit = parameter.unit if parameter.unit is not None else " or ".join(units)
        if parameter.unit is not None and len(target.of) == 1 and units != [""] and parameter.unit not in units:
            raise SpecError(
                f'{where}: unit = "{parameter.unit}"; "{target.words}" holds {" or ".join(units)}, as all of an MJCF in'
                " SI",
                key=name,
            )
        low, high = _range(parameter.allowed, where)
        return ParameterInfo(
            name, unit, parameter.meaning or meaning_of(target), parameter.source, low[0], low[1], high[0], high[1]
        )


def _range(text: str, where: str) -> tuple[tuple[float, bool], tuple[float, bool]]:
    """Lower and upper bound of ``> 0``, ``0 to 1``, ``> 0 and < 2``, each with whether it is allowed itself."""
    low, high = (-math.inf, True), (math.inf, True)
    said = f'{where}: allowed = "{shorten(text)}"; allowed: such as "> 0", ">= 0", "0 to 1", "> 0 and < 2"'
    if not text.strip():
        return low, high
    try:
        between = BETWEEN.fullmatch(text.strip())
        if between:
            low, high = (float(between[1]), True), (float(between[2]), True)
        else:
            for part in text.split(" and "):
                bound = BOUND.fullmatch(part.strip())
                if bound is None:
                    raise SpecError(said)
                value, itself = float(bound[2]), "=" in bound[1]
                if ">" in bound[1]:
                    low = (value, itself)
                else:
                    high = (value, itself)
    except ValueError as error:
        raise SpecError(said) from error
    if not low[0] < high[0]:
        raise SpecError(f"{said}; nothing lies between {low[0]:g} and {high[0]:g}")
    return low, high


def read_robot_file(path: Path, shown: str = "", builtin: bool = False) -> RobotFile:
    """Read and check a robot file.

    Raises
    ------
    SpecError
        Missing or malformed, an unknown key (with the nearest valid one), a place or range that is none, a file that
        it names and that is not there.
    """
    shown = shown or str(path)
    document = read_toml(path, shown)
    try:
        spec = RobotSpec.model_validate(document)
    except ValidationError as error:
        raise SpecError(f"{shown}: {FORM.problem(error, document)}", file=shown) from error
    found = RobotFile(path, shown, spec, builtin)
    for joint in spec.limits:
        if joint not in spec.actuated:
            raise SpecError(f'{shown}: limits: no actuated joint "{joint}"{did_you_mean(joint, spec.actuated)}')
        low, high = spec.limits[joint]
        if not low < high:
            raise SpecError(f"{shown}: limits.{joint} = {low:g} to {high:g}; the first must be below the second")
    check_joints(spec.actuators, spec.actuated, shown)
    _ = found.model, found.formulas, found.table
    return found
