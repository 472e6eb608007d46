"""MuJoCo's own interactive viewer, replaying a motion."""

from __future__ import annotations

import contextlib
import sys
import threading
import time

import mujoco

from workbench.errors import MissingExtraError
from workbench.rendering.poses import Poses
from workbench.rendering.system import refuse_without_display
from workbench.shielded import shielded

REFRESH_S = 1 / 60
CLOSING_S = 5.0
"""How long a closing window may take."""


def view(poses: Poses, speed: float = 1.0) -> None:
    """Show poses in a window, over and over in their own time, until the window is closed or Ctrl-C.

    Parameters
    ----------
    poses
        One pose, or a motion.
    speed
        1 is the motion's own time, 0.1 ten times slower.

    Raises
    ------
    MissingExtraError
        There is no display, or a package is missing; the message says what to install.
    """
    refuse_without_display()
    with shielded():
        import mujoco.viewer

    if sys.platform == "darwin" and mujoco.viewer._MJPYTHON is None:
        raise MissingExtraError("on macOS the viewer runs under mjpython: mjpython -m workbench.cli model view ...")
    data = mujoco.MjData(poses.model)
    _pose(poses, data, 0)
    duration = float(poses.times[-1] - poses.times[0])
    step = duration / max(len(poses.times) - 1, 1)
    others = set(threading.enumerate())
    # the panels would hide most of the robot; Tab and Shift-Tab bring them
    with (
        contextlib.suppress(KeyboardInterrupt),
        mujoco.viewer.launch_passive(poses.model, data, show_left_ui=False, show_right_ui=False) as window,
    ):
        with window.lock():
            mujoco.mjv_defaultFreeCamera(poses.model, window.cam)
        begin = time.monotonic()
        while window.is_running():
            passed = speed * (time.monotonic() - begin)
            number = int(passed % duration / step) if step else 0
            with window.lock():
                _pose(poses, data, number)
            window.set_texts((None, None, poses.title, f"t = {poses.times[number]:.3f} s" if step else ""))
            window.sync()
            time.sleep(REFRESH_S)
    # the window's thread still uses the model and the screen; a program that ends before it crashes
    for thread in set(threading.enumerate()) - others:
        thread.join(CLOSING_S)


def _pose(poses: Poses, data: mujoco.MjData, number: int) -> None:
    data.qpos = poses.qpos[number]
    data.time = poses.times[number]
    mujoco.mj_forward(poses.model, data)
