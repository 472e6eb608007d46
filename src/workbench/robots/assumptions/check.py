"""Everything that a closed form takes for granted about a model, checked one by one on the compiled MJCF.

`workbench.robots.load.load_model` refuses the first assumption that is broken; `check_assumptions` lists them all.
Nothing here closes a loop, so loading stays fast; `workbench.reference.check` adds what needs the reference.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from workbench.errors import ModelError
from workbench.robots.assumptions.rules import ALIGNMENT, Assumption, Context
from workbench.robots.assumptions.structure import STRUCTURAL_CHECKS, principal_axes
from workbench.robots.parameters import Target
from workbench.robots.values import vector

if TYPE_CHECKING:
    from workbench.robots.load import LoadedModel

__all__ = ["ALIGNMENT", "Assumption", "Context", "check_assumptions", "refuse_broken"]


def structural(context: Context) -> Iterator[Assumption]:
    """Names, tree, joints, loops, actuators, and what the closed form leaves out; asks for no parameter."""
    for check in STRUCTURAL_CHECKS:
        yield from check(context)


def numeric(context: Context, values: Mapping[str, float]) -> Iterator[Assumption]:
    """Every number that the parameters determine; the rest of each position is zero."""
    attributes: dict[tuple[str, str, str], dict[int, Target]] = {}
    for target in context.mechanism.targets:
        if target.element != "geom":
            attributes.setdefault((target.element, target.name, target.attribute), {})[target.index] = target
    for (tag, element, attribute), targets in attributes.items():
        yield _numbers(context, tag, element, attribute, targets, values)
    for info in context.layout.bodies:
        if info.turns:
            yield from principal_axes(context, info.name)


def _numbers(
    context: Context, tag: str, element: str, attribute: str, targets: Mapping[int, Target], values: Mapping[str, float]
) -> Assumption:
    """One attribute: its worst number."""
    found = vector(context.model, next(iter(targets.values())), context.file)
    worst, shown = -1.0, (0.0, 0.0, 0.0, True, 0, "")
    for index, value in enumerate(found):
        if index in targets:
            expected, why = targets[index].number(values), ""
        elif attribute in ("pos", "gravity"):
            expected, why = 0.0, "on the axis"
        else:
            continue
        # inertias are small: a kilogram's millionth is much of a bar's inertia
        scale = abs(expected) if attribute == "diaginertia" and expected else max(1.0, abs(expected))
        limit = ALIGNMENT * scale
        ok = bool(abs(value - expected) <= limit)
        badness = abs(value - expected) / scale if np.isfinite(value) else np.inf
        if badness > worst:
            worst = badness
            shown = float(value), expected, limit, ok, index, why
    value, expected, limit, ok, index, why = shown
    why = why or " * ".join([f"{targets[index].factor:g}", *targets[index].of])
    return context.rule(
        "number", tag, element, attribute, f"{value:.9g}", f"{expected:.9g} within {limit:.2g}", ok,
        f"number {index + 1}: {why}",
    )  # fmt: skip


def check_assumptions(loaded: LoadedModel) -> list[Assumption]:
    """List every assumption of the closed form about a loaded model, kept or broken.

    Parameters
    ----------
    loaded
        From `workbench.robots.load.load_model`, or `workbench.robots.load.open_model` where the model may be broken.

    Returns
    -------
    list of Assumption
        Empty for a model without a closed form. Where names or the tree are broken, the numbers are not checked.
    """
    described = loaded.description
    if described is None or described.layout is None:
        return []
    context = Context(loaded.model, described, loaded.file, loaded.text)
    found = list(structural(context))
    if loaded.values is None or any(not a.ok and a.value == "missing" for a in found):
        if loaded.problem:
            found.append(Assumption("parameters", "parameters", "unreadable", "readable", False, loaded.problem))
        return found
    return [*found, *numeric(context, loaded.values)]


def refuse_broken(context: Context, values: Mapping[str, float] | None) -> None:
    """Refuse the first broken assumption: of the structure, or with *values* of the numbers.

    Raises
    ------
    ModelError
        Naming file, line, element, attribute, value and limit.
    """
    for assumption in structural(context) if values is None else numeric(context, values):
        if not assumption.ok:
            raise ModelError(
                assumption.message,
                file=context.file,
                element=assumption.element,
                attribute=assumption.attribute,
                value=assumption.value,
                limit=assumption.limit,
            )
