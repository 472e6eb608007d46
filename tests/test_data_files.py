"""Bundled models and campaigns are found in a checkout and in an installed, read-only wheel."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from typer.testing import CliRunner

from workbench.cli import app
from workbench.data_files import bundled, bundled_names
from workbench.errors import WorkbenchError


def checkout(root: Path) -> Path:
    (root / "models").mkdir()
    (root / "campaigns").mkdir()
    (root / "models" / "robot.xml").write_text("<mujoco/>", encoding="utf-8")
    (root / "models" / "notes.md").write_text("no model", encoding="utf-8")
    (root / "pyproject.toml").write_text("", encoding="utf-8")
    package = root / "src" / "workbench"
    package.mkdir(parents=True)
    return package


def test_checkout_names_with_and_without_ending(tmp_path: Path) -> None:
    package = checkout(tmp_path)
    assert (
        bundled("models", "robot", package) == bundled("models", "robot.xml", package) == tmp_path / "models/robot.xml"
    )
    assert bundled_names("models", package) == ("robot.xml",)
    assert bundled_names("campaigns", package) == ()


def test_installed_data_win_over_a_stranger_beside_the_package(tmp_path: Path) -> None:
    package = checkout(tmp_path)
    (tmp_path / "pyproject.toml").unlink()
    (package / "data" / "models").mkdir(parents=True)
    (package / "data" / "models" / "other.xml").write_text("<mujoco/>", encoding="utf-8")
    assert bundled_names("models", package) == ("other.xml",)


@pytest.mark.parametrize(
    ("kind", "name", "message"),
    [
        ("models", "robt.xml", 'did you mean "robot.xml"'),
        ("models", "../pyproject", "no file"),
        ("models", "../models/robot.xml", "no file"),
        ("models", "notes.md", "no file"),
        ("model", "robot", 'did you mean "models"'),
    ],
)
def test_unknown_names_are_one_line(tmp_path: Path, kind: str, name: str, message: str) -> None:
    with pytest.raises(WorkbenchError, match=message) as caught:
        bundled(kind, name, checkout(tmp_path))  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


def test_an_installation_without_data_says_so(tmp_path: Path) -> None:
    with pytest.raises(WorkbenchError, match="install the workbench again"):
        bundled("models", "robot", tmp_path / "lib" / "workbench")


@pytest.mark.slow
def test_a_wheel_carries_models_and_campaigns(repository: Path, tmp_path: Path) -> None:
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", tmp_path], cwd=repository, check=True
    )
    (wheel,) = tmp_path.glob("*.whl")
    site = tmp_path / "site"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    before = {path: path.stat().st_mtime_ns for path in site.rglob("*")}
    for path in before:
        path.chmod(0o555 if path.is_dir() else 0o444)
    code = (
        "import workbench.data_files as d; print(d.__file__);"
        "print(*[d.bundled(k, n) for k in ('models', 'campaigns', 'docs') for n in d.bundled_names(k)], sep='\\n')"
    )
    environment = {**os.environ, "PYTHONPATH": str(site), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment, check=True, capture_output=True, text=True
    )
    module, *found = map(Path, done.stdout.split("\n")[:-1])
    assert module == site / "workbench" / "data_files.py"
    shipped = {*(repository / "models").glob("*.xml"), *(repository / "campaigns").glob("*.toml")}
    shipped |= set((repository / "docs").rglob("*.md"))
    assert {path.parent.name for path in shipped} == {"models", "campaigns", "docs", "derivations"}
    assert set(found) == {site / "workbench" / "data" / path.relative_to(repository) for path in shipped}
    assert {path: path.stat().st_mtime_ns for path in site.rglob("*")} == before


def test_every_document_that_is_cited_can_be_read_from_the_package(repository: Path) -> None:
    cited = {
        name
        for folder, pattern in (("campaigns", "*.toml"), ("src/workbench", "**/*.py"))
        for path in (repository / folder).glob(pattern)
        for name in re.findall(r"docs/([a-z0-9_/-]+\.md)", path.read_text(encoding="utf-8"))
    }
    assert {"evidence.md", "derivations/asym_2rss_ppap.md"} <= cited
    assert cited <= set(bundled_names("docs"))
    assert not {"gone.md"} <= set(bundled_names("docs"))
    done = CliRunner().invoke(app, ["docs", "docs/derivations/asym_2rss_ppap.md, section 7"])
    assert done.output == (repository / "docs" / "derivations" / "asym_2rss_ppap.md").read_text(encoding="utf-8")
    assert "derivations/planar_4rprp" in CliRunner().invoke(app, ["docs"]).output.split()
