"""Forward replay: torques drive the MuJoCo model from the exact initial state; either it follows the motion or not.

Right torques leave only the error of time stepping, which halves with the step. Wrong torques leave an error that
stays, however small the step. So the replay judges torques with MuJoCo's *forward* dynamics and its own, soft loop
closures, which share nothing with the projection. The model is always the one with distributed masses, as the file has
it.

Open-loop driving is unstable where gravity, a force or the motion itself pushes the mechanism away from its course;
there any error, rounding included, grows exponentially and a long replay proves nothing. The window is therefore
shortened until the reference's own torques, and the same a thousandth too large, keep the mechanism near its course at
the coarsest step.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch

from workbench.arrays import FloatArray
from workbench.errors import ArrayError, MotionError
from workbench.mjcf.engine_warnings import engine_warnings
from workbench.reference.alike import first_alike
from workbench.reference.mujoco_reference import MujocoReference

COARSE_STEPS = 1000
"""Steps over the window at the coarsest step size; the other two take twice and four times as many."""

HALVINGS = (1, 2, 4)

LONGEST_WINDOW = 1.0
"""Seconds replayed at most, so that a case costs less than a second."""

PROBES = (1.0, 1.001)
"""The window is chosen with the reference's torques times these: as they are, and a thousandth too large. The second
shows how much the motion amplifies an error; that of time stepping alone may cancel by chance."""

NEAR = 0.1
"""The window ends where a probe, at the coarsest step, is off by this fraction of a joint's stroke."""

SHRINKINGS = 8
"""How often the window may be shortened; a smaller window has smaller steps, so the search ends soon."""

SMALLEST_STROKE = 1e-3
"""m or rad: a joint that (almost) holds still is measured against this."""

ORDER, ORDER_TOLERANCE = 1.0, 0.1
"""Time stepping by `implicitfast` with torques held over a step is of first order."""

STALLED = 0.5
"""Torques are wrong when extrapolation to a step of zero leaves more than this fraction of the error at the finest."""

LOST = 10.0
"""Strokes; an error beyond is no tracking error any more."""

IMPEDANCE = (0.9999, 0.9999)
"""Near-rigid loop closures, at any distance, with solref "2h 1" for step h; stiffer direct values diverge."""

SILENT, PULLING = 30, 29
"""Groups of actuators: the file's own, which are switched off, and the one that stands for an external force."""

REFERENCE = "reference"
"""Name of the reference's own torques among the replayed ones."""

MotionAt = Callable[[FloatArray], tuple[FloatArray, FloatArray, FloatArray]]
"""Times ``(n,)`` in s -> q, qd, qdd, each ``(n, na)``, SI."""

TorqueAt = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
"""q, qd, qdd ``(n, na)`` -> tau ``(n, na)``: a closed form with its external force bound in."""


@dataclass(frozen=True)
class Replay:
    """One candidate's replay at three step sizes."""

    steps: FloatArray
    """``(3,)`` step sizes, s, coarsest first"""
    peak_error: FloatArray
    """``(3, na)`` largest tracking error over the window per step size and joint, m or rad"""
    final_error: FloatArray
    """``(3, na)`` tracking error at the window's end; may pass through zero by chance, so no verdict rests on it"""
    order: float
    """observed order between the two finest steps, of the largest error in strokes; NaN where there is none"""
    worst_joint: str
    """the joint with the largest error in strokes at the finest step"""
    limit: float
    """peak error of that joint extrapolated to a step of zero, m or rad; never negative"""
    verdict: str
    """``converges``, ``stalls``, ``diverges`` or ``undecided``"""
    text: str
    """the verdict with its figures, for a table"""
    same_as: str = ""
    """whose simulation this is, where the torques are the same by `workbench.reference.alike`; empty: its own"""


@dataclass(frozen=True)
class ReplaySet:
    """Replays of several candidates over the same window."""

    start: float
    stop: float
    """the replayed window, s"""
    asked_stop: float
    limited_by: str
    """why the window ends before *asked_stop*: ``duration``, ``instability`` or nothing"""
    stroke: FloatArray
    """``(na,)`` normaliser per joint: the range of q over what was asked for, m or rad"""
    replays: dict[str, Replay]
    """by candidate; `REFERENCE` is always among them"""

    @property
    def note(self) -> str:
        """What a reader must know about the window."""
        shown = f"replayed {self.start:.4g} to {self.stop:.4g} s"
        if self.limited_by == "instability":
            return f"{shown} of {self.start:.4g} to {self.asked_stop:.4g} s: driven open-loop, this motion is unstable"
        if self.limited_by == "duration":
            return f"{shown} of {self.start:.4g} to {self.asked_stop:.4g} s"
        return shown


def motion_through(t: FloatArray, q: FloatArray, qd: FloatArray, qdd: FloatArray) -> MotionAt:
    """Return the piecewise quintic that has the given position, velocity and acceleration at every sample.

    Parameters
    ----------
    t
        Times ``(n,)``, s, strictly increasing, n >= 2.
    q, qd, qdd
        Each ``(n, na)``, SI.

    Raises
    ------
    ArrayError
        Fewer than two samples or lengths that differ. The returned function raises MotionError outside of *t*.
    """
    from scipy.interpolate import BPoly

    if not (len(t) == len(q) == len(qd) == len(qdd)) or len(t) < 2:
        raise ArrayError(
            f"t, q, qd, qdd: expected equal lengths of at least 2, got {[len(t), len(q), len(qd), len(qdd)]}"
        )
    position = BPoly.from_derivatives(t, np.stack([q, qd, qdd], axis=1))
    velocity = position.derivative()
    acceleration = velocity.derivative()
    first, last = float(t[0]), float(t[-1])
    slack = 1e-9 * (last - first)

    def motion_at(times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        if times.min() < first - slack or times.max() > last + slack:
            raise MotionError(
                f"replay: {times.min():g} to {times.max():g} s asked for; allowed: {first:g} to {last:g} s"
            )
        inside = np.clip(times, first, last)
        return position(inside), velocity(inside), acceleration(inside)

    return motion_at


def replay(
    reference: MujocoReference,
    motion_at: MotionAt,
    torques: Mapping[str, TorqueAt],
    start: float,
    stop: float,
    external_force: FloatArray | None = None,
) -> ReplaySet:
    """Drive the MuJoCo model with each candidate's torques, at three step sizes.

    Torques are held over each step at their value in its middle; the loops are near-rigid springs of MuJoCo's solver.

    Parameters
    ----------
    reference
        The robot.
    motion_at
        The motion as a function of time; see `motion_through` for samples.
    torques
        Candidates by name; the reference's own torques are replayed beside them under the name `REFERENCE`.
    start, stop
        Window, s; at most `LONGEST_WINDOW` of it is replayed.
    external_force
        One constant vector ``(3,)`` in newtons, paper frame, on the platform; it follows the platform's site.

    Returns
    -------
    ReplaySet
        A candidate that diverges or returns NaN gets a verdict, not an exception.

    Raises
    ------
    MotionError
        An empty window, or a motion that the reference cannot follow.
    ArrayError
        A candidate that returns another shape than ``(n, na)``.
    """
    if not stop > start:
        raise MotionError(f"replay: stop = {stop:g} s; allowed: > start = {start:g} s", value=stop, limit=start)
    force = np.zeros(3) if external_force is None else np.asarray(external_force, dtype=np.float64)
    if force.shape != (3,):
        raise ArrayError(f"external_force: a replay takes one constant vector of shape (3,), got {force.shape}")
    runner = _Runner(reference, motion_at, start, force)
    course = motion_at(_times(start, (stop - start) / COARSE_STEPS, COARSE_STEPS))[0]
    stroke = np.maximum(np.ptp(course, axis=0), SMALLEST_STROKE)
    window = min(stop - start, LONGEST_WINDOW)
    limited_by = "duration" if window < stop - start else ""

    for _ in range(SHRINKINGS):
        own = runner.torques({}, window, COARSE_STEPS)
        tracked = runner.run(np.concatenate([factor * own for factor in PROBES]), window, COARSE_STEPS)
        away = ~np.all(np.abs(tracked) <= NEAR * stroke, axis=(0, 2))
        if not away.any():
            break
        window *= max(int(np.argmax(away)), 1) / COARSE_STEPS
        limited_by = "instability"
    names = [REFERENCE, *torques]
    driven = [runner.torques(torques, window, k * COARSE_STEPS) for k in HALVINGS]
    first = first_alike(driven)
    simulated = sorted(set(first))
    errors = [runner.run(tau[simulated], window, k * COARSE_STEPS, k) for k, tau in zip(HALVINGS, driven, strict=True)]
    steps, labels = window / COARSE_STEPS / np.array(HALVINGS), _labels(reference)
    judged = [_judge(one, steps, stroke, labels) for one in np.stack(errors, axis=1)]
    replays = {
        name: dataclasses.replace(judged[simulated.index(i)], same_as="" if names[i] == name else names[i])
        for name, i in zip(names, first, strict=True)
    }
    return ReplaySet(start, start + window, stop, limited_by, stroke, replays)


class _Runner:
    """Runs torques on the model; all candidates of one step size as one batch."""

    def __init__(self, reference: MujocoReference, motion_at: MotionAt, start: float, force: FloatArray) -> None:
        self._reference, self._motion_at, self._start, self._force = reference, motion_at, start, force
        self._initial = reference.inverse_dynamics(*motion_at(np.array([start])), "distributed", force)
        self._last: tuple[FloatArray, FloatArray] = np.zeros(0), np.zeros(0)
        """times and the reference's torques: the last probe and the coarsest replay ask for the same"""

    def torques(self, torques: Mapping[str, TorqueAt], window: float, steps: int) -> FloatArray:
        """Torques in the middle of each step ``(1 + candidates, steps, na)``: the reference's own come first."""
        step = window / steps
        times = _times(self._start + 0.5 * step, step, steps)
        middle = self._motion_at(times)
        found = [self._own(times, middle)]
        for name, torque in torques.items():
            tau = np.asarray(torque(*middle), dtype=np.float64)
            if tau.shape != middle[0].shape:
                raise ArrayError(f'candidate "{name}": expected tau of shape {middle[0].shape}, got {tau.shape}')
            found.append(tau)
        return np.stack(found)

    def run(self, tau: FloatArray, window: float, steps: int, every: int = 1) -> FloatArray:
        """Joint coordinates less those of the motion, ``(k, steps / every, na)``, under torques ``(k, steps, na)``."""
        structure, count, step = self._reference.structure, len(tau), window / steps
        model = near_rigid(self._reference.spec(), step, self._pull())
        applied = np.zeros((count, steps, model.nv))
        applied[:, :, structure.actuated] = tau
        lost = ~np.isfinite(tau).all(axis=(1, 2))
        applied[lost] = 0.0
        batch = Batch(model, count, min(count, self._reference.threads))
        batch.qpos = np.repeat(self._initial.qpos, count, axis=0)
        batch.qvel = np.repeat(self._initial.qvel, count, axis=0)
        with quiet():
            record = batch.rollout(steps, applied, mujoco.mjtState.mjSTATE_QFRC_APPLIED.value, record=("qpos",))
        followed = record["qpos"][:, every - 1 :: every, :][:, :, structure.actuated_qpos]
        course = self._motion_at(_times(self._start + every * step, every * step, steps // every))[0]
        errors: FloatArray = followed - course
        errors[lost] = np.nan
        return errors

    def _own(self, times: FloatArray, middle: tuple[FloatArray, FloatArray, FloatArray]) -> FloatArray:
        if not np.array_equal(self._last[0], times):
            found = self._reference.inverse_dynamics(*middle, "distributed", self._force, along=times)
            self._last = times, found.tau
        return self._last[1]

    def _pull(self) -> tuple[str, FloatArray] | None:
        """The platform's site and the force on it ``(3,)``, world frame; None where there is none."""
        if not self._force.any():
            return None
        reference = self._reference
        name = reference.compiled().site(reference.structure.platform_site).name
        return name, reference.base_rotation @ self._force


@contextmanager
def quiet() -> Iterator[None]:
    """Keep MuJoCo from writing "unstable" to the terminal and to MUJOCO_LOG.TXT: that is a verdict here."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _times(first: float, step: float, count: int) -> FloatArray:
    times: FloatArray = first + step * np.arange(count, dtype=np.float64)
    return times


@engine_warnings()
def near_rigid(spec: mujoco.MjSpec, step: float, pull: tuple[str, FloatArray] | None = None) -> mujoco.MjModel:
    """Compile an MJCF for forward simulation.

    Parameters
    ----------
    spec
        A specification of its own, `MujocoReference.spec`.
    step
        Time step, s; loops and dry friction are as stiff as it allows.
    pull
        A site and a constant force on it ``(3,)``, N, world frame, which follows the site in every step.
    """
    option = spec.option
    option.timestep = step
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    option.iterations = 100
    option.tolerance = 1e-12
    # torques are applied to the joints themselves, whatever the actuators' gears and limits are
    flags = mujoco.mjtDisableBit
    option.disableflags |= flags.mjDSBL_CONTACT.value | flags.mjDSBL_AUTORESET.value | flags.mjDSBL_ISLAND.value
    for actuator in spec.actuators:
        actuator.group = SILENT
    option.disableactuator |= 1 << SILENT
    if pull is not None:
        _pull_at(spec, *pull)
    for equality in spec.equalities:
        equality.solref = [2.0 * step, 1.0]
        equality.solimp[:2] = IMPEDANCE
    # dry friction is a constraint too; with its soft defaults joints would creep
    for rubbing in (*spec.joints, *spec.tendons):
        rubbing.solref_friction = [2.0 * step, 1.0]
        rubbing.solimp_friction[:2] = IMPEDANCE
    return spec.compile()


def _pull_at(spec: mujoco.MjSpec, site: str, force: FloatArray) -> None:
    """Add an actuator whose force on a site is constant in the world: its gear is counted in a site of the world."""
    origin = spec.worldbody.add_site(name="workbench origin", pos=[0.0, 0.0, 0.0])
    actuator = spec.add_actuator(
        name="workbench pull",
        trntype=mujoco.mjtTrn.mjTRN_SITE,
        target=site,
        refsite=origin.name,
        gear=[*force.tolist(), 0.0, 0.0, 0.0],
        group=PULLING,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
    )
    actuator.gainprm[0] = 0.0
    actuator.biasprm[0] = 1.0  # times gear
    # keyframes hold as many controls as there were actuators
    for key in list(spec.keys):
        spec.delete(key)


def _labels(reference: MujocoReference) -> tuple[tuple[str, str], ...]:
    """Name and coordinate unit of each actuated joint."""
    model, slide = reference.compiled(), mujoco.mjtJoint.mjJNT_SLIDE.value
    kinds = np.asarray(model.jnt_type)[np.asarray(model.dof_jntid)[reference.structure.actuated]]
    return tuple(
        (name, "m" if kind == slide else "rad") for name, kind in zip(reference.joint_names, kinds, strict=True)
    )


def _judge(errors: FloatArray, steps: FloatArray, stroke: FloatArray, labels: tuple[tuple[str, str], ...]) -> Replay:
    """Verdict on tracking errors ``(3, samples, na)``, NaN where the replay was lost."""
    size = np.abs(errors)
    peak, final = size.max(axis=1), size[:, -1]
    relative = peak / stroke
    worst = int(np.argmax(np.where(np.isnan(relative[-1]), np.inf, relative[-1])))
    largest = relative.max(axis=1)
    joint, unit = labels[worst]
    order, limit = math.nan, math.nan
    if not np.isfinite(largest).all() or largest[-1] > LOST:
        verdict = "diverges"
        text = f"diverges: off by more than {LOST:g} strokes of {joint}, or not finite"
    elif largest[-1] == 0.0:
        verdict, text, limit = "converges", "converges: no error at any step", 0.0
    else:
        order = math.log2(largest[-2] / largest[-1]) if largest[-2] > 0.0 else -math.inf
        limit = max(0.0, 2.0 * float(peak[-1, worst]) - float(peak[-2, worst]))
        figures = ", ".join(f"{value:.2g}" for value in peak[:, worst])
        if abs(order - ORDER) <= ORDER_TOLERANCE:
            verdict, text = "converges", f"converges: order {order:.2f} ({joint}: {figures} {unit})"
        elif limit > STALLED * peak[-1, worst]:
            verdict, text = "stalls", f"stalls at {peak[-1, worst]:.2g} {unit} on {joint}"
        else:
            verdict, text = "undecided", f"undecided: order {order:.2f} ({joint}: {figures} {unit})"
    return Replay(steps, peak, final, order, joint, limit, verdict, text)
