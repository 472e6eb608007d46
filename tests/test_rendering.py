"""Pictures, films and the viewer; what is missing is said in one line. Drawing itself needs the extra and an OpenGL."""

from __future__ import annotations

import itertools
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import own_mechanisms
from small_campaign import SMALL, Workbench
from workbench.errors import MissingExtraError, ModelError
from workbench.rendering import drawing as film_drawing
from workbench.rendering import run_pictures, system
from workbench.rendering.poses import Poses, home_pose, motion_poses

MODELS = Path(__file__).resolve().parents[1] / "models"
DRAWS = run_pictures.RunPictures
ASYM, PLANAR = MODELS / "asym_2rss_ppap.xml", MODELS / "planar_4rprp.xml"


def can_draw() -> bool:
    try:
        system.offscreen_backend()
    except MissingExtraError:
        return False
    return True


draws = pytest.mark.skipif(not can_draw(), reason="no offscreen OpenGL, or the extra rendering is not installed")


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    bench = Workbench(tmp_path, monkeypatch, capsys)
    bench.write(SMALL)
    return bench


# --- poses ---


def test_poses_of_a_case_are_those_of_its_motion(workbench: Workbench) -> None:
    poses = motion_poses(ASYM, Path("small.toml"), "second", 0.2, 0.8, 0.1)
    assert poses.times == pytest.approx(np.arange(0.2, 0.81, 0.1))
    t, first = poses.times, poses.model.joint("q2").qposadr[0]
    assert poses.qpos[:, first] == pytest.approx(0.75 + 0.3 * np.sin(6.0 * t))
    assert gap(poses) < 1e-12
    # twin: a pose that is not on the motion leaves the loops open
    poses.qpos[0, first] += 1e-3
    assert gap(poses) > 1e-5


def test_poses_of_a_mechanism_of_ones_own(workbench: Workbench) -> None:
    workbench.write(own_mechanisms.FOURBAR, "fourbar.xml")
    workbench.write(own_mechanisms.CAMPAIGN, "own.toml")
    poses = motion_poses(Path("fourbar.xml"), Path("own.toml"), None, None, None, 0.1)
    assert poses.qpos[:, 0] == pytest.approx(1.0 + 0.6 * np.sin(3.0 * poses.times))
    assert gap(poses) < 1e-12


def gap(poses: Poses) -> float:
    """Largest distance of sites that the loops hold together, metres."""
    import mujoco

    data, worst = mujoco.MjData(poses.model), 0.0
    for qpos in poses.qpos:
        data.qpos = qpos
        mujoco.mj_kinematics(poses.model, data)
        for one, two in zip(poses.model.eq_obj1id, poses.model.eq_obj2id, strict=True):
            worst = max(worst, float(np.linalg.norm(data.site_xpos[one] - data.site_xpos[two])))
    return worst


def test_a_broken_model_can_be_looked_at(tmp_path: Path) -> None:
    path = tmp_path / "broken.xml"
    path.write_text(ASYM.read_text().replace('tip" pos="0 0 0.25"', 'tip" pos="0 0 5"'))
    poses = home_pose(path)
    assert poses.qpos.shape == (1, 15)
    assert gap(poses) > 1
    assert gap(home_pose(ASYM)) < 1e-12
    path.write_text("<mujoco><wheel/></mujoco>")
    with pytest.raises(ModelError):
        home_pose(path)


# --- what cannot be ---


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--out", "x.jpg"), 'x.jpg: no picture ends in ".jpg"'),
        (("--out", "x"), 'x: no picture ends in ""; valid: .png, .gif, .mp4'),
        (("--out", "x.gif"), "x.gif: a film needs a motion"),
        (("--out", "nowhere/x.png"), "there is no directory nowhere"),
        (("--out", "folder.png"), "folder.png: is a directory"),
        (("--out", "x.png", "--size", "big"), '--size "big"; allowed: width and height'),
        (("--out", "x.png", "--size", "5x99999"), "width 5 pixels; allowed: 16 to 4096"),
        (("--out", "x.png", "--fps", "0"), "--fps 0; allowed: a positive number"),
        (("--out", "x.png", "--speed", "nan"), "--speed nan; allowed: a positive number"),
        (("--out", "x.png", "--case", "first"), "--case first: of which campaign?"),
        (("--out", "x.png", "--start", "1"), "--start 1.0: of which campaign?"),
        (("--out", "x.png", "--camera", "overwiev"), 'no camera "overwiev"; did you mean "overview"?'),
        (("--out", "x.png", "--campaign", "gone.toml"), "gone.toml: no such campaign file"),
        (("--out", "x.png", "--campaign", "small.toml", "--case", "frist"), 'no case "frist"; did you mean "first"?'),
        (("--out", "x.gif", "--campaign", "small.toml", "--stop", "9"), "0 to 9 s; allowed: a part of 0 to 1 s"),
        (
            ("--out", "x.gif", "--campaign", "small.toml", "--speed", "1e-6"),
            "--speed 1e-06; allowed: a positive number, 0.0001 to 10000",
        ),
        ((), "Missing option '--out'"),
    ],
)
def test_bad_input_is_one_line(workbench: Workbench, options: tuple[str, ...], expected: str) -> None:
    (workbench.directory / "folder.png").mkdir()
    before = sorted(workbench.directory.rglob("*"))
    done = workbench("model", "render", ASYM, *options)
    assert done.code == 2
    assert expected in done.err
    assert len(done.complaint) == 1
    assert sorted(workbench.directory.rglob("*")) == before


@pytest.fixture
def fresh(monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.MonkeyPatch]:
    system.offscreen_backend.cache_clear()
    yield monkeypatch
    system.offscreen_backend.cache_clear()


def test_without_opengl_one_line_says_what_to_install(workbench: Workbench, fresh: pytest.MonkeyPatch) -> None:
    fresh.setattr(system, "needs", lambda *modules: None)
    fresh.setattr(system, "_draws", lambda code, environment: False)
    fresh.delenv("MUJOCO_GL", raising=False)
    done = workbench("model", "render", ASYM, "--out", "x.png")
    assert (done.code, len(done.complaint)) == (2, 1)
    assert "apt-get install libegl1" in done.err
    assert not (workbench.directory / "x.png").exists()
    fresh.setenv("DISPLAY", ":1234")
    done = workbench("model", "view", ASYM)
    assert (done.code, len(done.complaint)) == (2, 1)
    assert 'display ":1234" opens no OpenGL window' in done.err
    fresh.delenv("DISPLAY")
    fresh.delenv("WAYLAND_DISPLAY", raising=False)
    assert "no display, DISPLAY is not set" in workbench("model", "view", ASYM).err


def test_without_the_extra_one_line_says_what_to_install(workbench: Workbench, fresh: pytest.MonkeyPatch) -> None:
    fresh.setattr(system.importlib.util, "find_spec", lambda name: None)
    for command in (("view",), ("render", "--out", "x.png")):
        done = workbench("model", command[0], ASYM, *command[1:])
        assert (done.code, len(done.complaint)) == (2, 1)
        assert "pip install 'parallel-robot-workbench[rendering]'" in done.err


def test_a_backend_that_crashes_is_passed_over(fresh: pytest.MonkeyPatch) -> None:
    fresh.setattr(system, "needs", lambda *modules: None)
    fresh.setattr(system, "PICTURE", "import os; os.environ['MUJOCO_GL'] == 'osmesa' or os.abort(); print('drawn')")
    fresh.setattr(system.sys, "platform", "linux")
    fresh.delenv("MUJOCO_GL", raising=False)
    assert system.offscreen_backend() == "osmesa"
    system.offscreen_backend.cache_clear()
    fresh.setenv("MUJOCO_GL", "egl")
    with pytest.raises(MissingExtraError, match="MUJOCO_GL=egl does not draw"):
        system.offscreen_backend()


# --- drawing ---


def picture(path: Path) -> np.ndarray:
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"), dtype=int)


@draws
def test_pictures_show_the_robot(workbench: Workbench) -> None:
    for model, name in ((ASYM, "a.png"), (PLANAR, "b.png")):
        done = workbench("model", "render", model, "--out", name, "--size", "320x240")
        assert done.code == 0, done
        pixels = picture(workbench.directory / name)
        assert pixels.shape == (240, 320, 3)
        # the sky is bright, the robot's parts are dark or coloured
        robot = np.ptp(pixels, axis=2) > 60
        assert 0.002 < robot.mean() < 0.3
        rows, columns = np.nonzero(robot)
        assert 60 < rows.mean() < 180
        assert 80 < columns.mean() < 240
    # another camera, another time: other pictures
    workbench("model", "render", ASYM, "--out", "c.png", "--size", "320x240", "--camera", "overview")
    workbench(
        "model", "render", ASYM, "--out", "d.png", "--size", "320x240", "--campaign", "small.toml", "--start", ".3"
    )
    pictures = [picture(workbench.directory / f"{name}.png") for name in "acd"]
    for one, two in ((0, 1), (0, 2), (1, 2)):
        assert (pictures[one] != pictures[two]).mean() > 0.005


@draws
def test_films_move(workbench: Workbench) -> None:
    from PIL import Image

    options = "--campaign", "small.toml", "--case", "first", "--size", "160x120", "--fps", "20", "--stop", "0.5"
    assert workbench("model", "render", ASYM, "--out", "film.gif", *options).code == 0
    with Image.open(workbench.directory / "film.gif") as film:
        assert film.n_frames == 11
        assert film.info["duration"] == 50
        frames = []
        for number in (0, 5, 10):
            film.seek(number)
            frames.append(np.asarray(film.convert("RGB"), dtype=int))
    assert (frames[0] != frames[1]).mean() > 0.002
    assert (frames[1] != frames[2]).mean() > 0.002
    imageio = pytest.importorskip("imageio_ffmpeg")
    assert workbench("model", "render", ASYM, "--out", "film.mp4", *options).code == 0
    assert imageio.count_frames_and_secs("film.mp4") == (11, pytest.approx(11 / 20, abs=0.01))
    last = ["-ss", "0.5", "-i", "film.mp4", "-frames:v", "1", "last.png"]
    subprocess.run([imageio.get_ffmpeg_exe(), *last], check=True, capture_output=True)
    pixels = picture(Path("last.png"))
    assert pixels.shape == (120, 160, 3)
    assert np.abs(pixels - frames[2]).mean() < 8 < np.abs(pixels - pixels[::-1]).mean()
    assert sorted(path.name for path in workbench.directory.iterdir()) == [
        "film.gif", "film.mp4", "last.png", "small.toml",
    ]  # fmt: skip


@draws
def test_a_crash_on_the_way_leaves_no_file(workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    code = "import sys; sys.stdout.buffer.write(bytes(9)); sys.exit('planted')"
    popen = subprocess.Popen
    monkeypatch.setattr(
        "workbench.rendering.offscreen.subprocess.Popen",
        lambda command, **options: popen([sys.executable, "-c", code], **options),
    )
    done = workbench("model", "render", ASYM, "--out", "x.png")
    assert (done.code, done.complaint) == (2, ["workbench: drawing failed at picture 1: planted"])
    assert [path.name for path in workbench.directory.iterdir()] == ["small.toml"]


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("Xvfb") is None, reason="no Xvfb for a virtual screen")
def test_the_viewer_on_a_virtual_screen(tmp_path: Path) -> None:
    pytest.importorskip("glfw")
    (tmp_path / "small.toml").write_text(SMALL)
    read, write = os.pipe()
    screen = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "800x600x24"], pass_fds=[write], stderr=subprocess.DEVNULL
    )
    os.close(write)
    try:
        with os.fdopen(read) as stream:
            display = f":{stream.readline().strip()}"
        viewer = subprocess.Popen(
            [sys.executable, "-m", "workbench.cli", "model", "view", ASYM, "--campaign", "small.toml"],
            cwd=tmp_path, env={**os.environ, "DISPLAY": display}, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        time.sleep(20)
        assert viewer.poll() is None, viewer.communicate()
        viewer.send_signal(signal.SIGINT)
        errors = viewer.communicate(timeout=30)[1]
        assert (viewer.returncode, errors) == (0, "")
    finally:
        screen.terminate()
        screen.wait()


# --- the pictures of a run ---


@pytest.fixture
def drawing(workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> Workbench:
    monkeypatch.setattr(run_pictures, "RunPictures", DRAWS)
    return workbench


def record_of(workbench: Workbench, name: str) -> dict[str, Any]:
    text = (workbench.directory / name / "pictures" / "pictures.json").read_text(encoding="utf-8")
    loaded: dict[str, Any] = json.loads(text)
    return loaded


@draws
def test_a_run_keeps_a_still_and_a_film_of_its_first_case(drawing: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    from PIL import Image

    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(film_drawing, "PATIENCE_S", 300.0)  # a busy machine draws no less
    assert drawing.run(SMALL, "--quick", "--out", "run").code == 0
    record = record_of(drawing, "run")
    assert (record["case"], record["note"]) == ("first", "")
    assert record["times"] == pytest.approx(np.linspace(0, 1, 21))
    place = drawing.directory / "run" / "pictures"
    width, height = record["width"], record["height"]
    with Image.open(place / "mechanism.webp") as still, Image.open(place / "film.webp") as film:
        assert still.size == (2 * width, 2 * height)
        sheet = np.asarray(film.convert("RGB")).astype(int)
    assert sheet.shape == (4 * height, 6 * width, 3)
    frames = [sheet[k // 6 * height :, k % 6 * width :][:height, :width] for k in range(21)]
    assert all(np.ptp(frame) > 100 for frame in frames)
    moved = [np.abs(one - other).max() for one, other in itertools.pairwise(frames)]
    assert min(moved) > 50
    assert np.abs(frames[0] - frames[0]).max() == 0
    again = drawing.run(SMALL, "--quick", "--out", "run")  # pictures are part of a run directory
    assert again.code == 0
    assert drawing.run(SMALL, "--quick", "--no-pictures", "--out", "run").code == 2  # which would be lost
    assert place.exists()
    assert drawing.run(SMALL, "--quick", "--no-pictures", "--out", "run", "--replace").code == 0
    assert not place.exists()


@pytest.mark.parametrize(
    ("backend", "said"), [("nonsense", "no offscreen OpenGL on this machine (tried nonsense)"), (None, "needs")]
)
def test_a_machine_that_cannot_draw_says_so_and_fails_no_run(
    drawing: Workbench, monkeypatch: pytest.MonkeyPatch, backend: str | None, said: str
) -> None:
    if backend:
        monkeypatch.setattr(film_drawing, "needs", lambda *modules: None)
        monkeypatch.setenv("MUJOCO_GL", backend)
    else:
        monkeypatch.setattr(system.importlib.util, "find_spec", lambda name: None)
    done = drawing.run(SMALL, "--quick", "--out", "run")
    assert (done.code, done.complaint) == (0, [])
    assert said in record_of(drawing, "run")["note"]
    assert [path.name for path in (drawing.directory / "run" / "pictures").iterdir()] == ["pictures.json"]


def test_a_drawing_that_hangs_is_left_behind(
    drawing: Workbench, monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> None:
    # a directory of its own: other tests draw at the same time
    temporary = tmp_path_factory.mktemp("temporary")
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    monkeypatch.setattr(film_drawing, "needs", lambda *modules: None)
    monkeypatch.setattr(film_drawing, "PATIENCE_S", 0.2)
    started: list[subprocess.Popen[bytes]] = []

    def hang(command: list[str], **options: Any) -> subprocess.Popen[bytes]:
        started.append(subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"]))
        return started[-1]

    monkeypatch.setattr(film_drawing, "popen", hang)
    done = drawing.run(SMALL, "--quick", "--out", "run")
    assert (done.code, done.complaint) == (0, [])
    assert record_of(drawing, "run")["note"] == "drawing took longer than 0.2 s"
    assert [process.wait(20) for process in started] == [-signal.SIGKILL]
    assert not list(temporary.iterdir())
