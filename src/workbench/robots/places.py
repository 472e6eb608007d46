"""Where a parameter lives in the MJCF, in words: ``mass distal1``, ``offset arm_left y = -L_left``.

One line names one number of the model; what follows ``=`` says what the number is in terms of parameters, a product
with at most one factor. Without it the number is the parameter itself. Words that hold blanks stand in quotes.
"""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from functools import lru_cache

from workbench.errors import SpecError, did_you_mean
from workbench.robots.parameters import Target

AXES = ("x", "y", "z")
ENDS = tuple(f"{axis}{end}" for end in (1, 2) for axis in AXES)
"""Words for the six numbers of ``fromto``."""

FACTOR = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
NAME = re.compile(r"[A-Za-z_]\w*")


@dataclass(frozen=True)
class Kind:
    """One kind of place."""

    form: str
    """how it is written, for messages"""
    elements: tuple[str, ...]
    """what its names are: bodies, sites, joints, geoms"""
    axis: bool
    unit: str
    """SI; ``S|H``: for a slide and for a hinge"""
    meaning: str


KINDS: dict[str, Kind] = {
    "mass": Kind("mass BODY", ("body",), False, "kg", "mass of {0}"),
    "inertia": Kind(
        "inertia BODY x|y|z", ("body",), True, "kg m^2", "moment of inertia of {0} about its mass centre, axis {axis}"
    ),
    "com": Kind("com BODY x|y|z", ("body",), True, "m", "mass centre of {0}, {axis} in its own frame"),
    "offset": Kind("offset BODY x|y|z", ("body",), True, "m", "origin of {0}, {axis} in its parent's frame"),
    "site": Kind("site SITE x|y|z", ("site",), True, "m", "site {0}, {axis} in its body's frame"),
    "anchor": Kind("anchor JOINT x|y|z", ("joint",), True, "m", "joint {0}, {axis} in its body's frame"),
    "distance": Kind(
        "distance SITE SITE", ("site", "site"), False, "m", "distance from site {0} to site {1} in the model as drawn"
    ),
    "damping": Kind("damping JOINT", ("joint",), False, "N s/m|N m s/rad", "viscous friction of joint {0}"),
    "frictionloss": Kind("frictionloss JOINT", ("joint",), False, "N|N m", "Coulomb friction of joint {0}"),
    "armature": Kind("armature JOINT", ("joint",), False, "kg|kg m^2", "rotor inertia of joint {0}"),
    "stiffness": Kind("stiffness JOINT", ("joint",), False, "N/m|N m/rad", "stiffness of joint {0}"),
    "gravity": Kind("gravity or gravity x|y|z", (), True, "m/s^2", "gravity"),
    "geom": Kind("geom GEOM|BODY ATTRIBUTE x|y|z|x1..z2|1..", ("geom",), False, "", "{0}"),
}

ELEMENT_OF = {
    "mass": ("inertial", "mass"), "inertia": ("inertial", "diaginertia"), "com": ("inertial", "pos"),
    "offset": ("body", "pos"), "site": ("site", "pos"), "anchor": ("joint", "pos"), "damping": ("joint", "damping"),
    "frictionloss": ("joint", "frictionloss"), "armature": ("joint", "armature"), "stiffness": ("joint", "stiffness"),
    "gravity": ("option", "gravity"), "distance": ("distance", ""),
}  # fmt: skip
"""Kind of place -> element and attribute of the MJCF."""

WHOLE = -1
"""Index of a target that is the length of its vector."""

GEOM_NUMBERS = {"pos": AXES, "fromto": ENDS, "size": ("1", "2", "3"), "mass": ("1",), "density": ("1",)}


def parse_place(text: str, own: str, where: str, optional: bool = False) -> Target:
    """Read one place.

    Parameters
    ----------
    text
        As the robot file writes it.
    own
        The parameter that it stands under.
    where
        File and key, for messages.
    optional
        Whether it may be missing from the model.

    Raises
    ------
    SpecError
        An unknown kind, axis or form; what follows ``=`` is no product.
    """
    left, equals, right = text.partition("=")
    where = f'{where} "{text}"'
    try:
        words = shlex.split(left)
    except ValueError as error:
        raise SpecError(f"{where}: {error}") from error
    if not words or words[0] not in KINDS:
        raise SpecError(f"{where}: unknown place{did_you_mean(words[0] if words else '', KINDS)}")
    kind, names = KINDS[words[0]], words[1:]
    factor, of = _product(right, where) if equals else (1.0, (own,))
    said = f'{where}: allowed: "{kind.form}"'
    if words[0] == "geom":
        if len(names) not in (2, 3) or names[1] not in GEOM_NUMBERS:
            raise SpecError(f"{said}, ATTRIBUTE one of {', '.join(GEOM_NUMBERS)}")
        numbers = GEOM_NUMBERS[names[1]]
        number = names[2] if len(names) == 3 else numbers[0] if len(numbers) == 1 else ""
        if number not in numbers:
            raise SpecError(f'{where}: number "{number}" of {names[1]}; allowed: {", ".join(numbers)}')
        return Target("geom", names[0], names[1], numbers.index(number), factor, of, words=left.strip(),
                      optional=optional)  # fmt: skip
    element, attribute = ELEMENT_OF[words[0]]
    index = 0
    if words[0] == "gravity" and not names:
        index = WHOLE
    elif kind.axis:
        if len(names) != len(kind.elements) + 1:
            raise SpecError(said)
        if names[-1] not in AXES:
            raise SpecError(f'{where}: axis "{names[-1]}"; allowed: x, y, z')
        index, names = AXES.index(names[-1]), names[:-1]
    if len(names) != len(kind.elements):
        raise SpecError(said)
    return Target(element, "\n".join(names), attribute, index, factor, of, words=left.strip(), optional=optional)


def _product(text: str, where: str) -> tuple[float, tuple[str, ...]]:
    """Factor and names of ``-0.5 * k1 * a1``."""
    factor, names, stripped = 1.0, [], text.strip()
    if stripped[:1] in "+-" and stripped[1:2] not in "0123456789.":
        factor, stripped = (-1.0 if stripped[0] == "-" else 1.0), stripped[1:]
    for number, piece in enumerate(part.strip() for part in stripped.split("*")):
        if number == 0 and FACTOR.fullmatch(piece):
            factor *= float(piece)
        elif NAME.fullmatch(piece):
            names.append(piece)
        else:
            raise SpecError(f'{where}: "{text.strip()}" is no product; allowed: NUMBER * NAME * NAME, such as -0.5 * a')
    if not names or not factor:
        raise SpecError(f'{where}: "{text.strip()}" names no parameter; allowed: NUMBER * NAME * NAME, NUMBER not 0')
    return factor, tuple(names)


def kind_of(target: Target) -> Kind:
    """The kind of place that a target was read from."""
    return KINDS[_first_word(target.words)]


@lru_cache(maxsize=4096)
def _first_word(words: str) -> str:
    return shlex.split(words)[0]


def meaning_of(target: Target) -> str:
    """What a place holds, in words: what a parameter means where the robot file does not say it."""
    words = shlex.split(target.words)
    kind, names = KINDS[words[0]], words[1:]
    if words[0] == "geom":
        return f"{' '.join(names[1:])} of the geom of {names[0]}"
    return kind.meaning.format(*names, axis=names[-1] if kind.axis and names else "")
