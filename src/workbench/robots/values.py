"""Parameters as the compiled model holds them: where MuJoCo keeps each number, and how a parameter follows from it.

Parameters are read from what MuJoCo compiled, so both sides of a comparison see the same robot. The text is asked for
one thing only: which of several fractions, whose products with a length are the same double, was meant.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from decimal import Context, Decimal
from fractions import Fraction

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError, did_you_mean
from workbench.mjcf.text import (
    PLAIN_DIGITS,
    Edit,
    Element,
    element_label,
    find,
    replace_numbers,
    significant_digits,
    tokens,
)
from workbench.robots.base import Mechanism
from workbench.robots.parameters import Target, check_parameters

FIELDS = {
    ("body", "pos"): (mujoco.mjtObj.mjOBJ_BODY, "body_pos"),
    ("inertial", "pos"): (mujoco.mjtObj.mjOBJ_BODY, "body_ipos"),
    ("inertial", "mass"): (mujoco.mjtObj.mjOBJ_BODY, "body_mass"),
    ("site", "pos"): (mujoco.mjtObj.mjOBJ_SITE, "site_pos"),
    ("joint", "pos"): (mujoco.mjtObj.mjOBJ_JOINT, "jnt_pos"),
    ("joint", "damping"): (mujoco.mjtObj.mjOBJ_JOINT, "dof_damping"),
    ("joint", "frictionloss"): (mujoco.mjtObj.mjOBJ_JOINT, "dof_frictionloss"),
    ("joint", "armature"): (mujoco.mjtObj.mjOBJ_JOINT, "dof_armature"),
}
"""Where the compiled model keeps an attribute."""

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
    count = getattr(model, {"joint": "njnt", "text": "ntext"}.get(tag, f"n{tag}"), 0)
    names = [mujoco.mj_id2name(model, kind, i) or "" for i in range(count)]
    return f'<{tag} name="{name}"> is missing{did_you_mean(name, [n for n in names if n])}'


def inertia_matrix(model: mujoco.MjModel, body: int) -> FloatArray:
    """Inertia of a body about its mass centre ``(3, 3)`` in kg m^2, in the axes of its body frame."""
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.body_iquat[body])
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
    if (target.element, target.attribute) == ("inertial", "diaginertia"):
        return np.diag(inertia_matrix(model, index_of(model, mujoco.mjtObj.mjOBJ_BODY, "body", target.name, file)))
    kind, field = FIELDS[target.element, target.attribute]
    tag = "body" if target.element == "inertial" else target.element
    index = index_of(model, kind, tag, target.name, file)
    if field.startswith("dof_"):
        index = int(model.jnt_dofadr[index])
    return np.atleast_1d(getattr(model, field)[index])


def target_number(target: Target, values: Mapping[str, float]) -> float:
    """The number that a target has to hold for these parameters."""
    return target.factor * math.prod(values[name] for name in target.of)


def read_parameters(
    model: mujoco.MjModel,
    mechanism: type[Mechanism],
    file: str,
    text: str = "",
    elements: list[Element] | None = None,
) -> dict[str, float]:
    """Read every parameter from the compiled model.

    Parameters
    ----------
    model, mechanism, file
        Compiled MJCF, what it describes, and its name for messages.
    text, elements
        The MJCF's text and what `workbench.mjcf.text.scan` found in it; without them a fraction written with more than
        17 digits is read as the shortest one with that product.

    Raises
    ------
    ModelError
        A missing element.
    ParameterError
        A value that the parameter may not have.
    """
    values: dict[str, float] = {}
    for target in sorted((t for t in mechanism.targets if t.reads), key=lambda t: len(t.of)):
        found = float(vector(model, target, file)[target.index])
        assert target.reads is not None
        others = math.prod(values[name] for name in target.of if name != target.reads)
        token = _token(text, elements, target) if elements and len(target.of) > 1 else ""
        value = _exact_quotient(token, found, target.factor, others)
        values[target.reads] = (quotient(found / target.factor, others) if value is None else value) + 0.0
    check_parameters(mechanism.parameter_table, values)
    return {f.name: values[f.name] for f in dataclasses.fields(mechanism.parameter_type)}


def _token(text: str, elements: list[Element], target: Target) -> str:
    element = find(elements, target.element, target.name)
    found = tokens(text, element, target.attribute) if element else []
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
    if quotient(target_number(target, values) / target.factor, others) == values[target.reads]:
        return ""
    exact = PRECISE.multiply(Decimal(target.factor), Decimal(values[target.reads]))
    exact = PRECISE.multiply(exact, Decimal(others))
    texts = (f"{exact:.{digits}g}" for digits in PRECISE_DIGITS)
    return next((text for text in texts if float(text) == target_number(target, values)), "")


def rewrite(
    text: str,
    file: str,
    mechanism: type[Mechanism],
    values: Mapping[str, float],
    new: Mapping[str, float],
    elements: list[Element] | None = None,
) -> str:
    """Return the MJCF text with parameters changed from *values* to *new*, all by stored name; see `replace_numbers`.

    Raises
    ------
    ModelError
        An element or attribute that is missing.
    """
    edits = [
        Edit(t.element, t.name, t.attribute, t.index, target_number(t, new), precise(t, new))
        for t in mechanism.targets
        if any(new[name] != values[name] for name in t.of)
    ]
    return replace_numbers(text, file, edits, elements) if edits else text


def target_label(target: Target) -> str:
    """How messages speak of the element of a target."""
    return element_label(target.element, target.name)
