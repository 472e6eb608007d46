"""M and h of a plant, held one by one against torques that the null space of MuJoCo's own Jacobian gives.

A plant holds itself against the reference when it is made; both would be wrong in what they share.
"""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from made_machines import custom
from nullspace_oracle import NullSpaceOracle
from platform_robots import three_rps
from random_mechanisms import draw
from test_closure_kinds import stewart
from workbench.errors import ModelError
from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference, forward
from workbench.reference.forward import Plant
from workbench.reference.forward_kernels import Masses, accelerations

AGREE = 1e-9
SEEDS = (15, 57, 86)
"""Random mechanisms with springs, armatures, gravity taken off a body, welds, and rods on ball joints."""
IN_THE_FILE = "six legs, said in the file"
"""A campaign that says what drives a robot has free joints taken apart; a file that says so itself keeps them."""


def machine(name: str) -> tuple[str, tuple[str, ...], str]:
    """Text, actuated joints, site."""
    if name == "six legs":
        return stewart("<freejoint/>"), tuple(f"l{k}" for k in range(6)), "plate"
    if name == IN_THE_FILE:
        text, actuated, site = machine("six legs")
        motors = "".join(f'<motor joint="{joint}"/>' for joint in actuated)
        return text.replace("</mujoco>", f"{custom(site)}<actuator>{motors}</actuator></mujoco>"), actuated, site
    if name == "three legs":
        return three_rps(), ("q1", "q2", "q3"), "centre"
    drawn = draw(int(name))
    assert drawn is not None
    return drawn.text, tuple(drawn.actuated), "platform"


@pytest.mark.parametrize("name", ["six legs", IN_THE_FILE, "three legs", *map(str, SEEDS)])
def test_mass_and_bias_are_those_of_the_null_space(tmp_path: Path, name: str) -> None:
    text, actuated, site = machine(name)
    path = tmp_path / "model.xml"
    path.write_text(text)
    force = np.array([5.0, -3.0, 9.0])
    setup = Setup(actuated, site) if name != IN_THE_FILE else None
    plant = Plant(MujocoReference(path, setup=setup), force)
    free = mujoco.mjtJoint.mjJNT_FREE in plant.reference.compiled().jnt_type
    assert free == (setup is None)
    oracle = NullSpaceOracle(text, list(actuated), spins_of(name))
    rng = np.random.default_rng(3)
    q = plant.reference.home + 0.02 * rng.uniform(-1, 1, len(actuated))
    qd, qdd = rng.uniform(-1, 1, (2, len(actuated)))
    plant.begin(q, qd)
    pose = oracle.close(plant.reference.closer.home, q)

    def torque(rates: np.ndarray, rise: np.ndarray, part: float = 1.0) -> np.ndarray:
        return oracle.inverse_dynamics(pose, rates, rise, site, part * force).tau

    bias = torque(qd, 0 * qdd)
    mass = np.column_stack([torque(qd, unit) - bias for unit in np.eye(len(actuated))])
    assert np.abs(plant.bias - bias).max() < AGREE * np.abs(bias).max()
    assert np.abs(plant.mass - mass).max() < AGREE * np.abs(mass).max()
    assert np.abs(plant.acceleration(torque(qd, qdd)) - qdd).max() < 1e-7
    # twins
    assert np.abs(plant.bias - torque(1.001 * qd, 0 * qdd, 1.001)).max() > 10 * AGREE * np.abs(bias).max()
    assert np.abs(plant.bias - bias - mass @ qdd).max() > 1e-3 * np.abs(bias).max()


def spins_of(name: str) -> list:  # type: ignore[type-arg]
    drawn = draw(int(name)) if name.isdecimal() else None
    return drawn.spins if drawn else []


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_plant_that_differs_from_the_reference_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, side: float
) -> None:
    path = tmp_path / "model.xml"
    path.write_text(three_rps())
    reference, masses_of = MujocoReference(path, setup=Setup(("q1", "q2", "q3"), "centre")), forward.masses_of

    def heavier(part: float) -> None:
        def changed(robot: MujocoReference, force: np.ndarray) -> Masses:
            found = masses_of(robot, force)
            return found._replace(mass=(1.0 + part) * found.mass, inertia=(1.0 + part) * found.inertia)

        monkeypatch.setattr(forward, "masses_of", changed)

    heavier(side * 0.3e-9)  # all torques with them
    Plant(reference)
    heavier(side * 3e-9)
    with pytest.raises(ModelError, match=r"control is not covered for this model: on joint q\d something acts"):
        Plant(reference)


def test_a_mass_matrix_that_is_none_gives_no_accelerations(tmp_path: Path) -> None:
    path = tmp_path / "model.xml"
    path.write_text(three_rps())
    plant = Plant(MujocoReference(path, setup=Setup(("q1", "q2", "q3"), "centre")))
    plant.begin(plant.reference.home, np.zeros(3))
    room, found = plant._room, np.empty(3)
    assert accelerations(room, np.ones(3), found)
    room.mass[2, 2] = -1.0
    assert not accelerations(room, np.ones(3), found)
