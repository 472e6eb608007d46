"""A second engine: the same MJCF through Pinocchio's reader, kinematics and recursive Newton-Euler algorithm.

It shares with the MuJoCo reference the file and the list of loop closures, but no kinematics, dynamics or solver.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray, as_batches, as_force
from workbench.dry_friction import direction
from workbench.errors import ModelError, MotionError, ParameterError, did_you_mean
from workbench.mjcf.compile import custom_text
from workbench.mjcf.setup import Setup
from workbench.reference.kinds import CONNECT, SPIN, WELD
from workbench.reference.pinocchio_limits import refuse_uncounted
from workbench.reference.pinocchio_loops import PinocchioLoops
from workbench.reference.pinocchio_reader import import_pinocchio, read, without_inertia
from workbench.reference.structure import structure_of
from workbench.robots.load import LoadedModel, load_model

MASS_MODELS = ("distributed", "lumped")

INCONSISTENT = 1e-9
"""Largest velocity residual, as a fraction of the fastest actuated velocity (at least 1), of a motion that can be
followed."""


@dataclass(frozen=True)
class PinocchioResult:
    """Inverse dynamics of n samples; arrays float64, SI, platform quantities in the paper's (base body's) frame."""

    tau: FloatArray
    """``(n, na)`` actuator forces (N) and torques (N m), actuator order"""
    x: FloatArray
    """``(n, 3)`` platform position, m"""
    xd: FloatArray
    xdd: FloatArray
    closure_residual: FloatArray
    """``(n,)`` largest open loop coordinate, m (rad for turns)"""
    velocity_residual: FloatArray
    acceleration_residual: FloatArray
    rank: np.ndarray
    """``(n,)`` rank of the loop constraints on the passive freedoms"""


class PinocchioReference:
    """Closed-chain inverse dynamics of an MJCF model by Pinocchio.

    Parameters
    ----------
    path
        MJCF file; ``<custom>`` names ``base_body``, ``platform_site`` and ``lumped_bodies``.
    setup
        Actuated joints, platform and first guess of a file whose ``<custom>`` does not name them.
    loaded
        The same model with the same overrides where it is at hand.
    **parameters
        Overrides by name, SI, as for `workbench.load_mechanism`.

    Raises
    ------
    MissingExtraError
        The extra ``pinocchio`` is not installed; the message holds the install command.
    ModelError
        The file does not compile, its loops cannot be closed, or it holds something that is not covered.
    ParameterError
        Unknown parameter or a value it may not have.

    Notes
    -----
    Coulomb friction is its full value against the direction of motion, and zero at rest.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        loaded: LoadedModel | None = None,
        setup: Setup | None = None,
        **parameters: float,
    ) -> None:
        self._pin = import_pinocchio()
        loaded = loaded or load_model(path, parameters, setup)
        self.file = loaded.file
        self._compiled = loaded.model
        structure = self._structure = structure_of(loaded)
        sites = {structure.platform_site}
        refuse_uncounted(loaded.model, structure)
        for kind, _, _, one, two in structure.blocks.tolist():
            sites |= {
                point for point in (one, two) if kind in (CONNECT, WELD, SPIN) and 0 <= point < loaded.model.nsite
            }
        self._reading = read(self._pin, _flat(loaded), loaded.model, sites, loaded.file, structure.frames)
        self._loops = PinocchioLoops(self._pin, self._reading, structure, loaded.model)
        self._models: dict[str, Any] = {"distributed": self._reading.model}

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Actuated joints, in actuator order."""
        return self._structure.joint_names

    @property
    def reader_difference(self) -> str:
        """Why Pinocchio was given a normal form of the model instead of the file as written; empty if it was not."""
        return self._reading.difference

    def inverse_dynamics(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        qdd: ArrayLike,
        mass_model: str = "distributed",
        external_force: ArrayLike | None = None,
        ordered: bool = False,
    ) -> PinocchioResult:
        """Actuator forces that produce a motion.

        Parameters
        ----------
        q, qd, qdd
            Actuated position, velocity, acceleration, each ``(n, na)``, SI; samples need not form a trajectory, but
            neighbours that are near make it faster.
        mass_model
            ``"distributed"``, the model as it is, or ``"lumped"``, bars without rotational inertia.
        external_force
            Newtons, base (paper) frame, acting on the platform site: ``(3,)`` or ``(n, 3)``.
        ordered
            The samples are one motion, in the order of time: each is closed from its predecessor.

        Raises
        ------
        MotionError
            A sample that cannot be closed on the home branch, or a singular pose.
        ArrayError
            Wrong shapes or entries that are not finite.
        ParameterError
            Unknown mass model.
        """
        pin, loops = self._pin, self._loops
        q, qd, qdd = as_batches(len(loops.actuated), q=q, qd=qd, qdd=qdd)
        n, na = q.shape
        applied = as_force("external_force", external_force, n)
        model = self._model(mass_model)
        data = model.createData()
        damping, friction = np.array(model.damping), np.array(model.friction)
        configurations, closure = loops.close(q, ordered)
        base = self._base()
        tau, motion = np.zeros((n, na)), np.zeros((3, n, 3))
        residuals, ranks = np.zeros((2, n)), np.zeros(n, dtype=np.int64)
        site = self._structure.platform_site
        for s in range(n):
            here = configurations[s]
            jacobian = loops.linear(here).jacobian
            force_rows = loops.frame_jacobian(site)[:3]
            # velocities per unit actuated velocity, J W = 0; along them closure forces do no work
            W = np.zeros((model.nv, na))
            W[loops.actuated] = np.eye(na)
            W[loops.passive], ranks[s] = loops.solve(jacobian, -jacobian[:, loops.actuated])
            v = W @ qd[s]
            residuals[0, s] = np.abs(jacobian @ v).max(initial=0.0)
            self._refuse_singular(s, q[s], qd[s], ranks[s], residuals[0, s])
            drift = loops.drift(here, v)
            a = W @ qdd[s]
            a[loops.passive] += loops.solve(jacobian, -drift)[0]
            residuals[1, s] = np.abs(jacobian @ a + drift).max(initial=0.0)
            generalized = pin.rnea(model, data, here, v, a) + damping * v + friction * direction(v)
            generalized -= force_rows.T @ (base.rotation @ applied[s])
            tau[s] = W.T @ generalized
            pin.forwardKinematics(loops.model, loops.data, here, v, a)
            place = pin.updateFramePlacement(loops.model, loops.data, self._reading.sites[site])
            motion[0, s] = place.translation - base.translation
            motion[1, s] = force_rows @ v
            motion[2, s] = loops.acceleration(site)[:3]
        x, xd, xdd = motion @ base.rotation
        return PinocchioResult(
            tau=tau, x=x, xd=xd, xdd=xdd, closure_residual=closure, velocity_residual=residuals[0],
            acceleration_residual=residuals[1], rank=ranks,
        )  # fmt: skip

    def _base(self) -> Any:
        """Placement of the base body in the world; it does not move."""
        if self._structure.moves[self._structure.base].any():
            raise ModelError(f'{self.file}: the base body moves; <text name="base_body"> must name a fixed one')
        return self._reading.model.frames[self._reading.bodies[self._structure.base]].placement

    def _model(self, mass_model: str) -> Any:
        if mass_model not in MASS_MODELS:
            raise ParameterError(f'unknown mass model "{mass_model}"{did_you_mean(mass_model, MASS_MODELS)}')
        if mass_model not in self._models:
            names = custom_text(self._compiled, "lumped_bodies")
            if names is None:
                raise ModelError(
                    f'{self.file}: <custom> has no <text name="lumped_bodies">; the lumped model needs the names of the'
                    " bars that lose their rotational inertia",
                    file=self.file,
                )
            known = [self._compiled.body(i).name for i in range(1, self._compiled.nbody)]
            for name in names.split():
                if name not in known:
                    raise ModelError(
                        f'{self.file}: <text name="lumped_bodies"> names body "{name}"{did_you_mean(name, known)}',
                        file=self.file,
                    )
            self._models[mass_model] = without_inertia(self._pin, self._reading, self._compiled, tuple(names.split()))
        return self._models[mass_model]

    def _refuse_singular(self, sample: int, q: FloatArray, qd: FloatArray, rank: int, residual: float) -> None:
        speed = max(float(np.abs(qd).max()), 1.0)
        if rank == len(self._loops.passive) and residual <= INCONSISTENT * speed:
            return
        shown = ", ".join(f"{name} = {value:.6g}" for name, value in zip(self.joint_names, q, strict=True))
        raise MotionError(
            f"sample {sample}: singular pose at {shown}; the actuators do not determine the motion",
            sample=sample,
            value=q.tolist(),
        )


def _flat(loaded: LoadedModel) -> str:
    """The file's text with its includes in it; Pinocchio would look for them elsewhere."""
    return loaded.prepared.source.text if loaded.prepared else loaded.text
