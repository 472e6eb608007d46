"""Draws a run's pictures in a process of its own: a still and a sheet of small frames, both WebP.

A wrong OpenGL ends the process that tries it, so this is never the run's own (`workbench.rendering.run_pictures`).
"""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path

import mujoco
import numpy as np
from PIL import Image

from workbench.rendering.dressing import dress
from workbench.rendering.worker import MODEL, POSES, rendered

STILL, FILM = "mechanism.webp", "film.webp"
STILL_QUALITY, FILM_QUALITY = 88, 70
FINER = 2
"""Pictures are drawn so many times as large as they are kept, which smooths their edges for less than samples do."""
SHADOWS = 1024
"""Pixels of the map of shadows; MuJoCo's own 4096 takes half of the time without a graphics card."""


def film(folder: Path, width: int, height: int, columns: int) -> None:
    """Draw the poses in *folder*: the first one twice as large, all of them as one sheet of frames, row by row."""
    model = mujoco.MjModel.from_binary_path(str(folder / MODEL))
    model.vis.quality.offsamples, model.vis.quality.shadowsize = 0, SHADOWS
    poses = np.load(folder / POSES)
    dress(model, poses, width / height)
    large = next(rendered(model, poses[:1], 2 * FINER * width, 2 * FINER * height))
    _smaller(large).save(folder / STILL, format="WEBP", quality=STILL_QUALITY, method=4)
    sheet = Image.new("RGB", (columns * width, -(-len(poses) // columns) * height))
    for number, picture in enumerate(rendered(model, poses, FINER * width, FINER * height)):
        sheet.paste(_smaller(picture), (number % columns * width, number // columns * height))
    sheet.save(folder / FILM, format="WEBP", quality=FILM_QUALITY, method=2)


def _smaller(picture: np.ndarray) -> Image.Image:
    return Image.fromarray(picture).reduce(FINER)


def _end_with_parent() -> None:
    """Wait for the end of the standard input, which the run that began this process holds open, and end."""
    while os.read(0, 4096):  # not sys.stdin: its lock, held here, aborts the interpreter when it ends
        pass
    os._exit(0)


if __name__ == "__main__":
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if hasattr(os, "nice"):
        os.nice(10)  # the run that it belongs to goes first
    film(Path(sys.argv[1]), *map(int, sys.argv[2:5]))
