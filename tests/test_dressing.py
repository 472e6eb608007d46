"""A model without colours and view of its own is told apart by roles and stands in the middle of its pictures."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
import pytest

from workbench.rendering.dressing import DRIVEN, FIXED, MARGIN, OBLIQUE, PASSIVE, PLATFORM, dress

TEXT = """
<mujoco>
  {head}
  <worldbody>
    <geom name="base" type="box" size="0.1 0.1 0.1"{look}/>
    <body name="crank" pos="0.5 0 0">
      <joint name="q" axis="{axis}"/><geom name="crank" type="capsule" size="0.02" fromto="0 0 0 0 0 1"/>
      <body name="pin" pos="0 0 0.5"><geom name="pin" size="0.05"/></body>
      <body name="rod" pos="0 0 1">
        <joint name="p" axis="0 1 0"/><geom name="rod" type="capsule" size="0.02" fromto="0 0 0 1 0 0"/>
        <body name="plate" pos="1 0 0"><joint name="r" axis="0 1 0"/><geom name="plate" size="0.1"/><site name="tool"/>
          <geom name="hidden" size="5" group="4"/></body>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="q"/></actuator>
  <custom><text name="platform_site" data="tool"/></custom>
</mujoco>
"""
POSES = np.array([[0.0, 0.0, 0.0], [2.0, 1.0, 0.5]])


def model(head: str = "", look: str = "", axis: str = "0 1 0") -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(TEXT.format(head=head, look=look, axis=axis))


def test_colours_tell_roles() -> None:
    made = model()
    dress(made, POSES, 4 / 3)
    colours = {
        made.geom(name).name: tuple(np.round(made.geom(name).rgba, 2)) for name in ("base", "crank", "rod", "plate")
    }
    assert colours == {"base": FIXED, "crank": DRIVEN, "rod": PASSIVE, "plate": PLATFORM}
    assert np.allclose(made.geom("pin").rgba, DRIVEN), "what is welded to a body moves with it"
    assert made.site("tool").rgba[3] == 0


@pytest.mark.parametrize("look", [' rgba="1 0 0 1"', ' material="steel"'])
def test_colours_of_the_author_stay(look: str) -> None:
    made = model('<asset><material name="steel" rgba="0.1 0.2 0.3 1"/></asset>', look)
    before = made.geom_rgba.copy(), made.site_rgba.copy()
    dress(made, POSES, 4 / 3)
    assert np.array_equal(made.geom_rgba, before[0])
    assert np.array_equal(made.site_rgba, before[1])


def _spread(made: mujoco.MjModel, aspect: float) -> Iterator[tuple[float, float]]:
    """Where MuJoCo's own free camera sees the corners around geoms, as shares of half the picture."""
    scene, data = mujoco.MjvScene(made, 100), mujoco.MjData(made)
    camera, options = mujoco.MjvCamera(), mujoco.MjvOption()
    mujoco.mjv_defaultFreeCamera(made, camera)
    for pose in POSES:
        data.qpos[:] = pose
        mujoco.mj_forward(made, data)
        mujoco.mjv_updateScene(made, data, options, None, camera, mujoco.mjtCatBit.mjCAT_ALL, scene)
        eyes = scene.camera
        place = np.mean([eye.pos for eye in eyes], axis=0)
        forward, up = np.array(eyes[0].forward), np.array(eyes[0].up)
        right = np.cross(forward, up)
        for geom in range(made.ngeom):
            if made.geom(geom).name == "hidden":
                continue
            box, turn = made.geom_aabb[geom], data.geom_xmat[geom].reshape(3, 3)
            for sign in np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T:
                away = data.geom_xpos[geom] + turn @ (box[:3] + sign * box[3:]) - place
                half = np.tan(np.radians(made.vis.global_.fovy) / 2) * (away @ forward)
                yield float(away @ right / half / aspect), float(away @ up / half)


@pytest.mark.parametrize("axis", ["0 1 0", "1 0 0"])
@pytest.mark.parametrize("aspect", [0.5, 4 / 3])
def test_all_poses_are_within_the_picture_and_fill_it(axis: str, aspect: float) -> None:
    made = model(axis=axis)
    dress(made, POSES, aspect)
    seen = np.abs(np.array(list(_spread(made, aspect))))
    assert seen.max() == pytest.approx(MARGIN, abs=1e-4)  # the corner that decides lies on the margin
    bare = model(axis=axis)
    assert np.abs(np.array(list(_spread(bare, aspect)))).max() != pytest.approx(MARGIN, abs=1e-2)


def test_planar_robots_are_seen_in_their_plane() -> None:
    flat, spatial = model(), model(axis="1 0 0")
    for made in (flat, spatial):
        dress(made, POSES, 1.0)
    assert (flat.vis.global_.azimuth, flat.vis.global_.elevation) == (90, 0)
    assert (spatial.vis.global_.azimuth, spatial.vis.global_.elevation) == OBLIQUE


def test_a_view_of_the_author_stays() -> None:
    made = model('<visual><global azimuth="30" elevation="-10"/></visual><statistic center="1 2 3" extent="7"/>')
    dress(made, POSES, 1.0)
    assert made.stat.extent == 7
    assert made.stat.center.tolist() == [1, 2, 3]
    assert made.vis.global_.azimuth == 30
