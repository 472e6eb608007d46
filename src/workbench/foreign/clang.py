"""C: a source file that is compiled here, or a shared library, called in a process of its own.

What a file has to offer stands in docs/languages.md: ``workbench_parameters`` and a function of the file's name.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from workbench.arrays import FloatArray
from workbench.errors import SpecError, did_you_mean
from workbench.foreign.fault import ForeignError
from workbench.foreign.served import Scratch, Served, read_reply, write_request

COMPILERS = ("cc", "gcc", "clang")
COMPILE_S = 60.0
START_S = 60.0
FLAGS = ("-O2", "-g", "-fPIC", "-shared", "-fno-omit-frame-pointer", "-std=gnu11")
LIBRARIES = (".so", ".dylib", ".dll")

HANDLER = """#include <execinfo.h>
#include <signal.h>
#include <unistd.h>
static char stack[65536];
static void caught (int number) {
  void *frames[32];
  int count = backtrace (frames, 32);
  backtrace_symbols_fd (frames, count, 2);
  signal (number, SIG_DFL);
  raise (number);
}
__attribute__ ((constructor)) static void watch (void) {
  stack_t own = { .ss_sp = stack, .ss_size = sizeof stack };
  struct sigaction action = { .sa_handler = caught, .sa_flags = SA_ONSTACK };
  void *frame[1];
  backtrace (frame, 1);
  sigaltstack (&own, 0);
  sigaction (SIGSEGV, &action, 0);
  sigaction (SIGFPE, &action, 0);
  sigaction (SIGBUS, &action, 0);
  sigaction (SIGILL, &action, 0);
}
"""
"""Compiled with a source file where the system can: on a crash it says where."""


class CFormula:
    """One C source file or library."""

    def __init__(self, path: Path) -> None:
        self.path = path.resolve()
        self._folder = Scratch()
        self._server: Served | None = None
        self._wanted: tuple[str, ...] = ()
        self._force = False
        self._library = self.path if path.suffix in LIBRARIES else self._compiled()
        self.start()

    @property
    def _symbol(self) -> str:
        stem = self.path.name.split(".")[0]
        return stem.removeprefix("lib") if self.path.suffix in LIBRARIES else stem

    def __call__(
        self, parameters: Mapping[str, float], arrays: tuple[FloatArray, ...], joints: tuple[str, ...], seconds: float
    ) -> FloatArray:
        """Torques ``(n, na)``.

        Raises
        ------
        ForeignError
            It asks for a parameter that the robot has not, returns an error, crashes (with its line where the compiler
            kept it), or takes too long.
        """
        self.ready(parameters)
        assert self._server is not None
        for name in self._wanted:
            if name not in parameters:
                raise ForeignError(f'workbench_parameters: no parameter "{name}"{did_you_mean(name, parameters)}')
        scratch = Path(self._folder.name)
        write_request(scratch, [parameters[name] for name in self._wanted], arrays)
        try:
            answer = self._server.ask(seconds)
        except ForeignError as fault:
            raise ForeignError(str(fault).partition(": ")[0], self._line(self._server.complaints())) from fault
        if answer != "ok":
            raise ForeignError(answer.removeprefix("error "))
        return read_reply(scratch)

    def ready(self, parameters: Mapping[str, float]) -> None:
        """See that the process runs."""
        if self._server is None or not self._server.running:
            self.start()

    def start(self) -> None:
        """Start the process that calls it.

        Raises
        ------
        SpecError
            The library cannot be loaded, or offers no such function.
        """
        scratch = Path(self._folder.name)
        worker = str(Path(__file__).with_name("c_worker.py"))
        # -I: neither the current directory nor variables or packages of the user's are looked at
        arguments = [sys.executable, "-I", worker, str(self._library), self._symbol, str(scratch)]
        try:
            self._server = Served(arguments, scratch, START_S)
        except ForeignError as fault:
            raise SpecError(f"{self.path.name}: {fault}", file=str(self.path)) from fault
        word, _, rest = self._server.greeting.partition(" ")
        if word != "ready":
            raise SpecError(f"{self.path.name}: {rest}; docs/languages.md says what a file offers", file=str(self.path))
        force, _, names = rest.partition(" ")
        self._force, self._wanted = force == "1", tuple(names.replace(",", " ").split())

    def close(self) -> None:
        """End the process."""
        if self._server:
            self._server.close()

    def _compiled(self) -> Path:
        compiler = os.environ.get("CC") or next((c for c in COMPILERS if shutil.which(c)), None)
        program = shutil.which(compiler) if compiler else None
        if program is None:
            raise SpecError(f"{self.path.name}: no C compiler (cc) is installed", file=str(self.path))
        scratch = Path(self._folder.name)
        target, handler = scratch / "formula.so", scratch / "handler.c"
        handler.write_text(HANDLER, encoding="utf-8")
        last = ""
        for extra in ([str(handler)], []):  # a system without backtrace goes without
            command = [program, *FLAGS, "-o", str(target), str(self.path), *extra, "-lm"]
            try:
                done = subprocess.run(command, cwd=scratch, capture_output=True, timeout=COMPILE_S, check=False)
            except subprocess.TimeoutExpired as error:
                raise SpecError(f"{self.path.name}: compiling takes more than {COMPILE_S:g} s") from error
            if done.returncode == 0:
                return target
            last = done.stderr.decode("utf-8", errors="replace")
            if re.search(rf"{re.escape(self.path.name)}:\d+:", last):
                break
        found = re.search(rf"{re.escape(self.path.name)}:(\d+):(?:\d+:)? (?:fatal )?error: (.*)", last)
        if found:
            raise SpecError(f"{self.path.name}:{found[1]}: {found[2]}", file=str(self.path), line=int(found[1]))
        said = last.strip().splitlines()
        raise SpecError(f"{self.path.name}: {said[-1] if said else 'does not compile'}", file=str(self.path))

    def _line(self, complaints: str) -> int | None:
        """Line of the user's file in the backtrace of a crash."""
        program = shutil.which("addr2line")
        offsets = re.findall(rf"{re.escape(self._library.name)}\([^)]*\+?(0x[0-9a-f]+)?\)", complaints)
        places = re.findall(rf"{re.escape(str(self._library))}\(\+(0x[0-9a-f]+)\)", complaints)
        names = re.findall(rf"{re.escape(str(self._library))}\((\w+)\+(0x[0-9a-f]+)\)", complaints)
        if program is None or not (offsets or places or names):
            return None
        wanted = [*places]
        nm = shutil.which("nm")
        if names and nm:
            table = subprocess.run([nm, str(self._library)], capture_output=True, timeout=10.0, check=False, text=True)
            starts = {
                line.split()[2]: int(line.split()[0], 16) for line in table.stdout.splitlines() if line[:1] != " "
            }
            wanted += [hex(starts[name] + int(offset, 16)) for name, offset in names if name in starts]
        for address in wanted:
            done = subprocess.run(
                [program, "-e", str(self._library), address], capture_output=True, timeout=10.0, check=False, text=True
            )
            found = re.search(rf"{re.escape(self.path.name)}:(\d+)", done.stdout)
            if found:
                return int(found[1])
        return None
