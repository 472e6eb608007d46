"""``workbench model show``, ``set`` and ``check`` on the command line, and what ``run`` makes of edited files."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from small_campaign import CANDIDATES, CASE, HEAD, SMALL, Workbench, listing
from test_mjcf_assumptions import HAND_EDITS, HandEdit, mirror_home
from test_mjcf_edit import assert_bit_equal, assert_only_numbers_moved, random_values
from workbench.campaign.rerun import compute_errors
from workbench.errors import MotionError
from workbench.robots.edit import edit_file
from workbench.robots.show import show_parameters

MODELS = Path(__file__).resolve().parents[1] / "models"
ASYM, PLANAR = MODELS / "asym_2rss_ppap.xml", MODELS / "planar_4rprp.xml"
BOTH = pytest.mark.parametrize("model", [ASYM, PLANAR], ids=lambda path: path.stem)

GENTLE = """
format = 1
name = "gentle"
title = "Small motions about home, which edited robots reach too"
model = "models/NAME.xml"
""" + CANDIDATES  # fmt: skip
MOTIONS = {
    ASYM: "offset = [0.01, 0.78, 0.8]\namplitude = [0.03, 0.06, 0.05]\nfrequency = [7.0, 9.0, 11.0]",
    PLANAR: "offset = [0.3893, 0.3769, 0.3893]\namplitude = [0.01, 0.012, 0.009]\nfrequency = [7.0, 9.0, 11.0]",
}


def gentle(model: Path) -> str:
    """A campaign for a model."""
    motion = f'[[case]]\nname = "gentle"\n[case.motion]\nkind = "sine"\n{MOTIONS[model]}\nstop = 0.5\nsamples = 16\n'
    return GENTLE.replace("NAME", model.stem) + motion


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    bench = Workbench(tmp_path, monkeypatch, capsys)
    for model in MOTIONS:
        bench.write(gentle(model), f"{model.stem}.toml")
    return bench


# --- show ---


@BOTH
def test_show_lists_every_parameter_with_its_place(workbench: Workbench, model: Path) -> None:
    done = workbench("model", "show", f"models/{model.name}")
    assert (done.code, done.err) == (0, "")
    rows = show_parameters(model)
    for row in rows:
        assert re.search(rf"^ {re.escape(row.name)} +{re.escape(repr(row.value))} ", done.out, re.MULTILINE), row
    shown = json.loads(workbench("model", "show", model, "--json").out)
    assert [entry["name"] for entry in shown] == [row.name for row in rows]
    for entry, row in zip(shown, rows, strict=True):
        assert entry["value"] == row.value
        assert entry["unit"] == row.unit
        assert row.meaning == entry["meaning"]
        line = model.read_text().split("\n")[entry["line"] - 1]
        tag, _, owner = entry["element"].partition(" of ")  # what has no name of its own is its body's
        named = [tag] if owner else tag.split(" ", 1)
        assert f"<{named[0]} " in line
        assert ('name="' in line) == (not owner and named[0] != "option"), entry
        assert named[1:] == re.findall(r'<\w+ name="([^"]*)"', line)
        assert f"{entry['attribute'].partition('[')[0]}=" in line


# --- set ---


def test_set_moves_what_has_to_move_and_says_so(workbench: Workbench) -> None:
    done = workbench("model", "set", ASYM, "a2*=1.1", "m1_left=0.25", "--out", "new.xml")
    assert (done.code, done.err) == (0, "")
    assert_bit_equal(Path("new.xml"), {"a2_left": 0.3 * 1.1, "a2_right": 0.3 * 1.1, "m1_left": 0.25, "m1_right": 0.2})
    before, after = ASYM.read_text(), Path("new.xml").read_text()
    changed = tuple(
        number
        for number, pair in enumerate(zip(before.split("\n"), after.split("\n"), strict=True), start=1)
        if pair[0] != pair[1]
    )
    assert_only_numbers_moved(before, after, changed)
    assert f"new.xml: {len(changed)} lines changed ({', '.join(map(str, changed))})" in done.out
    assert re.search(r"a2_left +0\.3 +0\.33 +m +x 1\.1 ", done.out)
    assert re.search(r"I2_right +0\.00225 +0\.0027225\d* +kg m\^2 +x 1\.21", done.out)
    again = workbench("model", "set", "new.xml", "a2=0.33", "--in-place")
    assert "Nothing changes: new.xml has these values already." in again.out
    assert Path("new.xml").read_text() == after
    assert workbench("model", "set", "new.xml", "a2=0.3", "m1_left=0.2", "--in-place").code == 0
    assert Path("new.xml").read_text() == before


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("a2=0.3",), "give either a file to write to or in-place, not neither"),
        (("a2=0.3", "--out", "x.xml", "--in-place"), "not both"),
        (("a2", "--out", "x.xml"), '"a2" is no change of a parameter; allowed: NAME=VALUE, NAME*=FACTOR'),
        (("a2=long", "--out", "x.xml"), 'parameter a2: "long" is not a finite number'),
        (("a2_lfet=1", "--out", "x.xml"), 'unknown parameter "a2_lfet"; did you mean "a2_left"?'),
        (("a2=0.3", "a2*=2", "--out", "x.xml"), "parameter a2 is given twice"),
        (("a2=-1", "--out", "x.xml"), "parameter a2_left = -1 m; allowed: > 0"),
        (("m2=1e-6", "--out", "x.xml"), "parameter I2_left = 7.5e-09 kg m^2"),
        (("a2=5", "--out", "nowhere/x.xml"), "there is no directory nowhere"),
        (("--out", "x.xml"), "Missing argument"),
    ],
)
def test_edits_that_cannot_be_are_one_line(workbench: Workbench, arguments: tuple[str, ...], expected: str) -> None:
    before = listing(workbench.directory)
    done = workbench("model", "set", ASYM, *arguments)
    assert done.code == 2
    assert expected in done.err
    assert len(done.complaint) == 1
    assert listing(workbench.directory) == before


# --- check ---


@BOTH
def test_check_prints_what_it_found(workbench: Workbench, model: Path) -> None:
    done = workbench("model", "check", model, "--all")
    assert done.code == 0
    facts = {"asym_2rss_ppap": ("13 joint freedoms - rank 8 - 2 idle", "1 of 9 rows", "2: spin of rod_left, rod_right"),
             "planar_4rprp": ("14 joint freedoms - rank 11", "7 of 18 rows", "mobility M = p - r: 3")}  # fmt: skip
    for text in (*facts[model.stem], "mobility by rank     3", "MuJoCo warns         of nothing", "range of q1"):
        assert text in done.out
    assert "OK: the loops close" in done.out
    assert len(re.findall(r"^ ok ", done.out, re.MULTILINE)) > 100
    assert not re.findall(r"^ ok ", workbench("model", "check", model).out, re.MULTILINE)
    found = json.loads(workbench("model", "check", model, "--json").out)
    assert found["mobility"]["mobility"] == 3
    assert all(assumption["ok"] for assumption in found["assumptions"])


def test_check_of_what_is_no_model(workbench: Workbench) -> None:
    workbench.write("<mujoco><include file='/etc/passwd'/></mujoco>", "include.xml")
    bomb = '<!DOCTYPE m [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;&a;">]><mujoco model="&b;"/>'
    workbench.write(bomb, "bomb.xml")
    for name, expected in (("include.xml", '"/etc/passwd">: an absolute path'), ("bomb.xml", "document type"),
                           ("gone.xml", "gone.xml: no such model file")):  # fmt: skip
        for command in (("check",), ("show",), ("set", "a2=1", "--in-place"), ("render", "--out", "x.png")):
            done = workbench("model", command[0], name, *command[1:])
            assert (done.code, len(done.complaint)) == (2, 1)
            assert expected in done.err
        done = workbench("run", "asym_2rss_ppap.toml", "--model", name)
        assert (done.code, len(done.complaint)) == (2, 1)
    assert "x.png" not in os.listdir(workbench.directory)


@pytest.mark.parametrize("edit", [e for e in HAND_EDITS if e.refused], ids=lambda e: f"{e.model.stem[:4]}-{e.name}")
def test_hand_edits_are_refused_by_check_and_by_run(workbench: Workbench, edit: HandEdit) -> None:
    assert edit.refused
    edit.write(workbench.directory)
    check = workbench("model", "check", "edited.xml")
    assert check.code in (1, 2)
    said = [line for line in (check.out + check.err).splitlines() if re.search(edit.refused, line)]
    assert said, check
    assert check.code == 2 or said[-1].startswith("broken: edited.xml")
    run = workbench("run", f"{edit.model.stem}.toml", "--model", "edited.xml", "--quick")
    assert (run.code, len(run.complaint)) == (2, 1)
    assert re.search(edit.refused, run.err)
    assert not Path("reports").exists()


@pytest.mark.parametrize("edit", [e for e in HAND_EDITS if not e.refused], ids=lambda e: f"{e.model.stem[:4]}-{e.name}")
def test_hand_edits_are_handled_by_check_and_by_run(workbench: Workbench, edit: HandEdit) -> None:
    edit.write(workbench.directory)
    check = workbench("model", "check", "edited.xml")
    assert check.code == 0
    errors = compute_errors(f"{edit.model.stem}.toml", model=Path("edited.xml"))
    assert max(row.peak_error for row in errors.rows if row.bound) <= 1e-10


def test_another_assembly_branch_is_refused_by_run(workbench: Workbench) -> None:
    """No table of names and numbers sees it: only where the platform stands."""
    other = re.sub(
        r'(<body name="platform" pos=")0.29999999996240867', r"\g<1>-0.29999999996240867", PLANAR.read_text()
    )
    workbench.write(mirror_home(other), "other.xml")
    run = workbench("run", "planar_4rprp.toml", "--model", "other.xml")
    assert (run.code, len(run.complaint)) == (2, 1)
    assert "other.xml: the platform is 0.6" in run.err
    assert "is the home pose on another assembly branch?" in run.err
    assert not Path("reports").exists()
    workbench.write(PLANAR.read_text(), "same.xml")
    assert workbench("run", "planar_4rprp.toml", "--model", "same.xml", "--quick").code == 0


# --- run ---


def test_relative_settings_start_from_each_case(workbench: Workbench) -> None:
    campaign = SMALL.replace("payload = 1.5", "payload = 1.5, a2_left = 0.31")
    options = "--set", "a2*=1.1", "--set", "payload+=0.5", "--set", "m1=0.25"
    assert workbench.run(campaign, "--quick", "--out", "out", *options).code == 0
    cases = json.loads(Path("out/manifest.json").read_text())["cases"]
    assert {name: cases["first"]["parameters"].get(name) for name in ("a2_left", "a2_right", "payload", "m1")} == {
        "a2_left": 0.3 * 1.1, "a2_right": 0.3 * 1.1, "payload": 0.5, "m1": 0.25,
    }  # fmt: skip
    assert cases["second"]["parameters"]["a2_left"] == 0.31 * 1.1
    assert cases["second"]["parameters"]["payload"] == 2.0
    # the same robot by an edited file gives the same torques, bit for bit
    workbench("model", "set", ASYM, "a2*=1.1", "m1=0.25", "payload=0.5", "--out", "edited.xml")
    assert workbench.run(HEAD + CANDIDATES + CASE, "--quick", "--out", "file", "--model", "edited.xml").code == 0
    assert Path("file/series/first.parquet").read_bytes() == Path("out/series/first.parquet").read_bytes()


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        (("a2*=x",), 'parameter a2: "x" is not a finite number'),
        (("a2*=1.1", "a2=0.3"), "--set a2 is given twice"),
        (("a2*=-1",), "parameter a2_left = -0.3 m; allowed: > 0"),
        (("a9*=2",), 'unknown parameter "a9"'),
        (("a2/=0",), "divides by zero"),
        (("a2*=1e300",), "parameter a2_left = 3e+299 m; allowed: > 0 and at most 1e+10 in size"),
    ],
)
def test_relative_settings_that_cannot_be(workbench: Workbench, settings: tuple[str, ...], expected: str) -> None:
    done = workbench.run(SMALL, *(word for text in settings for word in ("--set", text)))
    assert (done.code, len(done.complaint)) == (2, 1)
    assert expected in done.err


@BOTH
def test_a_campaign_on_randomly_edited_files(model: Path, tmp_path: Path) -> None:
    edited, campaign = tmp_path / "edited.xml", tmp_path / "gentle.toml"
    campaign.write_text(gentle(model))
    errors: list[float] = []

    @settings(max_examples=10)
    @given(data=st.data())
    def one_edit(data: st.DataObject) -> None:
        values = random_values(data.draw, model)
        edit_file(model, [f"{name}={value!r}" for name, value in values.items()], edited)
        assert_bit_equal(edited, values)
        try:
            rows = [row for row in compute_errors(campaign, model=edited).rows if row.bound is not None]
        except MotionError:  # ever so often a drawn robot cannot make the motion
            return
        assert {row.reference for row in rows} == {"lumped", "distributed"}
        errors.append(max(row.peak_error for row in rows))
        assert errors[-1] <= 1e-10, values

    one_edit()
    assert len(errors) >= 6


def process(directory: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "workbench.cli", *arguments],
        cwd=directory, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


def steps() -> Iterator[tuple[tuple[str, ...], int, str]]:
    """A user's way through the commands: arguments, exit code, what is shown."""
    yield ("set", "models/asym_2rss_ppap.xml", "a2*=1.02", "--out", "mine.xml"), 0, "mine.xml: 6 lines changed"
    yield ("check", "gone.xml"), 2, "workbench: gone.xml: no such model file\n"


def test_a_way_through_the_commands_from_outside(tmp_path: Path) -> None:
    for arguments, code, shown in steps():
        done = process(tmp_path, "model", *arguments)
        assert done.returncode == code, done
        assert shown in done.stdout + done.stderr
    assert os.listdir(tmp_path) == ["mine.xml"]
