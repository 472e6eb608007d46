"""One assumption of a closed form about a model, and how it is worded: rows of `workbench.robots.assumptions.check`."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray
from workbench.errors import did_you_mean
from workbench.mjcf.text import Element, find_any, scan
from workbench.robots.assumptions.layout import Layout
from workbench.robots.description import Description
from workbench.robots.values import missing

ALIGNMENT = 1e-12
"""Largest deviation of a length (m), a mass (kg) or a direction, relative to the larger of 1 and the value, that still
counts as on the axis or equal: above it the closed form would describe another robot. Inertias: relative to the
value."""

OBJECTS = {
    "body": mujoco.mjtObj.mjOBJ_BODY,
    "joint": mujoco.mjtObj.mjOBJ_JOINT,
    "site": mujoco.mjtObj.mjOBJ_SITE,
    "equality": mujoco.mjtObj.mjOBJ_EQUALITY,
    "actuator": mujoco.mjtObj.mjOBJ_ACTUATOR,
}


@dataclass(frozen=True)
class Assumption:
    """One thing that the closed form takes for granted, and whether the model keeps it."""

    name: str
    """what is assumed, in a word or two"""
    where: str
    """element and attribute"""
    value: str
    """what the model has"""
    limit: str
    """what is allowed"""
    ok: bool
    message: str
    """one line that names file, line, element, attribute, value and limit"""
    element: str = ""
    attribute: str = ""


KEPT = Assumption("", "", "", "", True, "")
"""Any assumption that a model keeps, where nobody asks which."""


@dataclass
class Context:
    """A compiled model beside the mechanism that it is said to describe."""

    model: mujoco.MjModel
    mechanism: Description
    file: str
    text: str
    brief: bool = False
    """whether what is kept need not be worded: `KEPT` stands for all of it"""
    _elements: list[Element] | None = field(default=None, repr=False)

    @property
    def layout(self) -> Layout:
        """The make-up that the closed form assumes."""
        assert self.mechanism.layout is not None
        return self.mechanism.layout

    @cached_property
    def covered(self) -> set[tuple[str, str, str]]:
        """Elements and attributes that parameters are read from: the numbers are checked with them."""
        return {(t.element, t.name, t.attribute) for t in self.mechanism.targets}

    def index(self, kind: str, name: str) -> int:
        """Index of a named object, -1 where it is missing."""
        return int(mujoco.mj_name2id(self.model, OBJECTS[kind], name))

    def name(self, kind: str, index: int) -> str:
        """Name of an object, ``#3`` where it has none."""
        return mujoco.mj_id2name(self.model, OBJECTS[kind], index) or f"#{index}"

    def line(self, tag: str, name: str) -> int | None:
        """Line of an element in the text."""
        if not self.text:
            return None
        if self._elements is None:
            self._elements = scan(self.text, self.file)
        found = find_any(self._elements, tag, name)
        return found.line if found else None

    def rule(
        self, name: str, tag: str, element: str, attribute: str, value: str, limit: str, ok: bool, why: str = ""
    ) -> Assumption:
        """An assumption about an attribute of an element; *why* ends the message where it is broken."""
        if ok and self.brief:
            return KEPT
        label = f'{tag} "{element}" {attribute}'.rstrip() if element else f"{tag} {attribute}".rstrip()
        message = ""
        if not ok:
            line = self.line(tag, element)
            place = f"{self.file}:{line}" if line else self.file
            message = f"{place}: {label} is {value}; the closed form needs {limit}{f' ({why})' if why else ''}"
        return Assumption(name, label, value, limit, ok, message, element, attribute)

    def absent(self, name: str, tag: str, element: str) -> Assumption:
        """The assumption that an element exists, broken."""
        text = missing(self.model, OBJECTS[tag], tag, element)
        return Assumption(
            name,
            f'{tag} "{element}"',
            "missing",
            "present",
            False,
            f"{self.file}: {text}; the closed form needs it",
            element,
        )


def vector_rule(
    context: Context,
    name: str,
    tag: str,
    element: str,
    attribute: str,
    value: FloatArray,
    expected: ArrayLike,
    why: str = "",
) -> Assumption:
    """The assumption that a vector is another one, within `ALIGNMENT`."""
    wanted = np.asarray(expected, dtype=np.float64)
    gap = float(np.abs(value - wanted).max())
    if context.brief and gap <= ALIGNMENT:
        return KEPT
    limit = f"{show(wanted)} within {ALIGNMENT:g}"
    return context.rule(name, tag, element, attribute, show(value), limit, gap <= ALIGNMENT, why)


def show(values: ArrayLike) -> str:
    """Numbers as an MJCF writes them, short."""
    return " ".join(f"{v + 0.0:.9g}" for v in np.atleast_1d(np.asarray(values, dtype=np.float64)))


def text_rule(
    context: Context, name: str, tag: str, element: str, attribute: str, value: str, valid: tuple[str, ...]
) -> Assumption:
    """The assumption that a name is one of some."""
    if context.brief and value in valid:
        return KEPT
    hint = "" if value in valid else did_you_mean(value, valid).lstrip("; ")
    quoted = " or ".join(f'"{v}"' for v in valid)
    return context.rule(
        name, tag, element, attribute, f'"{value}"', quoted, value in valid, hint if len(valid) > 1 else ""
    )
