"""A mechanism made of nothing but its MJCF: kinematics by the reference, parameters by name, closed forms by the user.

There is no closed form here to be held against the reference, so kinematics are not compared; the torques of the user's
candidates are what is judged.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray, as_batch, as_batches
from workbench.errors import MotionError, ParameterError
from workbench.mjcf.quantities import read_quantities
from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference
from workbench.robots.base import Mechanism, Reach
from workbench.robots.kernel_call import TorqueKernel
from workbench.robots.parameters import ParameterInfo

DEGREES = 4.0 * np.pi
"""A hinge that moves through more than two turns was most likely given in degrees."""


class GenericMechanism(Mechanism):
    """Any closed chain; a class of its own for each model, made by `generic_mechanism`."""

    closed_kinematics = False
    mass_models = ("distributed",)
    parameter_table = ()
    targets = ()
    reference: MujocoReference
    made_by: tuple[Any, ...]

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Made anew from the file where it is copied to another process."""
        return generic_mechanism, self.made_by

    def _solved(self, q: ArrayLike, qd: ArrayLike | None = None, qdd: ArrayLike | None = None) -> Any:
        q = as_batch("q", q, len(self.joints))
        self._refuse_degrees(q)
        zero = np.zeros_like(q)
        return self.reference.inverse_dynamics(q, zero if qd is None else qd, zero if qdd is None else qdd)

    def _refuse_degrees(self, q: FloatArray) -> None:
        for i, (joint, unit) in enumerate(zip(self.joints, self.coordinate_units, strict=True)):
            far = float(np.abs(q[:, i]).max(initial=0.0))
            if unit == "rad" and far > DEGREES and np.ptp(q[:, i]) < far:
                raise MotionError(
                    f"joint {joint}: reaches {far:g} rad, {far / (2 * np.pi):.3g} turns, and never passes zero; angles"
                    f" are in radians ({far:g} degrees are {np.radians(far):.6g} rad)",
                    joint=joint,
                    value=far,
                )

    def forward_kinematics(self, q: ArrayLike) -> FloatArray:
        """Platform position ``(n, 3)``, m, in the base body's frame."""
        found: FloatArray = self._solved(q).x
        return found

    def platform_motion(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position, velocity and acceleration of the platform site, each ``(n, 3)``."""
        found = self._solved(q, qd, qdd)
        return found.x, found.xd, found.xdd

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """J ``(n, 3, na)`` with xd = J qd, column by column from the reference's velocities."""
        q = as_batch("q", q, len(self.joints))
        columns = [self._solved(q, np.tile(unit, (len(q), 1))).xd for unit in np.eye(len(self.joints))]
        return np.stack(columns, axis=2)

    def inverse_kinematics(self, x: ArrayLike) -> FloatArray:
        """Refused: there is no closed form."""
        raise self._joint_space()

    def joint_motion(self, x: ArrayLike, xd: ArrayLike, xdd: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Refused: there is no closed form."""
        raise self._joint_space()

    def reach(self, x: ArrayLike) -> Reach:
        """Refused: there is no closed form."""
        raise self._joint_space()

    def reach_box(self) -> tuple[FloatArray, FloatArray]:
        """Refused: there is no closed form."""
        raise self._joint_space()

    def _joint_space(self) -> MotionError:
        return MotionError(
            f"{self.name}: a motion of the platform needs inverse kinematics in closed form, which a mechanism that is"
            " given by its MJCF alone does not have; give the motion of the joints (sine, multi_sine, csv)"
        )

    def singularity_measures(self, q: ArrayLike) -> dict[str, FloatArray]:
        """None; the condition number of the loops is among the case's facts."""
        return {}

    def torques(
        self,
        q: FloatArray,
        qd: FloatArray,
        qdd: FloatArray,
        mass_model: str,
        external_force: FloatArray,
        threads: int = 1,
    ) -> FloatArray:
        """The reference's own torques."""
        return self.reference.inverse_dynamics(q, qd, qdd, mass_model, external_force).tau

    def kernel(self, mass_model: str = "distributed") -> TorqueKernel:
        """Refused: there is no closed form."""
        raise ParameterError(f"{self.name}: there is no closed form to prepare; call your own formula")

    def inverse_dynamics(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        qdd: ArrayLike,
        mass_model: str = "distributed",
        external_force: ArrayLike | None = None,
        threads: int = 1,
    ) -> FloatArray:
        """Actuator forces and torques ``(n, na)`` by the reference; see `Mechanism.inverse_dynamics`."""
        q, qd, qdd = as_batches(len(self.joints), q=q, qd=qd, qdd=qdd)
        return self.reference.inverse_dynamics(q, qd, qdd, mass_model, external_force).tau

    def with_parameters(self, **changes: float) -> GenericMechanism:
        """Refused: the numbers stand in the MJCF."""
        raise ParameterError(f"{self.name}: parameters cannot be set; edit the MJCF, which both sides read")

    def warnings(self, t: FloatArray, q: FloatArray, qd: FloatArray | None = None) -> list[str]:
        """What a reader of the results should know."""
        found = []
        if self.reference.excess_actuators:
            freedoms = len(self.joints) - self.reference.excess_actuators
            found.append(
                f"redundant actuation: {len(self.joints)} actuators for {freedoms} freedom(s); the reference's torques"
                " are those of least norm, newtons and newton-metres counted alike; no second engine looks at"
                " them, and reactions are left out"
            )
        structure, model = self.reference.structure, self.reference.compiled()
        found += self.reference.notes
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


def generic_mechanism(path: Path, setup: Setup, read: tuple[tuple[str, str], ...] = ()) -> GenericMechanism:
    """Make the mechanism of an MJCF.

    Parameters
    ----------
    path
        The MJCF file.
    setup
        Actuated joints, platform site, first guess.
    read
        Parameters for the user's candidates: name and where the model holds it (`workbench.mjcf.quantities`).

    Raises
    ------
    ModelError
        The file does not compile, its loops cannot be closed, or something holds that is not covered.
    SpecError
        A parameter that the model does not have.
    """
    reference = MujocoReference(path, setup=setup)
    quantities = read_quantities(reference.compiled(), dict(read))
    slides = reference.actuated_slides
    gravity = np.asarray(reference.compiled().opt.gravity) @ reference.base_rotation
    axis = int(np.argmax(np.abs(gravity)))
    fields = [(name, float) for name in quantities]
    attributes: dict[str, Any] = {
        "name": path.stem,
        "title": path.stem.replace("_", " "),
        "reference_key": "",
        "joints": reference.joint_names,
        "coordinate_units": tuple("m" if slide else "rad" for slide in slides),
        "force_units": tuple("N" if slide else "N m" for slide in slides),
        "up": tuple(float(i == axis) * (-1.0 if gravity[axis] > 0 else 1.0) for i in range(3)),
        "joint_limits": (),
        "platform_axes": ("x1", "x2", "x3"),
        "mass_models": ("distributed", "lumped") if setup.lumped_bodies else ("distributed",),
        "parameter_table": tuple(
            ParameterInfo(name, found.unit, found.meaning, path.name) for name, found in quantities.items()
        ),
        "parameter_type": dataclasses.make_dataclass("Parameters", fields, frozen=True),
        "reference": reference,
        "made_by": (path, setup, read),
        "candidates": {},
    }
    kind = type("GenericMechanism", (GenericMechanism,), attributes)
    made: GenericMechanism = kind(
        attributes["parameter_type"](**{name: found.value for name, found in quantities.items()})
    )
    return made
