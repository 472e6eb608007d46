"""A model whose parameters are named numbers only: change them in the specification, on every body that is alike.

A campaign that reads ``m1 = "mass crank1"`` means all cranks when all are alike. So a number is changed wherever the
model holds the same value in the same kind of place, except where another parameter names that place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.errors import ParameterError
from workbench.reference.engine import LUMPED_INERTIA
from workbench.reference.mujoco_reference import MujocoReference
from workbench.robots.load import LoadedModel
from workbench.robots.places import AXES

SETTABLE = ("mass", "inertia", "damping", "armature", "gravity")
"""Kinds of quantities that can be changed without moving the geometry."""

ALIKE = 1e-9
"""Relative: numbers that differ by less are one parameter's."""


@dataclass(frozen=True)
class Place:
    """What a parameter of a campaign names: kind, element and axis."""

    kind: str
    element: str
    axis: str = ""

    @classmethod
    def of(cls, text: str) -> Place:
        """Read ``inertia crank1 y``."""
        words = text.split()
        return cls(words[0], words[1] if len(words) > 1 else "", words[2] if len(words) > 2 else "")


def settable(read: Mapping[str, str]) -> dict[str, Place]:
    """Parameters of a campaign that `varied_reference` can change."""
    return {name: place for name, text in read.items() if (place := Place.of(text)).kind in SETTABLE}


def varied_reference(
    base: MujocoReference,
    read: Mapping[str, str],
    changes: Mapping[str, float],
    mass_model: str,
    scale_inertia: bool,
) -> MujocoReference:
    """Return the reference of a changed model; its distributed model is *base*'s *mass_model*.

    Parameters
    ----------
    base
        The robot as it is.
    read
        The campaign's parameters, name -> place.
    changes
        New values.
    mass_model
        Of *base*.
    scale_inertia
        Let a body's inertia follow its mass where no parameter names that inertia: the formula makes it of the mass.

    Raises
    ------
    ParameterError
        A parameter that cannot be changed.
    """
    spec = mujoco.MjSpec.from_string(base.text)
    model = base.compiled(mass_model)
    places = {name: Place.of(text) for name, text in read.items()}
    masses, inertias = np.array(model.body_mass), np.array(model.body_inertia)
    named_inertia = {body for place in places.values() if place.kind == "inertia" for body in _alike(model, place)}
    for name, value in changes.items():
        place = places[name]
        if place.kind not in SETTABLE:
            raise ParameterError(f"parameter {name} cannot be set; edit the MJCF, which both sides read")
        taken = {(p.kind, p.element, p.axis) for other, p in places.items() if other != name}
        if place.kind == "gravity":
            size = float(np.linalg.norm(spec.option.gravity))
            spec.option.gravity = np.array(spec.option.gravity) * (value / size if size else 0.0)
            continue
        if place.kind in ("damping", "armature"):
            address = model.jnt_dofadr[model.joint(place.element).id]
            values = np.array(getattr(model, f"dof_{place.kind}"))
            for joint in range(model.njnt):
                other = model.joint(joint).name
                dof = model.jnt_dofadr[joint]
                if _same(values[dof], values[address]) and (place.kind, other, "") not in taken:
                    _set_joint(spec, other, place.kind, value)
            continue
        for body in _alike(model, place, taken):
            if place.kind == "mass":
                factor = value / masses[body]
                masses[body] = value
                if scale_inertia and body not in named_inertia:
                    inertias[body] *= factor
            else:
                inertias[body] = _turned(model, place, places, body, value, inertias[body])
    for body in range(1, model.nbody):
        element = spec.body(model.body(body).name)
        if element is None:
            continue
        element.explicitinertial = True
        element.mass, element.ipos, element.iquat = masses[body], model.body_ipos[body], model.body_iquat[body]
        element.fullinertia = [np.nan] * 6
        element.inertia = np.maximum(inertias[body], LUMPED_INERTIA) if masses[body] else inertias[body]
    spec.compiler.balanceinertia = False
    return MujocoReference(base.file, loaded=LoadedModel(base.file, base.text, _compiled(spec), None))


def _compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    from workbench.mjcf.compile import engine_warnings

    try:
        with engine_warnings():
            return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise ParameterError(f"no body can have these numbers: {error}") from error


def _set_joint(spec: mujoco.MjSpec, name: str, kind: str, value: float) -> None:
    joint = spec.joint(name)
    if kind == "damping":
        joint.damping = value if np.isscalar(joint.damping) else [value, *list(joint.damping)[1:]]
    else:
        joint.armature = value


def _same(one: float, other: float) -> bool:
    return bool(abs(one - other) <= ALIKE * max(abs(one), abs(other)))


def _moment(model: mujoco.MjModel, place: Place) -> float:
    """Moment of inertia of the named body about the named axis of its own frame."""
    turn = np.zeros(9)
    body = model.body(place.element).id
    mujoco.mju_quat2Mat(turn, model.body_iquat[body])
    return float(turn.reshape(3, 3)[AXES.index(place.axis)] ** 2 @ model.body_inertia[body])


def _turned(
    model: mujoco.MjModel, place: Place, places: Mapping[str, Place], body: int, value: float, principal: np.ndarray
) -> np.ndarray:
    """Principal inertias with those that equal the named moment moved to *value*.

    Transverse twins of a rod move along; where no body has such moments, so do all that no other parameter names.
    """
    before = _moment(model, place)
    mine = np.array([_same(moment, before) for moment in model.body_inertia[body]])
    if not mine.any():
        raise ParameterError(f"inertia {place.element} {place.axis}: no principal axis of the body")
    factor = value / before
    moved = np.where(mine, principal * factor, principal)
    if 2 * moved.max() > moved.sum() * (1 + 1e-12):
        others = [_moment(model, p) for p in places.values() if p.kind == "inertia" and p != place]
        named = np.array([any(_same(m, other) for other in others) for m in model.body_inertia[body]]) & ~mine
        moved = np.where(named, principal, principal * factor)
    return moved


def _alike(model: mujoco.MjModel, place: Place, taken: set[tuple[str, str, str]] | None = None) -> list[int]:
    """Bodies that hold the same number in the same kind of place, those that others name left out."""
    named = model.body(place.element).id

    def numbers(body: int) -> np.ndarray:
        if place.kind == "mass":
            return np.array([model.body_mass[body]])
        return np.sort(model.body_inertia[body])

    wanted = numbers(named)
    found = [named]
    for body in range(1, model.nbody):
        name = model.body(body).name
        if body == named or (taken and (place.kind, name, place.axis) in taken):
            continue
        if wanted.max() > 1e-9 and np.allclose(numbers(body), wanted, rtol=ALIKE, atol=0.0):
            found.append(body)
    return found
