"""Platforms seen from a base that stands anywhere: turns against SciPy, motion against the same robot in the origin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from own_mechanisms import FOURBAR
from workbench.errors import ModelError
from workbench.mjcf.setup import Setup
from workbench.reference import MujocoReference
from workbench.reference.forward import Plant
from workbench.reference.pinocchio_reference import PinocchioReference
from workbench.reference.task_rows import relative


def test_orientation_seen_from_a_base_that_is_turned_any_way() -> None:
    random = np.random.default_rng(0)
    for _ in range(20):
        base, seen = (Rotation.from_quat(random.normal(size=4)) for _ in range(2))
        found = np.empty(4)
        relative.py_func(base.as_quat(scalar_first=True), seen.as_quat(scalar_first=True), found)
        expected = (base.inv() * seen).as_quat(scalar_first=True)
        assert min(np.abs(found - expected).max(), np.abs(found + expected).max()) < 1e-14


def stood(tmp_path: Path, place: str, base: str = "stand") -> MujocoReference:
    """A four-bar on a stand."""
    path = tmp_path / "model.xml"
    path.write_text(
        FOURBAR.replace("<worldbody>", f'<worldbody><body name="stand" {place}>').replace(
            "</worldbody>", "</body></worldbody>"
        )
    )
    guess = (("crank", 1.0), ("elbow", -0.5), ("wrist", -1.5))
    return MujocoReference(path, setup=Setup(("crank",), "coupler", base_body=base, initial=guess))


ANYWHERE = 'pos="0.3 -0.7 1.1" euler="0.4 -0.7 1.1"'


def test_the_plant_sees_its_platform_from_the_base(tmp_path: Path) -> None:
    reference, qd = stood(tmp_path, ANYWHERE), np.array([0.7])
    plant = Plant(reference)
    plant.begin(np.array([1.2]), qd)
    expected = reference.inverse_dynamics(np.array([[1.2]]), qd[None], np.zeros((1, 1))).x[0]
    assert np.abs(plant.platform - expected).max() < 1e-12


@pytest.mark.parametrize("engine", [MujocoReference, PinocchioReference])
def test_a_base_that_moves_is_refused(tmp_path: Path, engine: type) -> None:
    stood(tmp_path, ANYWHERE)  # writes the file
    guess = (("crank", 1.0), ("elbow", -0.5), ("wrist", -1.5))
    setup = Setup(("crank",), "coupler", base_body="coupler", initial=guess)
    still = np.zeros((1, 1))

    def torques() -> object:
        return engine(tmp_path / "model.xml", setup=setup).inverse_dynamics(still + 1.0, still, still)

    with pytest.raises(ModelError, match="the base body moves"):
        torques()


def test_motion_seen_from_a_base_is_that_of_the_robot_in_the_origin(tmp_path: Path) -> None:
    t = np.linspace(0.0, 1.0, 21)[:, None]
    motion = 1.0 + 0.4 * np.sin(3 * t), 1.2 * np.cos(3 * t), -3.6 * np.sin(3 * t)
    here, there = (stood(tmp_path, place).inverse_dynamics(*motion) for place in ('pos="0 0 0"', ANYWHERE))
    for one, other in ((here.x, there.x), (here.xd, there.xd), (here.xdd, there.xdd)):
        assert np.abs(one - other).max() < 1e-13 * max(1.0, np.abs(one).max())
    assert np.abs(here.tau - there.tau).max() > 1e-3  # gravity comes from elsewhere
