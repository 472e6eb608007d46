"""The translational 4-RPRP robot built from two planar loops, of [GarciaMurillo2016].

Frame: the paper's, y up, gravity (0, -g, 0). Limbs 1 and 3 turn about axes parallel to x and carry the ends of rod 1-3,
limbs 2 and 4 turn about axes parallel to z and carry rod 2-4; both rods slide in the platform. The equations stand in
`kernel`; this module gives them names, units, checks and errors.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray, as_batch, as_batches
from workbench.robots.assumptions.layout import Layout
from workbench.robots.closed_form import Candidate, ClosedForm, Condition, Reach, refuse_samples
from workbench.robots.kernel_call import TorqueKernel, fill_torques, one_sample
from workbench.robots.planar_4rprp import kernel
from workbench.robots.planar_4rprp import screws as screw_route
from workbench.robots.planar_4rprp.friction import Friction
from workbench.robots.planar_4rprp.kernel import SINGULAR
from workbench.robots.planar_4rprp.layout import LAYOUT
from workbench.robots.registration import closed_form

JOINTS = ("q1", "q2", "q3")

BAR_INERTIA = {"distributed": 1.0, "lumped": 0.0}
HOME_SOLUTION = 2
"""Index of the home branch (Px > 0, Py > 0) in `Planar4Rprp.forward_kinematics_all`: Table 2's third solution."""


@closed_form
class Planar4Rprp(ClosedForm):
    """Closed-form kinematics and inverse dynamics of the 4-RPRP robot."""

    layout: ClassVar[Layout] = LAYOUT

    def __init__(self, parameters: Any) -> None:
        """Build from the values of the robot's parameters, by name."""
        super().__init__(parameters)
        self._friction = Friction(parameters)
        self._has_friction = bool(self._friction)  # asked with every sample
        self._constants = {model: kernel.pack(parameters, factor) for model, factor in BAR_INERTIA.items()}

    def forward_kinematics(self, q: ArrayLike) -> FloatArray:
        """Position of P on the home branch, Px > 0 and Py > 0; [GarciaMurillo2016] eq. (14)-(16).

        Parameters
        ----------
        q
            Limb lengths q1, q2, q3, ``(n, 3)``, metres.

        Returns
        -------
        numpy.ndarray
            x ``(n, 3)`` in metres, paper frame.

        Raises
        ------
        MotionError
            A sample outside the workspace or at a singular pose, with its index and the joint.
        """
        return self._motion_at_rest(q)

    def forward_kinematics_all(self, q: ArrayLike) -> FloatArray:
        """All four solutions of the forward position problem, ``(n, 4, 3)`` in metres, in the order of Table 2.

        The signs of (Px, Py) are (+, -), (-, -), (+, +), (-, +); the third is the home branch (`HOME_SOLUTION`). A
        solution that is not real is NaN.

        Raises
        ------
        MotionError
            A length that is not positive; the message names sample and joint.
        """
        lengths = as_batch("q", q)
        self._refuse_lengths(lengths)
        q1, q2, q3 = lengths.T
        b, h = self._parameters.b, self._parameters.h
        z = 0.5 * (b + (q1 - q3) * (q1 + q3) / b)
        solutions = np.empty((len(lengths), 4, 3))
        with np.errstate(invalid="ignore"):
            height = np.sqrt((q1 - z) * (q1 + z))
            for index, (sign_x, sign_y) in enumerate(((1, -1), (-1, -1), (1, 1), (-1, 1))):
                low = sign_y * height - h
                across = sign_x * np.sqrt((q2 - low) * (q2 + low))
                solutions[:, index] = np.stack([across, sign_y * height, z], axis=1)
        solutions[np.isnan(solutions).any(axis=2)] = np.nan
        return solutions

    def inverse_kinematics(self, x: ArrayLike) -> FloatArray:
        """Limb lengths ``(n, 3)`` in metres from positions of P; [GarciaMurillo2016] eq. (9)-(11).

        Raises
        ------
        MotionError
            A position that is not on the home branch (Px > 0, Py > 0), or where limb 4 has no length.
        """
        points = as_batch("x", x)
        refuse_samples(points[:, 0] <= 0, "q2", "position is not on the home branch Px > 0", points, "x")
        refuse_samples(points[:, 1] <= 0, "q1, q3", "position is not on the home branch Py > 0", points, "x")
        p = self._parameters
        px, py, pz = points.T
        short = np.hypot(p.a - px, py - p.h) < SINGULAR * p.a
        refuse_samples(short, "q4", "singular pose: the passive limb 4 has no length", points, "x")
        return np.stack([np.hypot(py, pz), np.hypot(px, py - p.h), np.hypot(py, p.b - pz)], axis=1)

    def reach(self, x: ArrayLike) -> Reach:
        """Inverse kinematics on the home branch that marks positions out of reach; see `ClosedForm.reach`."""
        points = as_batch("x", x)
        p = self._parameters
        px, py, pz = points.T
        reachable = (px > 0) & (py > 0) & (np.hypot(p.a - px, py - p.h) >= SINGULAR * p.a)
        q = np.stack([np.hypot(py, pz), np.hypot(px, py - p.h), np.hypot(py, p.b - pz)], axis=1)
        q[~reachable] = np.nan
        condition = np.full(len(points), np.nan)
        with np.errstate(divide="ignore"):
            condition[reachable] = np.linalg.cond(self._rows(q[reachable], points[reachable]))
        measures = {name: np.where(reachable, value, np.nan) for name, value in self._measures(q, points).items()}
        return Reach(q, reachable, measures, condition)

    def reach_box(self, limits: tuple[tuple[float, float], ...]) -> tuple[FloatArray, FloatArray]:
        """Box that holds every position with limbs no longer than *limits* allow; see `ClosedForm.reach_box`."""
        longest = max(high for _, high in limits)
        p = self._parameters
        return np.array([0.0, 0.0, p.b - longest]), np.array([longest, longest, longest])

    def passive_length(self, q: ArrayLike) -> FloatArray:
        """Length q4 of the passive limb, ``(n,)`` in metres."""
        x = self._motion_at_rest(q)
        return self._passive_length(x)

    def reduced_jacobian(self, q: ArrayLike) -> FloatArray:
        """J_r, rows w1, w2, w3, shape ``(n, 3, 3)``, with J_r xd = qd; [GarciaMurillo2016] eq. (19)."""
        array = as_batch("q", q)
        return self._rows(array, self._motion_at_rest(array))

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """J = J_r^-1, shape ``(n, 3, 3)``, with xd = J qd."""
        array = as_batch("q", q)
        px, py, pz = self._motion_at_rest(array).T
        q1, q2, q3 = array.T
        b, low = self._parameters.b, py - self._parameters.h
        jacobian = np.zeros((len(array), 3, 3))
        jacobian[:, 2, 0], jacobian[:, 2, 2] = q1 / b, -q3 / b
        jacobian[:, 1, 0], jacobian[:, 1, 2] = q1 * (b - pz) / (b * py), q3 * pz / (b * py)
        jacobian[:, 0, :] = -(low / px)[:, None] * jacobian[:, 1, :]
        jacobian[:, 0, 1] = q2 / px
        return jacobian

    def platform_motion(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position, velocity and acceleration of P, each ``(n, 3)``, SI, paper frame.

        Raises
        ------
        MotionError
            A sample outside the workspace or at a singular pose, with its index and the joint.
        """
        arrays = as_batches(q=q, qd=qd, qdd=qdd)
        x, xd, xdd = (np.empty_like(arrays[0]) for _ in range(3))
        kernel.motion_batch(self._constants["distributed"], *arrays, x, xd, xdd)
        self._refuse_poses(arrays[0], x)
        return x, xd, xdd

    def joint_motion(self, x: ArrayLike, xd: ArrayLike, xdd: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Limb lengths, rates and accelerations, each ``(n, 3)``, from a platform motion on the home branch.

        Raises
        ------
        MotionError
            As `inverse_kinematics`.
        """
        points, velocities, accelerations = as_batches(x=x, xd=xd, xdd=xdd)
        q = self.inverse_kinematics(points)
        rows = self._rows(q, points)
        qd = np.einsum("nij,nj->ni", rows, velocities)
        # q qdd + qd^2 = r . xdd + |rd|^2, with rd the part of xd in the limb's plane
        planar = np.stack([_squared(velocities, 1, 2), _squared(velocities, 0, 1), _squared(velocities, 1, 2)], axis=1)
        qdd = np.einsum("nij,nj->ni", rows, accelerations) + (planar - qd**2) / q
        return q, qd, qdd

    def singularity_measures(self, q: ArrayLike) -> dict[str, FloatArray]:
        """``det J_r`` and ``q4 / a``, each ``(n,)`` without unit.

        det J_r = b Px Py / (q1 q2 q3) vanishes with Px or Py and at no other pose. Where q4 vanishes the passive limb
        has no direction, and its inertia no bound.

        Raises
        ------
        MotionError
            A sample outside the workspace. A singular pose is not refused here: its measure is zero.
        """
        array = as_batch("q", q)
        x = self._solve(array)
        self._refuse_unreachable(array, x)
        return self._measures(array, x)

    def assembly_solutions(self, q: ArrayLike) -> FloatArray:
        """All four solutions of the forward position problem, ``(n, 4, 3)``, in Table 2's order."""
        return self.forward_kinematics_all(q)

    def mobility_count(self) -> dict[str, int]:
        """Gogu's count, [GarciaMurillo2016] eq. (1)-(8), each dimension from the rank of screws."""
        from workbench.robots.planar_4rprp.mobility import gogu_mobility

        count = gogu_mobility(self._parameters)
        return {"joints p": count.p, "lost joint parameters r": count.r, "mobility M = p - r": count.mobility}

    def conditions(self, q: ArrayLike) -> tuple[Condition, ...]:
        """Section 5's conditions on the limb lengths and Figure 7's, which are neither necessary nor sufficient."""
        from workbench.robots.planar_4rprp.singularity import paper_singularity_conditions

        return tuple(
            Condition(
                name=condition.name,
                value=condition.value,
                relation=condition.relation,
                limit=condition.limit,
                holds=condition.holds,
                unit=condition.unit,
                note="" if condition.printed else "asked for by the text, not printed",
            )
            for condition in paper_singularity_conditions(self, q)
        )

    def condition_number(self, q: ArrayLike) -> FloatArray:
        """Condition number of J_r in the 2-norm, ``(n,)``: 1 is isotropic, infinity singular."""
        array = as_batch("q", q)
        x = self._solve(array)
        self._refuse_unreachable(array, x)
        result: FloatArray = np.linalg.cond(self._rows(array, x))
        return result

    def torques(
        self,
        q: FloatArray,
        qd: FloatArray,
        qdd: FloatArray,
        mass_model: str,
        external_force: FloatArray,
        threads: int = 1,
    ) -> FloatArray:
        """Inverse dynamics on arrays of checked shape; see `ClosedForm.torques`."""
        constants = self._constants[mass_model]
        tau = np.empty_like(q)
        if fill_torques(kernel.torques_batch, constants, q, qd, qdd, external_force, tau, threads):
            self._refuse_torques(q, qd, qdd, tau)
        return tau

    def kernel(self, mass_model: str = "distributed") -> TorqueKernel:
        """Inverse dynamics of one sample at a time, prepared for control loops; see `ClosedForm.kernel`."""
        self._check_mass_model(mass_model)

        def refuse(q: FloatArray, qd: FloatArray, qdd: FloatArray, force: FloatArray) -> None:
            self.torques(q, qd, qdd, mass_model, force)

        constants = self._constants[mass_model]
        return one_sample(kernel.torques_single, constants, refuse, self.friction if self.has_friction else None)

    def _refuse_torques(self, q: FloatArray, qd: FloatArray, qdd: FloatArray, tau: FloatArray) -> None:
        """Name the sample and the joint of a batch whose torques are not all finite."""
        self.platform_motion(q, qd, qdd)
        bad = ~np.isfinite(tau).all(axis=1)
        refuse_samples(bad, "q1, q2, q3", "rates so large that forces overflow", q, "q")

    @property
    def has_friction(self) -> bool:
        """Whether any joint has friction or a rotor."""
        return self._has_friction

    def friction(self, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        """What the actuators must supply for friction and rotors; see `ClosedForm.friction` and docs/friction.md."""
        if not self._friction:
            return np.zeros_like(q)
        x, xd, _ = self.platform_motion(q, qd, qdd)
        return self._friction.torques(qd, qdd, x, xd, self.jacobian(q))

    def friction_warnings(self, qd: FloatArray) -> list[str]:
        """Samples at which a joint with Coulomb friction rests; see `ClosedForm.friction_warnings`."""
        return self._friction.drives.warnings(qd)

    def _solve(self, q: FloatArray) -> FloatArray:
        x, unused_rate, unused_acceleration = (np.empty_like(q) for _ in range(3))
        zero = np.zeros_like(q)
        kernel.motion_batch(self._constants["distributed"], q, zero, zero, x, unused_rate, unused_acceleration)
        return x

    def _motion_at_rest(self, q: ArrayLike) -> FloatArray:
        array = as_batch("q", q)
        x = self._solve(array)
        self._refuse_poses(array, x)
        return x

    def _rows(self, q: FloatArray, x: FloatArray) -> FloatArray:
        """w1, w2, w3 as rows."""
        rows = np.zeros((len(q), 3, 3))
        rows[:, 0, 1], rows[:, 0, 2] = x[:, 1], x[:, 2]
        rows[:, 1, 0], rows[:, 1, 1] = x[:, 0], x[:, 1] - self._parameters.h
        rows[:, 2, 1], rows[:, 2, 2] = x[:, 1], x[:, 2] - self._parameters.b
        return rows / q[:, :, None]

    def _passive_length(self, x: FloatArray) -> FloatArray:
        result: FloatArray = np.hypot(self._parameters.a - x[:, 0], x[:, 1] - self._parameters.h)
        return result

    def _measures(self, q: FloatArray, x: FloatArray) -> dict[str, FloatArray]:
        determinant = self._parameters.b * x[:, 0] * x[:, 1] / np.prod(q, axis=1)
        return {"det J_r": determinant, "q4 / a": self._passive_length(x) / self._parameters.a}

    def _refuse_lengths(self, q: FloatArray) -> None:
        for column, joint in enumerate(JOINTS):
            refuse_samples(q[:, column] <= 0, joint, "limb length must be > 0", q, "q")

    def _refuse_unreachable(self, q: FloatArray, x: FloatArray) -> None:
        self._refuse_lengths(q)
        refuse_samples(np.isnan(x[:, 1]), "q1, q3", "limbs 1 and 3 cannot meet", q, "q")
        refuse_samples(np.isnan(x[:, 0]), "q2", "limb 2 is shorter than |Py - h|", q, "q")

    def _refuse_poses(self, q: FloatArray, x: FloatArray) -> None:
        self._refuse_unreachable(q, x)
        measures = self._measures(q, x)
        for (measure, value), joint in zip(measures.items(), ("q1, q2, q3", "q4"), strict=True):
            what = f"singular pose: {measure} below {SINGULAR:g}"
            refuse_samples(np.abs(value) < SINGULAR, joint, what, q, "q")


def _squared(vectors: FloatArray, first: int, second: int) -> FloatArray:
    result: FloatArray = vectors[:, first] ** 2 + vectors[:, second] ** 2
    return result


def _kernel_candidate(mass_model: str) -> Candidate:
    return Candidate(
        name=mass_model,
        mass_model=mass_model,
        function=lambda mech, q, qd, qdd, force: mech.inverse_dynamics(q, qd, qdd, mass_model, force),
        description=f"virtual work in platform coordinates, {mass_model} masses",
        source="docs/derivations/planar_4rprp.md",
    )


def _screw_candidate(name: str, description: str, moment_sign: float) -> Candidate:
    def torques(mech: Any, q: FloatArray, qd: FloatArray, qdd: FloatArray, external_force: FloatArray) -> FloatArray:
        x = mech.forward_kinematics(q)
        tau = screw_route.torques(mech.parameters, q, qd, qdd, x, external_force, moment_sign=moment_sign)
        friction: FloatArray = mech.friction(q, qd, qdd)
        return tau + friction

    return Candidate(name, "distributed", torques, description, "[GarciaMurillo2016] eq. (17)-(32)")


Planar4Rprp.candidates = {
    candidate.name: candidate
    for candidate in (
        _kernel_candidate("lumped"),
        _kernel_candidate("distributed"),
        _screw_candidate("screws", "screws, Lie screws, partial screws and virtual work", 1.0),
        _screw_candidate("screws-as-printed", "screws with the moments as printed, u x A in place of A x u", -1.0),
    )
}
