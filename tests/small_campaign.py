"""A small campaign for tests, and the command line called in this process."""

from __future__ import annotations

import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from workbench.cli import main
from workbench.commands import run as run_command

CANDIDATES = """
[[candidate]]
name = "lumped"
reference = "lumped"
bound = 1e-10

[[candidate]]
name = "distributed"
reference = "distributed"
bound = 1e-10

[[candidate]]
name = "lumped"
reference = "distributed"
"""

HEAD = """
format = 1
name = "small"
title = "A small campaign"
model = "models/asym_2rss_ppap.xml"
"""

MOTION = """
[case.motion]
kind = "multi_sine"
offset = [0.02, 0.75, 0.85]
terms = [[[0.06, 4.0, 0.3]], [[0.3, 6.0]], [[0.28, 5.0, 2.6]]]
stop = 1.0
samples = 21
"""

CASE = f"""
[[case]]
name = "first"
{MOTION}
"""

CASES = f"""
{CASE}
[[case]]
name = "second"
parameters = {{ payload = 1.5 }}
external_force = [12.0, -8.0, 25.0]
{MOTION}
"""

SMALL = HEAD + CANDIDATES + CASES


@dataclass(frozen=True)
class Done:
    """What a call of the command line left."""

    code: int
    out: str
    err: str

    @property
    def complaint(self) -> list[str]:
        """Lines on stderr that are no progress, ``[1/2] first``, and no notice of a first use."""
        return [line for line in self.err.splitlines() if not re.match(r"\[\d+/\d+\] |workbench: compiling ", line)]


def listing(directory: Path) -> dict[str, bytes | None]:
    """Every file, directory and link below, with the content of files."""
    return {
        str(path.relative_to(directory)): path.read_bytes() if path.is_file() else None
        for path in sorted(directory.rglob("*"))
    }


class Workbench:
    """Calls of ``workbench`` in this process, in a directory of its own; what takes long is left out unless asked for.

    That are reports, pictures, and what `--quick` leaves out: the evidence about the reference takes six times as long
    as all the rest of a small run.
    """

    def __init__(self, directory: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self.directory = directory
        self._patch = monkeypatch
        self._captured = capsys
        monkeypatch.chdir(directory)
        monkeypatch.setattr("workbench.report.build_report", lambda directory: None)
        monkeypatch.setattr("workbench.commands.sweeps.report_apart", lambda directory: None)
        monkeypatch.setattr("workbench.rendering.run_pictures.RunPictures", lambda: None)
        monkeypatch.setattr("workbench.commands.run_cases.WORTH_IT", 1_000_000)
        monkeypatch.setattr("workbench.rendering.tracking_film.draw_tracking", lambda footage, directory: None)
        self._effort = run_command._effort
        monkeypatch.setattr(run_command, "_effort", lambda engines, quick: self._effort(engines, True))

    def write(self, text: str, name: str = "small.toml") -> str:
        """Write a file and return its name."""
        (self.directory / name).write_text(text, encoding="utf-8")
        return name

    def gather_evidence(self) -> None:
        """From now on a run gathers power balance and forward replay, as the command does unless told `--quick`."""
        self._patch.setattr(run_command, "_effort", self._effort)

    def __call__(self, *arguments: str | os.PathLike[str]) -> Done:
        """Call the command line."""
        self._patch.setattr(sys, "argv", ["workbench", *map(os.fspath, arguments)])
        self._captured.readouterr()
        with pytest.raises(SystemExit) as stop:
            main()
        out, err = self._captured.readouterr()
        assert isinstance(stop.value.code, int)
        return Done(stop.value.code, out, err)

    def run(self, text: str, *options: str) -> Done:
        """Write a campaign and run it."""
        return self("run", self.write(text), *options)
