"""Files that a user names to be written: what would be lost in their place is refused before anything is computed."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from small_campaign import SMALL, Workbench
from workbench.errors import OutputError
from workbench.output_file import refuse_target

pytestmark = pytest.mark.skipif(os.name != "posix", reason="links, pipes and devices are POSIX")


def as_it_is(path: Path) -> object:
    """What a file is, without when it was last looked at."""
    if not os.path.lexists(path):
        return None
    found = os.lstat(path)
    return found.st_mode, found.st_ino, found.st_size, found.st_mtime_ns, found.st_nlink


def lay(place: Path, kind: str) -> Path:
    path = place / "x.json"
    other = place / "other"
    other.write_text("precious")
    if kind == "directory":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "link":
        path.symlink_to(other)
    elif kind == "hard link":
        os.link(other, path)
    elif kind == "read-only":
        path.write_text("precious")
        path.chmod(0o444)
    elif kind == "no directory":
        return place / "nowhere" / "x.json"
    return path


SAID = {
    "directory": "is a directory", "pipe": "is no regular file", "link": "is a symbolic link",
    "hard link": "has 2 names", "read-only": "is read-only", "no directory": "there is no directory",
}  # fmt: skip


@pytest.mark.parametrize("kind", SAID)
def test_what_would_be_lost_is_refused(tmp_path: Path, kind: str) -> None:
    with pytest.raises(OutputError, match=SAID[kind]):
        refuse_target(lay(tmp_path, kind))


def test_devices_are_refused_and_files_are_not(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"/dev/null: is no regular file"):
        refuse_target(Path("/dev/null"))
    with pytest.raises(OutputError, match="null byte"):
        refuse_target(tmp_path / "a\0b")
    (tmp_path / "old").write_text("x")
    refuse_target(tmp_path / "old")
    refuse_target(tmp_path / "new")


@pytest.mark.parametrize("option", ["--json", "--apply"])
@pytest.mark.parametrize("kind", SAID)
def test_diagnose_refuses_its_files_before_it_looks_at_a_formula(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], option: str, kind: str
) -> None:
    workbench = Workbench(tmp_path, monkeypatch, capsys)
    workbench.write(SMALL)
    path = lay(tmp_path, kind)
    before = as_it_is(path)
    done = workbench("diagnose", "small.toml", option, os.fspath(path))
    assert (done.code, done.out) == (2, "")
    assert SAID[kind] in done.complaint[0]
    assert as_it_is(path) == before
