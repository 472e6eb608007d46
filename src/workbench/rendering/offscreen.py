"""Pictures of poses, drawn without a screen."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench import processes
from workbench.errors import ModelError, OutputError, ParameterError, did_you_mean
from workbench.rendering import worker
from workbench.rendering.poses import Poses
from workbench.rendering.system import offscreen_backend
from workbench.scratch import scratch_directory

Picture = NDArray[np.uint8]
"""``(height, width, 3)`` red, green, blue"""

SIDES = (16, 4096)
"""Smallest and largest width and height, pixels."""


def draw(poses: Poses, width: int, height: int, camera: str | None = None) -> Iterator[Picture]:
    """Draw poses one after the other.

    Parameters
    ----------
    poses
        What is drawn.
    width, height
        Pixels.
    camera
        Name of one of the model's cameras; None is the view with which the interactive viewer begins.

    Raises
    ------
    ParameterError
        A size that cannot be drawn.
    ModelError
        No such camera.
    MissingExtraError
        This machine cannot draw; the message says what to install.
    OutputError
        Drawing failed on the way.
    """
    for name, value in (("width", width), ("height", height)):
        if not SIDES[0] <= value <= SIDES[1]:
            raise ParameterError(f"{name} {value} pixels; allowed: {SIDES[0]} to {SIDES[1]}", value=value)
    view = _camera(poses.model, camera)
    backend = offscreen_backend()
    with scratch_directory() as folder:
        mujoco.mj_saveModel(poses.model, str(folder / worker.MODEL))
        np.save(folder / worker.POSES, poses.qpos)
        command = processes.python_module(worker.__name__, str(folder), str(width), str(height), view)
        with (
            open(folder / "log", "w+", encoding="utf-8", errors="replace") as log,
            subprocess.Popen(
                command,
                env=processes.environment(MUJOCO_GL=backend),
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=log,
            ) as process,
        ):
            assert process.stdout is not None
            try:
                for number in range(len(poses.qpos)):
                    pixels = process.stdout.read(height * width * 3)
                    if len(pixels) < height * width * 3:
                        process.wait()
                        log.seek(0)
                        reason = (log.read().strip().splitlines() or [f"exit code {process.returncode}"])[-1]
                        raise OutputError(f"drawing failed at picture {number + 1}: {reason}")
                    yield np.frombuffer(pixels, dtype=np.uint8).reshape(height, width, 3)
            finally:
                process.kill()


def _camera(model: mujoco.MjModel, name: str | None) -> str:
    if name is None:
        return ""
    cameras = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_CAMERA, i) or "" for i in range(model.ncam)]
    if not name or name not in cameras:
        raise ModelError(f'no camera "{name}"{did_you_mean(name, [c for c in cameras if c])}', camera=name)
    return name
