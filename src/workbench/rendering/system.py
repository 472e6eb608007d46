"""What this machine can draw with, tried in processes of their own: a wrong OpenGL crashes hard, it raises nothing."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from functools import cache
from pathlib import Path

from workbench import processes
from workbench.errors import MissingExtraError

EXTRA = "pip install 'parallel-robot-workbench[rendering]'"
PATIENCE_S = 60.0

OFFSCREEN = {"linux": ("egl", "osmesa", "glfw"), "darwin": ("cgl", "glfw"), "win32": ("wgl", "glfw")}
"""Values of MUJOCO_GL to try, best first."""

PICTURE = """
import mujoco
model = mujoco.MjModel.from_xml_string('<mujoco><worldbody><light pos="0 0 3"/><geom size="1"/></worldbody></mujoco>')
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 32, 32) as renderer:
    renderer.update_scene(data)
    print("drawn" if renderer.render().max() > 0 else "black")
"""

WINDOW = """
import glfw
if not glfw.init():
    raise SystemExit("no display")
glfw.window_hint(glfw.VISIBLE, False)
window = glfw.create_window(32, 32, "", None, None)
print("drawn" if window else "no window")
glfw.terminate()
"""


def needs(*modules: str) -> None:
    """Refuse to go on without optional packages.

    Raises
    ------
    MissingExtraError
        Naming them and what installs them.
    """
    missing = [module for module in modules if importlib.util.find_spec(module) is None]
    if missing:
        raise MissingExtraError(f"drawing needs {' and '.join(missing)}; install: {EXTRA}", modules=missing)


def backends() -> tuple[str, ...]:
    """Return the values of MUJOCO_GL to try on this system, best first; one that is set already counts alone."""
    chosen = os.environ.get("MUJOCO_GL")
    return (chosen,) if chosen else OFFSCREEN.get(sys.platform, ("glfw",))


@cache
def offscreen_backend() -> str:
    """Return the value of MUJOCO_GL that draws offscreen on this machine; one that is set already counts alone.

    Raises
    ------
    MissingExtraError
        None does; the message says what to install.
    """
    needs("OpenGL", "glfw")
    tried = backends()
    for backend in tried:
        if _draws(PICTURE, {"MUJOCO_GL": backend}):
            return backend
    chosen = os.environ.get("MUJOCO_GL")
    said = f"MUJOCO_GL={chosen} does not draw" if chosen else f"none of {', '.join(tried)} draws"
    raise MissingExtraError(
        f"no offscreen OpenGL on this machine, {said}; on Debian or Ubuntu install: apt-get install libegl1"
        " libgl1-mesa-dri (no graphics card is needed)",
        backends=tried,
    )


def refuse_without_display() -> None:
    """Refuse to open a window where none can be.

    Raises
    ------
    MissingExtraError
        The message says what is missing, and what works without it.
    """
    needs("glfw")
    if not _draws(WINDOW, {}):
        display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
        what = f'display "{display}" opens no OpenGL window' if display else "no display, DISPLAY is not set"
        raise MissingExtraError(
            f"{what}: the viewer needs a screen, or a virtual one (apt-get install xvfb libgl1-mesa-dri; xvfb-run"
            " workbench model view ...); workbench model render needs none"
        )


def _draws(code: str, environment: dict[str, str]) -> bool:
    try:
        done = subprocess.run(
            processes.python_code(code),
            env=processes.environment(**environment),
            cwd=Path(__file__).parent,  # drivers and their loaders find nothing of the current directory
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.stdout.strip() == "drawn"
