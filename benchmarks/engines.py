"""What other ways to closed-chain inverse dynamics from Python cost: Pinocchio, and plain mj_inverse."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np
from samples import Samples, model

import workbench as wb
from workbench.errors import MissingExtraError
from workbench.reference.pinocchio_reference import PinocchioReference


def mj_inverse(robot: str, samples: Samples) -> Callable[[], None]:
    """`mj_inverse` sample by sample on closed configurations: not right for closed chains, and timed all the same."""
    closed = wb.MujocoReference(model(robot)).inverse_dynamics(samples.q, samples.qd, samples.qdd)
    compiled = mujoco.MjModel.from_xml_path(str(model(robot)))
    data = mujoco.MjData(compiled)

    def loop() -> None:
        for k in range(len(samples.q)):
            data.qpos[:], data.qvel[:], data.qacc[:] = closed.qpos[k], closed.qvel[k], closed.qacc[k]
            mujoco.mj_inverse(compiled, data)

    return loop


def pinocchio(robot: str, samples: Samples) -> tuple[Callable[[], None], Callable[[], None]] | None:
    """Pinocchio with closure, and without: on configurations closed beforehand, torques only. None: not installed."""
    try:
        reference = PinocchioReference(model(robot))
    except MissingExtraError:
        return None
    pin, loops = reference._pin, reference._loops
    dynamics = reference._model("distributed")
    data = dynamics.createData()
    configurations, _ = loops.close(samples.q)
    na = len(loops.actuated)

    def whole() -> None:
        reference.inverse_dynamics(samples.q, samples.qd, samples.qdd)

    def given() -> None:
        for s, here in enumerate(configurations):
            jacobian = loops.linear(here).jacobian
            W = np.zeros((dynamics.nv, na))
            W[loops.actuated] = np.eye(na)
            W[loops.passive], _ = loops.solve(jacobian, -jacobian[:, loops.actuated])
            v = W @ samples.qd[s]
            a = W @ samples.qdd[s]
            a[loops.passive] += loops.solve(jacobian, -loops.drift(here, v))[0]
            W.T @ pin.rnea(dynamics, data, here, v, a)

    return whole, given
