"""Parameters as the compiled model holds them: where MuJoCo keeps each number, and how a parameter follows from it.

Parameters are read from what MuJoCo compiled, so both sides of a comparison see the same robot. The text is asked for
one thing only: which of several fractions, whose products with a length are the same double, was meant.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import Context, Decimal
from fractions import Fraction

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError, ParameterError, did_you_mean
from workbench.mjcf.text import (
    PLAIN_DIGITS,
    Edit,
    Element,
    numbers_replaced,
    numbers_written,
    significant_digits,
    tokens,
    written,
)
from workbench.robots.description import COUNTS, Description
from workbench.robots.parameters import Target
from workbench.robots.places import WHOLE

FIELDS = {
    ("body", "pos"): (mujoco.mjtObj.mjOBJ_BODY, "body_pos"),
    ("inertial", "pos"): (mujoco.mjtObj.mjOBJ_BODY, "body_ipos"),
    ("inertial", "mass"): (mujoco.mjtObj.mjOBJ_BODY, "body_mass"),
    ("site", "pos"): (mujoco.mjtObj.mjOBJ_SITE, "site_pos"),
    ("joint", "pos"): (mujoco.mjtObj.mjOBJ_JOINT, "jnt_pos"),
    ("joint", "damping"): (mujoco.mjtObj.mjOBJ_JOINT, "dof_damping"),
    ("joint", "frictionloss"): (mujoco.mjtObj.mjOBJ_JOINT, "dof_frictionloss"),
    ("joint", "armature"): (mujoco.mjtObj.mjOBJ_JOINT, "dof_armature"),
    ("joint", "stiffness"): (mujoco.mjtObj.mjOBJ_JOINT, "jnt_stiffness"),
}
"""Where the compiled model keeps an attribute."""

Place = tuple[str, str, str, int]
"""Element, name, attribute and index of a `Target`."""

PRECISE = Context(prec=300)
"""Decimal digits for products of two doubles; they have 106 bits and are exact in this many digits for all lengths."""

PRECISE_DIGITS = (25, 60, 300)
"""Digits of a product that tell neighbouring fractions apart: they differ in the 16th or 17th. More are needed where
the product lies so near the middle between two doubles that cutting it moves it to the other one."""


def index_of(model: mujoco.MjModel, kind: mujoco.mjtObj, tag: str, name: str, file: str) -> int:
    """Index of a named object in the compiled model.

    Raises
    ------
    ModelError
        There is none; the message names the nearest.
    """
    index = int(mujoco.mj_name2id(model, kind, name))
    if index < 0:
        raise ModelError(f"{file}: {missing(model, kind, tag, name)}", file=file, element=name)
    return index


def missing(model: mujoco.MjModel, kind: mujoco.mjtObj, tag: str, name: str) -> str:
    """What to say of an object that is not there."""
    names = [mujoco.mj_id2name(model, kind, i) or "" for i in range(getattr(model, COUNTS[tag]))]
    return f'<{tag} name="{name}"> is missing{did_you_mean(name, [n for n in names if n])}'


def inertia_matrix(model: mujoco.MjModel, body: int) -> FloatArray:
    """Inertia of a body about its mass centre ``(3, 3)`` in kg m^2, in the axes of its body frame."""
    quaternion = model.body_iquat[body]
    if quaternion[0] == 1.0 and not quaternion[1:].any():  # what the product below gives, and many bodies are so
        return np.diag(model.body_inertia[body])
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, quaternion)
    matrix = rotation.reshape(3, 3)
    result: FloatArray = matrix @ np.diag(model.body_inertia[body]) @ matrix.T
    return result


def vector(model: mujoco.MjModel, target: Target, file: str) -> FloatArray:
    """The numbers of the attribute that a target is one of, from the compiled model.

    Raises
    ------
    ModelError
        The element is missing.
    """
    if target.element == "option":
        return np.asarray(getattr(model.opt, target.attribute), dtype=np.float64)
    if target.element == "distance":
        return np.atleast_1d(_distance(model, target, file))
    if (target.element, target.attribute) == ("inertial", "diaginertia"):
        return np.diag(inertia_matrix(model, index_of(model, mujoco.mjtObj.mjOBJ_BODY, "body", target.name, file)))
    kind, field = FIELDS[target.element, target.attribute]
    tag = "body" if target.element == "inertial" else target.element
    index = index_of(model, kind, tag, target.name, file)
    if field.startswith("dof_"):
        index = int(model.jnt_dofadr[index])
    return np.atleast_1d(getattr(model, field)[index])


def _distance(model: mujoco.MjModel, target: Target, file: str) -> float:
    """Between two sites, in the model as drawn."""
    ids = [index_of(model, mujoco.mjtObj.mjOBJ_SITE, "site", name, file) for name in target.name.split("\n")]
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return float(np.linalg.norm(data.site_xpos[ids[0]] - data.site_xpos[ids[1]]))


def read_number(model: mujoco.MjModel, target: Target, file: str, text: str, elements: list[Element]) -> float:
    """The number at a place: from the compiled model, but for geoms, which MuJoCo keeps in another form, from the text.

    Raises
    ------
    ModelError
        The element is missing, or a geom's number is not written.
    """
    if target.element == "geom":
        place = written(text, elements, "geom", target.name, target.attribute)
        found = tokens(text, *place) if place else []
        if target.index >= len(found):
            raise ModelError(
                f'{file}: "{target.words}" is not written; write {target.attribute} out at the geom, or name another'
                " place",
                file=file,
                element=target.name,
                attribute=target.attribute,
            )
        return float(found[target.index][2])
    numbers = vector(model, target, file)
    return float(np.linalg.norm(numbers)) if target.index == WHOLE else float(numbers[target.index])


def is_written(text: str, elements: list[Element], target: Target) -> bool:
    """Whether a number stands literally in the file, so that it can be set; else MuJoCo computes it from others."""
    if target.element == "distance":
        return False
    count = numbers_written(text, elements, target.element, target.name, target.attribute)
    return count > max(target.index, 0)


def read_parameters(
    model: mujoco.MjModel,
    description: Description,
    file: str,
    text: str,
    elements: list[Element],
    known: Mapping[Place, float] | None = None,
) -> dict[str, float]:
    """Read every parameter from the compiled model.

    Parameters
    ----------
    model, description, file
        Compiled MJCF, what it describes, and its name for messages.
    text, elements
        The MJCF's text and what `workbench.mjcf.text.scan` found in it: a fraction may be written with more than the 17
        digits of a double, to say which of several fractions with the same product is meant.
    known
        Numbers of *model* that were read already (`NumberChecks.read`).

    Raises
    ------
    ModelError
        A missing element.
    ParameterError
        A value that the parameter may not have.
    """
    values: dict[str, float] = {}
    for target in sorted((t for t in description.targets if t.reads), key=lambda t: len(t.of)):
        place = target.element, target.name, target.attribute, target.index
        found = known[place] if known and place in known else read_number(model, target, file, text, elements)
        assert target.reads is not None
        others = math.prod(values[name] for name in target.of if name != target.reads)
        token = _token(text, elements, target) if len(target.of) > 1 else ""
        value = _exact_quotient(token, found, target.factor, others)
        values[target.reads] = (quotient(found / target.factor, others) if value is None else value) + 0.0
    try:
        description.table.check(values)
    except ParameterError as error:
        raise ParameterError(f"{file}: {error}", **error.facts) from error
    return {name: values[name] for name in description.table.infos}


def _token(text: str, elements: list[Element], target: Target) -> str:
    place = written(text, elements, target.element, target.name, target.attribute)
    found = tokens(text, *place) if place else []
    return found[target.index][2] if target.index < len(found) else ""


def _exact_quotient(token: str, found: float, factor: float, others: float) -> float | None:
    """The fraction whose product was written with more digits than a double has; None where it was not.

    Two fractions may have products with *others* that round to the same double. `precise` writes digits that tell them
    apart; MuJoCo rounds them away, and here they are read again.
    """
    if significant_digits(token) <= PLAIN_DIGITS or others == 0:
        return None
    try:
        value = float(Fraction(token) / Fraction(factor) / Fraction(others))
    except (ValueError, OverflowError, ZeroDivisionError):
        return None
    return value if value * others * factor == found else None


def quotient(product: float, factor: float) -> float:
    """The number whose product with *factor* is *product*; of several, the one with the shortest decimal form.

    Division alone is one rounding off for some fractions; a user who asked for 0.45 reads 0.45 back.
    """
    if factor in (0.0, 1.0):
        return product
    near = product / factor
    around = (near, math.nextafter(near, -math.inf), math.nextafter(near, math.inf))
    return min((v for v in around if v * factor == product), key=lambda v: len(repr(v)), default=near)


def precise(target: Target, values: Mapping[str, float]) -> str:
    """Text of a product that gives the parameter back bit-equal; empty where the shortest text does so too."""
    if target.reads is None or len(target.of) == 1:
        return ""
    others = math.prod(values[name] for name in target.of if name != target.reads)
    if quotient(target.number(values) / target.factor, others) == values[target.reads]:
        return ""
    exact = PRECISE.multiply(Decimal(target.factor), Decimal(values[target.reads]))
    exact = PRECISE.multiply(exact, Decimal(others))
    texts = (f"{exact:.{digits}g}" for digits in PRECISE_DIGITS)
    return next((text for text in texts if float(text) == target.number(values)), "")


def rewrite(
    model: mujoco.MjModel,
    text: str,
    file: str,
    description: Description,
    values: Mapping[str, float],
    new: Mapping[str, float],
    elements: list[Element],
) -> tuple[str, list[Element]]:
    """Return the MJCF text with parameters changed from *values* to *new*, and its elements; see `numbers_replaced`.

    Places that the file does not write follow from others, or disagree with them, which is looked at after compiling.

    Raises
    ------
    ModelError
        An element or attribute that is missing.
    """
    edits = []
    for target in description.targets:
        if target.element == "distance" or all(new[name] == values[name] for name in target.of):
            continue
        changed = target.reads is not None and new[target.reads] != values[target.reads]
        optional = target.optional or (not changed and not is_written(text, elements, target))
        index, factor = target.index, 1.0
        if index == WHOLE:
            index, factor = _only_component(vector(model, target, file), target, file)
        number = factor * target.number(new)
        edits.append(Edit(target.element, target.name, target.attribute, index, number, precise(target, new), optional))
    return numbers_replaced(text, file, edits, elements) if edits else (text, elements)


def _only_component(numbers: FloatArray, target: Target, file: str) -> tuple[int, float]:
    """Index and sign of the one component of a vector that is not zero."""
    index = int(np.argmax(np.abs(numbers)))
    if np.count_nonzero(numbers) != 1:
        shown = " ".join(f"{value:g}" for value in numbers)
        raise ModelError(
            f'{file}: <{target.element} {target.attribute}="{shown}"> has not one component, so its size alone cannot'
            f' be set; name an axis, "{target.words} z"',
            file=file,
        )
    return index, 1.0 if numbers[index] > 0 else -1.0
