"""Pictures of a run's robot, drawn while the run computes: a still and a film of the first case. They fail no run."""

from __future__ import annotations

import json
import shutil
import subprocess
import threading
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from workbench import processes
from workbench.arrays import FloatArray
from workbench.campaign import store
from workbench.campaign.compare import CaseResult
from workbench.errors import MissingExtraError
from workbench.rendering import film_worker
from workbench.rendering.system import backends, needs
from workbench.rendering.worker import MODEL, POSES
from workbench.scratch import Scratch

popen = subprocess.Popen
"""What starts the process that draws."""

FORMAT = 1
RECORD = "pictures.json"
FRAMES, COLUMNS = 36, 6
WIDTH, HEIGHT = 400, 300
"""Pixels of a frame; the still has twice as many each way."""
PATIENCE_S = 20.0
"""How long a run waits for its pictures when all else is done."""


class RunPictures:
    """Draws in processes of their own, watched by a thread; what goes wrong is said in the record."""

    def __init__(self) -> None:
        self._scratch: Scratch | None = None
        self._thread: threading.Thread | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._record: dict[str, Any] = {}
        self._note = ""
        self._over = False

    def start(self, result: CaseResult) -> None:
        """Begin to draw the robot along a case."""
        if result.qpos is None or self._thread is not None:
            return
        try:
            needs("OpenGL", "glfw", "PIL")
            self._scratch = Scratch()
            self._record = _write_poses(self._scratch.path, result.model, result.qpos, result.series["t"])
        except (MissingExtraError, OSError) as error:
            self._note = str(error)
            return
        self._record["case"] = result.name
        self._thread = threading.Thread(target=self._draw, args=(self._scratch.path,), daemon=True)
        self._thread.start()

    def finish(self, stage: Path) -> None:
        """Put the pictures, or the reason why there are none, into a run directory."""
        if self._thread is not None:
            self._thread.join(PATIENCE_S)
            if self._thread.is_alive():
                self._note = f"drawing took longer than {PATIENCE_S:g} s"
        elif not self._note:
            return
        folder = stage / store.PICTURES
        folder.mkdir(exist_ok=True)
        record: dict[str, Any] = {"format": FORMAT, "note": self._note}
        if not self._note and self._scratch is not None:
            for name in (film_worker.STILL, film_worker.FILM):
                shutil.copyfile(self._scratch.path / name, folder / name)
            manifest = json.loads((stage / store.MANIFEST).read_text(encoding="utf-8"))
            record |= {"model_sha256": manifest["model"]["sha256"], **self._record}
        text = json.dumps(record, indent=1, ensure_ascii=False) + "\n"
        (folder / RECORD).write_text(text, encoding="utf-8")

    def close(self) -> None:
        """End what still draws and remove what it leaves."""
        self._over = True
        if self._process is not None and self._process.poll() is None:
            self._process.kill()
        if self._thread is not None:
            self._thread.join(PATIENCE_S)
        if self._scratch is not None:
            self._scratch.close()

    def _draw(self, folder: Path) -> None:
        """Try one OpenGL after the other: a machine that can draw needs one process, others some that fail fast."""
        tried = backends()
        command = processes.python_module(film_worker.__name__, str(folder), *map(str, (WIDTH, HEIGHT, COLUMNS)))
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
                if ended == 0 and (folder / film_worker.FILM).is_file():
                    return
            except OSError as error:
                self._note = f"drawing could not be started: {error.strerror or error}"
                return
        self._note = f"no offscreen OpenGL on this machine (tried {', '.join(tried)})"


def _write_poses(folder: Path, model: mujoco.MjModel, qpos: FloatArray, times: FloatArray) -> dict[str, Any]:
    kept = np.unique(np.linspace(0, len(qpos) - 1, FRAMES).round().astype(int))
    mujoco.mj_saveModel(model, str(folder / MODEL))
    np.save(folder / POSES, qpos[kept])
    return {
        "columns": COLUMNS,
        "width": WIDTH,
        "height": HEIGHT,
        "times": [float(f"{time:.6g}") for time in times[kept]],
    }
