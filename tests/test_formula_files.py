"""Files with formulas: neighbours that they import, limits of their calls, and a report that fails after the run."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from small_campaign import CANDIDATES, CASE, HEAD, Workbench
from workbench.campaign.bounded_call import UnrulyError, bounded, said
from workbench.campaign.user_candidates import load_candidates
from workbench.control.user_controller import load_controllers
from workbench.errors import OutputError, SpecError
from workbench.robots.edit import edit_file

pytestmark = pytest.mark.usefixtures("warm_kernels")

FORMULA = """
import workbench
import {neighbour}

@workbench.candidate("mine{number}")
def mine(p, q, qd, qdd):
    from lazily_imported import ZERO
    return {neighbour}.FACTOR * q * ZERO
"""


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


def folder(place: Path, number: int) -> Path:
    place.mkdir()
    (place / "my_geometry.py").write_text(f"from my_inner import ONE\nFACTOR = {number} * ONE\n")
    (place / "my_inner.py").write_text("ONE = 1.0\n")
    (place / "lazily_imported.py").write_text("ZERO = 0.0\n")
    (place / "numpy.py").write_text("raise SystemExit('a neighbour in place of an installed package')\n")
    (place / "an_optional_package_of_somebody.py").write_text("raise SystemExit('asked for by a stranger')\n")
    (place / "f.py").write_text(
        FORMULA.format(neighbour="my_geometry", number=number) + "import numpy as np\nnp.zeros(1)\n"
    )
    return place / "f.py"


def test_a_file_imports_its_neighbours_and_nobody_else_does(tmp_path: Path) -> None:
    before = set(sys.modules)
    found = load_candidates([folder(tmp_path / "one", 1), folder(tmp_path / "two", 2)])
    factors = [vars(sys.modules[one.function.__module__])["my_geometry"].FACTOR for one in found]
    assert sorted(factors)[-1] == 2.0
    assert {path.name for path in found[0].files} == {"f.py", "my_geometry.py", "my_inner.py"}
    assert not {"my_geometry", "my_inner", "lazily_imported"} & set(sys.modules)
    assert "my_geometry" not in set(sys.modules) - before
    with pytest.raises(ModuleNotFoundError):
        __import__("my_geometry")
    with pytest.raises(ModuleNotFoundError):
        __import__("an_optional_package_of_somebody")


def test_neighbours_are_there_in_calls_and_their_changes_count(workbench: Workbench) -> None:
    file = folder(workbench.directory / "mine", 1)
    done = workbench.run(HEAD + CANDIDATES + CASE, "--quick", "--candidates", str(file))
    assert done.code == 0, done
    (file.parent / "my_geometry.py").write_text("FACTOR = float('nan')\n")
    assert workbench.run(HEAD + CANDIDATES + CASE, "--quick", "--candidates", str(file)).code == 1


MEMORY = """
import numpy as np
from workbench.campaign import bounded_call
bounded_call.LIMIT_MB = 300.0
try:
    bounded_call.bounded(lambda: np.ones(100_000_000), 60.0)
except bounded_call.UnrulyError as error:
    print(error, np.ones(10).sum())
"""


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the limit needs Linux")
def test_memory_is_limited_and_given_back() -> None:
    # in a process of its own: one that has freed as much before takes it again without asking the system
    done = subprocess.run([sys.executable, "-P", "-c", MEMORY], capture_output=True, text=True, timeout=60, check=True)
    assert "MemoryError" in done.stdout
    assert done.stdout.endswith(" 10.0\n")


def test_what_code_of_others_does_comes_out_as_one_error() -> None:
    class LoudError(Exception):
        def __str__(self) -> str:
            return "x" * 10_000_000

    class MuteError(Exception):
        def __str__(self) -> str:
            raise ValueError

    def fail(error: BaseException) -> None:
        raise error

    for error, expected in (
        (LoudError(), "LoudError: xxx"), (MuteError(), "MuteError: a message that cannot be shown"),
        (SystemExit(0), "SystemExit: 0"),
        (GeneratorExit(), "GeneratorExit"), (RecursionError("deep"), "RecursionError: deep"),
    ):  # fmt: skip
        with pytest.raises(UnrulyError, match=expected) as caught:
            bounded(lambda error=error: fail(error), 60.0)
        assert len(str(caught.value)) < 300
    with pytest.raises(KeyboardInterrupt):
        bounded(lambda: fail(KeyboardInterrupt()), 60.0)
    with pytest.raises(UnrulyError, match=r"takes more than 0\.05 s"):
        bounded(lambda: [None for _ in iter(int, 1)], 0.05)
    assert said("\udc80" * 3) == r"\udc80" * 3


def test_utf_16_has_no_line(tmp_path: Path) -> None:
    (tmp_path / "f.py").write_bytes("import workbench\n".encode("utf-16"))
    with pytest.raises(SpecError) as caught:
        load_candidates([tmp_path / "f.py"])
    assert "None" not in str(caught.value)


def test_results_stand_when_the_report_fails(workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(directory: Path) -> None:
        raise RuntimeError("no pen")

    monkeypatch.setattr("workbench.report.build_report", fail)
    done = workbench.run(HEAD + CANDIDATES + CASE, "--quick", "--out", "run")
    assert done.code == 2
    assert done.complaint == [
        "workbench: run: the results stand there, its report could not be written: RuntimeError: no pen; workbench"
        " report run tries again"
    ]
    assert (workbench.directory / "run/summary.csv").exists()
    assert not list(workbench.directory.glob(".run*"))


@pytest.mark.skipif(os.name != "posix", reason="names that are no text exist on POSIX systems")
def test_a_directory_whose_name_is_no_text(workbench: Workbench) -> None:
    place = os.fsdecode(b"a\xff")
    done = workbench.run(HEAD + CANDIDATES + CASE, "--quick", "--out", place)
    assert done.code == 0, done
    assert (workbench.directory / place / "series/first.parquet").exists()


@pytest.mark.skipif(os.name != "posix", reason="hard links and modes as on POSIX systems")
def test_protected_and_linked_models_are_not_overwritten(tmp_path: Path, repository: Path) -> None:
    model = tmp_path / "robot.xml"
    model.write_bytes((repository / "models/asym_2rss_ppap.xml").read_bytes())
    before = model.read_bytes()
    os.link(model, tmp_path / "other.xml")
    with pytest.raises(OutputError, match="2 names"):
        edit_file(model, ["a2=0.31"], in_place=True)
    (tmp_path / "other.xml").unlink()
    model.chmod(0o444)
    with pytest.raises(OutputError, match="read-only"):
        edit_file(model, ["a2=0.31"], in_place=True)
    assert (model.read_bytes(), stat.S_IMODE(model.stat().st_mode)) == (before, 0o444)
    model.chmod(0o640)
    edit_file(model, ["a2=0.31"], in_place=True)
    assert model.read_bytes() != before
    assert stat.S_IMODE(model.stat().st_mode) == 0o640


def test_a_function_that_decorators_wrap_is_not_lost(tmp_path: Path) -> None:
    file = tmp_path / "f.py"
    file.write_text(
        "import functools, workbench\n\ndef plainly(function):\n    @functools.wraps(function)\n"
        "    def call(*given):\n        return function(*given)\n    return call\n\n"
        '@plainly\n@workbench.candidate("inside")\ndef f(p, q, qd, qdd):\n    return q\n\n'
        '@workbench.candidate("outside")\n@plainly\ndef g(p, q, qd, qdd):\n    return q\n'
    )
    assert [one.name for one in load_candidates([file])] == ["inside", "outside"]
    file.write_text(file.read_text().replace("    @functools.wraps(function)\n", ""))
    with pytest.raises(SpecError, match=r'f\.py:8: candidate "inside" is registered and lost: its function f '):
        load_candidates([file])


def test_two_controllers_of_one_function_name_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "c.py"
    text = 'import workbench\n@workbench.controller("{0}")\ndef law(p, sample):\n    return sample.q\n'
    file.write_text(text.format("one"))
    assert [one.name for one in load_controllers([file])] == ["one"]
    file.write_text(text.format("one") + text.format("two"))
    with pytest.raises(SpecError, match=r'c\.py:2: controller "one" is registered and lost: its function law '):
        load_controllers([file])
