"""What is published installs without a network and works far from the checkout; so does shell completion."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from workbench import __version__

NAME = f"parallel_robot_workbench-{__version__}"


def build(source: Path, kind: str, out: Path) -> Path:
    command = [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", out]
    subprocess.run(command, cwd=source, check=True, capture_output=True)
    (built,) = out.glob("*.whl" if kind == "wheel" else "*.tar.gz")
    return built


def contents(wheel: Path) -> dict[str, bytes]:
    """Files of a wheel; its own list of them holds their order."""
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist() if not name.endswith("/RECORD")}


@pytest.fixture(scope="module")
def distributions(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    pytest.importorskip("hatchling")
    out = tmp_path_factory.mktemp("dist")
    return build(repository, "wheel", out / "wheel"), build(repository, "sdist", out / "sdist")


@pytest.fixture(scope="module")
def installed(distributions: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment with the wheel; it sees this one's dependencies, and this one's workbench only behind its own."""
    pytest.importorskip("pip")
    place = tmp_path_factory.mktemp("environment")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", place], check=True)
    python = place / "bin" / "python"
    if not python.exists():
        pytest.skip("another layout of environments than that of POSIX")
    ask = "import sysconfig; print(sysconfig.get_path('purelib'))"
    packages = Path(subprocess.run([python, "-c", ask], check=True, capture_output=True, text=True).stdout.strip())
    here = [entry for entry in sys.path if entry.endswith(("site-packages", "dist-packages"))]
    (packages / "dependencies.pth").write_text("\n".join(here), encoding="utf-8")
    command = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet", "--no-index", "--no-deps"]
    subprocess.run([*command, "--ignore-installed", str(distributions[0])], check=True)
    return place


def said(installed: Path, *command: str, cwd: Path, **environment: str) -> str:
    program, *arguments = command
    done = subprocess.run(
        [installed / "bin" / program, *arguments], cwd=cwd, env=clean() | environment, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def clean() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}


@pytest.mark.slow
def test_the_source_distribution_makes_the_same_wheel(distributions: tuple[Path, Path], tmp_path: Path) -> None:
    wheel, archive = distributions
    assert (wheel.name, archive.name) == (f"{NAME}-py3-none-any.whl", f"{NAME}.tar.gz")
    with tarfile.open(archive) as tar:
        tar.extractall(tmp_path, filter="data")
        names = {name.removeprefix(f"{NAME}/") for name in tar.getnames()}
    assert {"LICENSE", "README.md", "CITATION.cff", "tests/conftest.py", "paper/paper.md", "website/conf.py"} <= names
    assert not [name for name in names if name.startswith(("reports/", "build/", ".venv/"))]
    again = build(tmp_path / NAME, "wheel", tmp_path / "again")
    assert contents(again) == contents(wheel)


@pytest.mark.slow
def test_an_installed_wheel_works_away_from_the_checkout(installed: Path, tmp_path: Path, repository: Path) -> None:
    where = said(installed, "python", "-P", "-c", "import workbench; print(workbench.__file__)", cwd=tmp_path)
    assert Path(where.strip()).is_relative_to(installed)
    for command in (("workbench",), ("python", "-m", "workbench")):
        assert said(installed, *command, "--version", cwd=tmp_path) == f"workbench {__version__}\n"
    listed = said(installed, "workbench", "docs", cwd=tmp_path).split()
    assert {"start", "faq", "comparison", "derivations/asym_2rss_ppap"} <= set(listed)
    page = (repository / "docs" / "faq.md").read_text(encoding="utf-8")
    assert said(installed, "workbench", "docs", "faq", cwd=tmp_path) == page
    assert "payload" in said(installed, "workbench", "model", "show", "asym_2rss_ppap", cwd=tmp_path)
    run = ("workbench", "run", "almeida_2010", "--only", "simulation_2", "--quick", "--no-pictures")
    assert "PASSED" in said(installed, *run, cwd=tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "kernels"))
    assert (tmp_path / "reports" / "almeida_2010" / "report.html").exists()


@pytest.mark.slow
def test_the_installed_command_completes_itself(installed: Path, tmp_path: Path) -> None:
    def completed(words: str) -> list[str]:
        count = str(len(words.split(" ")) - 1)
        asked = {"_WORKBENCH_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": count}
        return said(installed, "workbench", cwd=tmp_path, **asked).split()

    assert completed("workbench mo") == ["model"]
    assert completed("workbench model re") == ["render"]
    assert "--keep-going" in completed("workbench run --k")
    assert completed("workbench nosuch") == []
