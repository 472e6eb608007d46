"""A robot file bound to a model: its parameters, where each number stands, and what its formulas take for granted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np

from workbench.errors import ModelError, SpecError, did_you_mean
from workbench.mjcf.text import Element, find, tokens
from workbench.robots.assumptions.layout import Layout
from workbench.robots.closed_form import ClosedForm
from workbench.robots.formulas import bundled_closed_form
from workbench.robots.parameter_set import parameter_type
from workbench.robots.parameters import ParameterTable, Target
from workbench.robots.places import AXES, kind_of
from workbench.robots.robot_file import BarSpec, RobotFile


@dataclass(frozen=True)
class Description:
    """What is known of a robot beside the numbers in its model."""

    robot: RobotFile
    targets: tuple[Target, ...]
    """all places of parameters, and what follows in bodies that are bars"""
    closed_form: type[ClosedForm] | None
    """the package's own formulas; a user's are offered later, by whoever may run them"""

    @property
    def name(self) -> str:
        """The robot's name."""
        return self.robot.spec.name

    @property
    def table(self) -> ParameterTable:
        """The parameters with their ranges, groups and bars."""
        return self.robot.table

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints, in the order of q and tau."""
        return tuple(self.robot.spec.actuated)

    @property
    def layout(self) -> Layout | None:
        """What the formulas take for granted; None is nothing."""
        return self.closed_form.layout if self.closed_form else None

    @cached_property
    def parameter_type(self) -> type:
        """The dataclass that holds the values."""
        return parameter_type(tuple(self.table.infos), tuple(self.table.groups.items()))


def describe(robot: RobotFile, model: mujoco.MjModel, text: str, elements: list[Element], file: str) -> Description:
    """Bind a robot file to a compiled model and its text.

    Raises
    ------
    ModelError
        A bar whose body is none: no such body, or one that lies along no axis of its own.
    """
    bars = [t for bar in robot.spec.bars for body in bar.bodies for t in _bar(bar, body, robot, model, text, elements)]
    closed_form = bundled_closed_form(robot) if robot.builtin else None
    if closed_form is None or closed_form.layout is None:  # a layout says it better, with all that it needs
        _refuse_missing(robot, model, elements)
    return Description(robot, (*robot.targets, *bars), closed_form)


OBJECTS = {
    "body": mujoco.mjtObj.mjOBJ_BODY,
    "site": mujoco.mjtObj.mjOBJ_SITE,
    "joint": mujoco.mjtObj.mjOBJ_JOINT,
}
COUNTS = {"body": "nbody", "site": "nsite", "joint": "njnt"}


def _refuse_missing(robot: RobotFile, model: mujoco.MjModel, elements: list[Element]) -> None:
    """Refuse places in elements that the model does not have.

    Raises
    ------
    SpecError
        Naming parameter, place, element and the nearest one that exists.
    """
    for target in robot.targets:
        if target.optional:
            continue
        for what, name in zip(kind_of(target).elements, target.name.split("\n"), strict=False):
            if what == "geom":
                known = [e.name or e.body for e in elements if e.tag == "geom" and (e.name or e.body)]
                missing = find(elements, "geom", name) is None
            else:
                missing = mujoco.mj_name2id(model, OBJECTS[what], name) < 0
                every = range(getattr(model, COUNTS[what]))
                known = [n for i in every if (n := mujoco.mj_id2name(model, OBJECTS[what], i))]
            if missing:
                hint = did_you_mean(name, set(known))
                raise SpecError(
                    f'{robot.shown}: {robot.key_of(target)} "{target.words}": no {what} "{name}"{hint}', key=name
                )


def _bar(
    bar: BarSpec, body: str, robot: RobotFile, model: mujoco.MjModel, text: str, elements: list[Element]
) -> Iterator[Target]:
    """Numbers of one body that follow from its mass and length: inertial, or the end of the geom that gives it."""
    index = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, body))
    if index < 0:
        raise ModelError(f'{robot.shown}: bars: no body "{body}" in the model', body=body)
    centre = np.asarray(model.body_ipos[index])
    axis = int(np.argmax(np.abs(centre)))
    if not np.abs(centre[axis]) > 1e-9 or np.abs(np.delete(centre, axis)).max() > 1e-6 * np.abs(centre[axis]):
        shown = " ".join(f"{v:.6g}" for v in centre)
        raise ModelError(
            f'{robot.shown}: bars: body "{body}" lies along no axis of its own frame (mass centre {shown}); give its'
            " numbers as places of parameters in place of bodies",
            body=body,
        )
    out = 1.0 if centre[axis] > 0 else -1.0
    length, half = bar.length or bar.half_length or "", bar.half_length is not None
    whole = 2.0 if half else 1.0
    words = {"words": f"bar {body}", "optional": True}
    yield Target("inertial", body, "pos", axis, out * whole / 2, (length,), **words)  # type: ignore[arg-type]
    for across in (i for i in range(3) if i != axis):
        factor = whole**2 / 12
        yield Target("inertial", body, "diaginertia", across, factor, (bar.mass, length, length), **words)  # type: ignore[arg-type]
    geom = find(elements, "geom", body)
    ends = tokens(text, geom, "fromto") if geom else []
    if len(ends) == 6 and _runs_from_origin([float(token) for _, _, token in ends], axis):
        yield Target("geom", body, "fromto", 3 + axis, out * whole, (length,), **words)  # type: ignore[arg-type]


def _runs_from_origin(ends: list[float], axis: int) -> bool:
    """Whether a geom runs from its body's origin along one axis."""
    return not any(ends[:3]) and bool(ends[3 + axis]) and not any(ends[3 + i] for i in range(len(AXES)) if i != axis)
