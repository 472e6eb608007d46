"""What the compiled model's numbers of a body mean: inertia in the body's axes, whatever frame it is written in."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from workbench.mjcf.text import scan
from workbench.robots.parameters import Target
from workbench.robots.places import WHOLE
from workbench.robots.values import inertia_matrix, is_written

PRINCIPAL = np.array([1e-3, 2.2e-3, 3e-3])


def tumbling(quaternion: np.ndarray) -> mujoco.MjModel:
    """A body that turns about its mass centre; its inertia is written in a frame of its own, ``w x y z``."""
    written = " ".join(repr(float(value)) for value in quaternion)
    moments = " ".join(repr(float(value)) for value in PRINCIPAL)
    return mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body name="b" pos="1 2 3" euler="10 20 30"><joint type="ball"/>'
        f'<inertial pos="0 0 0" quat="{written}" mass="1" diaginertia="{moments}"/></body></worldbody></mujoco>'
    )


@pytest.mark.parametrize(
    "quaternion",
    [[1, 0, 0, 0], [0.5, 0.5, 0.5, 0.5], [0.5, -0.5, -0.5, -0.5], [0.6, 0.0, 0.8, 0.0], [0.1, -0.3, 0.5, 0.8]],
)
def test_inertia_in_the_axes_of_the_body(quaternion: list[float]) -> None:
    unit = np.array(quaternion) / np.linalg.norm(quaternion)
    model = tumbling(unit)
    found = inertia_matrix(model, 1)
    # MuJoCo's own: a ball joint's velocity is counted in the body's axes, so there its mass matrix is the inertia
    data, mass = mujoco.MjData(model), np.zeros((3, 3))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    np.testing.assert_allclose(found, mass, atol=1e-17)
    # and by hand
    turn = Rotation.from_quat(np.roll(unit, -1)).as_matrix()
    np.testing.assert_allclose(found, (turn * PRINCIPAL) @ turn.T, atol=1e-15)
    if quaternion[0] != 1:
        assert np.abs(found - np.diag(PRINCIPAL)).max() > 1e-4


@pytest.mark.parametrize(
    ("attribute", "index", "written"),
    [
        ("size", 0, True),
        ("size", 1, True),
        ("size", 2, False),
        pytest.param("size", WHOLE, True, id="size as a whole"),
        ("fromto", 0, False),
        pytest.param("fromto", WHOLE, False, id="fromto as a whole"),
    ],
)
def test_a_number_is_written_where_the_file_has_so_many(attribute: str, index: int, written: bool) -> None:
    text = '<mujoco><worldbody><geom name="post" type="cylinder" size="0.1 0.2"/></worldbody></mujoco>'
    place = Target("geom", "post", attribute, index, 1.0, ("a",))
    assert is_written(text, scan(text, "post.xml"), place) is written
