"""Rendered pictures as a run stores them, without a robot: frames that differ in brightness."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from PIL import Image

TIMES = (0.1, 1.2, 2.6, 4.0, 5.0)
COLUMNS, WIDTH, HEIGHT = 2, 40, 30


def store_pictures(folder: Path, **changes: Any) -> Path:
    """Put pictures of case ``sim1`` into a run directory; *changes* go over their record."""
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    place = folder / "pictures"
    place.mkdir()
    sheet = Image.new("RGB", (COLUMNS * WIDTH, 3 * HEIGHT))
    for number in range(len(TIMES)):
        frame = Image.new("RGB", (WIDTH, HEIGHT), (40 * number, 40 * number, 40 * number))
        sheet.paste(frame, (number % COLUMNS * WIDTH, number // COLUMNS * HEIGHT))
    sheet.save(place / "film.webp", lossless=True)
    Image.new("RGB", (2 * WIDTH, 2 * HEIGHT), (0, 0, 0)).save(place / "mechanism.webp", lossless=True)
    record = {
        "format": 1, "note": "", "case": "sim1", "model_sha256": manifest["model"]["sha256"], "columns": COLUMNS,
        "width": WIDTH, "height": HEIGHT, "times": TIMES,
    }  # fmt: skip
    (place / "pictures.json").write_text(json.dumps(record | changes), encoding="utf-8")
    return folder
