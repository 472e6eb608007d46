"""A formula as the model inside a controller: the robot that it believes in, the force that it knows."""

from __future__ import annotations

import numpy as np

from workbench.arrays import FloatArray
from workbench.capabilities.robot import Robot
from workbench.errors import WorkbenchError
from workbench.robots.kernel_call import TorqueKernel

SAME = 1e-9
"""Of the largest torque: a robot's compiled closed form stands for the formula of its name if it is off by less."""


class FormulaModel:
    """One formula on one robot.

    Parameters
    ----------
    robot
        With the parameters that the controller believes.
    name
        Of the formula, one of the robot's candidates.
    force
        Newtons on the platform that it knows of, ``(3,)``, base frame.
    """

    def __init__(self, robot: Robot, name: str, force: FloatArray) -> None:
        self._robot, self._candidate = robot, robot.candidates[name]
        self._force = np.array(force, dtype=np.float64)
        self._row = self._force[None]
        self._kernel: TorqueKernel | None = None
        self._out = np.zeros(len(robot.joints))
        if robot.closed_form is not None and name in robot.closed_form.mass_models:
            self._take_kernel(name)

    def _take_kernel(self, name: str) -> None:
        """Call the compiled closed form of the same name, which gives the same torques, one sample at a time."""
        try:
            kernel = self._robot.kernel(name)
            state = self._robot.home, 0.3 + 0.0 * self._robot.home, 0.7 + 0.0 * self._robot.home
            one = kernel(*state, self._force).copy()
            other = self._function(*(array[None] for array in state))[0]
        except WorkbenchError:
            return
        if np.abs(one - other).max() <= SAME * max(np.abs(other).max(), 1e-12):
            self._kernel = kernel

    def _function(self, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        force = self._row if len(q) == 1 else np.tile(self._force, (len(q), 1))
        return self._candidate.function(self._robot, q, qd, qdd, force)

    def batch(self, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        """Torques ``(n, na)``."""
        return self._function(q, qd, qdd)

    def one(self, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        """Torques ``(na,)``; the array is written over by the next call."""
        if self._kernel is not None:
            return self._kernel(q, qd, qdd, self._force, self._out)
        found: FloatArray = self._function(q[None], qd[None], qdd[None])[0]
        return found
