"""Figures drawn, and the report written, by a process of its own beside a run: the same bytes, and it fails no run."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from threading import Event
from typing import Any

import pytest

from small_campaign import CANDIDATES, CASE, CASES, HEAD, MOTION, listing
from workbench import drawing_process, processes
from workbench.campaign.evidence import Effort
from workbench.campaign.run import run_campaign
from workbench.commands import run_cases
from workbench.drawing_process import WRITTEN, DrawingProcess
from workbench.errors import OutputError
from workbench.report import build_report, drawing_worker
from workbench.report import plot as plot_module
from workbench.report.build import DRAWN_STYLE
from workbench.report.style import figure_style

pytestmark = pytest.mark.usefixtures("warm_kernels")

FIGURES = """
[[figure]]
id = "one"
title = "Of the first case"
kind = "torque"
case = "first"
joint = "q2"
curves = ["cand:lumped", "ref:distributed"]

[[figure]]
id = "One"
title = "Of the second case"
kind = "platform"
case = "second"
"""
QUICK = Effort(budget=False)
OF_A_CASE = 10
"""figures: three of the motion, one for each joint, signed, spent, mechanism, reactions"""


@pytest.fixture
def campaign(tmp_path: Path) -> Path:
    path = tmp_path / "small.toml"
    path.write_text(HEAD + FIGURES + CANDIDATES + CASES)
    return path


@contextlib.contextmanager
def drawing() -> Iterator[DrawingProcess]:
    process = DrawingProcess()
    try:
        yield process
    finally:
        process.close()
    assert process._process is None or process._process.poll() is not None


def alone(campaign: Path, out: Path) -> dict[str, bytes]:
    run_campaign(campaign, out, report=build_report, effort=QUICK)
    return files(out)


def files(out: Path) -> dict[str, bytes]:
    """What a report holds, without the page's head and foot, which tell the time."""
    found = {f"figures/{path.name}": path.read_bytes() for path in sorted((out / "figures").iterdir())}
    page = (out / "report.html").read_text(encoding="utf-8")
    found["drawings"] = "".join(page.split("<svg")[1:]).partition("<section")[0].encode()
    return found


def written_by(process: DrawingProcess, asked: list[bool]) -> Callable[[Path], None]:
    """What writes the report of a run, noting whether the process has."""

    def report(stage: Path) -> None:
        asked.append(process.report(stage))
        if not asked[-1]:
            build_report(stage)

    return report


def test_the_report_that_it_writes_is_the_same(campaign: Path, tmp_path: Path) -> None:
    asked: list[bool] = []
    with drawing() as process:
        report = written_by(process, asked)
        run_campaign(campaign, tmp_path / "beside", report=report, drawing=process, effort=QUICK)
    assert asked == [True]
    assert files(tmp_path / "beside") == alone(campaign, tmp_path / "alone")


def test_what_was_drawn_meanwhile_is_taken(campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[Mapping[str, Any]] = []
    drawn: dict[tuple[str, str], str] = {}
    said: list[bytes] = []
    drawn_here = keys_of_what_is_drawn(monkeypatch)

    def report(stage: Path) -> None:
        with figure_style(DRAWN_STYLE):
            for case in told:
                drawing_worker.case(case, drawn, said.append, Event())
        drawn_here.clear()
        drawing_worker.report(stage, drawn, said.append)

    with drawing() as process:
        monkeypatch.setattr(process, "case", told.append)
        run_campaign(campaign, tmp_path / "beside", report=report, drawing=process, effort=QUICK)
    assert len({key for key, _ in drawn}) == 2 * OF_A_CASE + 1  # both figures have the key of the first of that name
    assert sorted(drawn_here) == ["figure-at-a-glance", "figure-one-2", "figure-robot"]
    assert said[-1] == WRITTEN
    assert files(tmp_path / "beside") == alone(campaign, tmp_path / "alone")


def test_once_all_results_stand_the_report_draws_what_is_left(campaign: Path, tmp_path: Path) -> None:
    told: list[Mapping[str, Any]] = []
    drawn: dict[tuple[str, str], str] = {}
    over = Event()

    def say(_: bytes) -> None:
        if len(drawn) == 3:
            over.set()

    with drawing() as process, pytest.MonkeyPatch.context() as patched:
        patched.setattr(process, "case", told.append)
        run_campaign(campaign, tmp_path / "run", drawing=process, effort=QUICK)
    for case in told:
        drawing_worker.case({**case, "directory": str(tmp_path / "run")}, drawn, say, over)
    assert len(drawn) == 3


def keys_of_what_is_drawn(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Keys of the figures that this process draws from now on."""
    keys: list[str] = []
    draw = plot_module.svg_of

    def noted(figure: Any, key: str) -> str:
        keys.append(key)
        return draw(figure, key)

    monkeypatch.setattr(plot_module, "svg_of", noted)
    return keys


def test_drawings_of_something_else_are_not_taken(
    campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign.write_text(HEAD + CANDIDATES + CASE)
    wanted = alone(campaign, tmp_path / "run")
    drawn_here = keys_of_what_is_drawn(monkeypatch)
    keys = [path.stem for path in (tmp_path / "run" / "figures").iterdir()]
    digest = "0" * 64
    build_report(tmp_path / "run", drawn={(key, digest): "<svg>of another run</svg>" for key in keys})
    assert sorted(drawn_here) == sorted(keys)
    assert files(tmp_path / "run") == wanted


TORN = """
import json, os, sys, time
from pathlib import Path
(Path(json.loads(sys.stdin.readline())["report"]) / f".x.{os.getpid()}.tmp").touch()
"""


@pytest.mark.parametrize(
    "code",
    [
        "import os; os._exit(3)",
        "import time; time.sleep(600)",
        "import sys; print('drawn', flush=True); sys.stdin.readline(); print('writ')",
        "import sys; sys.stdin.close(); print('nonsense', flush=True); import time; time.sleep(600)",
        "print('failed', flush=True); import time; time.sleep(600)",
        TORN,
        TORN + "time.sleep(600)",
    ],
    ids=["ends", "hangs", "breaks off", "says nonsense", "fails", "ends on its way", "hangs on its way"],
)
def test_it_fails_no_run(campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str) -> None:
    popen = subprocess.Popen
    monkeypatch.setattr(drawing_process, "popen", lambda _, **options: popen([sys.executable, "-c", code], **options))
    monkeypatch.setattr(drawing_process, "PATIENCE_S", 2.0)
    campaign.write_text(HEAD + CANDIDATES + CASE)
    asked: list[bool] = []
    with drawing() as process:
        told = None if code.startswith(TORN) else process
        run_campaign(campaign, tmp_path / "beside", drawing=told, report=written_by(process, asked), effort=QUICK)
    assert asked == [False]
    assert len(list((tmp_path / "beside" / "figures").glob("*.svg"))) > OF_A_CASE
    assert list((tmp_path / "beside").rglob(".*")) == []


def test_a_report_that_cannot_be_written_is_tried_and_told_of_by_the_run(campaign: Path, tmp_path: Path) -> None:
    asked: list[bool] = []

    def report(stage: Path) -> None:
        (stage / "figures").symlink_to(tmp_path)
        written_by(process, asked)(stage)

    with drawing() as process, pytest.raises(OutputError, match="symbolic link"):
        run_campaign(campaign, tmp_path / "run", drawing=process, report=report, only=["first"], effort=QUICK)
    assert asked == [False]


def test_a_process_that_cannot_be_started_is_done_without(
    campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise OSError("no room")

    monkeypatch.setattr(drawing_process, "popen", refuse)
    with drawing() as process:
        run_campaign(campaign, tmp_path / "beside", drawing=process, only=["first"], effort=QUICK)
        assert not process.report(tmp_path / "beside")


def test_it_ends_with_the_run_that_began_it_and_runs_no_code_from_where_it_is(tmp_path: Path) -> None:
    for name in ("json", "matplotlib", "numpy", "sitecustomize", "signal"):
        (tmp_path / f"{name}.py").write_text("open('ran', 'w')")
    (tmp_path / "matplotlibrc").write_text("figure.dpi: nonsense")
    code = (
        "from workbench.drawing_process import DrawingProcess; import os, time; p = DrawingProcess();"
        " print(p._process.pid, flush=True); p.case({}); time.sleep(600)"
    )
    with subprocess.Popen(
        processes.python_code(code), cwd=tmp_path, env=processes.environment(), stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        number = int(parent.stdout.readline())
        parent.kill()
    while alive(number):
        time.sleep(0.02)
    assert sorted(listing(tmp_path)) == sorted(
        ["json.py", "matplotlib.py", "numpy.py", "sitecustomize.py", "signal.py", "matplotlibrc"]
    )


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no copies of a process")
def test_a_copy_of_itself_ends_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    code = "import os, time; copy = os.fork(); copy and os.write(1, b'%d\\n' % copy); time.sleep(600)"
    popen = subprocess.Popen
    monkeypatch.setattr(drawing_process, "popen", lambda _, **options: popen([sys.executable, "-c", code], **options))
    with drawing() as process:
        copy = int(process._said.get(timeout=60))
        assert alive(copy)
    while alive(copy):
        time.sleep(0.02)


def alive(number: int) -> bool:
    """Whether a process runs; one that has ended and that nobody has asked after does not."""
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{number}/stat")
    return not (status.exists() and status.read_text().rpartition(")")[2].split()[0] == "Z")


def test_the_command_has_figures_drawn_meanwhile_where_that_pays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[int] = []

    class Noted(DrawingProcess):
        def __init__(self) -> None:
            begun.append(1)
            super().__init__()

    monkeypatch.setattr(run_cases, "DrawingProcess", Noted)
    monkeypatch.setattr(run_cases, "cores", lambda: 2)
    monkeypatch.chdir(tmp_path)
    more = "".join(f'\n[[case]]\nname = "more_{n}"\n{MOTION}' for n in range(run_cases.WORTH_IT - 2))
    (tmp_path / "small.toml").write_text(HEAD + CANDIDATES + CASES + more)
    from workbench.commands.run import run

    with contextlib.redirect_stdout(None):
        run("small.toml", quick=True, pictures=False, only=["first"], out=tmp_path / "one")
        assert begun == []
        run("small.toml", quick=True, pictures=False, out=tmp_path / "all")
    assert begun == [1]
    kept = json.loads((tmp_path / "all" / "drawn.json").read_text())
    assert len(kept["drawings"]) > run_cases.WORTH_IT * OF_A_CASE
