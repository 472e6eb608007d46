"""Forward dynamics that can be believed: the closed chain moved on under given torques, in its actuated coordinates.

Machine code of the package's own computes M(q) and h(q, qd) (`workbench.reference.forward_kernels`) and moves on by a
method of order four. Before a plant is handed out its numbers are held against the reference's inverse dynamics, which
MuJoCo evaluates: whatever acts in the model and is not known here is refused, not left out.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from workbench.arrays import FloatArray
from workbench.errors import ModelError, MotionError
from workbench.reference.bench import bench
from workbench.reference.body_forces import felt_gravity
from workbench.reference.forward_kernels import DONE, OPEN, Masses, accelerations, hold, move, room_for
from workbench.reference.mujoco_reference import MujocoReference
from workbench.reference.sides import UNKNOWN

AGREE = 1e-9
"""Of the largest torque: by more the plant's M and h may not differ from the reference's inverse dynamics."""

PROBES = 6
"""States, near home, at which they are held against each other."""

REACH = 0.02
"""rad, or part of the robot's size in m: how far from home they are."""

SOFT_SPEED = 1e-2
"""rad/s or m/s: dry friction grows to its full size over so much speed, F tanh(v / soft). A sharper step needs shorter
steps in time; a joint at rest creeps by up to so much a second in place of sticking."""


class Plant:
    """A robot's model to be moved on in time; one state at a time.

    Parameters
    ----------
    reference
        The robot, with as many actuators as freedoms.
    external_force
        Newtons, base frame, constant, on the platform's site ``(3,)``.

    Raises
    ------
    ModelError
        More actuators than freedoms, or a model in which more acts than is covered.
    """

    def __init__(self, reference: MujocoReference, external_force: FloatArray | None = None) -> None:
        closer = reference.closer
        if reference.excess_actuators or closer.mechanism is None:
            why = (
                f"{reference.excess_actuators} actuator(s) more than freedoms: their torques share a motion"
                if reference.excess_actuators
                else "its positions do not follow from joints alone (mocap bodies, flexes, plugins)"
            )
            raise ModelError(f"{reference.file}: control is not covered for this robot, {why}", file=reference.file)
        self.reference = reference
        self._mechanism = closer.mechanism
        self._rules = closer.rules()
        force = np.zeros(3) if external_force is None else reference.base_rotation @ np.asarray(external_force)
        masses = masses_of(reference, force)
        self._bench, self._room = bench(self._mechanism), room_for(self._mechanism)
        self._held = self._hold(masses)
        self._base_rotation, self._base_position = reference.base_rotation, reference.base_position
        self._force = np.zeros(3) if external_force is None else np.array(external_force, dtype=np.float64)
        self._check(masses)

    @property
    def q(self) -> FloatArray:
        """Actuated coordinates ``(na,)`` now; a view."""
        return self._room.q

    @property
    def qd(self) -> FloatArray:
        """Their rates now; a view."""
        return self._room.qd

    @property
    def qpos(self) -> FloatArray:
        """All coordinates ``(nq,)`` now; a view."""
        return self._bench.here

    @property
    def mass(self) -> FloatArray:
        """M ``(na, na)`` now, kg, kg m and kg m^2; a copy."""
        return self._room.mass.copy()

    @property
    def bias(self) -> FloatArray:
        """H ``(na,)`` now: what the actuators supply at qdd = 0, N and N m; a copy."""
        return self._room.bias.copy()

    @property
    def platform(self) -> FloatArray:
        """The platform's site ``(3,)``, m, base frame."""
        found: FloatArray = (self._room.site - self._base_position) @ self._base_rotation
        return found

    @property
    def size(self) -> float:
        """The robot's size, m."""
        return float(self.reference.closer.tolerance.size)

    def begin(self, q: FloatArray, qd: FloatArray) -> None:
        """Stand at a state ``(na,)``, on the home branch.

        Raises
        ------
        MotionError
            The loops cannot be closed there.
        """
        qpos = self.reference.closer.close(np.array(q, dtype=np.float64)[None]).qpos[0].copy()
        bench, room = self._bench, self._room
        room.q[:], room.qd[:], room.carried_here[:] = q, qd, 0.0
        bench.here[:], bench.tangent_here[:], bench.sides[:] = qpos, 0.0, UNKNOWN
        if move(self._held, np.zeros(len(room.q)), 0.0, 1, True) != DONE:
            raise MotionError(
                "control: the loops cannot be closed where the motion begins", value=np.asarray(q).tolist()
            )

    def move(self, tau: FloatArray, duration: float, steps: int) -> int:
        """Move on by *duration* seconds under constant torques ``(na,)`` in so many steps: `DONE`, `OPEN` or `LOST`.

        Unless it is `DONE`, the state is that of the last step that was.
        """
        if not all(map(math.isfinite, tau.tolist())):
            raise ValueError("torques have to be finite")
        return int(move(self._held, tau, duration, steps, False))

    def acceleration(self, tau: FloatArray) -> FloatArray:
        """Accelerations ``(na,)`` under torques, now."""
        qdd = np.zeros_like(self._room.q)
        accelerations(self._room, np.array(tau, dtype=np.float64), qdd)
        return qdd

    def _hold(self, masses: Masses) -> object:
        return hold(self._mechanism, self._rules, masses, self._bench, self._room)

    def _check(self, masses: Masses) -> None:
        """Hold M and h against the reference's inverse dynamics, at home and around it."""
        reference, na = self.reference, len(self._room.q)
        random = np.random.default_rng(2010)
        reach = np.where(reference.actuated_slides, REACH * self.size, REACH)
        q = reference.home + reach * random.uniform(-1.0, 1.0, (PROBES, na))
        q[0] = reference.home
        qd = 50.0 * reach * random.uniform(-1.0, 1.0, (PROBES, na))
        qdd = 1000.0 * reach * random.uniform(-1.0, 1.0, (PROBES, na))
        wanted = reference.inverse_dynamics(q, qd, qdd, "distributed", self._force).tau
        self._held = self._hold(masses._replace(soft=1e-300))
        found = np.zeros_like(wanted)
        for sample in range(PROBES):
            self.begin(q[sample], qd[sample])
            found[sample] = self._room.mass @ qdd[sample] + self._room.bias
        self._held = self._hold(masses)
        scale = np.maximum(np.abs(wanted).max(axis=0), AGREE)
        off = np.abs(found - wanted).max(axis=0) / scale
        joint = int(np.argmax(np.where(np.isnan(off), np.inf, off)))
        if not off[joint] <= AGREE:
            raise ModelError(
                f"{reference.file}: control is not covered for this model: on joint"
                f" {reference.joint_names[joint]} something acts (tendon, fluid, spring or damper of another kind)"
                f" that changes its torque by {off[joint]:.3g} of its largest",
                file=reference.file,
                joint=reference.joint_names[joint],
                value=float(off[joint]),
            )


def masses_of(reference: MujocoReference, force: FloatArray) -> Masses:
    """Read what moves and what acts from the compiled model; *force* ``(3,)`` on the platform in the world's frame."""
    model, structure = reference.compiled(), reference.structure
    inertia = np.zeros((model.nbody, 3, 3))
    for body in range(model.nbody):
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.body_iquat[body])
        axes = turn.reshape(3, 3)
        inertia[body] = axes @ np.diag(model.body_inertia[body]) @ axes.T
    stiffness, rest = np.zeros((2, model.nv))
    address = np.zeros(model.nv, dtype=np.int64)
    for joint in range(model.njnt):
        if model.jnt_type[joint] in (mujoco.mjtJoint.mjJNT_SLIDE.value, mujoco.mjtJoint.mjJNT_HINGE.value):
            dof = model.jnt_dofadr[joint]
            address[dof] = model.jnt_qposadr[joint]
            stiffness[dof] = model.jnt_stiffness[joint]
            rest[dof] = model.qpos_spring[address[dof]]
    off = int(model.opt.disableflags)
    flags = mujoco.mjtDisableBit
    springs = 0.0 if off & flags.mjDSBL_SPRING.value else 1.0
    dampers = 0.0 if off & flags.mjDSBL_DAMPER.value else 1.0
    dry = structure.friction.passive.copy()
    dry[structure.actuated] += structure.friction.actuated
    site = structure.platform_site
    return Masses(
        mass=np.array(model.body_mass),
        centre=np.array(model.body_ipos),
        inertia=inertia,
        pull=np.array(felt_gravity(model)),
        armature=np.array(model.dof_armature),
        damping=dampers * np.array(model.dof_damping),
        dry=dry,
        soft=SOFT_SPEED,
        stiffness=springs * stiffness,
        rest=rest,
        address=address,
        platform=int(model.site_bodyid[site]),
        site=np.array(model.site_pos[site]),
        force=np.array(force, dtype=np.float64),
    )


__all__ = ["DONE", "OPEN", "Plant", "masses_of"]
