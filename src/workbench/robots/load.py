"""A robot from its MJCF: load it safely, read parameters from the compiled model, apply overrides, check.

Parameters are read back from what MuJoCo compiled, never from the text, so both sides of a comparison see the same
robot. Overrides are written into the text (in memory) and compiled again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import mujoco

from workbench.errors import ModelError, ParameterError
from workbench.mjcf.compile import compile_text
from workbench.mjcf.safety import read_text
from workbench.mjcf.setup import Setup, prepare, says_it_itself
from workbench.mjcf.text import Element, scan
from workbench.robots.agreement import refuse_disagreement
from workbench.robots.assumptions.check import Context, refuse_broken
from workbench.robots.catalogue import Source, find_source, robot_beside, robot_named
from workbench.robots.closed_form import ClosedForm
from workbench.robots.description import Description, describe
from workbench.robots.inertia import refuse_impossible_bodies
from workbench.robots.parameters import Target
from workbench.robots.robot_file import RobotFile
from workbench.robots.values import is_written, quotient, read_number, read_parameters, rewrite


@dataclass(frozen=True)
class LoadedModel:
    """An MJCF after overrides: as the user wrote it, as the reference sees it, and the robot that it describes."""

    file: str
    text: str
    """the MJCF as the reference sees it: actuators, platform and first guess written into it"""
    model: mujoco.MjModel
    """compiled from `text`"""
    description: Description | None = None
    """known even where the model breaks the assumptions of its formulas"""
    values: Mapping[str, float] | None = None
    """parameters by name; None where they cannot be read"""
    problem: str = ""
    """why they cannot be read, one line"""
    source_text: str = field(default="", repr=False)
    """the MJCF as the user wrote it, with the overrides in it"""

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


def with_overrides(base: Base, overrides: Mapping[str, float]) -> LoadedModel:
    """Return what `load_model` gives for a model that has been read, with parameters changed.

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
    wanted = described.table.changed(values, overrides)
    refuse_computed(base, described.table.expand(overrides), values)
    refuse_impossible_bodies(base.model, described, file, values, wanted)
    text = rewrite(base.model, loaded.source_text, file, described, values, wanted, base.elements)
    return _confirmed(base, text, described, wanted)


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
    setup: Setup | None
    computed: Mapping[str, Target]
    """parameters whose number does not stand in the file -> their place"""


def read_base(path: str | Path, setup: Setup | None = None, robot: RobotFile | None = None) -> Base:
    """Read a robot once, for many variants of it (`with_overrides`); arguments as for `load_model`."""
    source = find_source(path)
    return _read_once(read_text(source.model), source.shown, source.model, robot or source.robot, setup)


@lru_cache(maxsize=8)
def _read_once(text: str, file: str, path: Path, robot: RobotFile | None, setup: Setup | None) -> Base:
    return _read(text, file, path, robot, setup)


def _read(text: str, file: str, path: Path, robot: RobotFile | None, setup: Setup | None) -> Base:
    elements = scan(text, file)
    model = compile_text(text, file)
    if robot is None and setup is None:
        robot = robot_named(model, file) or robot_beside(path)
    if robot is None:
        seen = _prepared(text, file, model, setup)
        return Base(LoadedModel(file, *seen, source_text=text), model, elements, setup, {})
    described = describe(robot, model, text, elements, file)
    setup = setup or robot.setup
    _check(described, model, file, text, None)
    values = read_parameters(model, described, file, text, elements)
    _check(described, model, file, text, values, elements)
    seen = _prepared(text, file, model, setup)
    computed = {t.reads: t for t in described.targets if t.reads and not is_written(text, elements, t)}
    return Base(LoadedModel(file, *seen, described, values, source_text=text), model, elements, setup, computed)


def _prepared(text: str, file: str, model: mujoco.MjModel, setup: Setup | None) -> tuple[str, mujoco.MjModel]:
    """The text that the reference sees, and its model."""
    if setup is None or says_it_itself(model, setup):
        return text, model
    prepared = prepare(text, file, setup, compile_text)
    return prepared, compile_text(prepared, file)


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
        refuse_broken(Context(model, described, file, text), values)
    elif values is not None and elements is not None:
        refuse_disagreement(model, described, file, text, elements, values)


def _confirmed(base: Base, text: str, described: Description, wanted: Mapping[str, float]) -> LoadedModel:
    """Compile an edited text, read it back and refuse it where it does not hold what was asked for."""
    file = base.loaded.file
    # an edit moves no element, only what lies behind a number in the text
    elements = base.elements if described.layout is not None else scan(text, file)
    model = compile_text(text, file)
    confirm(model, described, file, text, elements, wanted, base.computed)
    values = dict(wanted) if not base.computed else read_parameters(model, described, file, text, elements)
    # the file's structure was checked once; only numbers that are parameters' own have changed since
    _check(described, model, file, text, values, elements)
    return LoadedModel(file, *_prepared(text, file, model, base.setup), described, values, source_text=text)


def load_edited(base: Base, text: str, wanted: Mapping[str, float]) -> LoadedModel:
    """Load an edited text of a model as a file of its own, and confirm that it holds *wanted*.

    Raises
    ------
    ModelError, ParameterError
        See `load_model`.
    """
    loaded = _read(text, base.loaded.file, Path(base.loaded.file), _robot_of(base), base.setup)
    assert loaded.loaded.description is not None
    confirm(loaded.model, loaded.loaded.description, base.loaded.file, text, loaded.elements, wanted, base.computed)
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
    model = compile_text(text, file)
    robot = source.robot or robot_named(model, file) or robot_beside(source.model)
    if robot is None:
        return LoadedModel(file, text, model, source_text=text)
    described = describe(robot, model, text, elements, file)
    seen = _prepared(text, file, model, robot.setup) if described.layout is None else (text, model)
    try:
        values = read_parameters(model, described, file, text, elements)
        return LoadedModel(file, *seen, described, values, source_text=text)
    except (ModelError, ParameterError) as error:
        return LoadedModel(file, *seen, described, None, str(error), source_text=text)


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


def load_text(text: str, file: str) -> LoadedModel:
    """Load an MJCF text as `load_model` does a file; *file* is the name under which errors speak of it.

    Raises
    ------
    ModelError, ParameterError
        See `load_model`.
    """
    return _read(text, file, Path(file), None, None).loaded


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
