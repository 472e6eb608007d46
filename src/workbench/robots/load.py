"""A robot from its MJCF: load it safely, read parameters from the compiled model, apply overrides, check.

Parameters are read back from what MuJoCo compiled, never from the text, so both sides of a comparison see the same
robot. Overrides are written into the text (in memory) and compiled again.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path

import mujoco

from workbench.errors import ModelError, ParameterError
from workbench.mjcf.files import read_text
from workbench.mjcf.prepared import Prepared, open_source, prepared_for
from workbench.mjcf.setup import Setup, says_it_itself
from workbench.mjcf.text import Element, scan
from workbench.robots.agreement import refuse_disagreement
from workbench.robots.assumptions.check import Context, refuse_broken
from workbench.robots.catalogue import Source, find_source, robot_beside, robot_named
from workbench.robots.closed_form import ClosedForm
from workbench.robots.description import Description, describe
from workbench.robots.inertia import refuse_impossible_bodies
from workbench.robots.number_checks import NumberChecks, checks_of
from workbench.robots.parameters import Target
from workbench.robots.robot_file import RobotFile
from workbench.robots.values import is_written, quotient, read_number, read_parameters, rewrite
from workbench.robots.variants import Variants

NAMES_FILES = re.compile(r"file\s*=")
"""Of an include, a mesh, a picture, an attached model: a text with it may mean something else when it is read again."""


@dataclass(frozen=True)
class LoadedModel:
    """An MJCF after overrides: as the user wrote it, as the reference sees it, and the robot that it describes."""

    file: str
    writing: Callable[[], str] = field(repr=False)
    """how `text` is made"""
    model: mujoco.MjModel
    """as the reference sees it: actuators, platform and first guess put into it"""
    description: Description | None = None
    """known even where the model breaks the assumptions of its formulas"""
    values: Mapping[str, float] | None = None
    """parameters by name; None where they cannot be read"""
    problem: str = ""
    """why they cannot be read, one line"""
    prepared: Prepared | None = None
    """the file with all that it reads, and how its specification is made"""
    family: object = None
    """the same for models that were compiled from one specification and differ in nothing but numbers"""

    @cached_property
    def text(self) -> str:
        """The user's own, with the overrides written into it."""
        return self.writing()

    def spec(self) -> mujoco.MjSpec:
        """A fresh specification of `model`, to be changed and compiled."""
        if self.prepared is None:
            raise ModelError(f"{self.file}: was not loaded from a text", file=self.file)
        return self.prepared.spec()

    @property
    def user(self) -> mujoco.MjModel:
        """The file as it lies, compiled: with contacts, limits, actuators."""
        return self.prepared.user if self.prepared else self.model

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader of results has to know of the file."""
        return self.prepared.notes if self.prepared else ()

    @property
    def closed_form(self) -> ClosedForm | None:
        """The package's own formulas for this robot; None where it has none or its numbers cannot be read."""
        described = self.description
        if described is None or described.closed_form is None or self.values is None:
            return None
        return described.closed_form(described.parameter_type(**self.values))


def load_model(
    path: str | Path,
    overrides: Mapping[str, float] | None = None,
    setup: Setup | None = None,
    robot: RobotFile | None = None,
) -> LoadedModel:
    """Load an MJCF, apply overrides, read the parameters back and check what the robot's formulas take for granted.

    Parameters
    ----------
    path
        A robot (`workbench.robots.catalogue.find_source`): folder, robot file, MJCF, or a name.
    overrides
        Parameter values by name, SI.
    setup
        Actuated joints, platform and first guess of a file that has no robot file.
    robot
        The robot file, where another one than the path's own describes the model.

    Raises
    ------
    ModelError
        The file does not compile or breaks an assumption (what, where, value, limit).
    ParameterError
        An override that does not exist or has a value it may not have.
    SpecError
        A robot file that is wrong, or says of the model what it does not have.
    """
    source = find_source(path)
    text = read_text(source.model)
    base = _read_once(text, source.shown, source.model, robot or source.robot, setup)
    return with_overrides(base, overrides or {})


def with_overrides(base: Base, overrides: Mapping[str, float], *, whole: bool = False) -> LoadedModel:
    """Return what `load_model` gives for a model that has been read, with parameters changed.

    *whole* says that the overrides are all parameters, as `ParameterTable.changed` gave them.

    Raises
    ------
    ModelError, ParameterError
        See `load_model`.
    """
    loaded = base.loaded
    if not overrides:
        return loaded
    described, values, file = loaded.description, loaded.values, loaded.file
    if described is None or values is None:
        raise no_parameters(file)
    wanted = dict(overrides) if whole else described.table.changed(values, overrides)
    refuse_computed(base, overrides if whole else described.table.expand(overrides), values)
    quickly = base.variants.loaded(base, wanted)
    if quickly is not None:
        return quickly
    refuse_impossible_bodies(base.model, described, file, values, wanted)
    text, elements = rewrite(base.model, loaded.text, file, described, values, wanted, base.elements)
    return _confirmed(base, text, elements, described, wanted)


def no_parameters(file: str) -> ModelError:
    """What to say where parameters are asked for and nothing says what they are."""
    return ModelError(
        f"{file}: parameters cannot be set; a robot file beside it says which there are ([parameters.NAME] in"
        " robot.toml, docs/robots.md)",
        file=file,
    )


def refuse_computed(base: Base, given: Mapping[str, float], values: Mapping[str, float]) -> None:
    """Refuse to set a parameter whose number does not stand in the file: MuJoCo computes it from others.

    Raises
    ------
    ParameterError
        Naming the place, and what would make it settable.
    """
    for name, value in given.items():
        if name in base.computed and value != values[name]:
            target = base.computed[name]
            ways = {
                "distance": "name the numbers that it follows from as places of the parameter",
                "inertial": f'write an <inertial> into body "{target.name}" with it',
                "joint": f"write {target.attribute} at the joint itself, not in a class",
                "option": "write <option gravity> into the file",
            }
            way = ways.get(target.element, "write the number at the element itself, not in a class")
            raise ParameterError(
                f'{base.loaded.file}: parameter {name}: "{target.words}" is computed by MuJoCo and stands nowhere in'
                f" the file, so it cannot be set; {way}",
                parameter=name,
            )


@dataclass(frozen=True)
class Base:
    """A model as its file has it, and what changing it again and again needs to know."""

    loaded: LoadedModel
    model: mujoco.MjModel
    """compiled from the user's own text"""
    elements: list[Element]
    folder: Path | None
    """from which the model may read other files"""
    setup: Setup | None
    computed: Mapping[str, Target]
    """parameters whose number does not stand in the file -> their place"""
    checks: NumberChecks | None = field(default=None, repr=False, compare=False)
    """what the numbers of a variant have to pass; None where the places of parameters cannot be looked at at once"""
    variants: Variants = field(default_factory=Variants, repr=False, compare=False)
    """how variants are made where there are many"""


def read_base(path: str | Path, setup: Setup | None = None, robot: RobotFile | None = None) -> Base:
    """Read a robot once, for many variants of it (`with_overrides`); arguments as for `load_model`."""
    source = find_source(path)
    return _read_once(read_text(source.model), source.shown, source.model, robot or source.robot, setup)


@lru_cache(maxsize=8)
def _read_alone(text: str, file: str, path: Path, robot: RobotFile | None, setup: Setup | None) -> Base:
    return _read(text, file, path, path.parent, robot, setup)


def _read_once(text: str, file: str, path: Path, robot: RobotFile | None, setup: Setup | None) -> Base:
    """What was read of the same text before, unless the text names other files: those may have changed."""
    if NAMES_FILES.search(text):
        return _read(text, file, path, path.parent, robot, setup)
    return _read_alone(text, file, path, robot, setup)


def _read(
    text: str, file: str, path: Path, folder: Path | None, robot: RobotFile | None, setup: Setup | None
) -> Base:  # fmt: skip
    elements = scan(text, file)
    whole = open_source(text, file, folder, elements)
    model = whole.user
    if robot is None and setup is None:
        robot = robot_named(model, file) or robot_beside(path)
    if robot is None:
        return Base(_loaded(file, text, _prepared(whole, file, setup)), model, elements, folder, setup, {})
    described = describe(robot, model, text, elements, file)
    setup = setup or robot.setup
    _check(described, model, file, text, None)
    computed = {t.reads: t for t in described.targets if t.reads and not is_written(text, elements, t)}
    checks = checks_of(model, described, file, computed)
    known = checks.read(model) if checks else None
    values = read_parameters(model, described, file, text, elements, known)
    if not (checks and checks.whole and checks.passed(model, values)):
        _check(described, model, file, text, values, elements)
    loaded = _loaded(file, text, _prepared(whole, file, setup), described, values)
    return Base(loaded, model, elements, folder, setup, computed, checks)


def _loaded(
    file: str,
    text: str,
    prepared: Prepared,
    described: Description | None = None,
    values: Mapping[str, float] | None = None,
    problem: str = "",
) -> LoadedModel:
    return LoadedModel(file, lambda: text, prepared.model, described, values, problem, prepared)


def _prepared(whole: Prepared, file: str, setup: Setup | None) -> Prepared:
    """What the reference sees of a file."""
    return whole if setup is None or says_it_itself(whole.user, setup) else prepared_for(whole, file, setup)


def _check(
    described: Description,
    model: mujoco.MjModel,
    file: str,
    text: str,
    values: Mapping[str, float] | None,
    elements: list[Element] | None = None,
) -> None:
    """Refuse what the robot's formulas do not hold for; without formulas, places of a parameter that disagree."""
    if described.layout is not None:
        refuse_broken(Context(model, described, file, text, brief=True), values)
    elif values is not None and elements is not None:
        refuse_disagreement(model, described, file, text, elements, values)


def _confirmed(
    base: Base, text: str, elements: list[Element], described: Description, wanted: Mapping[str, float]
) -> LoadedModel:
    """Compile an edited text, read it back and refuse it where it does not hold what was asked for."""
    file, checks = base.loaded.file, base.checks
    whole = open_source(text, file, base.folder, elements)
    model = whole.user
    values = dict(wanted) if not base.computed else read_parameters(model, described, file, text, elements)
    if not (checks and checks.whole and checks.passed(model, values)):
        confirm(model, described, file, text, elements, wanted, base.computed)
        # the file's structure was checked once; only numbers that are parameters' own have changed since
        _check(described, model, file, text, values, elements)
    return _loaded(file, text, _prepared(whole, file, base.setup), described, values)


def load_edited(base: Base, text: str, wanted: Mapping[str, float]) -> LoadedModel:
    """Load an edited text of a model as a file of its own, and confirm that it holds *wanted*.

    Raises
    ------
    ModelError, ParameterError
        See `load_model`.
    """
    file = base.loaded.file
    loaded = _read(text, file, Path(file), base.folder, _robot_of(base), base.setup)
    assert loaded.loaded.description is not None
    confirm(loaded.model, loaded.loaded.description, file, text, loaded.elements, wanted, base.computed)
    return loaded.loaded


def _robot_of(base: Base) -> RobotFile | None:
    return base.loaded.description.robot if base.loaded.description else None


def open_model(path: str | Path) -> LoadedModel:
    """Load an MJCF that may break its formulas' assumptions, to list them (`workbench.robots.assumptions.check`).

    Raises
    ------
    ModelError
        The file cannot be read, is not safe, or does not compile; or it names an unknown robot.
    """
    source = find_source(path)
    file, text = source.shown, read_text(source.model)
    elements = scan(text, file)
    whole = open_source(text, file, source.model.parent, elements)
    model = whole.user
    robot = source.robot or robot_named(model, file) or robot_beside(source.model)
    if robot is None:
        return _loaded(file, text, whole)
    described = describe(robot, model, text, elements, file)
    seen = _prepared(whole, file, robot.setup) if described.layout is None else whole
    try:
        values = read_parameters(model, described, file, text, elements)
        return _loaded(file, text, seen, described, values)
    except (ModelError, ParameterError) as error:
        return _loaded(file, text, seen, described, None, str(error))


def confirm(
    model: mujoco.MjModel,
    described: Description,
    file: str,
    text: str,
    elements: list[Element],
    wanted: Mapping[str, float],
    computed: Mapping[str, Target],
) -> None:
    """Refuse an edited model that does not hold, bit for bit, the parameters that were asked for.

    Raises
    ------
    ModelError
        Naming the parameter: something in the file (a ``<compiler>`` option, a ``<frame>``) changes the numbers in it.
    """
    for target in described.targets:
        if target.reads is None or target.reads in computed:
            continue
        found = read_number(model, target, file, text, elements)
        if found != target.number(wanted):
            name = target.reads
            value = quotient(found / target.factor, math.prod(wanted[other] for other in target.of if other != name))
            raise ModelError(
                f"{file}: parameter {name} = {wanted[name]!r} was written but reads back as {value!r}; a"
                " <compiler> option or a <frame> of this file changes its numbers",
                file=file,
                parameter=name,
                value=value,
            )


def load_text(text: str, file: str, folder: Path | None = None) -> LoadedModel:
    """Load an MJCF text as `load_model` does a file; *file* is the name under which errors speak of it.

    *folder* is the directory from which it may read; None: it reads nothing.

    Raises
    ------
    ModelError, ParameterError
        See `load_model`.
    """
    return _read(text, file, Path(file), folder, None, None).loaded


__all__ = [
    "Base",
    "LoadedModel",
    "Source",
    "confirm",
    "load_edited",
    "load_model",
    "load_text",
    "open_model",
    "read_base",
    "with_overrides",
]
