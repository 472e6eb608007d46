"""The film of a study: which runs it shows, that it shows them as they were, and what the report makes of it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from inline_pool import Inline
from small_campaign import Workbench, listing
from test_control_study import planned, write
from test_rendering import draws
from workbench.control.evaluate import evaluate
from workbench.control.footage import chosen, footage_of
from workbench.control.plan import Loop
from workbench.errors import OutputError, WorkbenchError
from workbench.rendering.tracking_film import draw_tracking
from workbench.report.build import build_report
from workbench.sweep.record import FAILED, PASSED, Record


def record(index: int, rms: float | None, half: float | None = None, status: str = PASSED) -> Record:
    rows = [] if rms is None else [{"joint": "platform", "rms": rms, "rms_halved": half, "rms_second": rms}]
    return Record(index, f"key{index}", status, "", rows)


def loop(model: str, **changes: Any) -> Loop:
    return replace(Loop("swing", "computed torque", model, 1.0, 500.0, "500", 10.0), **changes)


TWO = (loop("lumped"), loop("distributed"))
FAST = (loop("lumped", speed=2.0), loop("distributed", speed=2.0))


@pytest.mark.parametrize(
    ("loops", "errors", "shown"),
    [
        ((*TWO, *FAST), (2e-3, 1e-3, 5e-3, 1e-3), (2, 3)),  # where models are farthest apart
        ((*TWO, *FAST), (6e-3, 1e-3, 9e-3, 5e-3), (0, 1)),  # which is not where the error is largest
        ((*TWO, *FAST), (2e-3, 1e-3, None, 1e-3), (0, 1)),  # a run that does not track shows nothing
        ((*TWO, *FAST), (2e-3, 1e-3, (5e-3, 4e-3), 1e-3), (0, 1)),  # nor one that is not known to a tenth
        ((loop("none"), loop("none", speed=2.0)), (1e-3, 3e-3), (1,)),
        ((loop("lumped"), loop("distributed", rate=1e3)), (3e-3, 1e-3), (0,)),  # rates of the printed costs
        ((loop("lumped"), loop("lumped", rate_asked="printed cost")), (3e-3, 1e-3), (0,)),
        ((*TWO, loop("mine"), loop("yours")), (2e-3, 1e-3, 3e-3, 2.5e-3), (1, 2)),  # the best and the worst of many
        (TWO, (None, None), ()),
    ],
)
def test_the_film_shows_where_models_differ_most(
    loops: tuple[Loop, ...], errors: tuple[Any, ...], shown: tuple[int, ...]
) -> None:
    records = [record(i, *(one if isinstance(one, tuple) else (one,))) for i, one in enumerate(errors)]
    assert chosen(loops, records) == shown


def test_a_run_that_could_not_be_computed_is_not_filmed() -> None:
    assert chosen(TWO, [record(0, 2e-3, status=FAILED), record(1, 1e-3)]) == (1,)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, list[Record]]:
    path = write(tmp_path_factory.mktemp("film"), ("[control]", '[control]\nsecond_route = "none"'))
    plan, made = planned(path)
    return made, [evaluate(made, "key", (i, one)).record for i, one in enumerate(plan.loops)]


def test_the_footage_is_the_kept_run_with_its_error_enlarged(study: tuple[Any, list[Record]]) -> None:
    made, records = study
    footage = footage_of(made, records)
    assert footage is not None
    assert [take.model for take in footage.takes] == ["lumped", "distributed"]
    bench = made.bench(made.plan.loops[0])
    desired, _ = bench.desired(500.0)
    closer = bench.plant.reference.closer
    columns = [int(footage.compiled.joint(name).qposadr[0]) for name in bench.robot.joints]
    # the package's closer and MuJoCo's own residual say that poses are closed; coordinates, that they are these
    assert footage.wanted[:, columns] == pytest.approx(desired.q, abs=1e-12)
    assert footage.enlarged >= 2.0
    for take in footage.takes:
        row = next(row for row in records[take.run].rows if row["joint"] == "q2")
        off = (take.qpos - footage.wanted)[:, columns[1]]
        assert np.sqrt(np.mean(off**2)) == pytest.approx(footage.enlarged * row["rms"], rel=1e-9)
        assert np.abs(off).max() == pytest.approx(footage.enlarged * row["peak"], rel=1e-9)
        again = closer.close_along(take.qpos[:, columns]).qpos
        assert again == pytest.approx(take.qpos, abs=1e-9)
    largest = max(footage.takes, key=lambda take: take.peak).qpos - footage.wanted
    assert np.abs(largest[footage.worst]).max() > 0.5 * np.abs(largest).max()


def test_a_run_that_comes_out_otherwise_is_not_filmed(study: tuple[Any, list[Record]]) -> None:
    made, records = study
    spoiled = [replace(one, rows=[{**row, "rms": row["rms"] * (1 + 1e-6)} for row in one.rows]) for one in records]
    with pytest.raises(WorkbenchError, match=r"run 0 made again errs by .* m, kept is"):
        footage_of(made, spoiled)


def test_an_error_that_cannot_be_enlarged_much_is_enlarged_less(
    study: tuple[Any, list[Record]], monkeypatch: pytest.MonkeyPatch
) -> None:
    made, records = study
    as_asked = footage_of(made, records)
    monkeypatch.setattr("workbench.control.footage.SHOWN", 1e4)
    far = footage_of(made, records)
    assert as_asked is not None
    assert far is not None
    assert far.enlarged > as_asked.enlarged
    assert far.enlarged * max(take.peak for take in far.takes) < 2.0 * far.compiled.stat.extent  # loops closed


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    class Own(Inline):
        pass

    monkeypatch.setattr("workbench.sweep.computing.Supervisor", Own)
    made = Workbench(tmp_path, monkeypatch, capsys)
    monkeypatch.setattr("workbench.rendering.tracking_film.draw_tracking", draw_tracking)
    write(tmp_path, ("[control]", '[control]\nsecond_route = "none"'))
    return made


@draws
def test_a_study_has_a_film_of_each_model(bench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    from PIL import Image

    monkeypatch.delenv("MUJOCO_GL", raising=False)
    done = bench("run", "loop.toml", "--out", "out")
    assert done.code == 0, done.complaint
    out = bench.directory / "out"
    told = json.loads((out / "pictures" / "tracking.json").read_text(encoding="utf-8"))
    assert (told["note"], told["case"], [take["model"] for take in told["takes"]]) == (
        "", "swing", ["lumped", "distributed"]
    )  # fmt: skip
    sheets = []
    for take in told["takes"]:
        with Image.open(out / "pictures" / take["sheet"]) as sheet, Image.open(out / "pictures" / take["still"]) as one:
            assert one.size == (2 * told["width"], 2 * told["height"])
            sheets.append(np.asarray(sheet.convert("RGB")).astype(int))
    assert sheets[0].shape == sheets[1].shape
    assert np.abs(sheets[0] - sheets[1]).max() > 60  # the models let it go to different places
    build_report(out)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.count('class="film"') == 2
    assert "computed torque, lumped</strong>: the platform is off by" in page
    text = (out / "report.md").read_text(encoding="utf-8")
    assert f"drawn {told['enlarged']:g} times as large as they are" in text
    assert 'src="pictures/tracking-1-still.webp"' in text
    # runs that were made anew since are not what the film shows
    told["takes"][0]["key"] = "another"
    (out / "pictures" / "tracking.json").write_text(json.dumps(told), encoding="utf-8")
    build_report(out)
    assert "No film: the stored film shows runs that were computed anew since." in (out / "report.md").read_text(
        encoding="utf-8"
    )
    (out / "pictures" / "tracking-0.webp").write_bytes(b"no picture")
    told["takes"][0]["key"] = json.loads((out / "journal.jsonl").read_bytes().splitlines()[0][9:])["key"]
    (out / "pictures" / "tracking.json").write_text(json.dumps(told), encoding="utf-8")
    with pytest.raises(OutputError, match=r"tracking-0\.webp: 10 bytes; allowed: a WebP picture"):
        build_report(out)
    assert bench("run", "loop.toml", "--out", "out").code == 0  # a film is drawn anew with each run
    assert (out / "pictures" / "tracking-0.webp").stat().st_size > 1000


def test_a_study_that_cannot_be_drawn_says_why_and_stands(bench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("workbench.rendering.drawing.needs", lambda *modules: None)
    monkeypatch.setenv("MUJOCO_GL", "nonsense")
    assert bench("run", "loop.toml", "--out", "out").code == 0
    out = bench.directory / "out"
    assert [name for name in listing(out) if name.startswith("pictures/")] == ["pictures/tracking.json"]
    build_report(out)
    said = "No film: no offscreen OpenGL on this machine (tried nonsense)."
    assert said in (out / "report.md").read_text(encoding="utf-8")
