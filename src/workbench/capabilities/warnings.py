"""What a reader of a robot's results should know: one line each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import MotionError
from workbench.robots.friction import DriveFriction
from workbench.robots.parameters import ParameterTable

if TYPE_CHECKING:
    from workbench.capabilities.robot import Robot

NEAR_SINGULAR = 0.05
"""A pose is worth a warning when a scaled determinant is below this: a factor of twenty between forces and torques."""

LONGEST_LINK = 20.0
"""Metres; no parallel robot has a longer link, so a longer one was written in millimetres."""

DEGREES = 4.0 * np.pi
"""A hinge that moves through more than two turns was most likely given in degrees."""


def near_singular_warnings(t: FloatArray, measures: Mapping[str, FloatArray]) -> list[str]:
    """Poses of a motion that come close to a singular one, by `Robot.singularity_measures`."""
    found = []
    for name, values in measures.items():
        worst = int(np.argmin(np.abs(values)))
        if abs(values[worst]) < NEAR_SINGULAR:
            found.append(
                f"close to a singular pose at t = {t[worst]:.6g} s: |{name}| falls to {abs(values[worst]):.3g} of"
                f" its scale (warning below {NEAR_SINGULAR:g})"
            )
    return found


def millimetre_warnings(table: ParameterTable, values: Mapping[str, float]) -> list[str]:
    """Lengths that were most likely written in millimetres."""
    return [
        f"{name} = {values[name]:g} m is longer than {LONGEST_LINK:g} m: lengths are in metres, this looks like"
        " millimetres"
        for name, info in table.infos.items()
        if info.unit == "m" and abs(values[name]) > LONGEST_LINK
    ]


def reference_warnings(robot: Robot, qd: FloatArray | None) -> list[str]:
    """What the reference takes for granted where no closed form says it: excess actuators, idle spins, rest."""
    reference, found = robot.reference, []
    structure, model = reference.structure, reference.compiled()
    if qd is not None and not reference.excess_actuators:
        dry = np.asarray(model.dof_frictionloss)[structure.actuated]
        found += DriveFriction(robot.joints, 0.0 * dry, dry, 0.0 * dry).warnings(qd)
    found += _far_away(model)
    if reference.excess_actuators:
        freedoms = len(robot.joints) - reference.excess_actuators
        found.append(
            f"redundant actuation: {len(robot.joints)} actuators for {freedoms} freedom(s); the reference's torques"
            " are those of least norm, newtons and newton-metres counted alike; no second engine looks at"
            " them, and reactions are left out"
        )
    found += reference.notes
    for name, rod in zip(structure.idle, structure.rods, strict=True):
        joints = [-1 - end for end in (rod.near, rod.far) if end < 0]
        dofs = [d for j in joints for d in range(model.jnt_dofadr[j], model.jnt_dofadr[j] + 3)]
        felt = (model.dof_damping, model.dof_armature, model.dof_frictionloss)
        if any(values[dofs].any() for values in felt) or model.jnt_stiffness[joints].any():
            found.append(
                f"rod {name}: damping, dry friction, stiffness or armature of its ball joint would spin it about"
                " its own axis; the reference holds that spin at zero, by a moment that no actuator gives"
            )
    return found


def _far_away(model: mujoco.MjModel) -> list[str]:
    """A body or site that lies so far from its parent that the file was most likely drawn in millimetres."""
    obj = mujoco.mjtObj
    for what, kind, places in (("body", obj.mjOBJ_BODY, model.body_pos), ("site", obj.mjOBJ_SITE, model.site_pos)):
        far = np.linalg.norm(places, axis=1)
        if len(far) and far.max() > LONGEST_LINK:
            worst = int(far.argmax())
            name = mujoco.mj_id2name(model, kind, worst) or f"#{worst}"
            return [
                f'{what} "{name}" lies {far[worst]:g} m from where it hangs, more than {LONGEST_LINK:g} m:'
                " an MJCF is in metres, this looks like millimetres"
            ]
    return []


def refuse_degrees(robot: Robot, q: FloatArray) -> None:
    """Refuse hinge coordinates ``(n, na)`` that look like degrees.

    Raises
    ------
    MotionError
        Naming the joint and its largest value.
    """
    for i, (joint, unit) in enumerate(zip(robot.joints, robot.coordinate_units, strict=True)):
        far = float(np.abs(q[:, i]).max(initial=0.0))
        if unit == "rad" and far > DEGREES and np.ptp(q[:, i]) < far:
            raise MotionError(
                f"joint {joint}: reaches {far:g} rad, {far / (2 * np.pi):.3g} turns, and never passes zero; angles"
                f" are in radians ({far:g} degrees are {np.radians(far):.6g} rad)",
                joint=joint,
                value=far,
            )
