"""What a robot's Python side may offer: candidates, and a class with kinematics and inverse dynamics in closed form.

Nothing here knows MuJoCo. A class offers as many of the methods below as its source gives; what it leaves out, the
reference computes (`workbench.capabilities`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.arrays import FloatArray, as_force, as_rows, same_lengths
from workbench.errors import MotionError, ParameterError, did_you_mean
from workbench.robots.assumptions.layout import Layout

NO_FORCE: FloatArray = np.zeros((1, 3))
NO_FORCE.flags.writeable = False


@dataclass(frozen=True)
class Condition:
    """One inequality that a paper states, evaluated over a motion."""

    name: str
    value: float
    relation: str
    """``>`` or ``<``: what the paper demands of value and limit"""
    limit: float
    holds: bool
    unit: str
    note: str = ""


@dataclass(frozen=True)
class Reach:
    """Which platform positions a mechanism reaches on its home branch; entries of positions out of reach are NaN."""

    q: FloatArray
    """``(n, na)`` actuated coordinates, m or rad"""
    reachable: NDArray[np.bool_]
    """``(n,)``, joint limits not considered"""
    measures: dict[str, FloatArray]
    """the singularity measures, ``(n,)`` each"""
    condition: FloatArray
    """``(n,)`` condition number of the Jacobian, columns of turning actuators divided by their arm's length"""


CandidateFunction = Callable[[Any, FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class Candidate:
    """A formula: ``(robot, q, qd, qdd, external_force) -> tau``, arrays ``(n, na)``, SI, platform frame."""

    name: str
    mass_model: str
    """the reference mass model whose assumption the formula shares"""
    function: CandidateFunction
    description: str
    source: str = ""


class ClosedForm:
    """Kinematics and inverse dynamics of a robot, written down; arrays are float64, SI, batch first, in actuator order.

    A subclass offers any of these methods, all of them optional; where one is missing, the reference takes its place:

    ``forward_kinematics(q)``, ``platform_motion(q, qd, qdd)``, ``jacobian(q)``
        From actuated to task coordinates.
    ``inverse_kinematics(x)``, ``joint_motion(x, xd, xdd)``, ``reach(x) -> Reach``, ``reach_box(limits)``
        From task to actuated coordinates.
    ``torques(q, qd, qdd, mass_model, external_force, threads)``, ``kernel(mass_model)``
        Inverse dynamics of a batch without friction, and of single samples for control loops.
    ``friction(q, qd, qdd)``, ``has_friction``, ``friction_warnings(qd)``
        What the actuators supply for friction and rotors.
    ``singularity_measures(q)``, ``assembly_solutions(q)``, ``mobility_count()``, ``conditions(q)``
        Determinants that vanish at singular poses, all assembly branches, freedoms counted on paper, conditions that
        the source states.
    """

    candidates: ClassVar[Mapping[str, Candidate]] = {}
    mass_models: ClassVar[tuple[str, ...]] = ("distributed", "lumped")
    """reference mass models under which `torques` holds"""
    layout: ClassVar[Layout | None] = None
    """what the formulas take for granted about a model; None is nothing"""

    def __init__(self, parameters: Any) -> None:
        """Build from the values of the robot's parameters, by name."""
        self._parameters = parameters

    @property
    def parameters(self) -> Any:
        """The frozen dataclass of parameters, SI."""
        return self._parameters

    @property
    def has_friction(self) -> bool:
        """Whether `friction` may be anything but zero."""
        return False

    def friction(self, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        """What the actuators must supply for friction and rotor inertia, ``(n, na)``; ``torques`` leaves it out."""
        return np.zeros_like(q)

    def friction_warnings(self, qd: FloatArray) -> list[str]:
        """Say where dry friction is a convention: samples ``(n, na)`` of *qd* at rest."""
        return []

    def inverse_dynamics(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        qdd: ArrayLike,
        mass_model: str = "distributed",
        external_force: ArrayLike | None = None,
        threads: int = 1,
    ) -> FloatArray:
        """Actuator forces and torques that produce a motion.

        Parameters
        ----------
        q, qd, qdd
            Actuated position, velocity, acceleration, each ``(n, 3)``, SI.
        mass_model
            One of `mass_models`: bars with their rotational inertia, or without.
        external_force
            Newtons, base frame, acting on the platform: ``(3,)`` or ``(n, 3)``; None is no force.
        threads
            At most so many threads share a large batch; the result is the same, bit for bit.

        Returns
        -------
        numpy.ndarray
            tau ``(n, 3)``, what the actuators must supply, N and N m.

        Raises
        ------
        ArrayError
            Wrong shapes or entries that are not finite.
        ParameterError
            Unknown mass model.
        MotionError
            A sample outside the workspace or at a singular pose; the message names sample and joint.
        """
        self._check_mass_model(mass_model)
        q, qd, qdd = as_rows("q", q), as_rows("qd", qd), as_rows("qdd", qdd)
        if not len(q) == len(qd) == len(qdd):  # looked at here: for one sample the call would cost as much as all above
            same_lengths(q=q, qd=qd, qdd=qdd)
        force = NO_FORCE if external_force is None else as_force("external_force", external_force, len(q))
        tau: FloatArray = self.torques(q, qd, qdd, mass_model, force, threads)  # type: ignore[attr-defined]
        if self.has_friction:
            tau += self.friction(q, qd, qdd)
        return tau

    def _check_mass_model(self, mass_model: str) -> None:
        if mass_model not in self.mass_models:
            raise ParameterError(f'unknown mass model "{mass_model}"{did_you_mean(mass_model, self.mass_models)}')


def refuse_samples(bad: ArrayLike, joint: str, what: str, values: FloatArray, name: str) -> None:
    """Raise for the first sample marked in *bad* ``(n,)``; *values* ``(n, k)``, called *name*, are shown for it.

    Raises
    ------
    MotionError
        Naming sample, joint, what is wrong and the values; the facts carry the same.
    """
    marked = np.asarray(bad, dtype=bool)
    if marked.any():
        sample = int(np.argmax(marked))
        shown = ", ".join(f"{value:.6g}" for value in values[sample])
        raise MotionError(
            f"sample {sample}, joint {joint}: {what} at {name} = ({shown})",
            sample=sample,
            joint=joint,
            reason=what,
            value=values[sample].tolist(),
        )
