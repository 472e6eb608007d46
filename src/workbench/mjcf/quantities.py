"""Named numbers of a compiled model, so that a user's formula reads its parameters where the reference reads them.

A campaign writes ``a1 = "distance pin_a pin_b"`` or ``m2 = "mass coupler"``; every number comes from what MuJoCo
compiled, never from the text.
"""

from __future__ import annotations

import keyword
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.errors import SpecError, did_you_mean

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Quantity:
    """One named number: its value, SI unit and what it is."""

    value: float
    unit: str
    meaning: str


@dataclass(frozen=True)
class _Kind:
    """A kind of quantity: which elements it names, whether an axis follows, and how it is read."""

    elements: tuple[str, ...]
    axis: bool
    unit: str
    meaning: str
    read: Callable[[mujoco.MjModel, mujoco.MjData, list[int], int], float]


def _inertia(model: mujoco.MjModel, data: mujoco.MjData, ids: list[int], axis: int) -> float:
    """Moment of inertia about the mass centre and an axis of the body's own frame."""
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[ids[0]])
    row = turn.reshape(3, 3)[axis]
    return float(row**2 @ model.body_inertia[ids[0]])


def _damping(model: mujoco.MjModel, data: mujoco.MjData, ids: list[int], axis: int) -> float:
    return float(model.dof_damping[model.jnt_dofadr[ids[0]]])


def _armature(model: mujoco.MjModel, data: mujoco.MjData, ids: list[int], axis: int) -> float:
    return float(model.dof_armature[model.jnt_dofadr[ids[0]]])


KINDS: dict[str, _Kind] = {
    "mass": _Kind(("body",), False, "kg", "mass of {}", lambda m, d, i, a: float(m.body_mass[i[0]])),
    "inertia": _Kind(("body",), True, "kg m^2", "moment of inertia of {} about its mass centre, axis {axis}", _inertia),
    "com": _Kind(
        ("body",),
        True,
        "m",
        "mass centre of {}, {axis} in its own frame",
        lambda m, d, i, a: float(m.body_ipos[i[0], a]),
    ),
    "offset": _Kind(
        ("body",),
        True,
        "m",
        "origin of {}, {axis} in its parent's frame",
        lambda m, d, i, a: float(m.body_pos[i[0], a]),
    ),
    "site": _Kind(
        ("site",), True, "m", "site {}, {axis} in its body's frame", lambda m, d, i, a: float(m.site_pos[i[0], a])
    ),
    "distance": _Kind(
        ("site", "site"),
        False,
        "m",
        "distance from site {} to site {} in the model as drawn",
        lambda m, d, i, a: float(np.linalg.norm(d.site_xpos[i[0]] - d.site_xpos[i[1]])),
    ),
    "damping": _Kind(("joint",), False, "N s/m or N m s", "viscous friction of joint {}", _damping),
    "armature": _Kind(("joint",), False, "kg or kg m^2", "rotor inertia of joint {}", _armature),
    "gravity": _Kind((), False, "m/s^2", "gravity", lambda m, d, i, a: float(np.linalg.norm(m.opt.gravity))),
}


def read_quantities(model: mujoco.MjModel, asked: dict[str, str]) -> dict[str, Quantity]:
    """Read named numbers.

    Parameters
    ----------
    model
        The compiled model.
    asked
        Name -> what it is: a kind, the elements it belongs to and, where one is needed, an axis.

    Raises
    ------
    SpecError
        An unknown kind, element or axis, with those that are valid.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return {name: _read(model, data, name, text) for name, text in asked.items()}


def _read(model: mujoco.MjModel, data: mujoco.MjData, name: str, text: str) -> Quantity:
    words = text.split()
    where = f'read: {name} = "{text}"'
    if not name.isidentifier() or keyword.iskeyword(name) or name.startswith("__"):
        raise SpecError(
            f"{where}: formulas read p.NAME, and this name cannot stand there; allowed: letters, digits and _, none"
            ' of the words of Python, such as "lambda"',
            key=name,
        )
    if not words or words[0] not in KINDS:
        raise SpecError(f"{where}: unknown quantity{did_you_mean(words[0] if words else '', KINDS)}", key=name)
    kind = KINDS[words[0]]
    form = " ".join([words[0], *(element.upper() for element in kind.elements), *(["x|y|z"] if kind.axis else [])])
    if len(words) != len(form.split()):
        raise SpecError(f'{where}: allowed: "{form}"', key=name)
    ids = []
    for element, word in zip(kind.elements, words[1:], strict=False):
        obj = getattr(mujoco.mjtObj, f"mjOBJ_{element.upper()}")
        index = int(mujoco.mj_name2id(model, obj, word))
        if index < 0:
            count = {"body": model.nbody, "site": model.nsite, "joint": model.njnt}[element]
            known = [found for i in range(count) if (found := mujoco.mj_id2name(model, obj, i))]
            raise SpecError(f'{where}: no {element} "{word}"{did_you_mean(word, known)}', key=name)
        ids.append(index)
    axis = words[-1] if kind.axis else ""
    if kind.axis and axis not in AXES:
        raise SpecError(f'{where}: axis "{axis}"; allowed: x, y, z', key=name)
    meaning = kind.meaning.format(*words[1 : 1 + len(ids)], axis=axis)
    return Quantity(kind.read(model, data, ids, AXES.index(axis) if axis else 0), kind.unit, meaning)
