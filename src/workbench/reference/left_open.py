"""What a model leaves open, in torque: rods that are not quite round, loops that agree only to some digits.

A rod between two spherical joints turns idly about its axis only where it is a body of revolution. One with the digits
of a CAD file is not; what turns it no actuator holds, and the reference holds its spin at zero. How much that matters
is the difference to the same robot with rods made round. Loops of few digits are closed by least squares; what their
disagreement is worth is the power of their multipliers along it (`ReferenceResult.slack`).
"""

from __future__ import annotations

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError
from workbench.mjcf.engine_warnings import engine_warnings
from workbench.reference.mujoco_reference import MujocoReference
from workbench.reference.result import ReferenceResult
from workbench.reference.rods import RodFrame


def left_open(
    reference: MujocoReference,
    result: ReferenceResult,
    q: FloatArray,
    qd: FloatArray,
    qdd: FloatArray,
    mass_model: str = "distributed",
    external_force: FloatArray | None = None,
) -> FloatArray:
    """Largest torque ``(na,)``, N or N m, by which each actuator's would change if what is open were decided otherwise.

    Parameters
    ----------
    reference
        The robot.
    result
        What it gave for this motion, ``(n, na)`` each of *q, qd, qdd*, with *mass_model* and *external_force*.
    """
    worth: FloatArray = result.slack.max(axis=0, initial=0.0)
    # without rotational inertia a bar is round, and the bodies that lose it are the file's own
    round_model = _with_round_rods(reference) if mass_model == "distributed" else None
    if round_model is not None:
        other = reference.with_model(round_model).inverse_dynamics(q, qd, qdd, mass_model, external_force)
        worth = worth + np.abs(other.tau - result.tau).max(axis=0)
    return worth


@engine_warnings()
def _with_round_rods(reference: MujocoReference) -> mujoco.MjModel | None:
    """The model with every lopsided rod made round about its axis; None where there is none."""
    model, structure = reference.compiled(), reference.structure
    if not structure.lopsided:
        return None
    uneven = [(rod, RodFrame(model, rod, structure.frames)) for rod in structure.lopsided]
    spec = reference.spec()
    for rod, shape in uneven:
        place, inertia = shape.rounded()
        body = spec.bodies[rod.body]
        body.explicitinertial = True
        body.mass = model.body_mass[rod.body]
        body.ipos, body.iquat = place, [1.0, 0.0, 0.0, 0.0]
        body.inertia = [0.0, 0.0, 0.0]
        body.fullinertia = [inertia[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    # the first body of a rod of several takes all of the difference, and need not be a possible one by itself
    spec.compiler.balanceinertia = False
    try:
        return spec.compile()
    except ValueError as error:
        raise ModelError(
            f"{reference.file}: the model with round rods, by which their unevenness is judged, cannot be made:"
            f" {' '.join(str(error).split())}",
            file=reference.file,
        ) from error
