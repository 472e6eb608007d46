"""The reference: closed-chain inverse dynamics by MuJoCo, with the constraint forces projected out.

`mj_inverse` alone is wrong for closed chains, since its equality constraints are soft; see docs/reference.md.
"""

from __future__ import annotations

import copy
import dataclasses
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray, as_batch, as_batches, as_force, as_rows, same_lengths
from workbench.dry_friction import direction
from workbench.errors import ModelError, MotionError, ParameterError, did_you_mean
from workbench.mjcf.compile import custom_text
from workbench.mjcf.setup import Setup
from workbench.reference.along import refuse_jumps
from workbench.reference.body_forces import acts_on_bodies, felt_gravity
from workbench.reference.closure import LoopCloser
from workbench.reference.continuation import Assembly
from workbench.reference.engine import Engine, Evaluator, mass_layout, without_bar_inertia
from workbench.reference.freedoms import check_freedoms, refuse_locked
from workbench.reference.kernels import velocities
from workbench.reference.platform_closure import PlatformCloser
from workbench.reference.platform_side import PlatformSide
from workbench.reference.projection import projection, projection_room
from workbench.reference.reactions import named, reaction_rows
from workbench.reference.redundant import excess_actuators, leading, shared
from workbench.reference.result import Mobility, ReferenceResult, refuse_overflow
from workbench.reference.shelf import shelf_of
from workbench.reference.structure import Structure, structure_of
from workbench.reference.tolerance import few_digits_note, rank_of
from workbench.robots.load import LoadedModel, load_model

MASS_MODELS = ("distributed", "lumped")


class MujocoReference(PlatformSide):
    """Closed-chain inverse dynamics of an MJCF model.

    Parameters
    ----------
    path
        MJCF file; ``<custom>`` names ``base_body``, ``platform_site`` and ``lumped_bodies``.
    threads
        Threads for MuJoCo's own work; results are the same, bit for bit, for any number.
    loaded
        The same model with the same overrides where it is at hand; it becomes the reference's own.
    setup
        Actuated joints, platform and first guess of a file whose ``<custom>`` does not name them.
    **parameters
        Overrides by name, SI, as for `workbench.load_mechanism`.

    Raises
    ------
    ModelError
        The file does not compile, its loops cannot be closed, or it holds something that is not covered.
    ParameterError
        Unknown parameter or a value it may not have.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        threads: int = 1,
        loaded: LoadedModel | None = None,
        setup: Setup | None = None,
        **parameters: float,
    ) -> None:
        loaded = loaded or load_model(path, parameters, setup)
        self.file = loaded.file
        self.loaded = loaded
        self._threads = threads
        shelf = shelf_of(loaded.family)
        self._structure = shelf.structure = structure_of(loaded, shelf.structure)
        self._engines = {"distributed": Engine(loaded.model, threads, self._structure.frames, shelf)}
        self._mass_layout = mass_layout(loaded.model)
        self._closer = LoopCloser(self._engines["distributed"], self._structure)
        tables = self._closer.tables
        self._tables = tables.closures, tables.joints, tables.split, tables.bodies
        self._reaction_rows = reaction_rows(loaded.model, self._structure)
        self._leader: tuple[MujocoReference, np.ndarray] | None = None
        self._closed: tuple[FloatArray, Assembly, bool] | None = None
        self._platform: dict[tuple[str, ...], PlatformCloser] = {}
        self._locate_base()
        self._check_freedoms()

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Actuated joints, in actuator order."""
        return self._structure.joint_names

    @property
    def home(self) -> FloatArray:
        """Actuated coordinates ``(na,)`` of the closed home pose, m and rad."""
        home: FloatArray = self._closer.home[self._structure.actuated_qpos].copy()
        return home

    @property
    def actuated_slides(self) -> tuple[bool, ...]:
        """Which actuated joints slide; the others turn."""
        model = self._engines["distributed"].model
        kinds = [model.jnt_type[model.dof_jntid[dof]] for dof in self._structure.actuated]
        return tuple(bool(kind == mujoco.mjtJoint.mjJNT_SLIDE) for kind in kinds)

    @property
    def excess_actuators(self) -> int:
        """Actuators beyond the freedoms; where there are any, tau is of least norm and no reactions are known."""
        return len(self._structure.actuated) - len(self._leader[1]) if self._leader else 0

    @property
    def determining(self) -> tuple[MujocoReference, np.ndarray | slice]:
        """The same model driven by as many actuators as there are freedoms, and their places among all."""
        return self._leader or (self, slice(None))

    def tangent(self, q: FloatArray, ordered: bool = False, near: ArrayLike | Assembly | None = None) -> FloatArray:
        """All velocities per actuated one, ``(n, nv, na)``; samples closed as `inverse_dynamics` does."""
        return self._assemble(q, ordered, near).tangent

    @property
    def threads(self) -> int:
        """Threads that samples are evaluated over; no bit of a result depends on it."""
        return self._threads

    @threads.setter
    def threads(self, threads: int) -> None:
        self._threads = threads
        for engine in self._engines.values():
            engine.threads = threads
        if self._leader:
            self._leader[0].threads = threads

    def spec(self) -> mujoco.MjSpec:
        """A fresh specification of the model, to be changed and compiled."""
        return self.loaded.spec()

    @property
    def structure(self) -> Structure:
        """Tables of actuated and passive freedoms and of loop closures."""
        return self._structure

    @property
    def closer(self) -> LoopCloser:
        """What closes the loops, by the same rules for whoever moves the mechanism."""
        return self._closer

    @property
    def base_position(self) -> FloatArray:
        """``(3,)`` origin of the paper's frame, m, world."""
        found: FloatArray = self._base_position.copy()
        return found

    @property
    def base_rotation(self) -> FloatArray:
        """``(3, 3)``: world vector = base_rotation @ vector in the paper's frame."""
        return self._base_rotation.copy()

    def compiled(self, mass_model: str = "distributed") -> mujoco.MjModel:
        """MuJoCo's model under a mass assumption; to be read, not written.

        Raises
        ------
        ParameterError
            Unknown mass model.
        ModelError
            The file does not say which bars lose their inertia in the lumped model.
        """
        return self.engine(mass_model).model

    def with_model(self, model: mujoco.MjModel) -> MujocoReference:
        """The same mechanism with other masses: *model* differs from the compiled one in nothing else."""
        other = copy.copy(self)
        other._engines = {"distributed": Engine(model, self._threads, self._structure.frames)}
        if self._leader:
            other._leader = self._leader[0].with_model(model), self._leader[1]
        return other

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader of the results should know of the model, one line each."""
        found = self._structure.notes
        if self._closer.tolerance.few_digits:
            found += (few_digits_note(self._closer.tolerance, float(self._closer.at_home.residual[0])),)
        if self._structure.friction.passive.any():
            found += ("dry friction of a passive joint that rests counts as zero, the middle of what it may be",)
        return found

    def mobility(self) -> Mobility:
        """Count freedoms and redundant rows by rank at the home pose."""
        structure = self._structure
        jacobian = self._home_jacobian()
        loops = jacobian[: structure.loop_rows]
        rank = rank_of(loops, self._closer.tolerance)
        freedoms = jacobian.shape[1]
        idle = len(structure.idle)
        return Mobility(freedoms - rank - idle, freedoms, structure.loop_rows, rank, structure.loop_rows - rank, idle)

    def inverse_dynamics(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        qdd: ArrayLike,
        mass_model: str = "distributed",
        external_force: ArrayLike | None = None,
        *,
        along: ArrayLike | None = None,
        near: ArrayLike | Assembly | None = None,
    ) -> ReferenceResult:
        """Actuator forces that produce a motion, with everything needed to judge them.

        Parameters
        ----------
        q, qd, qdd
            Actuated position, velocity, acceleration, each ``(n, na)``, SI; samples need not form a trajectory.
        mass_model
            ``"distributed"``, the model as it is, or ``"lumped"``, bars without rotational inertia.
        external_force
            Newtons, base (paper) frame, acting on the platform site: ``(3,)`` or ``(n, 3)``.
        along
            Times ``(n,)``, s, of samples that are one motion: each is closed from its predecessor, and jumps are
            refused. None: every sample is closed from home by straight lines, which is another assembly where the
            motion runs around a cusp of the singular curve.
        near
            Closed configurations ``(n, nq)``, as `ReferenceResult.qpos`, from which the samples are closed instead; or
            the samples' own.

        Raises
        ------
        MotionError
            A sample that cannot be closed on the home branch, or a singular pose; the message names sample and joint.
            With *along* also a sample that jumps: farther from the one before than rates and step allow.
        ArrayError
            Wrong shapes or entries that are not finite.
        ParameterError
            Unknown mass model.
        """
        structure = self._structure
        q, qd, qdd = as_batches(len(structure.actuated), q=q, qd=qd, qdd=qdd)
        n = len(q)
        if n == 0:
            return self._no_samples(mass_model)
        if self._leader:
            return shared(*self._leader, structure, q, qd, qdd, mass_model, external_force, along, near)
        # for the kernels, arrays that may not be written to are another type
        qd, qdd = np.require(qd, requirements="W"), np.require(qdd, requirements="W")
        force = np.ascontiguousarray(as_force("external_force", external_force, n) @ self._base_rotation.T)
        engine = self.engine(mass_model)
        times = None if along is None else as_rows("along", np.reshape(along, (-1, 1)), 1)[:, 0]
        if times is not None:
            same_lengths(q=q, along=times)
        model, assembly = engine.model, self._assemble(q, along is not None, near)
        qpos, (qvel, qacc) = assembly.qpos, np.zeros((2, n, model.nv))
        tau, motion, energy = np.zeros_like(q), np.zeros((3, n, 3)), np.zeros((n, 2))
        turning = np.zeros((n, 3, 3)), np.zeros((n, 3)), np.zeros((n, 3))
        closure_residual, velocity_residual, acceleration_residual, condition = np.zeros((4, n))
        (rank, weakest), site = np.zeros((2, n), dtype=np.int64), structure.platform_site
        # the kernel fills a row for every body, also for fixed ones that follow the last joint
        reactions = np.zeros((len(structure.blocks) + model.nbody, n, 3))
        velocities(assembly.tangent, qd, qvel)
        platform = int(model.site_bodyid[site]), site
        masses, gravity = np.array(model.body_mass), felt_gravity(model)
        few_digits = self._closer.tolerance.few_digits
        slack = np.zeros((n if few_digits else 0, len(structure.actuated)))
        friction = structure.friction

        def block(evaluator: Evaluator, rows: slice) -> None:
            poses, dynamics = evaluator.move(qpos[rows], qvel[rows])
            if friction.inside:
                passive = dynamics.passive[: rows.stop - rows.start] + friction.force(qvel[rows])
                passive.flags.writeable = False
                dynamics = dataclasses.replace(dynamics, passive=passive)
            projection(
                *self._tables, poses.tables, dynamics.tables, self._mass_layout, platform, masses, gravity,
                self._base_rotation, self._base_position, qpos[rows], qvel[rows], assembly.tangent[rows], qdd[rows],
                force[rows], qacc[rows], tau[rows], closure_residual[rows], velocity_residual[rows],
                acceleration_residual[rows], rank[rows], condition[rows], weakest[rows], motion,
                tuple(array[rows] for array in turning), reactions, slack[rows], rows.start,
                projection_room(structure.rows, model.nv, len(structure.passive), model.nbody, rows.stop - rows.start),
            )  # fmt: skip
            energy[rows] = dynamics.energy[: rows.stop - rows.start]

        engine.in_blocks(block, n)
        # beyond this rate MuJoCo sets the state back; such samples are refused for their rates
        self._closer.confirm(np.where(np.abs(qvel).max(axis=1) < mujoco.mjMAXVAL, closure_residual, 0.0))
        self._refuse_singular(q, qd, rank, velocity_residual, weakest)
        refuse_overflow("torques", tau, qd)
        if times is not None:
            refuse_jumps(times, structure, self._closer.joints, qpos, qvel, qacc)
        # in MuJoCo dry friction is a constraint, so neither bias nor passive forces hold it
        tau += friction.actuated * direction(qd)
        known = {} if acts_on_bodies(model) else named(self._reaction_rows, reactions)
        return ReferenceResult(
            tau=tau, x=motion[0], xd=motion[1], xdd=motion[2], rotation=turning[0], omega=turning[1], alpha=turning[2],
            reactions=known, closure_residual=closure_residual, velocity_residual=velocity_residual,
            acceleration_residual=acceleration_residual, rank=rank, condition=condition, energy=energy,
            qpos=qpos.copy(), qvel=qvel, qacc=qacc, slack=slack if few_digits else np.zeros_like(tau),
        )  # fmt: skip

    def _no_samples(self, mass_model: str) -> ReferenceResult:
        """The result of an empty batch, with the shapes of any other."""
        home = self._closer.home[None, self._structure.actuated_qpos]
        one = self.inverse_dynamics(home, 0 * home, 0 * home, mass_model)
        arrays: dict[str, Any] = {
            field.name: {name: force[:0] for name, force in value.items()} if isinstance(value, dict) else value[:0]
            for field in dataclasses.fields(one)
            for value in [getattr(one, field.name)]
        }
        return ReferenceResult(**arrays)

    def engine(self, mass_model: str) -> Engine:
        """What evaluates the model under a mass assumption; errors as `compiled`."""
        if mass_model not in MASS_MODELS:
            raise ParameterError(f'unknown mass model "{mass_model}"{did_you_mean(mass_model, MASS_MODELS)}')
        if mass_model not in self._engines:
            names = custom_text(self._engines["distributed"].model, "lumped_bodies")
            if names is None:
                raise ModelError(
                    f'{self.file}: <custom> has no <text name="lumped_bodies">; the lumped model needs the names of the'
                    " bars that lose their rotational inertia",
                    file=self.file,
                )
            whole = self._engines["distributed"].model
            known = [whole.body(i).name for i in range(1, whole.nbody)]
            for name in names.split():
                if name not in known:
                    raise ModelError(
                        f'{self.file}: <text name="lumped_bodies"> names body "{name}"{did_you_mean(name, known)}',
                        file=self.file,
                    )
            self._engines[mass_model] = Engine(
                without_bar_inertia(self.spec(), tuple(names.split()), self.file),
                self._threads,
                self._structure.frames,
            )
        return self._engines[mass_model]

    def _assemble(self, q: FloatArray, ordered: bool = False, near: ArrayLike | Assembly | None = None) -> Assembly:
        if isinstance(near, Assembly):
            return near
        if near is not None:
            return self._closer.close_near(q, as_batch("near", near, len(self._closer.home)))
        if self._closed is None or self._closed[2] != ordered or not np.array_equal(self._closed[0], q):
            self._closed = (q.copy(), self._closer.close_along(q) if ordered else self._closer.close(q), ordered)
        return self._closed[1]

    def _locate_base(self) -> None:
        if self._structure.moves[self._structure.base].any():
            raise ModelError(f'{self.file}: the base body moves; <text name="base_body"> must name a fixed one')
        self._base_position, self._base_rotation = self._closer.base

    def _home_jacobian(self) -> FloatArray:
        return self._closer.jacobian(self._closer.home)

    def _check_freedoms(self) -> None:
        """Every passive freedom must follow from the actuated ones; there may be more actuators than needed."""
        structure, home = self._structure, self._home_jacobian()
        tolerance = self._closer.tolerance
        check_freedoms(structure, home, self._closer.jacobian_near_home, tolerance.relative)
        mobility = self.mobility().mobility
        if not mobility:
            refuse_locked(structure, home, tolerance)
        if tolerance.few_digits:
            excess = len(structure.actuated) - mobility
        else:
            excess = excess_actuators(home, structure.passive, structure.actuated)
        if excess > 0:
            columns, tables = leading(structure, home, rank_of(home, tolerance))
            self._leader = self._led_by(dataclasses.replace(tables, home_qpos=self._closer.home)), columns

    def _led_by(self, structure: Structure) -> MujocoReference:
        """The same model, driven by fewer of its actuators."""
        led = copy.copy(self)
        led._structure, led._leader, led._closed, led._platform = structure, None, None, {}
        led._closer = LoopCloser(self._engines["distributed"], structure)
        tables = led._closer.tables
        led._tables = tables.closures, tables.joints, tables.split, tables.bodies
        return led

    def _refuse_singular(
        self, q: FloatArray, qd: FloatArray, rank: np.ndarray, residual: FloatArray, weakest: np.ndarray
    ) -> None:
        structure = self._structure
        speed = np.maximum(np.abs(qd).max(axis=1), 1.0)
        bad = (rank < len(structure.passive)) | ~(residual <= self._closer.tolerance.velocity * speed)
        if bad.any():
            sample = int(np.argmax(bad))
            joint = structure.dof_names[int(weakest[sample])]
            shown = ", ".join(f"{n} = {v:.6g}" for n, v in zip(structure.joint_names, q[sample], strict=True))
            raise MotionError(
                f"sample {sample}, joint {joint}: singular pose at {shown}; the actuators do not determine the motion",
                sample=sample,
                joint=joint,
                value=q[sample].tolist(),
            )
