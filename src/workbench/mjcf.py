"""The MJCF is the single source of truth: load it safely, read parameters from the compiled model, edit, check.

Parameters are read back from what MuJoCo compiled, never from the text, so both sides of a comparison see the same
robot. Overrides are written into the text (in memory) and compiled again.
"""

from __future__ import annotations

import contextlib
import math
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np

from workbench.data_files import bundled
from workbench.errors import ModelError, ParameterError, WorkbenchError, did_you_mean
from workbench.mechanisms import MECHANISMS, mechanism_class
from workbench.mechanisms.base import Mechanism
from workbench.mechanisms.parameters import LARGEST_NUMBER, changed_parameters
from workbench.mjcf_assumptions import Context, refuse_broken
from workbench.mjcf_inertia import refuse_impossible_bodies
from workbench.mjcf_safety import MAX_BYTES, read_text
from workbench.mjcf_setup import Setup, prepare
from workbench.mjcf_text import Element, scan
from workbench.mjcf_values import quotient, read_parameters, rewrite, target_number, vector

__all__ = [
    "MAX_BYTES",
    "LoadedModel",
    "compile_text",
    "custom_text",
    "edit_text",
    "find_model",
    "load_mechanism",
    "load_model",
    "load_text",
    "open_model",
    "plan_mechanism",
    "read_parameters",
    "read_text",
]

FINITE = (
    "qpos0", "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia", "jnt_pos", "jnt_axis",
    "site_pos", "site_quat", "dof_damping", "dof_armature", "dof_frictionloss", "jnt_stiffness", "eq_data", "key_qpos",
)  # fmt: skip
"""Compiled arrays that every result depends on."""

FINITE_OPTIONS = ("gravity", "wind", "density", "viscosity", "timestep")


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


def find_model(path: str | Path) -> Path:
    """Return *path*, or the bundled model of that name where no such file exists.

    Raises
    ------
    ModelError
        No such file.
    """
    path = Path(path)
    try:
        if path.is_file():
            return path
        exists = path.exists()
    except (OSError, ValueError) as error:  # a name too long, a null byte, a directory that may not be entered
        raise ModelError(f"{str(path)!r}: {getattr(error, 'strerror', None) or error}", file=str(path)) from error
    if exists:
        kind = "a directory" if path.is_dir() else "no regular file"
        raise ModelError(f"{path}: is {kind}; a model is an XML file", file=str(path))
    if path.parts[:1] == ("models",) and len(path.parts) == 2:
        with contextlib.suppress(WorkbenchError):  # the message below says it better
            return bundled("models", path.name)
    raise ModelError(f"{path}: no such model file", file=str(path))


@contextlib.contextmanager
def engine_warnings() -> Iterator[list[str]]:
    """Collect MuJoCo's warnings; left alone it prints them and writes a log file into the current directory.

    Those of a specification's own ``compile`` come as Python's UserWarning, and are dropped.
    """
    collected: list[str] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(collected.append)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            yield collected
    finally:
        mujoco.set_mju_user_warning(before)


def compile_text(text: str, file: str) -> mujoco.MjModel:
    """Compile an MJCF text.

    Raises
    ------
    ModelError
        MuJoCo's own message, which names the file's line; or a number that is not finite or beyond `LARGEST_NUMBER`.
    """
    try:
        with engine_warnings():
            model = mujoco.MjModel.from_xml_string(text)
    except (ValueError, TypeError, MemoryError, mujoco.FatalError) as error:
        raise ModelError(f"{file}: MuJoCo does not compile it: {error}", file=file) from error
    numbers = [(name, getattr(model, name)) for name in FINITE]
    numbers += [(f"option {name}", np.atleast_1d(getattr(model.opt, name))) for name in FINITE_OPTIONS]
    for name, values in numbers:
        if values.size and not np.abs(values).max() <= LARGEST_NUMBER:
            raise ModelError(
                f"{file}: {name} of the compiled model holds {np.abs(values).max():g}; allowed: at most"
                f" {LARGEST_NUMBER:g}",
                file=file,
            )
    return model


def custom_text(model: mujoco.MjModel, name: str) -> str | None:
    """Return the value of ``<custom><text name=...>``, or None."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXT, name)
    if index < 0:
        return None
    start = model.text_adr[index]
    return bytes(model.text_data[start : start + model.text_size[index] - 1]).decode()


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
    text = read_text(find_model(path))
    if setup:
        text = prepare(text, file, setup, compile_text)
    if not overrides:
        return load_text(text, file)
    base = _read_once(text, file)
    if base.kind is None or base.values is None:
        raise ModelError(
            f'{file}: parameters cannot be set, <custom> has no <text name="mechanism"> that says what they mean',
            file=file,
        )
    wanted = changed_parameters(base.kind, base.values, overrides)
    refuse_impossible_bodies(base.model, base.kind, file, base.values, wanted)
    text = rewrite(text, file, base.kind, base.values, wanted, base.elements)
    model = compile_text(text, file)
    confirm(model, base.kind, file, wanted)
    # the file's structure was checked once; only numbers that are parameters' own have changed since
    refuse_broken(Context(model, base.kind, file, text), wanted)
    return LoadedModel(file, text, model, base.kind(base.kind.parameter_type(**wanted)), base.kind, wanted)


def plan_mechanism(path: str | Path, overrides: Mapping[str, float]) -> Mechanism | None:
    """Return the closed form that `load_model` gives with overrides, without compiling the edited file.

    None where the file names no mechanism.

    Raises
    ------
    ModelError, ParameterError
        The file itself cannot be loaded, or as `Mechanism.with_parameters`.
    """
    base = _read_once(read_text(find_model(path)), str(path))
    if base.kind is None or base.values is None:
        return None
    return base.kind(base.kind.parameter_type(**changed_parameters(base.kind, base.values, overrides)))


def open_model(path: str | Path) -> LoadedModel:
    """Load an MJCF that may break the closed form's assumptions, to list them (`workbench.mjcf_assumptions`).

    Raises
    ------
    ModelError
        The file cannot be read, is not safe, or does not compile; or it names an unknown mechanism.
    """
    file = str(path)
    text = read_text(find_model(path))
    elements = scan(text, file)
    model = compile_text(text, file)
    kind = _kind(model, file)
    if kind is None:
        return LoadedModel(file, text, model, None)
    try:
        values = read_parameters(model, kind, file, text, elements)
        return LoadedModel(file, text, model, kind(kind.parameter_type(**values)), kind, values)
    except (ModelError, ParameterError) as error:
        return LoadedModel(file, text, model, None, kind, None, str(error))


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
def _read_once(text: str, file: str) -> _Read:
    """What a sweep over one file needs of it again and again."""
    loaded = load_text(text, file)
    return _Read(loaded.model, loaded.kind, loaded.values, scan(text, file))


def load_text(text: str, file: str) -> LoadedModel:
    """Load an MJCF text as `load_model` does a file; *file* is the name under which errors speak of it.

    Raises
    ------
    ModelError, ParameterError
        See `load_model`.
    """
    elements = scan(text, file)
    model = compile_text(text, file)
    kind = _kind(model, file)
    if kind is None:
        return LoadedModel(file, text, model, None)
    context = Context(model, kind, file, text)
    refuse_broken(context, None)
    values = read_parameters(model, kind, file, text, elements)
    refuse_broken(context, values)
    return LoadedModel(file, text, model, kind(kind.parameter_type(**values)), kind, values)


def _kind(model: mujoco.MjModel, file: str) -> type[Mechanism] | None:
    name = custom_text(model, "mechanism")
    if name is None:
        return None
    if name not in MECHANISMS:
        raise ModelError(f'{file}: unknown mechanism "{name}"{did_you_mean(name, MECHANISMS)}', file=file)
    return mechanism_class(name)
