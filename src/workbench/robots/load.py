"""A robot from its MJCF: load it safely, read parameters from the compiled model, apply overrides, check.

Parameters are read back from what MuJoCo compiled, never from the text, so both sides of a comparison see the same
robot. Overrides are written into the text (in memory) and compiled again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import mujoco

from workbench.errors import ModelError, ParameterError, did_you_mean
from workbench.mjcf.compile import custom_text, find_model
from workbench.mjcf.files import read_text
from workbench.mjcf.prepared import Prepared, open_source, prepare
from workbench.mjcf.setup import Setup
from workbench.mjcf.text import Element, scan
from workbench.robots import MECHANISMS, mechanism_class
from workbench.robots.assumptions.check import Context, refuse_broken
from workbench.robots.base import Mechanism
from workbench.robots.inertia import refuse_impossible_bodies
from workbench.robots.parameters import changed_parameters
from workbench.robots.values import quotient, read_parameters, rewrite, target_number, vector


@dataclass(frozen=True)
class LoadedModel:
    """An MJCF after overrides: its text, the compiled model, and the mechanism it describes, if it names one."""

    file: str
    text: str
    model: mujoco.MjModel
    mechanism: Mechanism | None
    kind: type[Mechanism] | None = None
    """the mechanism's class, known even where the model breaks its assumptions"""
    values: Mapping[str, float] | None = None
    """its parameters by stored name; None where they cannot be read"""
    problem: str = ""
    """why they cannot be read, one line"""
    prepared: Prepared | None = None
    """the file with all that it reads, and how its specification is made"""

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


def load_model(
    path: str | Path, overrides: Mapping[str, float] | None = None, setup: Setup | None = None
) -> LoadedModel:
    """Load an MJCF, apply overrides, read the mechanism's parameters back and check the closed form's assumptions.

    Parameters
    ----------
    path
        An MJCF file, or ``models/NAME.xml`` of the models that come with the package.
    overrides
        Parameter values by name, SI; see `Mechanism.with_parameters`.
    setup
        What a campaign says about a file that names neither mechanism, actuators nor platform.

    Raises
    ------
    ModelError
        The file does not compile or breaks an assumption (what, where, value, limit).
    ParameterError
        An override that does not exist or has a value it may not have.
    """
    file = str(path)
    found = find_model(path)
    text = read_text(found)
    if setup:
        prepared = prepare(text, file, found.parent, setup)
        if overrides:
            raise ModelError(f"{file}: parameters cannot be set; edit the MJCF, which both sides read", file=file)
        return LoadedModel(file, text, prepared.model, None, prepared=prepared)
    if not overrides:
        return load_text(text, file, found.parent)
    base = _read_once(text, file, found.parent)
    if base.kind is None or base.values is None:
        raise ModelError(
            f'{file}: parameters cannot be set, <custom> has no <text name="mechanism"> that says what they mean',
            file=file,
        )
    wanted = changed_parameters(base.kind, base.values, overrides)
    refuse_impossible_bodies(base.model, base.kind, file, base.values, wanted)
    text = rewrite(text, file, base.kind, base.values, wanted, base.elements)
    prepared = open_source(text, file, found.parent)
    model = prepared.model
    confirm(model, base.kind, file, wanted)
    # the file's structure was checked once; only numbers that are parameters' own have changed since
    refuse_broken(Context(model, base.kind, file, text), wanted)
    return LoadedModel(
        file, text, model, base.kind(base.kind.parameter_type(**wanted)), base.kind, wanted, prepared=prepared
    )


def plan_mechanism(path: str | Path, overrides: Mapping[str, float]) -> Mechanism | None:
    """Return the closed form that `load_model` gives with overrides, without compiling the edited file.

    None where the file names no mechanism.

    Raises
    ------
    ModelError, ParameterError
        The file itself cannot be loaded, or as `Mechanism.with_parameters`.
    """
    found = find_model(path)
    base = _read_once(read_text(found), str(path), found.parent)
    if base.kind is None or base.values is None:
        return None
    return base.kind(base.kind.parameter_type(**changed_parameters(base.kind, base.values, overrides)))


def open_model(path: str | Path) -> LoadedModel:
    """Load an MJCF that may break the closed form's assumptions, to list them (`workbench.robots.assumptions.check`).

    Raises
    ------
    ModelError
        The file cannot be read, is not safe, or does not compile; or it names an unknown mechanism.
    """
    file = str(path)
    found = find_model(path)
    text = read_text(found)
    elements = scan(text, file)
    prepared = open_source(text, file, found.parent, elements)
    model = prepared.model
    kind = _kind(model, file)
    if kind is None:
        return LoadedModel(file, text, model, None, prepared=prepared)
    try:
        values = read_parameters(model, kind, file, text, elements)
        return LoadedModel(file, text, model, kind(kind.parameter_type(**values)), kind, values, prepared=prepared)
    except (ModelError, ParameterError) as error:
        return LoadedModel(file, text, model, None, kind, None, str(error), prepared)


def load_mechanism(path: str | Path, **parameters: float) -> Mechanism:
    """Load the closed form of the mechanism that an MJCF describes.

    Parameters
    ----------
    path
        An MJCF file with ``<custom><text name="mechanism">``, or ``models/NAME.xml`` of those that come along.
    **parameters
        Overrides by name, SI: ``payload=0.5``, ``a2_left=0.31``.

    Raises
    ------
    ModelError, ParameterError
        See `load_model`.
    """
    loaded = load_model(path, parameters)
    if loaded.mechanism is None:
        raise ModelError(
            f'{path}: <custom> has no <text name="mechanism">; valid: {", ".join(MECHANISMS)}', file=str(path)
        )
    return loaded.mechanism


def edit_text(
    text: str, file: str, mechanism: type[Mechanism], values: Mapping[str, float], changes: Mapping[str, float]
) -> str:
    """Return the MJCF text with parameters changed; only numbers that have to change are touched.

    Parameters
    ----------
    text, file
        The MJCF and its name.
    mechanism
        The mechanism that it describes.
    values
        The parameters as they stand in the text.
    changes
        New values, as for `Mechanism.with_parameters`.

    Raises
    ------
    ModelError, ParameterError
        A missing element, an unknown name, a value that is not allowed.
    """
    return rewrite(text, file, mechanism, values, changed_parameters(mechanism, values, changes))


def confirm(model: mujoco.MjModel, kind: type[Mechanism], file: str, wanted: Mapping[str, float]) -> None:
    """Refuse an edited model that does not hold, bit for bit, the parameters that were asked for.

    Raises
    ------
    ModelError
        Naming the parameter: something in the file (a ``<compiler>`` option, a ``<frame>``) changes the numbers in it.
    """
    for target in kind.targets:
        if target.reads is None:
            continue
        found = float(vector(model, target, file)[target.index])
        if found != target_number(target, wanted):
            name = target.reads
            value = quotient(found / target.factor, math.prod(wanted[other] for other in target.of if other != name))
            raise ModelError(
                f"{file}: parameter {name} = {wanted[name]!r} was written but reads back as {value!r}; a"
                " <compiler> option or a <frame> of this file changes its numbers",
                file=file,
                parameter=name,
                value=value,
            )


@dataclass(frozen=True)
class _Read:
    model: mujoco.MjModel
    kind: type[Mechanism] | None
    values: Mapping[str, float] | None
    elements: list[Element]


@lru_cache(maxsize=8)
def _read_once(text: str, file: str, folder: Path) -> _Read:
    """What a sweep over one file needs of it again and again."""
    loaded = load_text(text, file, folder)
    return _Read(loaded.model, loaded.kind, loaded.values, scan(text, file))


def load_text(text: str, file: str, folder: Path | None = None) -> LoadedModel:
    """Load an MJCF text as `load_model` does a file; *file* is the name under which errors speak of it.

    *folder* is the directory from which it may read; None: it reads nothing.

    Raises
    ------
    ModelError, ParameterError
        See `load_model`.
    """
    elements = scan(text, file)
    prepared = open_source(text, file, folder, elements)
    model = prepared.model
    kind = _kind(model, file)
    if kind is None:
        return LoadedModel(file, text, model, None, prepared=prepared)
    context = Context(model, kind, file, text)
    refuse_broken(context, None)
    values = read_parameters(model, kind, file, text, elements)
    refuse_broken(context, values)
    return LoadedModel(file, text, model, kind(kind.parameter_type(**values)), kind, values, prepared=prepared)


def _kind(model: mujoco.MjModel, file: str) -> type[Mechanism] | None:
    name = custom_text(model, "mechanism")
    if name is None:
        return None
    if name not in MECHANISMS:
        raise ModelError(f'{file}: unknown mechanism "{name}"{did_you_mean(name, MECHANISMS)}', file=file)
    return mechanism_class(name)
