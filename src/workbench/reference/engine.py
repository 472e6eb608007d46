"""MuJoCo evaluated on many samples at once: the only calls of the engine's forward pipeline."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch

from workbench.arrays import FloatArray

LUMPED_INERTIA = 2e-15
"""kg m^2: what stands for "no rotational inertia"; MuJoCo refuses less than 1e-15. Against the smallest bar of the two
papers (1e-3 kg m^2) it is worth 1e-12."""


def without_bar_inertia(text: str, bodies: tuple[str, ...]) -> mujoco.MjModel:
    """Compile the model with the rotational inertia of the named bodies removed: the lumped-mass assumption.

    The specification is changed and compiled again; writing into a compiled model can be silently wrong.
    """
    spec = mujoco.MjSpec.from_string(text)
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
    return spec.compile()


@dataclass(frozen=True)
class Poses:
    """Position-dependent quantities of n configurations, as MuJoCo computes them."""

    cdof: FloatArray
    com: FloatArray
    site_xpos: FloatArray
    site_xquat: FloatArray
    anchors: FloatArray


@dataclass(frozen=True)
class Dynamics:
    """Velocity-dependent quantities and inertia of n states."""

    cdof_dot: FloatArray
    mass: FloatArray
    bias: FloatArray
    """Coriolis, centrifugal and gravity forces less passive ones (damping), ``(n, nv)``"""
    body_xpos: FloatArray
    body_com: FloatArray
    inertia_frame: FloatArray
    energy: FloatArray
    """potential and kinetic, ``(n, 2)``, J"""


class Engine:
    """A model with batches of the sizes asked for; results do not depend on the number of threads."""

    def __init__(self, model: mujoco.MjModel, threads: int = 1) -> None:
        self.model = model
        self.model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY.value
        self.threads = threads
        self._batch: Batch | None = None

    def _for(self, samples: int) -> Batch:
        if self._batch is None or self._batch.nsim != samples:
            self._batch = Batch(self.model, samples, self.threads)
        return self._batch

    def poses(self, qpos: FloatArray, ids: np.ndarray | None = None) -> Poses:
        """Evaluate positions of the configurations ``(n, nq)``; with *ids*, only those rows are refreshed."""
        batch = self._for(len(qpos))
        batch.qpos = qpos
        fields = Poses(*(batch.bind(f) for f in ("cdof", "subtree_com", "site_xpos", "site_xquat", "xanchor")))
        batch.forward(ids, stage=mujoco.mjtStage.mjSTAGE_POS.value)
        return fields

    def dynamics(self, qpos: FloatArray, qvel: FloatArray) -> Dynamics:
        """Evaluate velocity terms, inertia and bias of the states ``(n, nq)``, ``(n, nv)``."""
        batch = self._for(len(qpos))
        batch.qpos = qpos
        batch.qvel = qvel
        names = ("cdof_dot", "M", "qfrc_bias", "xpos", "xipos", "ximat", "energy", "qfrc_passive")
        cdof_dot, mass, bias, xpos, xipos, ximat, energy, passive = (batch.bind(f) for f in names)
        batch.forward(stage=mujoco.mjtStage.mjSTAGE_VEL.value)
        return Dynamics(
            cdof_dot.copy(), mass.copy(), bias - passive, xpos.copy(), xipos.copy(), ximat.copy(), energy.copy()
        )


def mass_layout(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """Row and column of every entry of MuJoCo's sparse mass matrix (lower triangle)."""
    rows = np.repeat(np.arange(model.nv), model.M_rownnz).astype(np.int64)
    order = np.concatenate([np.arange(a, a + n) for a, n in zip(model.M_rowadr, model.M_rownnz, strict=True)])
    return rows, np.asarray(model.M_colind)[order].astype(np.int64)
