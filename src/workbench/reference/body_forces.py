"""Forces on bodies that MuJoCo counts among its passive ones: what reactions in joints have to know of them."""

from __future__ import annotations

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.reference.closures import is_fixed
from workbench.reference.uncovered import switched_off


def felt_gravity(model: mujoco.MjModel) -> FloatArray:
    """What pulls each body ``(nbody, 3)``, m/s^2, world frame: gravity less its compensation; zero where it is off."""
    gravity = np.zeros(3) if switched_off(model, "gravity") else np.array(model.opt.gravity)
    # MuJoCo's passive forces, compensation among them, end where both of their kinds are off
    compensated = not (switched_off(model, "spring") and switched_off(model, "damper"))
    share = 1.0 - np.array(model.body_gravcomp) if compensated else np.ones(model.nbody)
    pulls: FloatArray = share[:, None] * gravity
    return pulls


def acts_on_bodies(model: mujoco.MjModel) -> bool:
    """Whether a fluid or a spatial tendon acts on bodies, so that reactions do not follow from weight and motion."""
    pulling = (model.tendon_stiffness, model.tendon_damping, model.tendon_stiffnesspoly, model.tendon_dampingpoly)
    spatial = [t for t in range(model.ntendon) if not is_fixed(model, t)]
    return bool(
        model.opt.density or model.opt.viscosity or any(np.any(values[t]) for t in spatial for values in pulling)
    )
