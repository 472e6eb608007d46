"""Pictures of a run's robot, drawn while the run computes: a still and a film of the first case. They fail no run."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

from workbench.campaign import store
from workbench.campaign.compare import CaseResult
from workbench.rendering import drawing
from workbench.rendering.drawing import COLUMNS, HEIGHT, WIDTH, Drawing, frames_of
from workbench.rendering.film_worker import SHEET, STILL

FORMAT = 1
RECORD, MECHANISM, FILM = "pictures.json", "mechanism.webp", "film.webp"


class RunPictures:
    """Draws in a process of its own, watched by a thread; what goes wrong is said in the record."""

    def __init__(self) -> None:
        self._drawing = Drawing()
        self._record: dict[str, Any] = {}

    def start(self, result: CaseResult) -> None:
        """Begin to draw the robot along a case."""
        if result.qpos is None or self._record:
            return
        kept = frames_of(len(result.qpos))
        times = [float(f"{time:.6g}") for time in result.series["t"][kept]]
        self._record = {"columns": COLUMNS, "width": WIDTH, "height": HEIGHT, "times": times, "case": result.name}
        self._drawing.start(result.model, result.qpos[None, kept])

    def finish(self, stage: Path) -> None:
        """Put the pictures, or the reason why there are none, into a run directory."""
        if not self._record:
            return
        drawn = self._drawing.finish(drawing.PATIENCE_S)
        folder = stage / store.PICTURES
        folder.mkdir(exist_ok=True)
        record: dict[str, Any] = {"format": FORMAT, "note": self._drawing.note}
        if drawn is not None:
            shutil.copyfile(drawn / STILL.format(0), folder / MECHANISM)
            shutil.copyfile(drawn / SHEET.format(0), folder / FILM)
            manifest = json.loads((stage / store.MANIFEST).read_text(encoding="utf-8"))
            record |= {"model_sha256": manifest["model"]["sha256"], **self._record}
        text = json.dumps(record, indent=1, ensure_ascii=False) + "\n"
        (folder / RECORD).write_text(text, encoding="utf-8")

    def close(self) -> None:
        """End what still draws and remove what it leaves."""
        self._drawing.close()
