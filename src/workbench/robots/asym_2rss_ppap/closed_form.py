"""The asymmetric 2RSS+PPaP pick-and-place robot of [Almeida2010].

Frame: the paper's, x3 down, gravity (0, 0, +g). Left limb A-C-E is driven by q2, right limb B-D-F by q3, the slider of
the central limb by q1. The equations stand in `kernel`; this module gives them names, units, checks and
errors.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.arrays import FloatArray, as_batch, as_batches
from workbench.errors import MotionError, ParameterError
from workbench.robots.assumptions.layout import Layout
from workbench.robots.asym_2rss_ppap import kernel
from workbench.robots.asym_2rss_ppap.candidates import CANDIDATES
from workbench.robots.asym_2rss_ppap.friction import Friction
from workbench.robots.asym_2rss_ppap.kernel import SINGULAR
from workbench.robots.asym_2rss_ppap.layout import LAYOUT
from workbench.robots.closed_form import ClosedForm, Reach, refuse_samples
from workbench.robots.kernel_call import TorqueKernel, fill_torques, one_sample
from workbench.robots.mass_models import mass_model as mass_model_of
from workbench.robots.registration import closed_form
from workbench.robots.sine_cosine import LARGEST_ANGLE

ELBOWS = ("out", "in")

SAME_BRANCH = 1e-7
"""Positions that differ by less than this fraction of the parallelogram's length are the same pose."""


@closed_form
class Asym2rssPpap(ClosedForm):
    """Closed-form kinematics and inverse dynamics of the 2RSS+PPaP robot."""

    layout: ClassVar[Layout] = LAYOUT

    def __init__(self, parameters: Any) -> None:
        """Build from the values of the robot's parameters, by name."""
        super().__init__(parameters)
        self._friction = Friction(parameters)
        self._has_friction = bool(self._friction)  # asked with every sample
        self._constants = {model: kernel.pack(parameters, mass_model_of(model)) for model in self.mass_models}

    def forward_kinematics(self, q: ArrayLike) -> FloatArray:
        """Platform position on the branch where the platform hangs (larger x3); [Almeida2010] eq. (1).

        Parameters
        ----------
        q
            Actuated coordinates ``(n, 3)``: m, rad, rad.

        Returns
        -------
        numpy.ndarray
            x ``(n, 3)`` in metres, paper frame.

        Raises
        ------
        MotionError
            A sample outside the workspace or at a singular pose, with its index and the joint.
        """
        array = as_batch("q", q)
        zero = np.zeros_like(array)
        return self._motion(array, zero, zero)[0]

    def inverse_kinematics(self, x: ArrayLike, elbows: tuple[str, str] = ("out", "out")) -> FloatArray:
        """Actuated coordinates from platform positions.

        Parameters
        ----------
        x
            Platform positions ``(n, 3)`` in metres, paper frame.
        elbows
            Branch of the left and of the right arm: ``"out"``, away from the platform, as in the paper, or ``"in"``.

        Raises
        ------
        MotionError
            A position that an arm or the parallelogram cannot reach; the message names sample and joint.
        ParameterError
            Unknown elbow branch.
        """
        points = as_batch("x", x)
        for elbow in elbows:
            if elbow not in ELBOWS:
                raise ParameterError(f'unknown elbow branch "{elbow}"; valid: {", ".join(ELBOWS)}')
        q, problems = self._arm_angles(points, elbows)
        for bad, joint, what in problems:
            refuse_samples(bad, joint, what, points, "x")
        return q

    def reach(self, x: ArrayLike) -> Reach:
        """Inverse kinematics, elbows out, that marks positions out of reach; see `ClosedForm.reach`."""
        points = as_batch("x", x)
        q, problems = self._arm_angles(points, ("out", "out"))
        n = len(points)
        found, rate, acceleration, determinants = (np.full((n, 3), np.nan) for _ in range(4))
        jacobian = np.full((n, 3, 3), np.nan)
        zero = np.zeros_like(q)
        kernel.motion_batch(
            self._constants["distributed"], q, zero, zero, found, rate, acceleration, jacobian, determinants
        )
        # the platform hangs: a position on the other assembly branch has the same q and is not reached
        reachable = np.abs(found - points).max(axis=1) < SAME_BRANCH * self._parameters.a5
        reachable &= np.isfinite(jacobian).all(axis=(1, 2))
        for bad, _, _ in problems:
            reachable &= ~bad
        q[~reachable] = np.nan
        condition = np.full(n, np.nan)
        p = self._parameters
        scaled = jacobian[reachable] / [1.0, p.a1_left, p.a1_right]
        with np.errstate(divide="ignore"):
            condition[reachable] = np.linalg.cond(scaled)
        measures = {name: np.where(reachable, value, np.nan) for name, value in self._scaled(determinants).items()}
        return Reach(q, reachable, measures, condition)

    def reach_box(self, limits: tuple[tuple[float, float], ...]) -> tuple[FloatArray, FloatArray]:
        """Box that holds the workspace; see `ClosedForm.reach_box`."""
        p = self._parameters
        along = min(p.a2_left, p.a2_right)
        across, depth = p.a5, min(p.a1_left + p.a2_left, p.a1_right + p.a2_right)
        return np.array([-along, -across, -depth]), np.array([along, across, depth])

    def _arm_angles(
        self, points: FloatArray, elbows: tuple[str, str]
    ) -> tuple[FloatArray, list[tuple[NDArray[np.bool_], str, str]]]:
        """Actuated coordinates, and for each way to be out of reach the samples, the joint and the words for it."""
        p = self._parameters
        problems: list[tuple[NDArray[np.bool_], str, str]] = []
        x1, x2, x3 = points.T
        q = np.empty_like(points)
        q[:, 0] = x1
        sides = (
            ("q2", -(x2 + p.L_left - p.l_left), p.a1_left, p.a2_left, elbows[0]),
            ("q3", x2 - (p.L_right - p.l_right), p.a1_right, p.a2_right, elbows[1]),
        )
        for column, (joint, outward, a1, a2, elbow) in enumerate(sides, start=1):
            # the arm points along (cos q, sin q) in (outward, x3); |p - a1 d|^2 + x1^2 = a2^2 gives its angle to p
            distance = np.hypot(outward, x3)
            with np.errstate(divide="ignore", invalid="ignore"):
                cosine = (distance**2 + x1**2 + a1**2 - a2**2) / (2 * a1 * distance)
                angle = np.arccos(cosine)
            problems.append((~np.isfinite(angle), joint, "position is out of reach of the limb"))
            q[:, column] = np.arctan2(x3, outward) + (-angle if elbow == "out" else angle)
        problems.append((np.abs(x2) >= p.a5, "q1", f"|x2| reaches the parallelogram's length {p.a5:g} m"))
        return q, problems

    def jacobian(self, q: ArrayLike) -> FloatArray:
        """J = J_x^-1 J_q, shape ``(n, 3, 3)``, with xd = J qd; [Almeida2010] eq. (2), with the sign of J_q33 mended."""
        array = as_batch("q", q)
        zero = np.zeros_like(array)
        return self._motion(array, zero, zero)[3]

    def platform_motion(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position, velocity and acceleration of the platform, each ``(n, 3)``, SI, paper frame."""
        x, xd, xdd, _, _ = self._motion(*as_batches(q=q, qd=qd, qdd=qdd))
        return x, xd, xdd

    def mobility_count(self) -> dict[str, int]:
        """Gogu's count, each dimension from the rank of screws; the paper states M = 3 without one."""
        from workbench.robots.asym_2rss_ppap.mobility import generic_poses, gogu_mobility

        for q in generic_poses(self._parameters):  # the count is structural: any pose without symmetry tells it
            try:
                x = self.forward_kinematics(q[None, :])[0]
            except MotionError:
                continue
            if abs(x[1]) < self._parameters.a5:
                return gogu_mobility(self._parameters, x, q)
        return {}

    def joint_motion(self, x: ArrayLike, xd: ArrayLike, xdd: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Actuated motion from a platform motion, elbows out.

        Raises
        ------
        MotionError
            A sample out of reach, or an arm in line with its rod (J_q singular).
        """
        points, velocities, accelerations = as_batches(x=x, xd=xd, xdd=xdd)
        p = self._parameters
        q = self.inverse_kinematics(points)
        qd, qdd = np.empty_like(q), np.empty_like(q)
        qd[:, 0], qdd[:, 0] = velocities[:, 0], accelerations[:, 0]
        sides = (("q2", 1, -1.0, p.L_left, p.l_left, p.a1_left), ("q3", 2, 1.0, p.L_right, p.l_right, p.a1_right))
        for joint, column, side, base, platform, a1 in sides:
            sine, cosine = np.sin(q[:, column]), np.cos(q[:, column])
            still = np.zeros_like(sine)
            tip = np.stack([still, side * (base + a1 * cosine), a1 * sine], axis=1)
            tangent = np.stack([still, -side * a1 * sine, a1 * cosine], axis=1)
            inward = np.stack([still, -side * a1 * cosine, -a1 * sine], axis=1)
            rod = points + np.array([0.0, side * platform, 0.0]) - tip
            lever = np.sum(rod * tangent, axis=1)
            short = np.abs(lever) < SINGULAR * a1 * np.linalg.norm(rod, axis=1)
            refuse_samples(short, joint, "singular pose: arm and rod in line (J_q)", points, "x")
            rate = np.sum(rod * velocities, axis=1) / lever
            relative = velocities - tangent * rate[:, None]
            needed = np.sum(rod * (accelerations - inward * rate[:, None] ** 2), axis=1)
            qd[:, column] = rate
            qdd[:, column] = (needed + np.sum(relative**2, axis=1)) / lever
        return q, qd, qdd

    def singularity_measures(self, q: ArrayLike) -> dict[str, FloatArray]:
        """``det J_x``, ``J_q22`` and ``J_q33``, each ``(n,)`` and divided by the lengths of the bars involved."""
        array = as_batch("q", q)
        zero = np.zeros_like(array)
        return self._scaled(self._motion(array, zero, zero)[4])

    def torques(
        self,
        q: FloatArray,
        qd: FloatArray,
        qdd: FloatArray,
        mass_model: str,
        external_force: FloatArray,
        threads: int = 1,
    ) -> FloatArray:
        """Inverse dynamics on arrays of checked shape; see `ClosedForm.torques`.

        *mass_model* may be any that `workbench.robots.mass_models.mass_model` knows.
        """
        constants = self._constants_of(mass_model)
        tau = np.empty_like(q)
        if fill_torques(kernel.torques_batch, constants, q, qd, qdd, external_force, tau, threads):
            self._refuse_torques(q, qd, qdd, tau)
        return tau

    def kernel(self, mass_model: str = "distributed") -> TorqueKernel:
        """Inverse dynamics of one sample at a time, prepared for control loops; see `ClosedForm.kernel`."""
        self._check_mass_model(mass_model)

        def refuse(q: FloatArray, qd: FloatArray, qdd: FloatArray, force: FloatArray) -> None:
            self.torques(q, qd, qdd, mass_model, force)

        constants = self._constants_of(mass_model)
        return one_sample(kernel.torques_single, constants, refuse, self.friction if self.has_friction else None)

    def _refuse_torques(self, q: FloatArray, qd: FloatArray, qdd: FloatArray, tau: FloatArray) -> None:
        """Name the sample and the joint of a batch whose torques are not all finite."""
        self._motion(q, qd, qdd)
        bad = ~np.isfinite(tau).all(axis=1)
        refuse_samples(bad, "q1, q2, q3", "rates so large that torques overflow", q, "q")

    def _constants_of(self, mass_model: str) -> FloatArray:
        if mass_model not in self._constants:
            self._constants[mass_model] = kernel.pack(self._parameters, mass_model_of(mass_model))
        return self._constants[mass_model]

    @property
    def has_friction(self) -> bool:
        """Whether any joint has friction or a rotor."""
        return self._has_friction

    def friction(self, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> FloatArray:
        """What the actuators must supply for friction and rotors; see `ClosedForm.friction` and docs/friction.md."""
        if not self._friction:
            return np.zeros_like(q)
        x, xd, _, jacobian, _ = self._motion(q, qd, qdd)
        return self._friction.torques(q, qd, qdd, x, xd, jacobian)

    def friction_warnings(self, qd: FloatArray) -> list[str]:
        """Samples at which a joint with Coulomb friction rests; see `ClosedForm.friction_warnings`."""
        return self._friction.drives.warnings(qd)

    def _motion(
        self, q: FloatArray, qd: FloatArray, qdd: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """x, xd, xdd, J and the raw determinants on checked arrays; refuses samples that are no pose."""
        n = len(q)
        x, xd, xdd, determinants = (np.empty((n, 3)) for _ in range(4))
        jacobian = np.empty((n, 3, 3))
        kernel.motion_batch(self._constants["distributed"], q, qd, qdd, x, xd, xdd, jacobian, determinants)
        p = self._parameters
        rod = min(p.a2_left, p.a2_right)
        turned = np.abs(q[:, 1:]).max(axis=1, initial=0.0)
        refuse_samples(turned > LARGEST_ANGLE, "q2, q3", f"an angle exceeds {LARGEST_ANGLE:g} rad", q, "q")
        refuse_samples(np.abs(q[:, 0]) > rod, "q1", f"|q1| exceeds the rod length {rod:g} m", q, "q")
        refuse_samples(np.isnan(x).any(axis=1), "q2, q3", "the rods cannot meet at the platform", q, "q")
        refuse_samples(np.abs(x[:, 1]) >= p.a5, "q2, q3", f"|x2| reaches the parallelogram's length {p.a5:g} m", q, "q")
        joints = {"det J_x": "q2, q3", "J_q22": "q2", "J_q33": "q3"}
        for measure, value in self._scaled(determinants).items():
            what = f"singular pose: |{measure}| below {SINGULAR:g} of its scale"
            refuse_samples(np.abs(value) < SINGULAR, joints[measure], what, q, "q")
        return x, xd, xdd, jacobian, determinants

    def _scaled(self, determinants: FloatArray) -> dict[str, FloatArray]:
        p = self._parameters
        return {
            "det J_x": determinants[:, 0] / (p.a2_left * p.a2_right),
            "J_q22": determinants[:, 1] / (p.a1_left * p.a2_left),
            "J_q33": determinants[:, 2] / (p.a1_right * p.a2_right),
        }


Asym2rssPpap.candidates = CANDIDATES
