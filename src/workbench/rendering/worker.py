"""Draws poses in a process of its own and writes them, raw, to its standard output (`workbench.rendering.offscreen`).

MuJoCo chooses its OpenGL when it is imported, and a wrong one ends the process: neither may happen to the caller's.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import mujoco
import numpy as np

MODEL, POSES = "model.xml", "qpos.npy"


def draw(folder: Path, width: int, height: int, camera: str) -> None:
    """Draw each row of ``qpos.npy`` with ``model.xml``; writes height * width * 3 bytes per picture."""
    pixels = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # whatever drivers print must not get between the pixels
    model = mujoco.MjModel.from_xml_path(str(folder / MODEL))
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    data = mujoco.MjData(model)
    with mujoco.Renderer(model, height, width) as renderer, pixels:
        for qpos in np.load(folder / POSES):
            data.qpos = qpos
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera or -1)
            pixels.write(np.ascontiguousarray(renderer.render()).tobytes())


if __name__ == "__main__":
    draw(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4])
