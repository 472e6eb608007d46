"""A model whose parameters are numbers without geometry: change them in the specification, wherever they stand.

A robot file says where each parameter stands (``at``), and where it lists several places those are changed and no
others. Many files name one of several bodies that are alike: ``mass crank1`` means all cranks to a formula that has one
mass for them. So of a parameter with one place the same number moves along wherever the model holds it in the same kind
of place, except where another parameter names that place.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Mapping, Set
from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.errors import ParameterError
from workbench.reference.engine import LUMPED_INERTIA
from workbench.reference.mujoco_reference import MujocoReference
from workbench.robots.load import LoadedModel
from workbench.robots.parameters import Target
from workbench.robots.places import AXES

SETTABLE = ("mass", "inertia", "damping", "armature", "gravity")
"""Kinds of quantities that can be changed without moving the geometry."""

ALIKE = 1e-9
"""Relative: numbers that differ by less are one parameter's."""


@dataclass(frozen=True)
class Place:
    """Where a number of a robot file stands: kind, element and axis."""

    kind: str
    element: str
    axis: str = ""

    @classmethod
    def of(cls, target: Target) -> Place:
        """Read ``inertia crank1 y``."""
        kind, *names = shlex.split(target.words) or [""]
        return cls(kind, "", names[0] if names else "") if kind == "gravity" else cls(kind, *names[:2])


Targets = Mapping[str, tuple[Target, ...]]
"""Parameter -> all the numbers that it is in."""


def places_of(targets: Iterable[Target]) -> Targets:
    """Sort the places of a robot file by parameter; those of bars, which follow mass and length, are no places."""
    found: dict[str, tuple[Target, ...]] = {}
    for target in targets:
        if target.words and not target.words.startswith("bar "):
            for name in dict.fromkeys(target.of):
                found[name] = (*found.get(name, ()), target)
    return found


def settable(targets: Targets) -> set[str]:
    """Parameters that `varied_reference` can change: they stand nowhere in the geometry."""
    return {name for name, every in targets.items() if all(Place.of(target).kind in SETTABLE for target in every)}


def varied_reference(
    base: MujocoReference,
    targets: Targets,
    values: Mapping[str, float],
    changes: Mapping[str, float],
    mass_model: str,
    scale_inertia: bool,
) -> MujocoReference:
    """Return the reference of a changed model; its distributed model is *base*'s *mass_model*.

    Parameters
    ----------
    base
        The robot as it is.
    targets
        Where the robot's parameters stand.
    values
        All of them as they are.
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
    spec = base.spec()
    model = base.compiled(mass_model)
    places = {Place.of(target) for every in targets.values() for target in every}
    masses, inertias = np.array(model.body_mass), np.array(model.body_inertia)
    named_inertia = {body for place in places if place.kind == "inertia" for body in _alike(model, place)}
    for place, value, alone in _numbers(targets, values, changes):
        taken = {(p.kind, p.element, p.axis) for p in places if p != place}
        if place.kind == "gravity":
            spec.option.gravity = _gravity(np.array(spec.option.gravity), place.axis, value)
        elif place.kind in ("damping", "armature"):
            for joint in _joints(model, place, taken, alone):
                _set_joint(spec, joint, place.kind, value)
        elif place.kind == "mass":
            for body in _alike(model, place, taken) if alone else [model.body(place.element).id]:
                factor = value / masses[body] if masses[body] else 1.0
                masses[body] = value
                if scale_inertia and body not in named_inertia:
                    inertias[body] *= factor
        else:
            for body in _alike(model, place, taken) if alone else [model.body(place.element).id]:
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
    return MujocoReference(base.file, loaded=LoadedModel(base.file, base.loaded.writing, _compiled(spec)))


def _compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    from workbench.mjcf.engine_warnings import engine_warnings

    try:
        with engine_warnings():
            return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise ParameterError(f"no body can have these numbers: {error}") from error


def _numbers(
    targets: Targets, values: Mapping[str, float], changes: Mapping[str, float]
) -> Iterator[tuple[Place, float, bool]]:
    """Places of changed parameters, what has to stand there, and whether no other element holds the parameter alike."""
    moved, done = {**values, **changes}, set()
    for name in changes:
        places = [Place.of(target) for target in targets.get(name, ())]
        if not places or any(place.kind not in SETTABLE for place in places):
            raise ParameterError(f"parameter {name} cannot be set; edit the MJCF, which both sides read")
        for place, target in zip(places, targets[name], strict=True):
            if place not in done:
                done.add(place)
                yield place, target.number(moved), len({p.element for p in places if p.kind == place.kind}) == 1


def _gravity(before: np.ndarray, axis: str, value: float) -> np.ndarray:
    if axis:
        return np.where(np.arange(3) == AXES.index(axis), value, before)
    size = float(np.linalg.norm(before))
    return before * (value / size if size else 0.0)


def _joints(model: mujoco.MjModel, place: Place, taken: set[tuple[str, str, str]], alone: bool) -> list[str]:
    """The named joint, and others with the same number that no parameter names."""
    values = np.array(getattr(model, f"dof_{place.kind}"))
    wanted = values[model.jnt_dofadr[model.joint(place.element).id]]
    names = [model.joint(joint).name for joint in range(model.njnt)] if alone else []
    alike = [
        name
        for name in names
        if name != place.element
        and (place.kind, name, "") not in taken
        and _same(values[model.jnt_dofadr[model.joint(name).id]], wanted)
    ]
    return [place.element, *alike]


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
    model: mujoco.MjModel, place: Place, places: Set[Place], body: int, value: float, principal: np.ndarray
) -> np.ndarray:
    """Principal inertias with those that equal the named moment moved to *value*.

    Transverse twins of a rod move along; where no body has such moments, so do all that no other parameter names.
    """
    before = _moment(model, place)
    mine = np.array([_same(moment, before) for moment in model.body_inertia[body]])
    if not mine.any():
        raise ParameterError(f"inertia {place.element} {place.axis}: no principal axis of the body")
    factor = value / before
    moved = np.where(mine, model.body_inertia[body] * factor, principal)  # a second axis does not move twins twice
    if 2 * moved.max() > moved.sum() * (1 + 1e-12):
        others = [_moment(model, p) for p in places if p.kind == "inertia" and p != place]
        named = np.array([any(_same(m, other) for other in others) for m in model.body_inertia[body]]) & ~mine
        moved = np.where(named, principal, model.body_inertia[body] * factor)
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
