"""Places of one parameter have to agree: a length that stands in the model three times is one length."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco

from workbench.errors import ModelError
from workbench.mjcf.text import Element, written
from workbench.robots.description import Description
from workbench.robots.values import read_number

AGREE = 1e-12
"""Largest difference of two places of one parameter, relative to the larger of 1 and the number; inertias: relative to
the number. Above it the formulas, which have one number, would describe another robot than the model."""


def refuse_disagreement(
    model: mujoco.MjModel,
    description: Description,
    file: str,
    text: str,
    elements: list[Element],
    values: Mapping[str, float],
) -> None:
    """Refuse places that do not hold what the first place of their parameter says.

    Raises
    ------
    ModelError
        Naming file, line, place, both numbers and the parameter.
    """
    first = {target.reads: target for target in description.targets if target.reads}
    for target in description.targets:
        if target.reads is not None or target.optional:
            continue
        found = read_number(model, target, file, text, elements)
        expected = target.number(values)
        scale = abs(expected) if target.attribute == "diaginertia" and expected else max(1.0, abs(expected))
        if abs(found - expected) <= AGREE * scale:
            continue
        place = written(text, elements, target.element, target.name, target.attribute)
        where = f"{file}:{place[0].line}" if place else file
        names = " * ".join(target.of)
        raise ModelError(
            f'{where}: "{target.words}" is {found:.12g}, but parameter {names} makes it {expected:.12g}, read from'
            f' "{first[target.of[0]].words}"; places of one parameter have to agree, make them equal or give them names'
            " of their own",
            file=file,
            parameter=target.of[0],
            value=found,
            limit=expected,
        )
