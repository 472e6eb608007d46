"""Figures drawn by two processes: the same bytes, and none is missing whatever becomes of the second."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from test_report import make_run
from workbench.report import drawing
from workbench.report.build import build_report
from workbench.report.drawing import can_fork, draw
from workbench.report.plot import Plot
from workbench.report.svg import compact

two = pytest.mark.skipif(not can_fork(), reason="one core, or no Linux")


def plots(count: int, place: Path) -> list[Plot]:
    """Figures that leave a file with the name of the process that drew them."""

    def drawn(number: int) -> Callable[[Any], None]:
        def into(figure: Any) -> None:
            (place / f"{number}-{os.getpid()}").touch()
            figure.add_axes((0.1, 0.1, 0.8, 0.8)).plot([0, 1], [0, number])

        return into

    return [Plot(f"figure-{n}", (2.0, 1.5), drawn(n), f"alt {n}", f"caption {n}") for n in range(count)]


@two
def test_two_processes_give_the_bytes_of_one(tmp_path: Path) -> None:
    files = {}
    for second in (False, True):
        run = make_run(tmp_path / str(second) / "run", cases=2, samples=20)
        build_report(run, ["html", "md", "pdf"], second=second)
        files[second] = {p.relative_to(run): p.read_bytes() for p in sorted(run.rglob("*")) if p.is_file()}
    assert files[True] == files[False]


@two
def test_what_the_second_has_drawn_the_first_does_not_draw(tmp_path: Path) -> None:
    made = plots(20, tmp_path)
    first = os.getpid()
    own = made[0].draw

    def waiting(figure: Any) -> None:  # until the second has drawn all others
        while sum(not path.name.endswith(f"-{first}") for path in tmp_path.iterdir()) < 19:
            time.sleep(0.01)
        own(figure)

    made[0] = Plot(made[0].key, made[0].size, waiting, "alt", "caption")
    counts: list[tuple[int, int]] = []
    draw(made, lambda done, of: counts.append((done, of)), second=True)
    by_first = {path.name.partition("-")[0] for path in tmp_path.iterdir() if path.name.endswith(f"-{first}")}
    assert "0" in by_first
    assert len(by_first) <= 2  # one may have been on its way
    assert all("svg" in vars(plot) for plot in made)
    alone = plots(20, tmp_path)
    draw(alone)
    assert [plot.svg for plot in made] == [plot.svg for plot in alone]
    assert counts[0] == (0, 20)
    assert counts == sorted(counts)
    assert counts[-1] == (20, 20)


def ends(*_: Any) -> None:
    os._exit(3)


def hangs(*_: Any) -> None:
    while True:
        time.sleep(60)


@two
@pytest.mark.parametrize("fate", [ends, hangs])
def test_the_first_waits_for_nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fate: Callable[..., None]) -> None:
    monkeypatch.setattr(drawing, "_from_the_end", fate)
    made = plots(14, tmp_path)
    draw(made, second=True)
    assert len(list(tmp_path.iterdir())) == 14
    assert all("<svg" in plot.svg for plot in made)
    children = Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children")
    assert not children.exists() or not children.read_text().split()


def test_few_figures_and_other_systems_draw_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = plots(drawing.WORTH_IT - 1, tmp_path)
    draw(made, second=True)
    monkeypatch.setattr(drawing, "can_fork", lambda: False)
    more = plots(drawing.WORTH_IT + 1, tmp_path)
    draw(more, second=True)
    assert {path.name.partition("-")[2] for path in tmp_path.iterdir()} == {str(os.getpid())}


@pytest.mark.parametrize(
    ("module", "heavy"),
    [
        ("workbench.report.build", "mujoco numba scipy pandas"),
        ("workbench.compare.page", "mujoco numba scipy pandas"),
        ("workbench.commands.run, workbench.campaign.run, workbench.sweep.pick, workbench.report", "pandas"),
    ],
    ids=["a report", "a comparison", "a run"],
)
def test_what_is_not_used_is_not_loaded(module: str, heavy: str) -> None:
    code = f"import sys, {module}; print(*[m for m in {heavy.split()} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.split() == []


def test_the_command_loads_no_engine_either(tmp_path: Path) -> None:
    code = """
import pathlib, sys
from workbench.commands.report import report
from workbench.errors import WorkbenchError
try:
    report(pathlib.Path(sys.argv[1]), ["pdf"])
except WorkbenchError as error:
    print(error, file=sys.stderr)
print(*[m for m in ("mujoco", "numba", "scipy", "pandas") if m in sys.modules])
"""
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=True, timeout=120
    )
    assert "manifest.json" in done.stderr
    assert done.stdout.split() == []


def test_an_empty_group_is_none_that_is_opened() -> None:
    inner = '<g clip-path="url(#a)"/>\n<g style="x: y">\n<path d="M 0 0"/>\n</g>'
    root = ElementTree.fromstring(compact(f'<svg viewBox="0 0 1 1">\n<g>\n{inner}\n</g>\n</svg>\n', "key"))
    groups = [child.attrib for child in root.iter() if child.tag == "g"]
    assert groups == [{"clip-path": "url(#key-0)"}, {"style": "x: y"}]
