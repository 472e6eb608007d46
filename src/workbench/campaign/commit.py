"""The git commit of a checkout, read without running anything that the checkout itself names.

A repository's configuration names programs (a file-system monitor, hooks, filters, pagers, helpers of remotes), and
git asked inside it would run some of them. So the commit is read from the files, and whether it has uncommitted changes
is asked of git with a repository of our own making: it borrows objects and index, and has no configuration.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

from workbench.scratch import scratch_directory

LONGEST = 10_000_000
"""Bytes of a file of references that is still read."""
PATIENCE_S = 10
_COMMIT = re.compile(r"[0-9a-f]{40}(?:[0-9a-f]{24})?")
_REFERENCE = re.compile(r"refs/[^\x00-\x20\\:?*\[~^]+")
SHA256_DIGITS = 64


def git_commit(directory: Path) -> str | None:
    """Commit of the checkout that holds *directory*, with ``+`` where it has uncommitted changes; None outside one.

    ``+`` stands also where git, which tells, is missing or cannot read the index.
    """
    try:
        found = _checkout(directory)
        if found is None:
            return None
        top, private = found
        shared = private / (_line(private / "commondir") or ".")
        commit = _head(private, shared)
        if commit is None:
            return None
        return commit if _unchanged(top, private, shared, commit) else f"{commit}+"
    except (OSError, ValueError):
        return None


def _checkout(directory: Path) -> tuple[Path, Path] | None:
    """Return the top of the checkout and the directory that holds its HEAD."""
    place = directory.resolve()
    for top in (place, *place.parents):
        git = top / ".git"
        if git.is_dir():
            return top, git
        if git.is_file():
            pointer = _line(git)
            return (top, top / pointer.removeprefix("gitdir:").strip()) if pointer.startswith("gitdir:") else None
    return None


def _line(path: Path) -> str:
    """Return the first line of a small file; empty where there is none."""
    return next(iter(_text(path).splitlines()), "")


def _text(path: Path) -> str:
    if not path.is_file() or path.stat().st_size > LONGEST:
        return ""
    return path.read_text(encoding="utf-8")


def _head(private: Path, shared: Path) -> str | None:
    said = _line(private / "HEAD")
    for _ in range(5):  # a symbolic reference may lead to another
        if _COMMIT.fullmatch(said):
            return said
        name = said.removeprefix("ref:").strip()
        if not _REFERENCE.fullmatch(name) or ".." in name:
            return None
        said = _line(private / name) or _line(shared / name) or _packed(shared / "packed-refs", name)
    return None


def _packed(path: Path, name: str) -> str:
    for line in _text(path).splitlines():
        commit, _, packed = line.partition(" ")
        if packed == name:
            return commit
    return ""


def _unchanged(top: Path, private: Path, shared: Path, commit: str) -> bool:
    git = shutil.which("git")
    if git is None or Path(git).resolve().is_relative_to(top):
        return False
    with scratch_directory() as own:
        (own / "refs").mkdir()
        (own / "HEAD").write_text(f"{commit}\n", encoding="utf-8")
        version = "1\n[extensions]\n\tobjectformat = sha256" if len(commit) == SHA256_DIGITS else "0"
        (own / "config").write_text(f"[core]\n\trepositoryformatversion = {version}\n", encoding="utf-8")
        environment = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")} | {
            "GIT_DIR": str(own),
            "GIT_WORK_TREE": str(top),
            "GIT_INDEX_FILE": str(private / "index"),
            "GIT_OBJECT_DIRECTORY": str(shared / "objects"),
            "GIT_CONFIG_GLOBAL": os.devnull,
            "GIT_CONFIG_NOSYSTEM": "1",
            "GIT_ATTR_NOSYSTEM": "1",
            "GIT_OPTIONAL_LOCKS": "0",
        }
        # of submodules only the commit is looked at: anything more would run git inside them
        command = [git, "status", "--porcelain", "--untracked-files=no", "--ignore-submodules=dirty"]
        try:
            done = subprocess.run(
                command, cwd=top, env=environment, stdin=subprocess.DEVNULL, capture_output=True, timeout=PATIENCE_S,
                check=False,
            )  # fmt: skip
        except (OSError, subprocess.SubprocessError):
            return False
    return done.returncode == 0 and not done.stdout
