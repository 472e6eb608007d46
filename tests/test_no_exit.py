"""A formula that ends the process ends no run: it is named, and the exit code is that of a bad input."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from small_campaign import CANDIDATES, CASE, HEAD
from sweep_campaign import SWEEP
from workbench import no_exit
from workbench.campaign.bounded_call import UnrulyError, bounded

pytestmark = pytest.mark.usefixtures("warm_kernels")
POSIX = pytest.mark.skipif(os.name != "posix", reason="signals and C's exit are POSIX here")

ENDS = {
    "_exit": "os._exit(0)",
    "the module below": "sys.modules['posix' if os.name == 'posix' else 'nt']._exit(0)",
    "abort": "os.abort()",
    "another program": "os.execv(sys.executable, [sys.executable, '-c', ''])",
    "another program, by its name": "os.execlp(sys.executable, sys.executable, '-c', '')",
    "an exit code": "sys.exit(0)",
    "killed": "os.kill(os.getpid(), signal.SIGKILL)",
    "its group": "os.killpg(os.getpgrp(), signal.SIGTERM)",
    "raised": "signal.raise_signal(signal.SIGTERM)",
}
FILE = """
import atexit, ctypes, os, signal, sys, threading
import numpy as np
import workbench

{before}

@workbench.candidate("mine", reference="distributed", bound=1e-10)
def mine(p, q, qd, qdd):
    {inside}
    return np.zeros_like(q)
"""


WITHOUT_REPORT = """
import sys, workbench.report
workbench.report.build_report = lambda directory: None
from workbench.__main__ import main
main()
"""
"""The command, which draws no figures: they take most of the time, and nothing here looks at them."""


def called(folder: Path, arguments: list[str], inside: str = "pass", before: str = "") -> tuple[int, str, str]:
    (folder / "good.toml").write_text(HEAD + CANDIDATES + CASE)
    (folder / "f.py").write_text(FILE.format(inside=inside, before=before))
    command = [sys.executable, "-P", "-c", WITHOUT_REPORT, *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    return done.returncode, done.stdout, done.stderr


RUN = ["run", "good.toml", "--quick", "--no-pictures", "--candidates", "f.py", "--out", "out"]


@POSIX
@pytest.mark.parametrize("how", ENDS)
def test_whatever_ends_a_process_raises_while_a_formula_is_called(how: str) -> None:
    def call() -> None:
        exec(ENDS[how], {"os": os, "sys": sys, "signal": signal})

    with pytest.raises(UnrulyError, match="SystemExit: 0" if how == "an exit code" else "it has to return") as caught:
        bounded(call, 10.0)
    assert "\n" not in str(caught.value)


@POSIX
@pytest.mark.parametrize("how", [how for how in ENDS if how not in ("its group", "killed")])
def test_nothing_else_holds_these_up(how: str) -> None:
    """The twin: outside of a formula, in a process that is no command, each ends the process as it always did."""
    wrapped = (
        "import os, sys, signal\nfrom workbench.campaign.bounded_call import bounded\n"
        f"bounded(lambda: 1, 1.0)\n{ENDS[how]}\nprint('still here')"
    )
    done = subprocess.run([sys.executable, "-c", wrapped], capture_output=True, text=True, timeout=60, check=False)
    assert "still here" not in done.stdout
    assert done.returncode == (0 if "exit" in how or "program" in how or "module" in how else done.returncode)


def test_a_forked_process_of_a_formula_may_end() -> None:
    if not hasattr(os, "fork"):
        pytest.skip("no fork")

    def call() -> int:
        child = os.fork()
        if not child:
            os._exit(7)
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])

    assert bounded(call, 20.0) == 7


def test_a_run_names_the_formula_that_would_end_it(tmp_path: Path) -> None:
    """As of one that raises: its check fails, and the others are judged."""
    code, out, err = called(tmp_path, RUN, "os._exit(0)")
    assert code == 1, out + err
    assert 'candidate "mine" (f.py:10) ends the process by _exit(0); it has to return' in out
    assert "FAILED: 3 of 9 checks" in out


def test_a_file_that_would_end_the_run_when_it_is_read_is_refused(tmp_path: Path) -> None:
    code, _, err = called(tmp_path, RUN, before="os._exit(0)")
    assert code == 2
    assert err.splitlines()[-1] == "workbench: f.py:6: ends the process by _exit(0); it has to return"
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "before",
    [
        "threading.Timer(0.05, os._exit, [0]).start()",
        "atexit.register(os._exit, 0)",
        "signal.signal(signal.SIGALRM, lambda *_: os._exit(0)); signal.setitimer(signal.ITIMER_REAL, 0.01)",
    ],
    ids=["a thread", "the end", "an alarm"],
)
@POSIX
def test_what_a_formula_leaves_behind_makes_no_pass(tmp_path: Path, before: str) -> None:
    code, out, err = called(tmp_path, RUN, before=before)
    assert code in (1, 2), out + err  # it fails its bound, or is refused; never a pass


@POSIX
def test_a_library_that_exits_is_a_bad_input(tmp_path: Path) -> None:
    code, out, err = called(tmp_path, RUN, "ctypes.CDLL(None).exit(0)")
    assert code == 2, out + err
    assert "exit(); it has to return" in err.splitlines()[-1]


@POSIX
def test_the_twin_without_the_guard_passes_for_a_script(tmp_path: Path) -> None:
    bare = (
        "import contextlib, sys\nimport workbench.campaign.bounded_call as b\n"
        "b.no_exit = contextlib.nullcontext\nimport workbench.report\n"
        "workbench.report.build_report = lambda directory: None\nfrom workbench.cli import main\n"
        f"sys.argv = {['workbench', *RUN]!r}\nmain()\n"
    )
    (tmp_path / "good.toml").write_text(HEAD + CANDIDATES + CASE)
    (tmp_path / "f.py").write_text(FILE.format(inside="os._exit(0)", before=""))
    done = subprocess.run(
        [sys.executable, "-P", "-c", bare], cwd=tmp_path, capture_output=True, timeout=300, check=False
    )
    assert done.returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize("command", ["diagnose", "sweep"])
def test_other_commands_that_call_formulas(tmp_path: Path, command: str) -> None:
    arguments = RUN
    if command == "diagnose":
        arguments = ["diagnose", "good.toml", "--candidates", "f.py"]
    (tmp_path / "more.toml").write_text(SWEEP.replace("samples = 40", "samples = 2"))
    if command == "sweep":
        arguments = ["run", "more.toml", "--candidates", "f.py", "--out", "out", "--jobs", "1"]
    code, out, err = called(tmp_path, arguments, "os._exit(0)")
    assert code not in (0, 4), out + err
    kept = "".join(path.read_text(errors="replace") for path in (tmp_path / "out").rglob("*.json"))
    assert "it has to return" in out + err + kept


@pytest.mark.slow
@POSIX
def test_a_sweep_notices_machine_code_that_ends_its_workers(tmp_path: Path) -> None:
    """As docs/safety.md says; a plain run has nobody beside it who could."""
    (tmp_path / "more.toml").write_text(SWEEP.replace("samples = 40", "samples = 2"))
    arguments = ["run", "more.toml", "--candidates", "f.py", "--out", "out", "--jobs", "1"]
    code, out, err = called(tmp_path, arguments, "ctypes.CDLL(None)._exit(0)")
    assert code not in (0, 4), out + err


def test_the_guard_knows_its_own_package() -> None:
    assert no_exit.OWN.endswith(os.sep)
    assert no_exit.__file__.startswith(no_exit.OWN)
