"""Draws pictures of a robot's course in a process of its own: stills and sheets of small frames, all WebP.

A wrong OpenGL ends the process that tries it, so this is never the run's own (`workbench.rendering.drawing`).
"""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from workbench.rendering.dressing import dress
from workbench.rendering.worker import MODEL, POSES, rendered

if TYPE_CHECKING:
    from PIL import Image

GHOSTS = "ghosts.npy"
STILL, SHEET = "still-{}.webp", "sheet-{}.webp"
STILL_QUALITY, SHEET_QUALITY = 88, 70
FINER = 2
"""Pictures are drawn so many times as large as they are kept, which smooths their edges for less than samples do."""
SHADOWS = 1024
"""Pixels of the map of shadows; MuJoCo's own 4096 takes half of the time without a graphics card."""
ROUND = 20, 12
"""Facets around and along what is round in a frame; MuJoCo's own 28 and 16 take a fifth longer and look the same there,
not in a still, which is twice as large."""


def film(folder: Path, width: int, height: int, columns: int, still: int) -> None:
    """Draw the films ``(films, n, nq)`` in *folder*, all seen from one place.

    Each becomes a sheet of its frames, row by row, and a picture twice as large of the frame *still*. Where there are
    ghosts, ``(n, nq)``, they shine through every film.
    """
    from PIL import Image  # a run only wants to know the names of files

    model = mujoco.MjModel.from_binary_path(str(folder / MODEL))
    model.vis.quality.offsamples, model.vis.quality.shadowsize = 0, SHADOWS
    films = np.load(folder / POSES)
    ghosts = np.load(folder / GHOSTS) if (folder / GHOSTS).is_file() else None
    seen = films.reshape(-1, films.shape[-1])
    dress(model, seen if ghosts is None else np.concatenate([seen, ghosts]), width / height)
    quality = model.vis.quality
    whole = quality.numslices, quality.numstacks
    for number, poses in enumerate(films):
        beside = None if ghosts is None else ghosts[still : still + 1]
        shot = poses[still : still + 1]
        quality.numslices, quality.numstacks = whole
        large = next(rendered(model, shot, 2 * FINER * width, 2 * FINER * height, ghosts=beside))
        _smaller(large).save(folder / STILL.format(number), format="WEBP", quality=STILL_QUALITY, method=4)
        quality.numslices, quality.numstacks = map(min, whole, ROUND)
        sheet = Image.new("RGB", (columns * width, -(-len(poses) // columns) * height))
        for k, picture in enumerate(rendered(model, poses, FINER * width, FINER * height, ghosts=ghosts)):
            sheet.paste(_smaller(picture), (k % columns * width, k // columns * height))
        sheet.save(folder / SHEET.format(number), format="WEBP", quality=SHEET_QUALITY, method=2)


def _smaller(picture: np.ndarray) -> Image.Image:
    from PIL import Image

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
    film(Path(sys.argv[1]), *map(int, sys.argv[2:6]))
