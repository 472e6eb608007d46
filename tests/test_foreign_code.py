"""Nothing that merely lies in a directory runs: modules, settings of libraries, a repository's programs.

A directory is filled with traps, one for every module that Python or an installed package could import, and each
command works in it. A trap that runs leaves its name; a twin shows that it would.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
import typer

from small_campaign import CANDIDATES, CASE, HEAD
from sweep_campaign import SWEEP
from workbench.campaign.commit import git_commit

CAMPAIGN = HEAD + CANDIDATES + CASE
TRAP = """
import posix
descriptor = posix.open({marks!r} + "/" + __name__, posix.O_CREAT | posix.O_WRONLY)
posix.close(descriptor)
raise SystemExit("a trap was imported: " + __name__)
"""

pytestmark = pytest.mark.skipif(os.name != "posix", reason="the traps are written with posix calls")


def lay_traps(place: Path, marks: Path) -> None:
    marks.mkdir()
    own = {"workbench", "sitecustomize_of_nobody"}
    for name in {*sys.stdlib_module_names, *packages_distributions(), "sitecustomize", "usercustomize"} - own:
        if name.isidentifier():
            (place / f"{name}.py").write_text(TRAP.format(marks=str(marks)))
    (place / "matplotlibrc").write_bytes(b"backend: module://trap_of_matplotlib\n\xff\xfe broken\n")
    (place / "trap_of_matplotlib.py").write_text(TRAP.format(marks=str(marks)))
    (place / ".numba_config.yaml").write_text(f"disable_jit: 1\ncache_dir: {place}\nopt: 17\n")
    (place / "libglfw.so").write_bytes(b"\x7fELF no library")
    program = place / "program.sh"
    program.write_text(f"#!/bin/sh\ntouch {marks}/program_of_$1\ncat\n")
    program.chmod(0o755)
    for name in ("git", "ffmpeg", "python", "python3", "gcc", "ld", "ldconfig", "uname"):
        shutil.copy(program, place / name)


def lay_traps_of_git(place: Path) -> None:
    def git(*arguments: str) -> None:
        subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b", *arguments], cwd=place, check=True,
                       capture_output=True, timeout=60)  # fmt: skip

    git("init")
    git("add", "small.toml")
    git("commit", "-m", "one")
    program = place / "program.sh"
    (place / ".gitattributes").write_text("* filter=trap diff=trap\n")
    for key, what in (
        ("core.fsmonitor", "fsmonitor"), ("core.pager", "pager"), ("core.sshCommand", "ssh"), ("core.editor", "editor"),
        ("filter.trap.clean", "clean"), ("filter.trap.smudge", "smudge"), ("filter.trap.process", "process"),
        ("diff.external", "external"), ("diff.trap.textconv", "textconv"), ("diff.trap.command", "command"),
        ("credential.helper", "credential"), ("gpg.program", "gpg"), ("alias.status", "!alias"), ("pager.status", "p"),
    ):  # fmt: skip
        git("config", key, f"{program} {what}")
    hooks = place / "hooks_of_repository"
    hooks.mkdir()
    git("config", "core.hooksPath", str(hooks))
    for hook in ("post-index-change", "pre-commit", "fsmonitor-watchman", "reference-transaction"):
        shutil.copy(program, hooks / hook)
    (place / "small.toml").touch()


@pytest.fixture(scope="module")
def trapped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("trapped")
    (place / "small.toml").write_text(CAMPAIGN)
    (place / "varied.toml").write_text(SWEEP.replace("samples = 40", "samples = 4"))
    (place / "pendulum.urdf").write_text(URDF)
    lay_traps(place, place / "marks")
    if shutil.which("git"):
        lay_traps_of_git(place)
    return place


def call(place: Path, *arguments: str, python: tuple[str, ...] = ("-P", "-m", "workbench")) -> tuple[int, str]:
    path = os.pathsep.join(["", os.environ.get("PYTHONPATH", "")]) if "PYTHONPATH" in os.environ else None
    environment = {**os.environ, "MPLBACKEND": "a_backend_that_went"} | ({"PYTHONPATH": path} if path else {})
    done = subprocess.run([sys.executable, *python, *arguments], cwd=place, env=environment, text=True, timeout=300,
                          capture_output=True, check=False, stdin=subprocess.DEVNULL)  # fmt: skip
    return done.returncode, done.stdout + done.stderr


COMMANDS = (
    (("run", "small.toml", "--out", "first"), 0),
    (("run", "small.toml", "--out", "second", "--quick", "--no-pictures"), 0),
    (("run", "small.toml", "--dry-run"), 0),
    (("run", "varied.toml", "--out", "swept", "--jobs", "2", "--quick"), 0),
    (("report", "first", "--format", "html", "--format", "md", "--format", "pdf"), 0),
    (("report", "swept"), 0),
    (("status", "first"), 0),
    (("compare", "first", "second"), 0),
    (("workspace", "models/asym_2rss_ppap.xml", "--grid", "0.05", "--out", "space"), 0),
    (("model", "show", "models/asym_2rss_ppap.xml"), 0),
    (("model", "check", "models/asym_2rss_ppap.xml"), 0),
    (("model", "set", "models/asym_2rss_ppap.xml", "a2=0.31", "--out", "changed.xml"), 0),
    (("model", "render", "models/asym_2rss_ppap.xml", "--out", "robot.png", "--size", "64x48"), None),
    (("model", "render", "models/asym_2rss_ppap.xml", "--out", "f.mp4", "--campaign", "small.toml", "--stop", "0.1"),
     None),
    (("model", "view", "models/asym_2rss_ppap.xml"), 2),
    (("new", "mine"), 0),
    (("report", "first", "--format", "csv", "--format", "mat"), 0),
    (("compare", "first", "second", "--html", "page.html"), 0),
    (("diagnose", "small.toml"), None),
    (("docs", "evidence"), 0),
    (("robots",), 0),
    (("robots", "fourbar", "--copy", "fourbar"), 0),
    (("run", "--robots", "fourbar", "--quick", "--out", "library"), 0),
    (("new", "imported", "--from", "changed.xml"), 0),
    (("new", "pendulum", "--from", "pendulum.urdf", "--actuated", "q1"), 2),
)  # fmt: skip
URDF = """<robot name="pendulum"><link name="base"/><link name="arm"><inertial><origin xyz="0 0 -0.3"/><mass value="2"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.01"/></inertial></link>
<joint name="q1" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="9" velocity="9"/></joint></robot>"""
SERVERS = {"watch": ("small.toml",), "studio": ("small.toml", "--port", "8801")}
"""Commands that go on until they are interrupted."""


QUICKLY = (
    (("run", "small.toml", "--out", "quick", "--quick"), 0),
    (("run", "varied.toml", "--out", "quickly", "--jobs", "1", "--quick"), 0),
)
"""The two that start processes of their own: one that draws, and workers; and a report in a process of its own."""


def obey(trapped: Path, commands: Sequence[tuple[tuple[str, ...], int | None]]) -> None:
    for arguments, expected in commands:
        code, said = call(trapped, *arguments)
        assert sorted(path.name for path in (trapped / "marks").iterdir()) == [], arguments
        assert code in ((0, 2) if expected is None else (expected,)), (arguments, said)
    kept = [*trapped.glob("*.nbi"), *trapped.glob("*.nbc"), *trapped.glob("*/*.nbi")]
    assert kept == []


def test_runs_and_sweeps_run_nothing_that_lies_in_their_directory(trapped: Path) -> None:
    obey(trapped, QUICKLY)


@pytest.mark.long
def test_no_command_runs_what_lies_in_its_directory(trapped: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)  # a viewer would wait for somebody to close it
    obey(trapped, COMMANDS)


def test_every_command_is_tried_among_traps() -> None:
    from workbench.cli import app
    from workbench.commands.model import model

    def names(group: typer.Typer) -> set[str]:
        called = [one.callback.__name__ for one in group.registered_commands if one.callback]
        return {name.rstrip("_") for name in called}

    tried = {arguments[0] for arguments, _ in COMMANDS} | set(SERVERS)
    assert tried == names(app) | {"model"}
    of_models = {arguments[1] for arguments, _ in COMMANDS if arguments[0] == "model"}
    assert of_models == names(model)


def interrupted(trapped: Path, command: str, waits: str) -> list[str]:
    """What such a command says until it waits; it is interrupted then."""
    call = [sys.executable, "-P", "-m", "workbench", command, *SERVERS[command]]
    with subprocess.Popen(call, cwd=trapped, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        said, waits_no_more = [], False
        patience = threading.Timer(300.0, process.kill)
        patience.start()
        for line in process.stdout:
            said.append(line)
            if waits in line and not waits_no_more:
                waits_no_more = True  # a second one would meet the interpreter at its end
                process.send_signal(signal.SIGINT)
        patience.cancel()
        assert process.wait(60) in (0, 130), said  # 130: interrupted before it had begun to wait
    assert list((trapped / "marks").iterdir()) == []
    return said


def test_watching_runs_nothing_either(trapped: Path) -> None:
    said = interrupted(trapped, "watch", "watching")
    assert any("within their bounds" in line for line in said), said


@pytest.mark.long
def test_the_studio_runs_nothing_either(trapped: Path) -> None:
    pytest.importorskip("viser")
    said = interrupted(trapped, "studio", "Ctrl-C")
    assert any("http://127.0.0.1:" in line for line in said), said


def test_python_m_leaves_the_directory_out_as_well(tmp_path: Path) -> None:
    """Python itself imports ``runpy`` from there, before anything of ours could hinder it; nothing after that."""
    lay_traps(tmp_path, tmp_path / "marks")
    for name in sys.stdlib_module_names:
        (tmp_path / f"{name}.py").unlink(missing_ok=True)
    code, said = call(tmp_path, "model", "show", "models/planar_4rprp.xml", python=("-m", "workbench"))
    assert (code, list((tmp_path / "marks").iterdir())) == (0, []), said


@pytest.mark.parametrize("arguments", [("-m", "workbench.cli", "--help"), ("-c", "import mujoco")])
def test_the_traps_work(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    lay_traps(tmp_path, tmp_path / "marks")
    for name in sys.stdlib_module_names:
        (tmp_path / f"{name}.py").unlink(missing_ok=True)
    call(tmp_path, python=arguments)
    assert list((tmp_path / "marks").iterdir())


# --- the commit of a checkout -----------------------------------------------------------------------------------------


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    (tmp_path / "small.toml").write_text("one\n")
    shutil.copy(shutil.which("true") or "/bin/true", tmp_path / "program.sh")
    (tmp_path / "marks").mkdir()
    (tmp_path / "program.sh").write_text(f"#!/bin/sh\ntouch {tmp_path}/marks/$1\ncat\n")
    lay_traps_of_git(tmp_path)
    return tmp_path


def commit_by_git(checkout: Path) -> str:
    done = subprocess.run(["git", "rev-parse", "HEAD"], cwd=checkout, check=True, text=True, capture_output=True)
    return done.stdout.strip()


def test_the_commit_is_the_one_that_git_names(checkout: Path) -> None:
    commit = commit_by_git(checkout)
    for mark in (checkout / "marks").iterdir():
        mark.unlink()
    assert git_commit(checkout) == commit
    (checkout / "below").mkdir()
    assert git_commit(checkout / "below") == commit
    (checkout / "small.toml").write_text("two\n")
    assert git_commit(checkout) == f"{commit}+"
    assert list((checkout / "marks").iterdir()) == []


def test_git_itself_would_have_run_a_program(checkout: Path) -> None:
    (checkout / "small.toml").write_text("two\n")
    subprocess.run(["git", "status", "--porcelain"], cwd=checkout, capture_output=True, check=False, timeout=60)
    assert list((checkout / "marks").iterdir())


def test_packed_references_worktrees_and_staged_changes(checkout: Path, tmp_path: Path) -> None:
    commit = commit_by_git(checkout)
    for arguments in (("pack-refs", "--all"), ("gc", "--quiet"), ("worktree", "add", "-q", "beside", "-b", "other")):
        subprocess.run(["git", *arguments], cwd=checkout, check=True, capture_output=True, timeout=60)
    assert git_commit(checkout) == commit
    assert git_commit(checkout / "beside") == commit
    (checkout / "beside" / "new").write_text("new\n")
    subprocess.run(["git", "add", "new"], cwd=checkout / "beside", check=True, capture_output=True, timeout=60)
    assert git_commit(checkout / "beside") == f"{commit}+"


@pytest.mark.parametrize(
    "head", ["", "ref: ../../secret", "ref: refs/heads/none", "f" * 39, "ref: refs/heads/\0", "\xff"]
)
def test_a_broken_checkout_has_no_commit(tmp_path: Path, head: str) -> None:
    (tmp_path / ".git").mkdir()
    (tmp_path / ".git/HEAD").write_bytes(head.encode("latin-1"))
    assert git_commit(tmp_path) is None
