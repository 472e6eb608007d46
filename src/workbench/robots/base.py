"""What every mechanism with a closed form is made of: parameters, kinematics, candidates. Nothing here knows MuJoCo."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.arrays import FloatArray, as_force, as_rows, same_lengths
from workbench.errors import MotionError, ParameterError, did_you_mean
from workbench.robots.assumptions.layout import Layout
from workbench.robots.parameters import (
    ParameterInfo,
    Target,
    UniformRule,
    changed_parameters,
    check_parameters,
    stored_names,
)

if TYPE_CHECKING:
    from workbench.robots.kernel_call import TorqueKernel

NEAR_SINGULAR = 0.05
"""A pose is worth a warning when a scaled determinant is below this: a factor of twenty between forces and torques."""

LONGEST_LINK = 20.0
"""Metres; no parallel robot of this kind has a longer link, so a longer one was written in millimetres."""

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


CandidateFunction = Callable[["Mechanism", FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class Candidate:
    """A closed form: ``(mechanism, q, qd, qdd, external_force) -> tau``, arrays ``(n, 3)``, SI, platform frame."""

    name: str
    mass_model: str
    """the reference mass model whose assumption the formula shares"""
    function: CandidateFunction
    description: str
    source: str = ""


class Mechanism(ABC):
    """A parallel robot with closed-form kinematics and inverse dynamics.

    Subclasses state the class attributes and implement the abstract methods; arrays at the public surface are float64,
    SI, batch first, in actuator order, in the paper's frame.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    reference_key: ClassVar[str]
    """bibliography key, explained in docs/references.md"""
    joints: ClassVar[tuple[str, ...]]
    coordinate_units: ClassVar[tuple[str, ...]]
    """unit of each q, ``m`` or ``rad``"""
    force_units: ClassVar[tuple[str, ...]]
    """unit of each tau, ``N`` or ``N m``"""
    up: ClassVar[tuple[float, float, float]]
    """unit vector against gravity, along one of the platform axes"""
    joint_limits: ClassVar[tuple[tuple[float, float], ...]]
    """range of each actuated coordinate that a workspace is computed for, where the user gives none"""
    platform_axes: ClassVar[tuple[str, ...]]
    """names of the platform coordinates as the paper writes them"""
    coordinates: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    """task coordinates, in which motions of the platform are given"""
    mass_models: ClassVar[tuple[str, ...]] = ("distributed", "lumped")
    parameter_table: ClassVar[tuple[ParameterInfo, ...]]
    targets: ClassVar[tuple[Target, ...]]
    uniform_rules: ClassVar[tuple[UniformRule, ...]] = ()
    layout: ClassVar[Layout]
    """bodies, joints, loops and sites that a model must have"""
    closed_kinematics: ClassVar[bool] = True
    """whether the platform's motion comes from closed forms, which a reference can be compared with"""
    candidates: ClassVar[Mapping[str, Candidate]]
    parameter_type: ClassVar[type]

    def __init__(self, parameters: Any) -> None:
        """Build from an instance of `parameter_type`.

        Raises
        ------
        ParameterError
            A value is not finite or outside the range that the parameter table allows.
        """
        self._parameters = parameters
        check_parameters(self.parameter_table, vars(parameters))

    @property
    def parameters(self) -> Any:
        """The frozen dataclass of parameters, SI."""
        return self._parameters

    def with_parameters(self, **changes: float) -> Self:
        """Return a new mechanism with some parameters changed.

        Parameters
        ----------
        **changes
            New values by name, SI. ``NAME`` sets both limbs, ``NAME_left`` or ``NAME_right`` one. Changing a bar's mass
            or length keeps it a uniform slender bar unless its inertia is given too.

        Raises
        ------
        ParameterError
            Unknown name, or a value that the parameter may not have.
        """
        values = changed_parameters(type(self), dict(vars(self._parameters)), changes)
        return type(self)(self.parameter_type(**values))

    @abstractmethod
    def forward_kinematics(self, q: ArrayLike) -> FloatArray:
        """Platform position ``(n, 3)`` in metres from actuated coordinates ``(n, 3)``, on the home branch."""

    @abstractmethod
    def inverse_kinematics(self, x: ArrayLike) -> FloatArray:
        """Actuated coordinates ``(n, 3)`` from platform positions ``(n, 3)`` in metres, on the home branch."""

    @abstractmethod
    def jacobian(self, q: ArrayLike) -> FloatArray:
        """J of shape ``(n, 3, 3)`` with xd = J qd."""

    @abstractmethod
    def platform_motion(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position, velocity and acceleration of the platform, each ``(n, 3)``."""

    def platform_along(
        self, t: FloatArray, q: FloatArray, qd: FloatArray, qdd: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """As `platform_motion`, for samples that are one motion, in the order of times ``(n,)``.

        Closed forms know their branch from q alone; what closes loops step by step follows the motion.
        """
        return self.platform_motion(q, qd, qdd)

    @abstractmethod
    def joint_motion(self, x: ArrayLike, xd: ArrayLike, xdd: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Actuated position, velocity and acceleration, each ``(n, 3)``, from a platform motion."""

    @abstractmethod
    def reach(self, x: ArrayLike) -> Reach:
        """Inverse kinematics that marks positions out of reach instead of refusing them; x ``(n, 3)`` in metres."""

    @abstractmethod
    def reach_box(self) -> tuple[FloatArray, FloatArray]:
        """Corners ``(3,)``, metres, of a box in platform space that holds every position in reach."""

    @abstractmethod
    def singularity_measures(self, q: ArrayLike) -> dict[str, FloatArray]:
        """Determinants that vanish at singular poses, name -> ``(n,)``, scaled to be dimensionless (1 is far away)."""

    def assembly_solutions(self, q: ArrayLike) -> FloatArray:
        """Platform positions of every assembly branch, ``(n, k, 3)``; here the home branch alone, k = 1."""
        return self.forward_kinematics(q)[:, None, :]

    def mobility_count(self) -> dict[str, int]:
        """Freedoms counted on paper, by the formula that the mechanism's source uses; name -> number, may be empty."""
        return {}

    def paper_conditions(self, q: ArrayLike) -> tuple[Condition, ...]:
        """Conditions that the mechanism's source states against singular poses, over a motion ``(n, na)``."""
        return ()

    def warnings(self, t: FloatArray, q: FloatArray, qd: FloatArray | None = None) -> list[str]:
        """What a reader of a case's results should know: poses near a singularity, lengths that look like millimetres.

        Parameters
        ----------
        t, q, qd
            Times ``(n,)`` in seconds, actuated coordinates and, where friction matters, their rates ``(n, na)``.
        """
        found = [] if qd is None else self.friction_warnings(qd)
        for name, values in self.singularity_measures(q).items():
            worst = int(np.argmin(np.abs(values)))
            if abs(values[worst]) < NEAR_SINGULAR:
                found.append(
                    f"close to a singular pose at t = {t[worst]:.6g} s: |{name}| falls to {abs(values[worst]):.3g} of"
                    f" its scale (warning below {NEAR_SINGULAR:g})"
                )
        return found + self.millimetre_warnings()

    def millimetre_warnings(self) -> list[str]:
        """Lengths that were most likely written in millimetres."""
        return [
            f"{name} = {value:g} m is longer than {LONGEST_LINK:g} m: lengths are in metres, this looks like"
            " millimetres"
            for name, info in stored_names(self.parameter_table).items()
            if info.unit == "m" and abs(value := getattr(self._parameters, name)) > LONGEST_LINK
        ]

    @property
    def has_friction(self) -> bool:
        """Whether `friction` may be anything but zero."""
        return True

    def friction(self, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        """What the actuators must supply for friction and rotor inertia, ``(n, na)``; `torques` leaves it out."""
        return np.zeros_like(q)

    def friction_warnings(self, qd: FloatArray) -> list[str]:
        """Say where dry friction is a convention: samples ``(n, na)`` of *qd* at rest."""
        return []

    @abstractmethod
    def torques(
        self,
        q: FloatArray,
        qd: FloatArray,
        qdd: FloatArray,
        mass_model: str,
        external_force: FloatArray,
        threads: int = 1,
    ) -> FloatArray:
        """Inverse dynamics without friction on arrays of checked shape, force ``(n, 3)`` or ``(1, 3)``.

        Entries that are not finite are refused here; see `inverse_dynamics`.
        """

    @abstractmethod
    def kernel(self, mass_model: str = "distributed") -> TorqueKernel:
        """Inverse dynamics of one sample at a time, prepared for control loops.

        Returns
        -------
        TorqueKernel
            ``tau = kernel(q, qd, qdd, external_force=None, out=None)`` on float64 arrays ``(3,)``, friction included.
            Everything is compiled before this method returns. With *out* a call allocates nothing; the errors are those
            of `inverse_dynamics`, and *out* is not to be read after one. Other parameters need another kernel.
        """

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
            Newtons, paper frame, acting on the platform: ``(3,)`` or ``(n, 3)``; None is no force.
        threads
            At most so many threads share a large batch; the result is the same, bit for bit.

        Returns
        -------
        numpy.ndarray
            tau ``(n, 3)``, what the actuators must supply, in `force_units`.

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
        q, qd, qdd = same_lengths(q=as_rows("q", q), qd=as_rows("qd", qd), qdd=as_rows("qdd", qdd))
        force = NO_FORCE if external_force is None else as_force("external_force", external_force, len(q))
        tau = self.torques(q, qd, qdd, mass_model, force, threads)
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
