"""MuJoCo evaluated on many samples at once: the only calls of the engine's forward pipeline.

Samples are evaluated in blocks that fit a processor's cache, whatever the size of a batch: memory stays small, and a
block's results do not depend on which thread computes it.
"""

from __future__ import annotations

import copy
import dataclasses
import os
import queue
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch

from workbench.arrays import FloatArray
from workbench.errors import ModelError, ParameterError
from workbench.mjcf.engine_warnings import EvaluationWarnings, engine_warnings
from workbench.reference.frames import Frames, place_frames
from workbench.reference.shelf import Shelf

LUMPED_INERTIA = 2e-15
"""kg m^2: what stands for "no rotational inertia"; MuJoCo refuses less than 1e-15. Against the smallest bar of the two
papers (1e-3 kg m^2) it is worth 1e-12."""

SAME_BODY = 1e-12
"""Relative: masses and inertias of two compilations that differ by more are those of two robots."""

NONE = Frames.of([])
"""No closure by bodies."""

BLOCK = 512
"""Samples evaluated at a time; some 3 kB each."""

SMALL = 128
"""Samples for which a short batch, such as the home pose, makes room: memory that is never used is not free."""

MOST_THREADS = 256


@engine_warnings()
def without_bar_inertia(spec: mujoco.MjSpec, bodies: tuple[str, ...], file: str) -> mujoco.MjModel:
    """Compile the model with the rotational inertia of the named bodies removed: the lumped-mass assumption.

    The specification is changed and compiled again; writing into a compiled model can be silently wrong.

    Raises
    ------
    ModelError
        Something in the file (a ``<compiler>`` option) gives the second model other masses than the first.
    """
    model = spec.compile()
    for name in bodies:
        body, index = spec.body(name), model.body(name).id
        # the compiled mass and mass centre, since the file may leave both to its geoms
        body.explicitinertial = True
        body.mass = model.body_mass[index]
        body.ipos = model.body_ipos[index]
        body.iquat = [1.0, 0.0, 0.0, 0.0]
        body.fullinertia = [np.nan] * 6
        body.inertia = [LUMPED_INERTIA] * 3
    lumped = spec.compile()
    wanted = np.array(model.body_inertia)
    wanted[[model.body(name).id for name in bodies]] = LUMPED_INERTIA
    for array, expected in (("body_mass", np.array(model.body_mass)), ("body_inertia", wanted)):
        found = np.asarray(getattr(lumped, array))
        if found.shape == expected.shape:
            off = ~np.isclose(found, expected, rtol=SAME_BODY, atol=0.0)
            if not off.any():
                continue
            body = int(np.argwhere(off)[0][0])
            said = f'body "{model.body(body).name}" has {found[body]} in it, expected {expected[body]}'
        else:
            said = f"{len(found)} bodies in place of {len(expected)}"
        raise ModelError(
            f"{file}: the model with lumped masses cannot be made, {array}: {said}; a <compiler> option of this file"
            " (settotalmass, boundinertia, fusestatic) changes masses or inertias",
            file=file,
            attribute=array,
        )
    return lumped


@dataclass(frozen=True)
class Poses:
    """Position-dependent quantities of a block of configurations, as MuJoCo computes them."""

    cdof: FloatArray
    com: FloatArray
    site_xpos: FloatArray
    site_xquat: FloatArray
    anchors: FloatArray

    @property
    def tables(self) -> tuple[FloatArray, ...]:
        """The arrays as the kernels take them."""
        return self.cdof, self.com, self.site_xpos, self.site_xquat, self.anchors


@dataclass(frozen=True)
class Dynamics:
    """Velocity-dependent quantities and inertia of a block of states."""

    cdof_dot: FloatArray
    mass: FloatArray
    """lower triangle of the mass matrix, ``(n, nM)``, in the sparse layout of the model"""
    bias: FloatArray
    """Coriolis, centrifugal and gravity forces, ``(n, nv)``"""
    passive: FloatArray
    """damping, springs, fluid, gravity compensation, ``(n, nv)``"""
    body_com: FloatArray
    energy: FloatArray
    """potential and kinetic, ``(n, 2)``, J"""

    @property
    def tables(self) -> tuple[FloatArray, ...]:
        """The arrays as the kernels take them."""
        return self.cdof_dot, self.mass, self.bias, self.passive, self.body_com


POSES = ("cdof", "subtree_com", "site_xpos", "site_xquat", "xanchor")
DYNAMICS = ("cdof_dot", "M", "qfrc_bias", "qfrc_passive", "xipos", "energy")


class ShapedBatch(Batch):  # type: ignore[misc]  # mujoco.batch comes without types
    """A batch that is told the shapes of MuJoCo's arrays: its own way to them takes longer than a short batch."""

    def __init__(self, model: mujoco.MjModel, room: int, shapes: mujoco.MjData) -> None:
        self._shapes = shapes
        super().__init__(model, room, 1)

    @property
    def _data(self) -> mujoco.MjData:
        return self._shapes


class Evaluator:
    """Evaluates up to *room* samples at a time; one thread's own."""

    def __init__(self, model: mujoco.MjModel, frames: Frames, room: int, shapes: mujoco.MjData) -> None:
        self.room = room
        """samples that it evaluates at a time"""
        self._batch = ShapedBatch(model, room, shapes)
        self.model = model
        """the model that is evaluated, a `lean` one"""
        self._poses = Poses(*(self._batch.bind(name) for name in POSES))
        self._dynamics = Dynamics(*(self._batch.bind(name) for name in DYNAMICS))
        self.qpos: FloatArray = self._batch.qpos
        """the configurations that `place` evaluates, ``(room, nq)``, to be written into"""
        self._qvel = self._batch.qvel
        self._all = np.arange(room, dtype=np.int32)
        self._frames = frames
        if len(frames):
            self._bodies = self._batch.bind("xpos"), self._batch.bind("xquat")
            self._sites = self._poses.site_xpos, self._poses.site_xquat
            self._places = tuple(np.zeros((room, model.nsite + len(frames), width)) for width in (3, 4))
            # for the kernels, arrays that may not be written to are another type; the engine's own may not
            shown = [array.view() for array in self._places]
            for array in shown:
                array.flags.writeable = False
            self._poses = dataclasses.replace(self._poses, site_xpos=shown[0], site_xquat=shown[1])

    def take_up(self, model: mujoco.MjModel, frames: Frames) -> None:
        """From now on evaluate another model of the same layout.

        Raises
        ------
        mujoco.FatalError
            It has another layout.
        """
        self._batch.set_models(model)
        self.model, self._frames = model, frames

    def place(self, ids: np.ndarray) -> Poses:
        """Evaluate positions of the listed rows of `qpos`; the arrays are valid until the next call."""
        self._batch.forward(ids, stage=mujoco.mjtStage.mjSTAGE_POS.value)
        return self._with_frames(ids)

    def _with_frames(self, ids: np.ndarray) -> Poses:
        """The poses, closures by bodies placed behind the sites."""
        frames = self._frames
        if len(frames):
            place_frames(
                ids, frames.bodies, frames.positions, frames.quaternions, *self._bodies, *self._sites, *self._places
            )
        return self._poses

    def move(self, qpos: FloatArray, qvel: FloatArray) -> tuple[Poses, Dynamics]:
        """Evaluate states ``(k, nq)``, ``(k, nv)``, k <= `room`; the arrays are valid until the next call."""
        count = len(qpos)
        self.qpos[:count] = qpos
        self._qvel[:count] = qvel
        self._batch.forward(self._all[:count], stage=mujoco.mjtStage.mjSTAGE_VEL.value)
        return self._with_frames(self._all[:count]), self._dynamics


def lean(model: mujoco.MjModel) -> mujoco.MjModel:
    """A copy that sets up no constraint forces, which are solved for elsewhere; nothing else depends on this."""
    flags, found = mujoco.mjtDisableBit, copy.copy(model)
    found.opt.disableflags |= flags.mjDSBL_CONSTRAINT.value | flags.mjDSBL_SENSOR.value
    found.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY.value
    return found


class Engine:
    """A model and its evaluators; results do not depend on the number of threads."""

    def __init__(
        self, model: mujoco.MjModel, threads: int = 1, frames: Frames = NONE, shelf: Shelf | None = None
    ) -> None:
        if not 1 <= threads <= MOST_THREADS:
            raise ParameterError(f"threads = {threads}; allowed: 1 to {MOST_THREADS}", value=threads)
        self.model = model
        self.threads = threads
        self._frames = frames
        self.shelf = shelf or Shelf()
        self._idle = self.shelf.evaluators
        self._lean = lean(model)
        self._pool: tuple[tuple[int, int], ThreadPoolExecutor] | None = None

    def poses(self, qpos: FloatArray) -> Poses:
        """Evaluate positions of a few configurations ``(k, nq)``, k <= `BLOCK`; the result is a copy."""
        evaluator = self._take(len(qpos))
        evaluator.qpos[: len(qpos)] = qpos
        with EvaluationWarnings():
            poses = evaluator.place(np.arange(len(qpos), dtype=np.int32))
        copies = [array[: len(qpos)].copy() for array in poses.tables]
        self._idle.put(evaluator)
        for copied in copies:
            # as the engine's own are: for the kernels, arrays that may be written to are another type
            copied.flags.writeable = False
        return Poses(*copies)

    def in_blocks(self, work: Callable[[Evaluator, slice], None], samples: int, size: int = BLOCK) -> None:
        """Call *work* for each block of samples, over the engine's threads; it writes its own rows of shared arrays."""

        def one(first: int) -> None:
            evaluator = self._take(min(size, samples, BLOCK))
            try:
                work(evaluator, slice(first, min(first + size, samples)))
            finally:
                self._idle.put(evaluator)

        starts = range(0, samples, size)
        with EvaluationWarnings():
            if self.threads == 1 or len(starts) == 1:
                for first in starts:
                    one(first)
            else:
                # a list, so that the error of the first sample at fault is raised, whichever thread meets one first
                for done in [self._workers().submit(one, first) for first in starts]:
                    done.result()

    def _take(self, samples: int) -> Evaluator:
        """An evaluator that has room for so many samples."""
        room = SMALL if samples <= SMALL else BLOCK
        while True:
            try:
                found = self._idle.get_nowait()
            except queue.Empty:
                return self._made(room)
            if found.room >= room:  # a smaller one is made for a short batch, and given up for a long one
                break
        if found.model is not self._lean:
            try:
                found.take_up(self._lean, self._frames)
            except mujoco.FatalError:  # bodies that MuJoCo calls simple have a smaller mass matrix
                return self._made(room)
        return found

    def _made(self, room: int) -> Evaluator:
        with self.shelf.data_of(self._lean) as shapes:
            return Evaluator(self._lean, self._frames, room, shapes)

    def _workers(self) -> ThreadPoolExecutor:
        # a forked process has no threads, whatever its parent had
        if self._pool is None or self._pool[0] != (os.getpid(), self.threads):
            self._pool = (os.getpid(), self.threads), ThreadPoolExecutor(self.threads, thread_name_prefix="workbench")
        return self._pool[1]


def mass_layout(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """Row and column of every entry of MuJoCo's sparse mass matrix (lower triangle)."""
    rows = np.repeat(np.arange(model.nv), model.M_rownnz).astype(np.int64)
    order = np.concatenate([np.arange(a, a + n) for a, n in zip(model.M_rowadr, model.M_rownnz, strict=True)])
    return rows, np.asarray(model.M_colind)[order].astype(np.int64)
