"""The tutorial as a list of steps: files that it shows, changes to them, commands, and what these print."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt

FILES = ("xml", "toml", "python")
"""Fences with a name, ```xml NAME: a file to save."""

ROUND_OFF = 1e-10
"""Smaller numbers in exponential form are rounding; their digits depend on the processor."""

EXPONENTIAL = re.compile(r"\b\d(?:\.\d+)?e-\d+\b")
RUN_ON = re.compile(r"([ ─])\1+")
"""Widths of columns, which follow the widths of what stands in them."""


@dataclass(frozen=True)
class Step:
    """A fenced block: its language, the file name behind it, its text and its line in the tutorial."""

    language: str
    name: str
    text: str
    line: int


@dataclass(frozen=True)
class Printed:
    """What a command printed and what the tutorial shows."""

    line: int
    command: str
    printed: str
    shown: str


def steps(tutorial: str) -> list[Step]:
    """Every fenced block, in order."""
    found = []
    for token in MarkdownIt().parse(tutorial):
        if token.type == "fence":
            language, _, name = token.info.strip().partition(" ")
            found.append(Step(language, name, token.content, token.map[0] + 1 if token.map else 0))
    return found


def walk(tutorial: str, directory: Path, bin_directory: Path) -> Iterator[Printed]:
    """Do what the tutorial says in an empty directory, as a reader would; yield what its commands print."""
    environment = _environment(bin_directory)
    pending: Printed | None = None
    for step in steps(tutorial):
        if step.language == "text":
            assert pending, f"line {step.line}: output without a command before it"
            yield Printed(pending.line, pending.command, pending.printed, step.text)
            pending = None
            continue
        if pending:
            yield pending
            pending = None
        if step.language in FILES and step.name:
            (directory / step.name).write_text(step.text, encoding="utf-8")
        elif step.language == "diff":
            _patch(directory / step.name, step)
        elif step.language == "sh":
            command = ["sh", "-e", "-c", step.text]
            done = subprocess.run(command, cwd=directory, env=environment, capture_output=True, text=True)
            assert done.returncode == 0, f"line {step.line}: {step.text}{done.stderr}"
            pending = Printed(step.line, step.text, done.stdout, "")
        else:
            raise AssertionError(f"line {step.line}: no meaning is declared for ```{step.language} {step.name}")
    if pending:
        yield pending


def _environment(bin_directory: Path) -> dict[str, str]:
    """The command `workbench` is that of this source tree, `python` the interpreter of the tests."""
    for name, arguments in (("workbench", "-m workbench.cli"), ("python", "")):
        command = bin_directory / name
        command.write_text(f'#!/bin/sh\nexec "{sys.executable}" {arguments} "$@"\n')
        command.chmod(0o755)
    return os.environ | {"PATH": f"{bin_directory}{os.pathsep}{os.environ['PATH']}", "COLUMNS": "110"}


def _patch(file: Path, step: Step) -> None:
    lines = step.text.splitlines(keepends=True)
    old = "".join(line[1:] for line in lines if not line.startswith("+"))
    new = "".join(line[1:] for line in lines if not line.startswith("-"))
    text = file.read_text(encoding="utf-8")
    assert text.count(old) == 1, f"line {step.line}: the lines to change stand {text.count(old)} times in {file.name}"
    file.write_text(text.replace(old, new), encoding="utf-8")


WORST = re.compile(r"worst is \S+ on joint \S+ in case \S+: rounding")
"""where rounding is largest is up to the processor"""


def normalised(text: str) -> list[str]:
    """Lines without what may differ: rounding, widths of columns, blanks at the ends, empty lines."""
    lines = (RUN_ON.sub(r"\1", EXPONENTIAL.sub(_rounding, line)).strip() for line in text.splitlines())
    return [WORST.sub("worst is rounding", line) for line in lines if line]


def _rounding(match: re.Match[str]) -> str:
    return "rounding" if float(match[0]) < ROUND_OFF else match[0]
