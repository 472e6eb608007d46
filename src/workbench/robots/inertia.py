"""Bodies that MuJoCo cannot hold, refused before compiling by the name of the parameter that makes them so."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import mujoco
import numpy as np

from workbench.errors import ParameterError
from workbench.robots.description import Description
from workbench.robots.parameters import Target
from workbench.robots.values import vector

SMALLEST = float(mujoco.mjMINVAL)
"""Smallest mass (kg) and inertia (kg m^2) of a body that moves, MuJoCo's own limit."""

OTHERS = 3
"""So many other changed parameters a message lists: an inertia often follows from a mass or a length."""


def refuse_impossible_bodies(
    model: mujoco.MjModel,
    description: Description,
    file: str,
    values: Mapping[str, float],
    wanted: Mapping[str, float],
) -> None:
    """Refuse masses and inertias that no moving body has.

    Parameters
    ----------
    model, description, file, values
        The model before the change, what it describes, its name, and its parameters by name.
    wanted
        The parameters after it.

    Raises
    ------
    ParameterError
        Naming the parameter, its value, the body and what is allowed.
    """
    units = {name: info.unit for name, info in description.table.infos.items()}
    for body, attribute, targets in _changed(description, values, wanted):
        numbers = vector(model, targets[0], file).copy()
        for target in targets:
            numbers[target.index] = target.number(wanted)
        name = next(n for n in reversed(targets[0].of) if wanted[n] != values[n])
        others = [f"{n} = {wanted[n]:.9g}" for n in wanted if n != name and wanted[n] != values[n]]
        after = f" (with {', '.join(others[:OTHERS])}{' ...' if len(others) > OTHERS else ''})" if others else ""
        said = f'parameter {name} = {wanted[name]:.9g} {units[name]}{after}: body "{body}" of {file} would have'
        moves = model.body_dofnum[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, body)] > 0
        if moves and numbers.min() < SMALLEST:
            raise ParameterError(
                f"{said} {attribute} {numbers.min():g}; allowed for a body that moves: at least {SMALLEST:g}",
                parameter=name,
                value=wanted[name],
            )
        ordered = np.sort(numbers)
        if len(ordered) == 3 and ordered[0] + ordered[1] < ordered[2]:
            shown = ", ".join(f"{number:.4g}" for number in numbers)
            raise ParameterError(
                f"{said} the moments of inertia {shown} kg m^2; allowed: each at most the sum of the other two",
                parameter=name,
                value=wanted[name],
            )


def _changed(
    description: Description, values: Mapping[str, float], wanted: Mapping[str, float]
) -> Iterator[tuple[str, str, list[Target]]]:
    """Bodies whose mass or inertia changes: name, attribute, and the targets in it, those that change first."""
    groups: dict[tuple[str, str], list[Target]] = {}
    for target in description.targets:
        if target.element == "inertial" and target.attribute in ("mass", "diaginertia") and not target.optional:
            groups.setdefault((target.name, target.attribute), []).append(target)
    for (body, attribute), targets in groups.items():
        targets.sort(key=lambda t: all(wanted[n] == values[n] for n in t.of))
        if any(wanted[n] != values[n] for n in targets[0].of):
            yield body, attribute, targets
