"""The MJCF is the single source of truth: load it safely, read parameters from the compiled model, edit, check.

Parameters are read back from what MuJoCo compiled, never from the text, so both sides of a comparison see the same
robot. Overrides are written into the text (in memory) and compiled again.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from workbench.data_files import bundled
from workbench.errors import ModelError, did_you_mean
from workbench.mechanisms import MECHANISMS, mechanism_class
from workbench.mechanisms.base import Mechanism, Target, changed_parameters, check_parameters
from workbench.mjcf_text import find, replace_numbers, scan

ALIGNMENT = 1e-12
"""Largest deviation (metres, kilograms, kg m^2, relative to the larger of 1 and the value) that still counts as on the
axis or equal: above it the closed form would describe another robot."""

MAX_BYTES = 10_000_000
"""A model larger than this is refused before it is parsed."""

FIELDS = {
    ("body", "pos"): (mujoco.mjtObj.mjOBJ_BODY, "body_pos"),
    ("inertial", "pos"): (mujoco.mjtObj.mjOBJ_BODY, "body_ipos"),
    ("inertial", "mass"): (mujoco.mjtObj.mjOBJ_BODY, "body_mass"),
    ("site", "pos"): (mujoco.mjtObj.mjOBJ_SITE, "site_pos"),
    ("joint", "pos"): (mujoco.mjtObj.mjOBJ_JOINT, "jnt_pos"),
    ("joint", "damping"): (mujoco.mjtObj.mjOBJ_JOINT, "dof_damping"),
}
"""Where the compiled model keeps an attribute."""


@dataclass(frozen=True)
class LoadedModel:
    """An MJCF after overrides: its text, the compiled model, and the mechanism it describes, if it names one."""

    file: str
    text: str
    model: mujoco.MjModel
    mechanism: Mechanism | None


def find_model(path: str | Path) -> Path:
    """Return *path*, or the bundled model of that name where no such file exists.

    Raises
    ------
    ModelError
        No such file.
    """
    path = Path(path)
    if path.is_file():
        return path
    if path.parts[:1] == ("models",) and len(path.parts) == 2:
        try:
            return bundled("models", path.name)
        except Exception:  # the message below says it better  # noqa: BLE001
            pass
    raise ModelError(f"{path}: no such model file", file=str(path))


def read_text(path: Path) -> str:
    """Read an MJCF file.

    Raises
    ------
    ModelError
        Not a file, not readable, not UTF-8, or too large.
    """
    try:
        raw = path.read_bytes()
        if len(raw) > MAX_BYTES:
            raise ModelError(f"{path}: {len(raw)} bytes; allowed: at most {MAX_BYTES}", file=str(path))
        return raw.decode()
    except OSError as error:
        raise ModelError(f"{path}: {error.strerror or error}", file=str(path)) from error
    except UnicodeDecodeError as error:
        raise ModelError(f"{path}: not UTF-8 text (byte {error.start})", file=str(path)) from error


def compile_text(text: str, file: str) -> mujoco.MjModel:
    """Compile an MJCF text.

    Raises
    ------
    ModelError
        MuJoCo's own message, which names the file's line.
    """
    try:
        return mujoco.MjModel.from_xml_string(text)
    except (ValueError, mujoco.FatalError) as error:
        raise ModelError(f"{file}: MuJoCo does not compile it: {error}", file=file) from error


def custom_text(model: mujoco.MjModel, name: str) -> str | None:
    """Return the value of ``<custom><text name=...>``, or None."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXT, name)
    if index < 0:
        return None
    start = model.text_adr[index]
    return bytes(model.text_data[start : start + model.text_size[index] - 1]).decode()


def load_model(path: str | Path, overrides: Mapping[str, float] | None = None) -> LoadedModel:
    """Load an MJCF, apply overrides, read the mechanism's parameters back and check the closed form's assumptions.

    Parameters
    ----------
    path
        An MJCF file, or ``models/NAME.xml`` of the models that come with the package.
    overrides
        Parameter values by name, SI; see `Mechanism.with_parameters`.

    Raises
    ------
    ModelError
        The file does not compile or breaks an assumption (what, where, value, limit).
    ParameterError
        An override that does not exist or has a value it may not have.
    """
    found = find_model(path)
    file = str(path)
    text = read_text(found)
    scan(text, file)
    model = compile_text(text, file)
    name = custom_text(model, "mechanism")
    if name is None:
        if overrides:
            raise ModelError(
                f'{file}: parameters cannot be set, <custom> has no <text name="mechanism"> that says what they mean',
                file=file,
            )
        return LoadedModel(file, text, model, None)
    if name not in MECHANISMS:
        raise ModelError(f'{file}: unknown mechanism "{name}"{did_you_mean(name, MECHANISMS)}', file=file)
    mechanism = mechanism_class(name)
    parameters = read_parameters(model, mechanism, file)
    if overrides:
        text = edit_text(text, file, mechanism, parameters, overrides)
        model = compile_text(text, file)
        parameters = read_parameters(model, mechanism, file)
    return LoadedModel(file, text, model, mechanism(mechanism.parameter_type(**parameters)))


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
    new = changed_parameters(mechanism, values, changes)
    edits = []
    for target in mechanism.targets:
        if any(new[name] != values[name] for name in target.of):
            edits.append((target.element, target.name, target.attribute, target.index, _number(target, new)))
    return replace_numbers(text, file, edits)


def _number(target: Target, values: Mapping[str, float]) -> float:
    return target.factor * math.prod(values[name] for name in target.of)


def read_parameters(model: mujoco.MjModel, mechanism: type[Mechanism], file: str) -> dict[str, float]:
    """Read every parameter from the compiled model and check the numbers that have to follow from them.

    Raises
    ------
    ModelError
        A missing element, a number off its axis, or two numbers that should agree and do not.
    ParameterError
        A value that the parameter may not have.
    """
    values: dict[str, float] = {}
    for target in sorted((t for t in mechanism.targets if t.reads), key=lambda t: len(t.of)):
        found = _compiled(model, target, file)
        assert target.reads is not None
        others = math.prod(values[name] for name in target.of if name != target.reads)
        values[target.reads] = _quotient(found / target.factor, others)
    check_parameters(mechanism.parameter_table, values)
    _check_numbers(model, mechanism, values, file)
    return {f.name: values[f.name] for f in dataclasses.fields(mechanism.parameter_type)}


def _quotient(product: float, factor: float) -> float:
    """The number whose product with *factor* is *product*; of several, the one with the shortest decimal form.

    Division alone is one rounding off for some fractions; a user who asked for 0.45 reads 0.45 back.
    """
    if factor == 1.0:
        return product
    near = product / factor
    candidates = [v for v in (near, math.nextafter(near, -math.inf), math.nextafter(near, math.inf)) if v * factor == product]
    return min(candidates, key=lambda v: len(repr(v)), default=near)


def _compiled(model: mujoco.MjModel, target: Target, file: str) -> float:
    vector = _vector(model, target, file)
    return float(vector[target.index])


def _vector(model: mujoco.MjModel, target: Target, file: str) -> np.ndarray:
    if target.element == "option":
        return np.asarray(getattr(model.opt, target.attribute))
    if (target.element, target.attribute) == ("inertial", "diaginertia"):
        body = _index(model, mujoco.mjtObj.mjOBJ_BODY, "body", target.name, file)
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, model.body_iquat[body])
        matrix = rotation.reshape(3, 3)
        return np.diag(matrix @ np.diag(model.body_inertia[body]) @ matrix.T)
    kind, name = FIELDS[target.element, target.attribute]
    tag = "body" if target.element == "inertial" else target.element
    return np.atleast_1d(getattr(model, name)[_index(model, kind, tag, target.name, file)])


def _index(model: mujoco.MjModel, kind: mujoco.mjtObj, tag: str, name: str, file: str) -> int:
    index = int(mujoco.mj_name2id(model, kind, name))
    if index < 0:
        names = [mujoco.mj_id2name(model, kind, i) or "" for i in range(getattr(model, f"n{tag}", 0))]
        hint = did_you_mean(name, [n for n in names if n]) if names else ""
        raise ModelError(f'{file}: <{tag} name="{name}"> is missing{hint}', file=file, element=name)
    return index


def _check_numbers(
    model: mujoco.MjModel, mechanism: type[Mechanism], values: Mapping[str, float], file: str
) -> None:
    """Every number that the parameters determine must have its value; the rest of each position must be zero."""
    covered: dict[tuple[str, str, str], dict[int, Target]] = {}
    for target in mechanism.targets:
        if target.element != "geom":
            covered.setdefault((target.element, target.name, target.attribute), {})[target.index] = target
    for (element, name, attribute), targets in covered.items():
        vector = _vector(model, next(iter(targets.values())), file)
        where = f'{file}: {element} "{name}" {attribute}' if name else f"{file}: {element} {attribute}"
        for index, found in enumerate(vector):
            if index in targets:
                expected = _number(targets[index], values)
                rule = " * ".join([f"{targets[index].factor:g}", *targets[index].of])
            elif attribute in ("pos", "gravity"):
                expected, rule = 0.0, "on the axis"
            else:
                continue
            limit = ALIGNMENT * max(1.0, abs(expected))
            if not abs(found - expected) <= limit:
                raise ModelError(
                    f"{where}, number {index + 1} is {found:.9g}; the closed form needs {expected:.9g} ({rule}) within"
                    f" {limit:g}",
                    file=file,
                    element=name,
                    attribute=attribute,
                    value=float(found),
                    limit=limit,
                )


def element_line(text: str, file: str, tag: str, name: str) -> int | None:
    """Line of an element in the text, for messages; None where it is missing."""
    element = find(scan(text, file), tag, name)
    return element.line if element else None
