"""What is left out of account, held against the motion: limits that it leaves, geoms that it makes touch."""

from __future__ import annotations

import copy
from dataclasses import dataclass

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.reference.closures import fixed_tendons, is_fixed, name_of

MOST_POSES = 200
"""Poses in which geoms are looked at; a longer motion is thinned out evenly."""


@dataclass(frozen=True)
class LimitLeft:
    """A limit that a motion leaves."""

    element: str
    """``joint`` or ``tendon``"""
    name: str
    unit: str
    """rad or m; empty for a tendon, whose unit its coefficients make"""
    sample: int
    """where the motion is furthest beyond"""
    value: float
    """the coordinate there; the angle of a ball joint"""
    lower: float
    upper: float

    def text(self, t: FloatArray | None = None) -> str:
        """One line, with the time where times ``(n,)`` in s are given."""
        when = f"sample {self.sample}" if t is None else f"t = {float(t[self.sample]):.6g} s"
        unit = f" {self.unit}" if self.unit else ""
        return (
            f'{when}, {self.element} "{self.name}" = {self.value:.6g}{unit}; its range is {self.lower:.6g} to'
            f" {self.upper:.6g}{unit}"
        )


@dataclass(frozen=True)
class Touch:
    """Two geoms that a motion makes touch, as MuJoCo finds them."""

    one: str
    two: str
    sample: int
    """of the poses looked at, where they are deepest in each other"""
    depth: float
    """m"""
    always: bool
    """whether they touch in every pose looked at: geoms that are drawn into each other"""


def limits_left(model: mujoco.MjModel, qpos: FloatArray) -> list[LimitLeft]:
    """Find the limits of joints and fixed tendons that configurations ``(n, nq)`` leave, whatever the flags say.

    Samples as `ReferenceResult.qpos` holds them; one record a limit, in the file's order.
    """
    found = []
    kinds = mujoco.mjtJoint
    for joint in np.flatnonzero(model.jnt_limited):
        kind, first = kinds(model.jnt_type[joint]), int(model.jnt_qposadr[joint])
        lower, upper = (float(value) for value in model.jnt_range[joint])
        if kind == kinds.mjJNT_BALL:
            lower = 0.0
            part = np.abs(qpos[:, first])
            values = 2.0 * np.arctan2(np.linalg.norm(qpos[:, first + 1 : first + 4], axis=1), part)
        else:
            values = qpos[:, first]
        unit = "m" if kind == kinds.mjJNT_SLIDE else "rad"
        name = name_of(model, mujoco.mjtObj.mjOBJ_JOINT, int(joint))
        found += _beyond("joint", name, unit, values, lower, upper)
    table = fixed_tendons(model)
    scalars = qpos[:, np.asarray(model.jnt_qposadr)]
    for tendon in np.flatnonzero(model.tendon_limited):
        if is_fixed(model, int(tendon)):
            lower, upper = (float(value) for value in model.tendon_range[tendon])
            name = name_of(model, mujoco.mjtObj.mjOBJ_TENDON, int(tendon))
            found += _beyond("tendon", name, "", scalars @ table[tendon], lower, upper)
    return found


def _beyond(element: str, name: str, unit: str, values: FloatArray, lower: float, upper: float) -> list[LimitLeft]:
    beyond = np.maximum(values - upper, lower - values)
    if not len(values) or beyond.max() <= 0.0:
        return []
    worst = int(np.argmax(beyond))
    return [LimitLeft(element, name, unit, worst, float(values[worst]), lower, upper)]


def touches(model: mujoco.MjModel, qpos: FloatArray) -> list[Touch]:
    """Find the geoms that touch in configurations ``(n, nq)`` if contacts counted, whatever the flags say."""
    watched = copy.copy(model)
    flags = mujoco.mjtDisableBit
    watched.opt.disableflags &= ~(flags.mjDSBL_CONTACT.value | flags.mjDSBL_CONSTRAINT.value)
    data = mujoco.MjData(watched)
    samples = np.unique(np.linspace(0, len(qpos) - 1, min(len(qpos), MOST_POSES)).astype(np.int64))
    deepest: dict[tuple[int, int], tuple[float, int, int]] = {}
    for sample in samples:
        data.qpos[:] = qpos[sample]
        mujoco.mj_kinematics(watched, data)
        mujoco.mj_comPos(watched, data)
        mujoco.mj_collision(watched, data)
        here: dict[tuple[int, int], float] = {}
        for contact in data.contact[: data.ncon]:
            if contact.dist < 0.0:
                pair = int(contact.geom[0]), int(contact.geom[1])
                here[pair] = max(here.get(pair, 0.0), -float(contact.dist))
        for pair, depth in here.items():
            before = deepest.get(pair, (0.0, int(sample), 0))
            place = (depth, int(sample)) if depth > before[0] else before[:2]
            deepest[pair] = (*place, before[2] + 1)
    names = [[name_of(model, mujoco.mjtObj.mjOBJ_GEOM, geom) for geom in pair] for pair in deepest]
    return [
        Touch(one, two, sample, depth, count == len(samples))
        for (one, two), (depth, sample, count) in zip(names, deepest.values(), strict=True)
    ]
