"""A robot: its parameters, its kinematics and its inverse dynamics, by closed form or by the reference."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray, as_batch
from workbench.capabilities.identity import RobotIdentity
from workbench.capabilities.limits import reach_box
from workbench.capabilities.nearest import with_nearest
from workbench.capabilities.offered import OfferedCandidates
from workbench.capabilities.samples import one_or_many
from workbench.capabilities.warnings import (
    millimetre_warnings,
    near_singular_warnings,
    reference_warnings,
    refuse_degrees,
)
from workbench.errors import MotionError, ParameterError
from workbench.reference import MujocoReference
from workbench.reference.task import continuous, task_motion, task_of
from workbench.robots.closed_form import Candidate, ClosedForm, Condition, Reach
from workbench.robots.description import Description
from workbench.robots.kernel_call import TorqueKernel
from workbench.robots.load import Base, LoadedModel, with_overrides


class Robot(RobotIdentity):
    """One robot with its parameters; made by `load_robot`, changed by `with_parameters` into another.

    Where its formulas offer something in closed form (`workbench.robots.closed_form.ClosedForm`), that is used, else
    the reference computes it. Arrays are float64, SI, batch first, in actuator order; a single sample may stand where a
    batch is. Task coordinates are those of the robot file, in the base body's frame.
    """

    def __init__(
        self,
        base: Base,
        values: Mapping[str, float] | None = None,
        loaded: LoadedModel | None = None,
        kind: type[ClosedForm] | None = None,
    ) -> None:
        described = base.loaded.description
        assert described is not None
        self._base = base
        self._loaded = loaded
        self._description: Description = described
        self._values: dict[str, float] = dict(values if values is not None else base.loaded.values or {})
        self._kind = kind or described.closed_form
        self._extra: ChainMap[str, Candidate] | None = None
        self.offered_kinematics: tuple[Any, ...] = ()

    def __repr__(self) -> str:
        """Name, freedoms and parameters."""
        by = "closed form" if self.closed_form else "reference"
        return (
            f"<Robot {self.name}: {self.title}; q = ({', '.join(self.joints)}), x = ({', '.join(self.platform_axes)}),"
            f" {len(self._values)} parameters, kinematics by {by}>"
        )

    def __getattr__(self, name: str) -> Any:
        """What else the robot's formulas offer: ``robot.reduced_jacobian(q)``.

        Raises
        ------
        AttributeError
            Neither robot nor formulas have it.
        """
        if not name.startswith("_") and self._kind is not None and hasattr(self._kind, name):
            return getattr(self.closed_form, name)
        raise AttributeError(f"robot {self.__dict__.get('_description') and self.name} has no attribute {name!r}")

    # parameters
    @cached_property
    def parameters(self) -> Any:
        """The frozen dataclass of parameters, SI."""
        return self._description.parameter_type(**self._values)

    @property
    def values(self) -> Mapping[str, float]:
        """The parameters by name, SI."""
        return dict(self._values)

    @property
    def file_values(self) -> Mapping[str, float]:
        """The parameters as the model's file has them, before any change, SI."""
        return dict(self._base.loaded.values or {})

    def with_parameters(self, **changes: float) -> Robot:
        """Return a new robot with some parameters changed.

        Parameters
        ----------
        **changes
            New values by name, SI; the name of a group sets all its members. A bar stays uniform and slender when its
            mass or length changes, unless its inertia is given too.

        Raises
        ------
        ParameterError
            Unknown name, a value that the parameter may not have, or a number that MuJoCo computes.
        """
        values = self._description.table.changed(self._values, changes)
        loaded = None
        if self._base.computed:
            fixed = {name: value for name, value in values.items() if name not in self._base.computed}
            loaded = with_overrides(self._base, {**fixed, **self._description.table.expand(changes)})
            values = dict(loaded.values or {})
        made = Robot(self._base, values, loaded, self._kind)
        made._extra, made.offered_kinematics = self._extra, self.offered_kinematics
        return made

    @property
    def loaded(self) -> LoadedModel:
        """The model with these parameters, compiled when first asked for.

        Raises
        ------
        ModelError, ParameterError
            The model cannot hold them.
        """
        if self._loaded is None:
            same = self._values == self._base.loaded.values
            self._loaded = self._base.loaded if same else with_overrides(self._base, self._values, whole=True)
        return self._loaded

    @property
    def home(self) -> FloatArray:
        """Actuated coordinates ``(na,)`` of the closed home pose."""
        return self.reference.home

    @cached_property
    def reference(self) -> MujocoReference:
        """MuJoCo's side of every comparison, with these parameters."""
        return MujocoReference(self.loaded.file, loaded=self.loaded)

    # formulas
    @cached_property
    def closed_form(self) -> Any:
        """The robot's kinematics and dynamics in closed form; None where nobody registered any."""
        return self._kind(self.parameters) if self._kind else None

    def _own(self, capability: str) -> Callable[..., Any] | None:
        found: Callable[..., Any] | None = getattr(self.closed_form, capability, None)
        return found

    @property
    def candidates(self) -> Mapping[str, Candidate]:
        """Formulas by name, a user's included where they were offered."""
        own: Mapping[str, Candidate] = self._kind.candidates if self._kind else {}
        return own if self._extra is None else OfferedCandidates(self._extra, own)  # type: ignore[arg-type]

    def offer(self, candidates: Mapping[str, Candidate]) -> None:
        """Add candidates to those of this robot, and of robots made from it."""
        self._extra = ChainMap(dict(candidates), *(self._extra.maps if self._extra else ()))

    def offer_kinematics(self, formulas: tuple[Any, ...]) -> None:
        """Add kinematics of a user's own, to be held against the reference."""
        self.offered_kinematics += formulas

    # kinematics

    def _checked(self, q: ArrayLike) -> FloatArray:
        array = as_batch("q", q, len(self.joints))
        refuse_degrees(self, array)
        return array

    def _at_rest(self, q: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        array = self._checked(q)
        return array, np.zeros_like(array), np.zeros_like(array)

    @one_or_many(1)
    def forward_kinematics(self, q: ArrayLike) -> FloatArray:
        """Task coordinates ``(n, m)`` from actuated coordinates ``(n, na)``, on the home branch."""
        own = self._own("forward_kinematics")
        return own(q) if own else self.reference.platform_motion(*self._at_rest(q), self.coordinates)[0]

    @one_or_many(3)
    def platform_motion(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Task coordinates, their rates and accelerations, each ``(n, m)``."""
        own = self._own("platform_motion")
        if own:
            moved: tuple[FloatArray, FloatArray, FloatArray] = own(q, qd, qdd)
            return moved
        return self.reference.platform_motion(self._checked(q), qd, qdd, self.coordinates)

    def platform_along(
        self, t: FloatArray, q: FloatArray, qd: FloatArray, qdd: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """As `platform_motion`, for samples that are one motion, in the order of times ``(n,)``.

        Closed forms know their branch from q alone; the reference, which closes loops step by step, follows the motion.
        """
        if self._own("platform_motion"):
            return self.platform_motion(q, qd, qdd)
        found = self.reference.inverse_dynamics(self._checked(q), qd, qdd, along=t)
        task, position = task_of(self.coordinates), (found.x, found.xd, found.xdd)
        x, xd, xdd = task_motion(task, position, found.rotation, found.omega, found.alpha)
        return continuous(task, x), xd, xdd

    @one_or_many(1)
    def jacobian(self, q: ArrayLike) -> FloatArray:
        """J of shape ``(n, m, na)`` with xd = J qd."""
        own = self._own("jacobian")
        return own(q) if own else self.reference.jacobian(q, self.coordinates)

    @one_or_many(1)
    def inverse_kinematics(self, x: ArrayLike, *branch: Any, **named: Any) -> FloatArray:
        """Actuated coordinates ``(n, na)`` from task coordinates ``(n, m)``, on the home branch.

        Further arguments are those of the robot's own closed form, such as the branch of each elbow.
        """
        own = self._own("inverse_kinematics")
        if not own:
            return self.reference.inverse_kinematics(x, self.coordinates)
        try:
            found: FloatArray = own(x, *branch, **named)
        except MotionError as error:
            raise (error if branch or named else with_nearest(error, self, x)) from None
        return found

    @one_or_many(3)
    def joint_motion(self, x: ArrayLike, xd: ArrayLike, xdd: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Actuated position, velocity and acceleration, each ``(n, na)``, from a motion in task coordinates."""
        own = self._own("joint_motion")
        return own(x, xd, xdd) if own else self.reference.joint_motion(x, xd, xdd, self.coordinates)

    def reach(self, x: ArrayLike) -> Reach:
        """Inverse kinematics that marks poses out of reach instead of refusing them; x ``(n, m)``."""
        own = self._own("reach")
        if own:
            found: Reach = own(x)
            return found
        seen = self.reference.reach(x, self.coordinates)
        return Reach(seen.q, seen.reachable, seen.measures, seen.condition)

    def reach_box(self) -> tuple[FloatArray, FloatArray]:
        """Corners ``(m,)`` of a box in task coordinates that holds what the joints' limits let the platform reach."""
        own = self._own("reach_box")
        return own(self.joint_limits) if own else reach_box(self)

    @one_or_many(1)
    def singularity_measures(self, q: ArrayLike) -> dict[str, FloatArray]:
        """Numbers that vanish at singular poses, name -> ``(n,)``, dimensionless, 1 far away."""
        own = self._own("singularity_measures")
        if own:
            found: dict[str, FloatArray] = own(q)
            return found
        return self.reference.singularity_measures(q, self.coordinates) if self.has_task else {}

    @cached_property
    def has_task(self) -> bool:
        """Whether the task coordinates are as many as the freedoms, so that they say where the robot is.

        Raises
        ------
        ParameterError
            The robot file states coordinates that the robot does not have.
        """
        if self._own("inverse_kinematics"):
            return True
        try:
            self.reference.check_coordinates(self.coordinates)
        except ParameterError as error:
            robot = self._description.robot
            if robot.spec.platform.coordinates is None:
                return False
            raise ParameterError(f"{robot.shown}: platform.coordinates: {error}", **error.facts) from error
        return True

    def assembly_solutions(self, q: ArrayLike) -> FloatArray:
        """Task coordinates of every assembly branch that is known, ``(n, k, m)``; at least the home branch."""
        own = self._own("assembly_solutions")
        return own(q) if own else self.forward_kinematics(q)[:, None, :]

    def mobility_count(self) -> dict[str, int]:
        """Freedoms counted on paper, by the formula that the robot's source uses; may be empty."""
        own = self._own("mobility_count")
        return own() if own else {}

    def conditions(self, q: ArrayLike) -> tuple[Condition, ...]:
        """Conditions that the robot's source states against singular poses, over a motion ``(n, na)``."""
        own = self._own("conditions")
        return own(q) if own else ()

    @property
    def closed_kinematics(self) -> bool:
        """Whether the platform's motion comes from a closed form, which the reference can be compared with."""
        return self._own("platform_motion") is not None

    # dynamics

    def torques(
        self,
        q: FloatArray,
        qd: FloatArray,
        qdd: FloatArray,
        mass_model: str,
        external_force: FloatArray,
        threads: int = 1,
    ) -> FloatArray:
        """Inverse dynamics on arrays of checked shape, without what `friction` holds; force ``(n, 3)``."""
        own = self._own("torques")
        if own:
            found: FloatArray = own(q, qd, qdd, mass_model, external_force, threads)
            return found
        return self.reference.inverse_dynamics(q, qd, qdd, mass_model, external_force).tau

    @property
    def has_friction(self) -> bool:
        """Whether `friction` may be anything but zero."""
        return bool(self.closed_form is not None and self.closed_form.has_friction)

    def friction(self, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        """What the actuators supply for friction and rotors beside `torques`, ``(n, na)``."""
        own = self._own("friction")
        return own(q, qd, qdd) if own else np.zeros_like(q)

    @one_or_many(3)
    def inverse_dynamics(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        qdd: ArrayLike,
        mass_model: str = "distributed",
        external_force: ArrayLike | None = None,
        threads: int = 1,
    ) -> FloatArray:
        """Actuator forces and torques that produce a motion, ``(n, na)``; see `ClosedForm.inverse_dynamics`."""
        if self._own("torques"):
            found: FloatArray = self.closed_form.inverse_dynamics(q, qd, qdd, mass_model, external_force, threads)
            return found
        return self.reference.inverse_dynamics(q, qd, qdd, mass_model, external_force).tau

    def kernel(self, mass_model: str = "distributed") -> TorqueKernel:
        """Inverse dynamics of one sample at a time, prepared for control loops.

        Returns
        -------
        TorqueKernel
            ``tau = kernel(q, qd, qdd, external_force=None, out=None)`` on float64 arrays ``(na,)``, friction included.
            Everything is compiled before this method returns. With *out* a call allocates nothing; the errors are those
            of `inverse_dynamics`, and *out* is not to be read after one. Other parameters need another kernel.

        Raises
        ------
        ParameterError
            The robot has no closed form to prepare.
        """
        own = self._own("kernel")
        if own is None:
            raise ParameterError(f"{self.name}: there is no closed form to prepare; call a formula of your own")
        found: TorqueKernel = own(mass_model)
        return found

    # what a reader should know

    def warnings(
        self,
        t: FloatArray,
        q: FloatArray,
        qd: FloatArray | None = None,
        measures: Mapping[str, FloatArray] | None = None,
    ) -> list[str]:
        """What a reader of a case's results should know: poses near a singularity, friction at rest, millimetres.

        Parameters
        ----------
        t, q, qd
            Times ``(n,)`` in seconds, actuated coordinates and, where friction matters, their rates ``(n, na)``.
        measures
            What `singularity_measures` gives at *q*, where it is at hand.
        """
        found = [] if qd is None or self.closed_form is None else self.closed_form.friction_warnings(qd)
        if self.closed_form is None:
            found += reference_warnings(self, qd)
        near = self.singularity_measures(q) if measures is None else measures
        return [*found, *near_singular_warnings(t, near), *self.millimetre_warnings()]

    def millimetre_warnings(self) -> list[str]:
        """Lengths that were most likely written in millimetres."""
        return millimetre_warnings(self._description.table, self._values)
