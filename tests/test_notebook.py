"""The notebook runs from top to bottom, and the outputs kept in it are those of its cells."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

from tutorial import normalised

pytestmark = pytest.mark.slow
LIGHT = 150_000
"""Bytes: outputs are kept as long as nobody minds them in a clone."""


def texts(notebook: Any) -> list[list[str]]:
    """What the cells print and show as text, cell by cell; pictures are left to the eye."""
    found = []
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            shown = output.get("text") or output["data"].get("text/plain", "")
            if "image/png" not in output.get("data", {}):
                found.append(normalised(shown))
    return found


def run_again(file: Path, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, Any]:
    """The notebook as kept, and run from top to bottom beside a copy of the folder that it uses."""
    for name in ("JUPYTER_RUNTIME_DIR", "JUPYTER_DATA_DIR", "IPYTHONDIR"):
        monkeypatch.setenv(name, str(tmp_path / name))
    monkeypatch.delenv("MPLBACKEND", raising=False)  # else pictures are not shown
    kept = nbformat.read(file, as_version=4)
    nbformat.validate(kept)
    assert file.stat().st_size < LIGHT
    shutil.copytree(folder, tmp_path / "examples" / folder.name)
    fresh = nbformat.read(file, as_version=4)
    for cell in fresh.cells:
        if cell.cell_type == "code":
            cell.outputs = []
    where = {"metadata": {"path": str(tmp_path / "examples")}}
    NotebookClient(fresh, timeout=300, kernel_name="python3", resources=where).execute()
    assert texts(fresh) == texts(kept)
    assert sum("image/png" in o.get("data", {}) for c in fresh.cells for o in c.get("outputs", [])) == 1
    return kept, fresh


def test_the_notebook_of_recorded_torques_finds_what_was_planted(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    examples = repository / "examples"
    kept, _ = run_again(examples / "recorded.ipynb", examples / "recorded", tmp_path, monkeypatch)
    shown = str(texts(kept))
    assert "differs" in shown
    assert "dry friction: +0.04940" in shown  # planted: 0.05 N m
    assert "scale: +1.05 % " in shown  # planted: 1 %


def test_the_notebook_gives_what_it_shows(repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    examples = repository / "examples"
    kept, fresh = run_again(examples / "results.ipynb", examples / "orthoglide", tmp_path, monkeypatch)
    # units come with the frames; and twin: another number would be seen
    shown = str(texts(kept))
    assert "'ref_distributed_q1': 'N'" in shown
    assert "5.060" in shown
    for cell in fresh.cells:
        for output in cell.get("outputs", []):
            if "5.060" in output.get("data", {}).get("text/plain", ""):
                output.data["text/plain"] = output.data["text/plain"].replace("5.060", "5.061")
    assert texts(fresh) != texts(kept)
