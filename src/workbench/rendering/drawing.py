"""Films of a robot, drawn in a process of their own beside whatever else is done; they fail no run."""

from __future__ import annotations

import subprocess
import threading
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench import processes
from workbench.arrays import FloatArray
from workbench.errors import MissingExtraError
from workbench.rendering import film_worker
from workbench.rendering.system import backends, needs
from workbench.rendering.worker import MODEL, POSES
from workbench.scratch import Scratch

popen = subprocess.Popen
"""What starts the process that draws."""

FRAMES, COLUMNS = 36, 6
WIDTH, HEIGHT = 400, 300
"""Pixels of a frame; a still has twice as many each way."""
PATIENCE_S = 20.0
"""How long a run waits for its pictures when all else is done."""


def frames_of(count: int) -> NDArray[np.intp]:
    """Return which of *count* samples are drawn, in order; the first and the last are."""
    return np.unique(np.linspace(0, count - 1, FRAMES).round().astype(np.intp))


class Drawing:
    """Sheets of frames and a still for each film; ``note`` says what went wrong."""

    def __init__(self) -> None:
        self.note = ""
        self._scratch: Scratch | None = None
        self._thread: threading.Thread | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._over = False

    def start(self, model: mujoco.MjModel, films: FloatArray, ghosts: FloatArray | None = None, still: int = 0) -> None:
        """Begin to draw.

        Parameters
        ----------
        model
            What is drawn.
        films
            ``(films, n, nq)`` poses, one a frame.
        ghosts
            ``(n, nq)`` poses that shine through all films.
        still
            Which of the n frames is drawn large.
        """
        try:
            needs("OpenGL", "glfw", "PIL")
            self._scratch = Scratch()
            folder = self._scratch.path
            mujoco.mj_saveModel(model, str(folder / MODEL))
            np.save(folder / POSES, films)
            if ghosts is not None:
                np.save(folder / film_worker.GHOSTS, ghosts)
        except (MissingExtraError, OSError) as error:
            self.note = str(error)
            return
        last = folder / film_worker.SHEET.format(len(films) - 1)
        self._thread = threading.Thread(target=self._draw, args=(folder, still, last), daemon=True)
        self._thread.start()

    def finish(self, patience: float) -> Path | None:
        """Wait for the pictures and return the folder that holds them; None, and a note, where there are none."""
        if self._thread is not None:
            self._thread.join(patience)
            if self._thread.is_alive():
                self.note = f"drawing took longer than {patience:g} s"
        return None if self.note or self._scratch is None else self._scratch.path

    def close(self) -> None:
        """End what still draws and remove what it leaves."""
        self._over = True
        if self._process is not None and self._process.poll() is None:
            self._process.kill()
        if self._thread is not None:
            self._thread.join(PATIENCE_S)
        if self._scratch is not None:
            self._scratch.close()

    def _draw(self, folder: Path, still: int, last: Path) -> None:
        """Try one OpenGL after the other: a machine that can draw needs one process, others some that fail fast."""
        tried = backends()
        numbers = (WIDTH, HEIGHT, COLUMNS, still)
        command = processes.python_module(film_worker.__name__, str(folder), *map(str, numbers))
        for backend in tried:
            if self._over:
                return
            try:
                self._process = popen(
                    command,
                    env=processes.environment(MUJOCO_GL=backend),
                    cwd=folder,
                    stdin=subprocess.PIPE,  # closed by the system when this process dies: then the other ends, too
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                )
                ended = self._process.wait()
                if self._process.stdin is not None:
                    self._process.stdin.close()
                if ended == 0 and last.is_file():
                    return
            except OSError as error:
                self.note = f"drawing could not be started: {error.strerror or error}"
                return
        self.note = f"no offscreen OpenGL on this machine (tried {', '.join(tried)})"
