"""Candidates in other languages: the same name, row, limits and messages as a Python function's."""

from __future__ import annotations

import re
import time
import tomllib
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, Protocol

from workbench.arrays import FloatArray
from workbench.campaign.user_candidates import LIMIT_S, UserCandidate
from workbench.capabilities.robot import Robot
from workbench.errors import CandidateError, SpecError
from workbench.foreign.clang import LIBRARIES, CFormula
from workbench.foreign.fault import ForeignError
from workbench.foreign.octave import OctaveFormula
from workbench.foreign.program import ProgramFormula, is_program
from workbench.robots.registration import Registration

SAID = re.compile(r"workbench:\s*(\{.*\})")
"""In a comment: ``workbench: { bound = 1e-10, reference = "lumped" }``"""

HEAD = 40
"""Lines among which that comment is looked for."""

LONGEST = 1_000_000
"""Characters of a source file."""


class Formula(Protocol):
    """What computes torques in another language."""

    def __call__(
        self, parameters: Mapping[str, float], arrays: tuple[FloatArray, ...], joints: tuple[str, ...], seconds: float
    ) -> FloatArray:
        """Torques ``(n, na)`` from q, qd, qdd and the external force."""

    def ready(self, parameters: Mapping[str, float]) -> None:
        """Start what takes longer than a formula."""


class ForeignCandidate(UserCandidate):
    """A formula in another language, judged on what it returns."""

    def __init__(self, path: Path, formula: Formula, registration: Registration, line: int) -> None:
        self.registration = registration
        self.name = registration.name
        self.file, self.line = path, line
        self._formula = formula
        self._taken: list[float] = []

    @property
    def files(self) -> tuple[Path, ...]:
        """The file itself."""
        return (self.file,)

    @property
    def takes_force(self) -> bool:
        """Handed to all; whether the formula looks at it is its own affair."""
        return True

    @property
    def needs_time(self) -> bool:
        """Formulas in other languages are not told the time."""
        return False

    @property
    def function(self) -> Any:
        """There is none in Python."""
        return None

    def __call__(
        self,
        robot: Robot,
        q: FloatArray,
        qd: FloatArray,
        qdd: FloatArray,
        force: FloatArray,
        known: Mapping[str, FloatArray] | None = None,
    ) -> FloatArray:
        """Call the formula.

        Raises
        ------
        CandidateError
            It failed, took too long, or returned something that is no finite array ``(n, na)``; with file and line.
        """
        try:
            self._formula.ready(robot.values)
            begun = time.perf_counter()
            found = self._formula(robot.values, (q, qd, qdd, force), robot.joints, LIMIT_S)
        except ForeignError as fault:
            where = f"{self.file.name}:{fault.line}" if fault.line else self.where
            raise CandidateError(
                f'candidate "{self.name}" ({where}) {fault}', candidate=self.name, line=where
            ) from fault
        self._taken.append((time.perf_counter() - begun) / max(len(q), 1))
        return self._checked(found, q.shape, robot.joints)


def is_foreign(path: Path) -> bool:
    """Whether a file holds a formula in another language than Python."""
    return path.suffix != ".py" and (path.suffix in (".m", ".c", *LIBRARIES) or is_program(path))


def load_foreign(path: Path) -> ForeignCandidate:
    """Load a formula.

    Raises
    ------
    SpecError
        What runs it is not installed; it does not compile (with its line); what its comment says is wrong.
    """
    if not path.is_file():
        raise SpecError(f"{path}: no such file", file=str(path))
    formula: Any
    text = ""
    if path.suffix not in LIBRARIES:
        try:
            text = path.read_text(encoding="utf-8", errors="replace")[:LONGEST]
        except OSError as error:
            raise SpecError(f"{path}: {error.strerror or error}", file=str(path)) from error
    said = _said(path, text)
    if path.suffix == ".m":
        formula, line = OctaveFormula(path), _line(text, rf"\bfunction\b.*\b{re.escape(path.stem)}\b")
    elif path.suffix == ".c":
        formula, line = CFormula(path), _line(text, rf"\b{re.escape(path.stem)}(_batch)?\s*\(")
    elif path.suffix in LIBRARIES:
        formula, line = CFormula(path), 0
    else:
        formula, line = ProgramFormula(path), 0
    return ForeignCandidate(path, formula, said, line)


def _line(text: str, pattern: str) -> int:
    found = re.search(pattern, text)
    return text.count("\n", 0, found.start()) + 1 if found else 1


def _said(path: Path, text: str) -> Registration:
    """What a comment among the first lines says of the formula."""
    name = path.name.split(".")[0]
    if path.suffix in LIBRARIES:
        name = name.removeprefix("lib")
    for number, line in enumerate(text.splitlines()[:HEAD], start=1):
        found = SAID.search(line)
        if not found:
            continue
        known = [f.name for f in fields(Registration) if f.name != "kind"]  # kinematics are held in Python only
        try:
            said = tomllib.loads(f"x = {found[1]}")["x"]
        except tomllib.TOMLDecodeError as error:
            raise SpecError(f"{path.name}:{number}: {found[1]}: {error}", file=str(path), line=number) from error
        for key, value in said.items():
            kinds = (int, float) if key == "bound" else (str,)
            if key not in known or not isinstance(value, kinds) or isinstance(value, bool):
                raise SpecError(
                    f"{path.name}:{number}: {key} = {value!r}; allowed: {', '.join(known)}, bound a number, the others"
                    " texts",
                    file=str(path),
                    line=number,
                )
        return Registration(**{"name": name, **said})
    return Registration(name)
