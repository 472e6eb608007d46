"""Draws poses in a process of its own and writes them, raw, to its standard output (`workbench.rendering.offscreen`).

MuJoCo chooses its OpenGL when it is imported, and a wrong one ends the process: neither may happen to the caller's.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.arrays import FloatArray
from workbench.rendering.dressing import dress

HEADLIGHT = {"ambient": 0.1, "diffuse": 0.4, "specular": 0.5}
"""What MuJoCo gives a model that says nothing."""
SKY = np.array([[245, 247, 252], [199, 212, 230]])
"""Colours behind a robot whose file has no sky, above and below: those of the robots that come along."""
FAR = 0.999
"""Share of the farthest depth from which on nothing was drawn."""
MODEL, POSES = "model.mjb", "qpos.npy"
GHOST = 0.28
"""Opacity of a robot that is shown where it should be, beside where it is."""


def rendered(
    model: mujoco.MjModel,
    poses: FloatArray,
    width: int,
    height: int,
    camera: str = "",
    ghosts: FloatArray | None = None,
) -> Iterator[NDArray[np.uint8]]:
    """Draw each row of *poses* ``(n, nq)``, with that of *ghosts* shining through: pictures ``(height, width, 3)``."""
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    light_up(model)
    bare = not np.any(model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX)
    data = mujoco.MjData(model)
    with mujoco.Renderer(model, height, width) as renderer:
        for number, qpos in enumerate(poses):
            data.qpos = qpos
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera or -1)
            if ghosts is not None:
                _add_ghost(model, ghosts[number], renderer.scene)
            picture = np.ascontiguousarray(renderer.render())
            if bare:
                renderer.enable_depth_rendering()
                put_behind(picture, renderer.render() >= FAR * model.vis.map.zfar * model.stat.extent)
                renderer.disable_depth_rendering()
            yield picture


def _add_ghost(model: mujoco.MjModel, qpos: FloatArray, scene: mujoco.MjvScene) -> None:
    """Add the moving bodies at another pose to a scene, so that one can look through them."""
    data = mujoco.MjData(model)
    data.qpos = qpos
    mujoco.mj_forward(model, data)
    first, moving = scene.ngeom, mujoco.mjtCatBit.mjCAT_DYNAMIC
    mujoco.mjv_addGeoms(model, data, mujoco.MjvOption(), mujoco.MjvPerturb(), moving, scene)
    for geom in scene.geoms[first : scene.ngeom]:
        geom.rgba[3] *= GHOST
        geom.transparent = 1


def light_up(model: mujoco.MjModel) -> None:
    """Give a model without a light of its own one that shows it, in memory; MuJoCo's is dim."""
    head = model.vis.headlight
    given = any(not np.allclose(getattr(head, name), value) for name, value in HEADLIGHT.items())
    if model.nlight == 0 and head.active and not given:
        head.ambient, head.diffuse, head.specular = [0.4] * 3, [0.5] * 3, [0.1] * 3


def put_behind(picture: NDArray[np.uint8], empty: NDArray[np.bool_]) -> None:
    """Put a bright background where nothing was drawn, in place: dark parts cannot be seen on MuJoCo's black."""
    share = np.linspace(0.0, 1.0, len(picture))[:, None]
    rows = np.rint((1 - share) * SKY[0] + share * SKY[1]).astype(np.uint8)
    picture[empty] = np.broadcast_to(rows[:, None, :], picture.shape)[empty]


def draw(folder: Path, width: int, height: int, camera: str) -> None:
    """Draw each row of ``qpos.npy`` with ``model.mjb``; writes height * width * 3 bytes per picture."""
    pixels = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # whatever drivers print must not get between the pixels
    model = mujoco.MjModel.from_binary_path(str(folder / MODEL))
    poses = np.load(folder / POSES)
    dress(model, poses, width / height)
    with pixels:
        for picture in rendered(model, poses, width, height, camera):
            pixels.write(picture.tobytes())


if __name__ == "__main__":
    draw(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4])
