"""Bad campaigns, models and output places: each is one line and exit code 2, and the directory stays as it was."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path

import pytest

from small_campaign import CANDIDATES, CASE, CASES, HEAD, SMALL, Workbench, listing
from workbench.campaign.spec import load_campaign
from workbench.data_files import bundled
from workbench.errors import ModelError, SpecError

RULE = "allowed: letters, digits and _ . + -"

CLAIM = """
[[claim]]
id = "c"
text = "t"
source = "s"
kind = "upper"
claimed = 1.0
unit = "%"
measure = { quantity = "peak_error", case = "first" }
"""

FIGURE = """
[[figure]]
id = "f"
title = "t"
case = "first"
kind = "torque"
joint = "q1"
curves = ["cand:lumped", "ref:lumped"]
"""

CYCLE = """
[[case]]
name = "cycle"
[case.motion]
kind = "pick_and_place"
pick = [-0.03, -0.10, 0.36]
place = [0.03, 0.10, 0.36]
lift = 0.06
up = [0.0, 0.0, -1.0]
lift_time = 0.2
traverse_time = 0.4
samples = 21
"""


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Workbench:
    return Workbench(tmp_path, monkeypatch, capsys)


def refused(workbench: Workbench, *arguments: str) -> str:
    """Run; demand exit code 2, one line and an unchanged directory; return the line."""
    before = listing(workbench.directory)
    done = workbench("run", *arguments)
    assert done.code == 2, done
    assert len(done.complaint) == 1, done
    assert done.out == ""
    assert listing(workbench.directory) == before
    line = done.complaint[0]
    assert line.startswith("workbench: ")
    assert len(line) < 1200
    return line


def changed(old: str, new: str, text: str = SMALL) -> str:
    assert old in text
    return text.replace(old, new, 1)


# --- the file itself ---


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("absent.toml", "absent.toml: no such campaign file"),
        (".", ".: is a directory; a campaign is a TOML file"),
        ("x" * 3000, "File name too long"),
    ],
)
def test_no_campaign_file(workbench: Workbench, name: str, expected: str) -> None:
    assert expected in refused(workbench, name)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "name: missing; this key is required"),
        (b"name = [", "not valid TOML"),
        (b"a = " + b"[" * 5000, "not valid TOML"),
        (SMALL.encode() + b"\n]]", "not valid TOML: Invalid statement (at line"),
        (SMALL.encode() + b"\xff", "not UTF-8 text (byte "),
    ],
    ids=["empty", "cut", "deep", "malformed", "not UTF-8"],
)
def test_malformed_file(workbench: Workbench, content: bytes, expected: str) -> None:
    (workbench.directory / "small.toml").write_bytes(content)
    line = refused(workbench, "small.toml")
    assert line.startswith("workbench: small.toml: ")
    assert expected in line


def test_a_byte_order_mark_does_no_harm(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_bytes(b"\xef\xbb\xbf" + SMALL.encode())
    campaign, _ = load_campaign(tmp_path / "small.toml")
    assert campaign.name == "small"


def test_bundled_campaigns_load_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    _, file = load_campaign("almeida_2010")
    assert file == bundled("campaigns", "almeida_2010.toml")


# --- keys, types and names ---

BAD_TEXTS = {
    # unknown and missing keys, with the nearest valid one
    "top key": (changed("title =", "titel = 'a'\ntitle ="), 'titel: unknown key; did you mean "title"?'),
    "motion key": (changed("samples", "sampels"), 'case "first".motion.sampels: unknown key; did you mean "samples"?'),
    "candidate key": (
        changed("bound", "bounds"), 'candidate "lumped".bounds: unknown key; did you mean "bound"?'
    ),
    "missing key": (changed("stop = 1.0", ""), 'case "first".motion.stop: missing'),
    "kind of motion": (
        changed("multi_sine", "multisine"),
        "case \"first\".motion.kind = 'multisine': unknown kind of motion; did you mean \"multi_sine\"?",
    ),
    "no kind": (changed('kind = "multi_sine"', ""), 'case "first".motion.kind: missing; valid: '),
    # names
    "parameter": (changed("payload = 1.5", "paylod = 1.5"), 'unknown parameter "paylod"; did you mean "payload"?'),
    "candidate": (changed('"lumped"', '"lumpd"'), 'no candidate "lumpd"; did you mean "lumped"?'),
    "reference": (changed('reference = "lumped"', 'reference = "lump"'), 'no reference "lump"; did you mean "lumped"?'),
    "case of a claim": (SMALL + changed('"first"', '"frist"', CLAIM), 'names case "frist"; did you mean "first"?'),
    "joint of a claim": (SMALL + changed('"first" }', '"first", joint = "q4" }', CLAIM), 'claim "c": no joint "q4"'),
    "candidate of a claim": (
        SMALL + changed('"first" }', '"first", candidate = "lumpd" }', CLAIM), 'claim "c": no candidate "lumpd"'
    ),
    "quantity": (SMALL + changed("peak_error", "peek_error", CLAIM), "claim \"c\".measure.quantity = 'peek_error'"),
    "case of a figure": (SMALL + changed('"first"', '"frist"', FIGURE), '"frist"; did you mean "first"?'),
    "joint of a figure": (SMALL + changed('"q1"', '"q4"', FIGURE), 'figure "f": no joint "q4"'),
    "curve": (SMALL + changed("ref:lumped", "ref:lumpd", FIGURE), 'no curve "ref:lumpd"; did you mean "ref:lumped"?'),
    "curve not computed": (SMALL + changed("cand:lumped", "cand:lumped-appendix", FIGURE), 'no curve "cand:lumped-'),
    "figure without curves": (SMALL + FIGURE.split("curves", maxsplit=1)[0], "kind torque needs joint and curves"),
    # empty and double
    "no case": (HEAD + CANDIDATES, "case: missing"),
    "empty case list": (HEAD + "case = []\n" + CANDIDATES, "case: list should have at least 1 item"),
    "no candidate": (HEAD + CASES, "candidate: missing"),
    "case as table": (HEAD + CANDIDATES + '[case]\nname = "x"', "case: should be a valid list"),
    "two cases": (HEAD + CANDIDATES + CASE + CASE, 'two cases have the name "first"'),
    "two cases but for capitals": (
        HEAD + CANDIDATES + CASE + CASE.replace("first", "FIRST"), "differ only in upper and lower case"
    ),
    "two candidates": (HEAD + CANDIDATES * 2 + CASE, 'candidate "lumped" against "lumped" stands twice'),
    "two claims": (SMALL + CLAIM * 2, 'two claims have the id "c"'),
    "two figures": (SMALL + FIGURE * 2, 'two figures have the id "f"'),
    # types: nothing is converted in silence
    "text for a number": (changed("samples = 21", 'samples = "21"'), "should be a valid integer"),
    "text for a parameter": (changed("payload = 1.5", 'payload = "1.5"'), "should be a valid number"),
    "truth for a parameter": (changed("payload = 1.5", "payload = true"), "should be a valid number"),
    "fraction of a sample": (changed("samples = 21", "samples = 2.5"), "should be a valid integer"),
    "number for a name": (changed('name = "first"', "name = 1"), "should be a valid string"),
    "number for a list": (changed("offset = [0.02, 0.75, 0.85]", "offset = 1.0"), "should be a valid list"),
    "format of the future": (changed("format = 1", "format = 2"), "format = 2"),
    # not finite, negative, too large
    "NaN in a motion": (changed("[0.02", "[nan"), 'case "first".motion.offset[1] = nan: should be a finite number'),
    "NaN in a term": (changed("0.06, 4.0", "0.06, nan"), "motion.terms[1][1][2] = nan: should be a finite number"),
    "infinite force": (changed("[12.0", "[inf"), 'case "second".external_force[1] = inf'),
    "infinite parameter": (changed("payload = 1.5", "m2 = inf"), 'case "second".parameters.m2 = inf'),
    "bound": (changed("bound = 1e-10", "bound = -1.0"), "should be greater than 0"),
    "NaN bound": (changed("bound = 1e-10", "bound = nan"), "should be a finite number"),
    "huge integer": (changed("payload = 1.5", "payload = 1" + 400 * "0"), "should be a valid number"),
    "negative mass": (changed("payload = 1.5", "m2 = -0.1"), "parameter m2_left = -0.1 kg; allowed: > 0"),
    "negative length": (changed("payload = 1.5", "a2_left = -0.3"), "parameter a2_left = -0.3 m; allowed: > 0"),
    "zero length": (changed("payload = 1.5", "a1 = 0.0"), "parameter a1_left = 0 m; allowed: > 0"),
    "mass centre beyond the bar": (changed("payload = 1.5", "k2 = 1.5"), "parameter k2_left = 1.5; allowed: >= 0 and"),
    "huge mass": (changed("payload = 1.5", "m2 = 1e300"), 'case "second": '),
    "no sample": (changed("samples = 21", "samples = 0"), 'case "first": time grid: samples = 0'),
    "one sample": (changed("samples = 21", "samples = 1"), "allowed: 2 to"),
    "too many samples": (changed("samples = 21", "samples = 100000000000"), "less than or equal to 100000"),
    "too high a rate": (changed("samples = 21", "rate = 1e12"), "makes more samples than allowed: 100000"),
    "too long a cycle": (
        HEAD + CANDIDATES + changed("samples = 21", "rate = 500000.0", CYCLE), "samples; allowed: at most 100000"
    ),
    "samples and rate": (changed("samples = 21", "samples = 21\nrate = 10.0"), "exactly one of samples and rate"),
    "neither": (changed("samples = 21", ""), "exactly one of samples and rate"),
    "backwards in time": (changed("stop = 1.0", "stop = -1.0"), "stop = -1 s; allowed: > start = 0 s"),
    "negative frequency": (changed("4.0, 0.3", "-4.0, 0.3"), "joint q1: frequency = -4 rad/s; allowed: >= 0"),
    "two joints": (changed("[0.02, 0.75, 0.85]", "[0.02, 0.75]"), "has 3 actuated joints: q1, q2, q3"),
    # motions: case, time and joint
    "beyond a rod": (
        changed("0.06, 4.0", "0.6, 4.0"), 'case "first": t = 0.05 s, joint q1: |q1| exceeds the rod length 0.3 m'
    ),
    "rods apart": (changed("0.75, 0.85]", "0.0, 0.0]"), "joint q2, q3: the rods cannot meet at the platform"),
    "parallelogram": (changed("payload = 1.5", "a5 = 0.01"), "|x2| reaches the parallelogram's length 0.01 m"),
    "cycle out of reach": (
        HEAD + CANDIDATES + changed("0.10, 0.36]\nlift", "0.10, 0.76]\nlift", CYCLE), "position is out of reach"
    ),
    "unknown law": (
        HEAD + CANDIDATES + CYCLE + 'law = "quintik"\n', 'unknown time law "quintik"; did you mean "quintic"?'
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD_TEXTS)
def test_bad_campaign(what: str, workbench: Workbench) -> None:
    text, expected = BAD_TEXTS[what]
    line = refused(workbench, workbench.write(text))
    assert line.startswith("workbench: small.toml: ")
    assert expected in line


@pytest.mark.parametrize(
    "name",
    ["a/b", "a\\b", "..", ".", "../up", ".hidden", "-rf", "two words", "größe", "名", "x" * 300, "", "a\0b", "a\nb"],
)
@pytest.mark.parametrize("of", ["small", "first"])
def test_names_that_may_not_become_file_names(workbench: Workbench, of: str, name: str) -> None:
    text = changed(f'name = "{of}"', f"name = {json.dumps(name)}")
    line = refused(workbench, workbench.write(text))
    assert RULE in line
    assert len(line) < 400


def test_longest_allowed_names_run(workbench: Workbench) -> None:
    text = changed('"small"', f'"{"c" * 100}"', changed('"first"', f'"{"x" * 100}"'))
    done = workbench.run(text, "--only", "x" * 100)
    assert done.code == 0, done
    assert (workbench.directory / "reports" / ("c" * 100) / "series" / f"{'x' * 100}.parquet").is_file()


# --- the model ---

MODEL = bundled("models", "asym_2rss_ppap.xml")

BAD_MODELS = {
    "cut short": ("</mujoco>", "", "not well-formed XML"),
    "type of a joint": (
        '<joint name="q1" type="slide"', '<joint name="q1" type="slid"', "XML Error: invalid keyword: 'slid'"
    ),
    "two of a name": ('<joint name="q2"', '<joint name="q1"', "repeated name 'q1' in joint Element 'joint', line "),
    "negative mass": ('mass="0.3"', 'mass="-0.3"', "mass and inertia of moving bodies must be larger than"),
    "NaN": ('pos="0 0 0.3"', 'pos="0 0 nan"', "m.xml:"),
    "another file": ("<worldbody>", '<include file="x.xml"/><worldbody>', "m.xml:53: <include file="),
    "no mechanism": ('<text name="mechanism" data="asym_2rss_ppap"/>', "", "m has no candidate \"lumped\""),
    "unknown mechanism": ('data="asym_2rss_ppap"', 'data="asym"', 'unknown mechanism "asym"'),
    "no motor": ('<motor name="q3" joint="q3"/>', "", "q3"),
    "mass centre off the axis": ('<inertial pos="0 0 0.15"', '<inertial pos="0.01 0 0.15"', "on the axis"),
    "a loop less": ('<connect name="spherical_F" site1="rod_right_tip" site2="platform_F"/>', "", "loop"),
    "rod too short to close its loop": (
        '<site name="rod_left_tip" pos="0 0 0.3"/>', '<site name="rod_left_tip" pos="0 0 0.16"/>',
        "the rods cannot meet at the platform",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD_MODELS)
def test_bad_model(what: str, workbench: Workbench) -> None:
    old, new, expected = BAD_MODELS[what]
    workbench.write(changed(old, new, MODEL.read_text(encoding="utf-8")), "m.xml")
    workbench.write(changed("models/asym_2rss_ppap.xml", "m.xml"))
    assert expected in refused(workbench, "small.toml")
    assert expected in refused(workbench, workbench.write(SMALL), "--model", "m.xml")


def test_loops_that_the_reference_cannot_close(workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    """The closed form refuses such robots first ("rod too short" above), so the reference only pretends here."""

    def no_loop(*_: object, **__: object) -> None:
        raise ModelError("m.xml: the loops cannot be closed from the home pose")

    monkeypatch.setattr("workbench.capabilities.robot.MujocoReference", no_loop)
    line = refused(workbench, workbench.write(SMALL))
    assert line == 'workbench: small.toml: case "first": m.xml: the loops cannot be closed from the home pose'


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        (os.fspath(MODEL), "allowed: a path below the campaign's directory or the one above, without .. (--model"),
        ("../models/asym_2rss_ppap.xml", "without .."),
        ("models/asym_3rss_ppap.xml", "no such file"),
        (".", "no such file"),
        ("", "no such file"),
        ("x" * 3000, "File name too long"),
        ("a\0b", "no such file"),
        ("small.toml", "small.toml: candidate: unknown key; valid: actuated"),
        ("link.xml", "a link that leads out of"),
    ],
    ids=["absolute", "up", "unknown", "directory", "empty", "long", "null", "no XML", "link out"],
)
def test_model_path(workbench: Workbench, name: str, expected: str) -> None:
    (workbench.directory / "link.xml").symlink_to(MODEL)
    text = changed('"models/asym_2rss_ppap.xml"', json.dumps(name))
    line = refused(workbench, workbench.write(text))
    assert expected in line
    assert len(line) < 500


@pytest.mark.parametrize(
    ("name", "expected"), [("absent.xml", "no such model file"), (".", "a robot is a folder with one")]
)
def test_model_of_the_command_line(workbench: Workbench, name: str, expected: str) -> None:
    assert expected in refused(workbench, workbench.write(SMALL), "--model", name)


def test_a_link_inside_the_directory_is_followed(workbench: Workbench) -> None:
    workbench.write(MODEL.read_text(encoding="utf-8"), "m.xml")
    (workbench.directory / "link.xml").symlink_to("m.xml")
    assert workbench.run(changed("models/asym_2rss_ppap.xml", "link.xml")).code == 0


# --- motions from files ---

TABLE = HEAD + CANDIDATES + '[[case]]\nname = "table"\nmotion = { kind = "csv", file = "m.csv" }\n'
ROWS = "t,q1,q2,q3\n" + "".join(f"{i / 10},0.0{i},0.{70 + i},0.8\n" for i in range(9))
STRAIGHT = "t,q1,q2,q3,qd1,qd2,qd3,qdd1,qdd2,qdd3\n0.5,0.0,{0},{0},0,0,0,0,0,0\n"


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("", "no header line"),
        (ROWS.replace("q3", "q4", 1), 'line 1: unknown column "q4"'),
        (ROWS.replace("0.8", "nan", 1), 'line 2, column q3: "nan"; allowed: a finite number'),
        (ROWS.replace("0.3,", "0.1,", 1), "line 5, column t: 0.1 s after 0.2 s; allowed: strictly increasing"),
        (ROWS + "1,2\n", "line 11: 2 cells; allowed: 4"),
        ("\n".join(ROWS.split("\n")[:4]), "3 samples; allowed: at least 6"),
        (ROWS.replace("0.04,", "0.44,"), 'case "table": t = 0.4 s, joint q1: |q1| exceeds the rod length 0.3 m'),
    ],
    ids=["empty", "column", "NaN", "time", "ragged", "short", "reach"],
)
def test_bad_motion_file(workbench: Workbench, content: str, expected: str) -> None:
    workbench.write(content, "m.csv")
    assert expected in refused(workbench, workbench.write(TABLE))


@pytest.mark.parametrize(
    ("name", "expected"),
    [("/etc/hostname", "without .."), ("../m.csv", "without .."), ("absent.csv", "no such file"), ("link.csv", "link")],
)
def test_motion_path(workbench: Workbench, name: str, expected: str) -> None:
    (workbench.directory / "link.csv").symlink_to("/etc/hostname")
    assert expected in refused(workbench, workbench.write(changed("m.csv", name, TABLE)))


def test_singular_pose(workbench: Workbench) -> None:
    """Both arms in line with their rods: (L - l) + (a1 + a2) cos q = 0."""
    angle = math.acos(-0.1 / 0.5)
    workbench.write(STRAIGHT.format(repr(angle)), "m.csv")
    line = refused(workbench, workbench.write(TABLE))
    assert 'case "table": t = 0.5 s, joint q2' in line
    assert "singular pose" in line


# --- where the run goes ---


def test_a_file_in_the_way(workbench: Workbench) -> None:
    workbench.write("mine", "out")
    assert "out: exists and is not a directory" in refused(workbench, workbench.write(SMALL), "--out", "out")
    assert "out is not a directory" in refused(workbench, "small.toml", "--out", "out/run")


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("thesis.tex", "years of work", "no run of the workbench, such as thesis.tex"),
        ("manifest.json", '{"name": "a browser extension"}', "no run of the workbench"),
        ("manifest.json", "not JSON", "no run of the workbench"),
    ],
)
def test_a_foreign_directory(workbench: Workbench, name: str, content: str, expected: str) -> None:
    (workbench.directory / "out").mkdir()
    workbench.write(content, f"out/{name}")
    assert expected in refused(workbench, workbench.write(SMALL), "--out", "out")


def test_a_file_of_the_user_inside_a_run(workbench: Workbench) -> None:
    assert workbench.run(SMALL, "--only", "first").code == 0
    workbench.write("mine", "reports/small/notes.txt")
    assert "notes.txt is no part of a run and would be lost" in refused(workbench, "small.toml")


def test_the_current_directory(workbench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    assert workbench.run(SMALL, "--only", "first").code == 0
    monkeypatch.chdir(workbench.directory / "reports" / "small")
    assert "current directory" in refused(workbench, "../../small.toml", "--out", ".")


@pytest.mark.parametrize("name", ["x" * 300, "/proc/absent/run", "loop"])
def test_places_that_the_system_refuses(workbench: Workbench, name: str) -> None:
    (workbench.directory / "loop").symlink_to("loop")
    assert "cannot be written" in refused(workbench, workbench.write(SMALL), "--out", name)


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="for this user every directory can be written")
def test_a_directory_without_permission(workbench: Workbench) -> None:
    (workbench.directory / "locked").mkdir(mode=0o500)
    assert "cannot be written" in refused(workbench, workbench.write(SMALL), "--out", "locked/run")


def test_an_earlier_run_survives_bad_input(workbench: Workbench) -> None:
    assert workbench.run(SMALL, "--only", "first").code == 0
    workbench.write(changed("0.06, 4.0", "0.6, 4.0"))
    assert "exceeds the rod length" in refused(workbench, "small.toml")


def test_the_error_carries_its_facts(tmp_path: Path) -> None:
    file = tmp_path / "small.toml"
    file.write_text(HEAD + CANDIDATES + CASE + CASE)
    with pytest.raises(SpecError) as caught:
        load_campaign(file)
    assert caught.value.facts == {"file": str(file), "case": "first"}
