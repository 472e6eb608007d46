"""The second route: MuJoCo's own forward dynamics with near-rigid loops, moved on in time by its own integrators.

Shares nothing with `workbench.reference.forward` but the model's numbers and the state that it begins at. MuJoCo's
Runge-Kutta method of order four moves what an explicit method can; what strong dampers or stiff springs bring to rest
within a step is moved by `implicitfast`, of first order.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np
from scipy.linalg import eigh

from workbench.arrays import FloatArray
from workbench.reference.forward_kernels import DONE, LOST
from workbench.reference.mujoco_reference import MujocoReference
from workbench.reference.replay import IMPEDANCE, near_rigid

EXPLICIT = 1.0
"""Rate of the fastest damper or spring times the step: an explicit method of order four is stable up to 2.78."""


class StiffPlant:
    """The same interface as `workbench.reference.forward.Plant`, by MuJoCo; run it inside of `replay.quiet`.

    Parameters
    ----------
    reference
        The robot.
    external_force
        Newtons, base frame, constant, on the platform's site ``(3,)``.
    """

    def __init__(self, reference: MujocoReference, external_force: FloatArray | None = None) -> None:
        self.reference = reference
        self._force = np.zeros(3) if external_force is None else np.array(external_force, dtype=np.float64)
        structure = reference.structure
        pull, name = None, reference.compiled().site(structure.platform_site).name
        if self._force.any():
            pull = name, reference.base_rotation @ self._force
        self._model = near_rigid(reference.spec(), 1e-3, pull)
        # what pulls brings a site of its own, so numbers are others
        self._site = self._model.site(name).id if name else structure.platform_site
        self._data = mujoco.MjData(self._model)
        self._qpos, self._qvel = np.asarray(self._data.qpos), np.asarray(self._data.qvel)
        self._actuated, self._actuated_qpos = structure.actuated, structure.actuated_qpos
        self._home = reference.home
        self._fastest: float | None = None

    @property
    def q(self) -> FloatArray:
        """Actuated coordinates ``(na,)`` now; a copy."""
        found: FloatArray = self._qpos[self._actuated_qpos]
        return found

    @property
    def qd(self) -> FloatArray:
        """Their rates now; a copy."""
        found: FloatArray = self._qvel[self._actuated]
        return found

    @property
    def platform(self) -> FloatArray:
        """The platform's site ``(3,)``, m, base frame."""
        mujoco.mj_kinematics(self._model, self._data)
        site = np.asarray(self._data.site_xpos[self._site])
        found: FloatArray = (site - self.reference.base_position) @ self.reference.base_rotation
        return found

    def begin(self, q: FloatArray, qd: FloatArray) -> None:
        """Stand at a state ``(na,)``."""
        start = self.reference.inverse_dynamics(q[None], qd[None], np.zeros((1, len(q))), "distributed", self._force)
        mujoco.mj_resetData(self._model, self._data)
        self._qpos[:], self._qvel[:] = start.qpos[0], start.qvel[0]

    @property
    def fastest(self) -> float:
        """Rate of the fastest damper or spring at home, 1/s; loops only make it slower."""
        if self._fastest is None:
            model, data = self._model, self._data
            self.begin(self._home, np.zeros_like(self._home))
            mujoco.mj_forward(model, data)
            mass = np.zeros((model.nv, model.nv))
            mujoco.mj_fullM(model, data, mass)
            stiffness = np.zeros(model.nv)
            for joint in range(model.njnt):
                end = model.jnt_dofadr[joint + 1] if joint + 1 < model.njnt else model.nv
                stiffness[model.jnt_dofadr[joint] : end] = model.jnt_stiffness[joint]
            damper = eigh(np.diag(model.dof_damping), mass, eigvals_only=True)[-1]
            spring = eigh(np.diag(stiffness), mass, eigvals_only=True)[-1]
            self._fastest = float(max(damper, math.sqrt(max(spring, 0.0))))
        return self._fastest

    def takes(self, step: float) -> bool:
        """Whether an explicit method can take such steps (s)."""
        return self.fastest * step <= EXPLICIT

    def stiffen(self, step: float, explicit: bool) -> None:
        """Make loops and dry friction as stiff as steps of at most *step* seconds allow, and choose the integrator."""
        model, kinds = self._model, mujoco.mjtIntegrator
        model.opt.integrator = kinds.mjINT_RK4 if explicit else kinds.mjINT_IMPLICITFAST
        model.eq_solref[:] = [2.0 * step, 1.0]
        model.eq_solimp[:, :2] = IMPEDANCE
        if model.nv:
            model.dof_solref[:] = [2.0 * step, 1.0]

    def move(self, tau: FloatArray, duration: float, steps: int) -> int:
        """Move on by *duration* seconds under constant torques ``(na,)``: `DONE`, or `LOST` where numbers are."""
        self._model.opt.timestep = duration / steps
        self._data.qfrc_applied[self._actuated] = tau
        mujoco.mj_step(self._model, self._data, nstep=steps)
        fast = math.sqrt(self._qvel @ self._qvel)  # infinite or no number where one of them is
        return DONE if fast < mujoco.mjMAXVAL else LOST
