"""Any program: it is given a JSON and a CSV file and writes a CSV file; called once for all samples of a case."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from workbench.arrays import FloatArray
from workbench.delimited import read_table
from workbench.errors import CandidateError, SpecError
from workbench.foreign.fault import ForeignError
from workbench.foreign.served import MOST_ERROR, Scratch
from workbench.processes import environment

INTERPRETERS = {".jl": "julia", ".R": "Rscript", ".r": "Rscript"}
FORMAT = 1


def is_program(path: Path) -> bool:
    """Whether a file can be run as a program."""
    return path.suffix in INTERPRETERS or (path.is_file() and os.access(path, os.X_OK))


class ProgramFormula:
    """One program."""

    def __init__(self, path: Path) -> None:
        self.path = path.resolve()
        self._folder = Scratch()
        self._command = [str(self.path)]
        if path.suffix in INTERPRETERS:
            name = INTERPRETERS[path.suffix]
            found = shutil.which(name)
            if found is None:
                raise SpecError(f"{path}: {name} is not installed", file=str(path))
            self._command = [found, *_arguments(self.path)]

    def __call__(
        self, parameters: Mapping[str, float], arrays: tuple[FloatArray, ...], joints: tuple[str, ...], seconds: float
    ) -> FloatArray:
        """Torques ``(n, na)``.

        Raises
        ------
        ForeignError
            It ends with another exit code than 0, takes too long, or its table is wrong (with row and column).
        """
        scratch = Path(self._folder.name)
        question, samples, answer = scratch / "in.json", scratch / "in.csv", scratch / "out.csv"
        answer.unlink(missing_ok=True)
        facts = {"format": FORMAT, "parameters": dict(parameters), "joints": list(joints), "samples": len(arrays[0])}
        question.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
        heads = [f"{p}{i + 1}" for p in ("q", "qd", "qdd") for i in range(len(joints))] + ["fx", "fy", "fz"]
        rows = np.column_stack(arrays)
        np.savetxt(samples, rows, delimiter=",", header=",".join(heads[: rows.shape[1]]), comments="", fmt="%.17g")
        self._run([*self._command, str(question), str(samples), str(answer)], seconds)
        if not answer.is_file():
            raise ForeignError("writes no table; its third argument names the file")
        try:
            table = read_table(answer, CandidateError)
        except CandidateError as error:
            raise ForeignError(str(error).replace(str(answer), "its table")) from error
        wanted = [f"tau{i + 1}" for i in range(len(joints))]
        missing = [name for name in wanted if name not in table.names]
        if missing:
            raise ForeignError(f"its table has no column {missing[0]}; allowed: {','.join(wanted)}")
        found: FloatArray = table.values[:, [table.names.index(name) for name in wanted]]
        return found

    def ready(self, parameters: Mapping[str, float]) -> None:
        """A program starts with each call."""

    def close(self) -> None:
        """Nothing runs between calls."""

    def _run(self, command: list[str], seconds: float) -> None:
        process = subprocess.Popen(
            command,
            cwd=self.path.parent,
            env=environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
        try:
            _, complaints = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired as error:
            if hasattr(os, "killpg"):
                os.killpg(process.pid, signal.SIGKILL)
            else:
                process.kill()
            process.communicate()
            raise ForeignError(f"takes more than {seconds:g} s") from error
        if process.returncode:
            text = complaints.decode("utf-8", errors="replace")[-MOST_ERROR:]
            lines = [line for line in text.splitlines() if line.strip()]
            place = re.findall(rf"{re.escape(self.path.name)}\D{{1,9}}(\d+)", text)
            last = next((k for k in range(len(lines) - 1, -1, -1) if "rror" in lines[k]), len(lines) - 1)
            said = lines[last] if lines else ""
            if said.rstrip().endswith(":") and last + 1 < len(lines):  # R breaks a long line there
                said = f"{said.rstrip()} {lines[last + 1].strip()}"
            what = f"ended with exit code {process.returncode}{': ' if said else ''}{said.strip()}"
            raise ForeignError(what, int(place[-1]) if place else None)


def _arguments(path: Path) -> list[str]:
    """What an interpreter is called with, so that it reads no settings and names the line of an error."""
    if path.suffix == ".jl":
        return ["--startup-file=no", str(path)]
    # R names lines of what it sources alone
    where = f"options(keep.source = TRUE, show.error.locations = TRUE); source({json.dumps(str(path))})"
    return ["--vanilla", "-e", where]
