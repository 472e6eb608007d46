"""The package says that it runs on any system: no call that only some have is made without asking for it."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

from floors import floors
from small_campaign import CANDIDATES, CASE, HEAD
from sweep_campaign import SWEEP

ONLY_SOMEWHERE = (
    "O_CLOEXEC", "O_NONBLOCK", "O_NOFOLLOW", "pwrite", "pread", "nice", "sched_getaffinity", "killpg", "fork",
    "geteuid", "getuid", "fchmod", "fchdir", "fchown", "mkfifo", "link_",
)  # fmt: skip
"""Members of ``os`` that are missing on some system."""

WITHOUT = """
import os, signal, sys
import asyncio, matplotlib, mujoco, multiprocessing.util, numba, numpy, pandas, pyarrow, scipy, shutil, subprocess
import pyarrow.parquet, tempfile, typer
for name in {names!r}:
    if hasattr(os, name):
        delattr(os, name)
for name in ("setitimer", "SIGALRM", "SIGHUP", "ITIMER_REAL", "pthread_kill", "pthread_sigmask"):
    if hasattr(signal, name):
        delattr(signal, name)
sys.modules["resource"] = None
from workbench.cli import main
for arguments in {commands!r}:
    sys.argv = ["workbench", *arguments]
    try:
        main()
    except SystemExit as stop:
        if stop.code:
            sys.exit(f"{{arguments[0]}} ends with exit code {{stop.code}}")
"""

FORMULA = """
import workbench

@workbench.candidate("mine", reference="distributed")
def mine(parameters, q, qd, qdd):
    return 0 * q
"""


def test_runs_and_sweeps_work_without_what_only_some_systems_have(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(HEAD + CANDIDATES + CASE)
    (tmp_path / "mine.py").write_text(FORMULA)
    (tmp_path / "varied.toml").write_text(SWEEP.replace("samples = 40", "samples = 2"))
    commands = (
        ("run", "small.toml", "--no-pictures", "--candidates", "mine.py"),
        ("status", "reports/small"),
        ("run", "varied.toml", "--quick", "--jobs", "1", "--out", "swept"),
    )
    code = WITHOUT.format(names=ONLY_SOMEWHERE, commands=commands)
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done
    assert "reports/small (small): finished" in done.stdout
    assert (tmp_path / "swept/sweep.json").is_file()


def unguarded(source: str) -> list[str]:
    """Members that are used in a file where nothing asks whether they are there."""
    nodes = list(ast.walk(ast.parse(source)))
    used = {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    asked = {node.value for node in nodes if isinstance(node, ast.Constant)}
    names = (*ONLY_SOMEWHERE, "setitimer", "SIGHUP", "flock", "RLIMIT_AS")
    return [name for name in names if name in used and name not in asked and "import resource" not in source]


def test_no_file_uses_such_a_call_without_asking(repository: Path) -> None:
    for path in (repository / "src").rglob("*.py"):
        assert unguarded(path.read_text(encoding="utf-8")) == [], path
    assert unguarded("import os\nos.pread(1, 2, 3)") == ["pread"]
    assert unguarded("import os\nif hasattr(os, 'nice'): os.nice(10)") == []
    assert os.name in ("posix", "nt")


def test_every_dependency_has_both_bounds(repository: Path) -> None:
    text = (repository / "pyproject.toml").read_text(encoding="utf-8")
    found = floors(text)
    assert {"numpy", "pyarrow", "typer", "mujoco-core", "pin", "dask"} <= set(found)
    for name in found:
        assert f"{name}>=" in text or f"{name}[" in text
    dependencies = [line for line in text.splitlines() if line.strip().startswith('"') and ">=" in line]
    assert all("," in line.split('"')[1] for line in dependencies), dependencies
