"""What takes a while shows that it goes on: a bar on a terminal, a plain line now and then elsewhere."""

from __future__ import annotations

import io
import os
import subprocess
import sys

import pytest
from rich.console import Console

import workbench as wb
from workbench import terminal


def shown_on(monkeypatch: pytest.MonkeyPatch, terminal: bool) -> io.StringIO:
    screen = io.StringIO()
    monkeypatch.setattr("workbench.terminal.err", Console(file=screen, force_terminal=terminal, width=100))
    return screen


def test_a_terminal_has_a_bar_with_what_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = shown_on(monkeypatch, terminal=True)
    with terminal.Steps("drawing figures") as steps:
        steps(3, 7)
        steps._bar.refresh()
    assert "drawing figures" in screen.getvalue()
    assert "3/7" in screen.getvalue()
    with terminal.CaseProgress() as cases:
        cases("second [case]", 1, 4)
        cases._bar.refresh()
        cases("", 4, 4)
        cases._bar.refresh()
    assert "second [case]" in screen.getvalue()
    assert "1/4" in screen.getvalue()
    assert "writing the report" in screen.getvalue()


def test_elsewhere_a_line_comes_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = shown_on(monkeypatch, terminal=False)
    clock = [100.0]
    monkeypatch.setattr(terminal.time, "monotonic", lambda: clock[0])
    with terminal.Steps("computing the workspace") as steps:
        for done in range(200):
            clock[0] += 1.0
            steps(done, 200)
    lines = screen.getvalue().splitlines()
    assert 2 <= len(lines) <= 40
    assert all("computing the workspace" in line for line in lines)
    with terminal.CaseProgress() as cases:
        cases("first", 0, 2)
        cases("", 2, 2)
    assert screen.getvalue().splitlines()[len(lines) :] == ["[1/2] first"]


def test_a_wrong_attribute_of_parameters_lists_the_valid_names() -> None:
    parameters = wb.load_mechanism("models/planar_4rprp.xml").parameters
    with pytest.raises(AttributeError, match=r'no parameter "m9"; valid: .*\bm2\b.*\bm3\b'):
        parameters.m9  # noqa: B018


def test_a_switch_of_the_environment_that_the_kernels_cannot_stand_is_not_heeded() -> None:
    code = (
        "import os, workbench.compiled\nfrom numba import config\n"
        "print(config.DISABLE_JIT, os.environ.get('NUMBA_DISABLE_JIT'))"
    )
    done = subprocess.run([sys.executable, "-c", code], env={**os.environ, "NUMBA_DISABLE_JIT": "1"}, text=True,
                          capture_output=True, timeout=120, check=False)  # fmt: skip
    assert done.stdout.split() in (["0", "None"], ["False", "None"]), done
