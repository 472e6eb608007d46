"""The film of a study: the robot where each model lets it go, its error enlarged, and where it should be."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from workbench.campaign import store
from workbench.control.footage import Footage
from workbench.control.names import LOOP_COLUMNS, TRACKING
from workbench.errors import WorkbenchError
from workbench.rendering.drawing import COLUMNS, HEIGHT, WIDTH, Drawing, frames_of
from workbench.rendering.film_worker import SHEET, STILL

FORMAT = 1
PATIENCE_S = 120.0
"""How long a study, which has nothing else left to do, waits for its film."""


def draw_tracking(footage: Callable[[], Footage | None], directory: Path) -> None:
    """Put the film of a study, or the reason why there is none, into its run directory in place of an earlier one.

    Parameters
    ----------
    footage
        Makes what is to be shown; None where no run tracks.
    directory
        Of a study, with its results.
    """
    folder = directory / store.PICTURES
    shutil.rmtree(folder, ignore_errors=True)
    record: dict[str, Any] = {"format": FORMAT, "note": ""}
    with closing(Drawing()) as drawing:
        try:
            shown = footage()
        except WorkbenchError as error:
            shown, record["note"] = None, str(error)
        if shown is None and not record["note"]:
            return
        folder.mkdir(exist_ok=True)
        if shown is not None:
            record |= _drawn(drawing, shown, folder)
        text = json.dumps(record, indent=1, ensure_ascii=False) + "\n"
        (folder / TRACKING).write_text(text, encoding="utf-8")


def _drawn(drawing: Drawing, shown: Footage, folder: Path) -> dict[str, Any]:
    """Draw, put the pictures into *folder* and return what the record says of them."""
    kept = np.unique(np.append(frames_of(len(shown.times)), shown.worst))
    still = int(np.searchsorted(kept, shown.worst))
    drawing.start(shown.compiled, np.stack([take.qpos[kept] for take in shown.takes]), shown.wanted[kept], still)
    drawn = drawing.finish(PATIENCE_S)
    if drawn is None:
        return {"note": drawing.note}
    takes = []
    for number, take in enumerate(shown.takes):
        names = {"still": f"tracking-{number}-still.webp", "sheet": f"tracking-{number}.webp"}
        shutil.copyfile(drawn / STILL.format(number), folder / names["still"])
        shutil.copyfile(drawn / SHEET.format(number), folder / names["sheet"])
        takes.append(
            {"run": take.run, "key": take.key, "model": take.model, "rms": take.rms, "peak": take.peak, **names}
        )
    times = [float(f"{time:.6g}") for time in shown.times[kept]]
    return {
        **{name: getattr(shown.loop, name) for name in LOOP_COLUMNS if name != "model"},
        "enlarged": shown.enlarged, "worst": times[still], "takes": takes,
        "columns": COLUMNS, "width": WIDTH, "height": HEIGHT, "times": times,
    }  # fmt: skip
