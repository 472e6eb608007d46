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

MODEL, POSES = "model.mjb", "qpos.npy"


def rendered(
    model: mujoco.MjModel, poses: FloatArray, width: int, height: int, camera: str = ""
) -> Iterator[NDArray[np.uint8]]:
    """Draw each row of *poses* ``(n, nq)``: pictures ``(height, width, 3)``."""
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    data = mujoco.MjData(model)
    with mujoco.Renderer(model, height, width) as renderer:
        for qpos in poses:
            data.qpos = qpos
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera or -1)
            yield np.ascontiguousarray(renderer.render())


def draw(folder: Path, width: int, height: int, camera: str) -> None:
    """Draw each row of ``qpos.npy`` with ``model.mjb``; writes height * width * 3 bytes per picture."""
    pixels = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # whatever drivers print must not get between the pixels
    model = mujoco.MjModel.from_binary_path(str(folder / MODEL))
    with pixels:
        for picture in rendered(model, np.load(folder / POSES), width, height, camera):
            pixels.write(picture.tobytes())


if __name__ == "__main__":
    draw(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4])
